// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/network/messages.hpp>
#include <palpate/network/protocol.hpp>
#include <palpate/simulator/snapshot.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace palpate {

/// Pictures for onlookers go in parts, each a frame, one after the other from the first column to the last; `Drawn` says that they are a picture:
///   triangles   revision u64 · total u32 · first u32 · count u32 · count × (3 × u32, corners · u8, 1 where a cut has made it)
///   points      revision u64 · total u32 · first u32 · count u32 · count × 3 × f32 [m]
/// total: of the whole picture; first: the part's first column; an empty picture has one part with a count of 0. Triangles stay until others come.
/// Limits     2²² points or triangles.
struct PictureFormat {
  static constexpr std::size_t part = 20, triangle = 13, point = 12;   ///< bytes, of what opens a part and of a column
  static constexpr std::uint32_t max_total = 1u << 22;
};

namespace detail::network {

/// Appends the frames of all parts; write(to, column) writes one column of so many bytes.
template <class Write>
void append_parts(std::vector<std::byte>& frames, MessageType type, std::uint64_t revision, std::uint32_t total, std::size_t bytes, Write const& write) {
  auto const most = static_cast<std::uint32_t>((FrameFormat::max_body - PictureFormat::part) / bytes);
  std::uint32_t first = 0;
  do {
    std::uint32_t const count = std::min(most, total - first);
    std::size_t const begin = frames.size(), body = PictureFormat::part + count * bytes;
    frames.resize(begin + FrameFormat::header + body);
    std::byte* to = frames.data() + begin;
    put_header(to, type, body);
    to += FrameFormat::header;
    put(to, revision), put(to + 8, total), put(to + 12, first), put(to + 16, count);
    to += PictureFormat::part;
    for (std::uint32_t k = 0; k < count; ++k, to += bytes) write(to, static_cast<Eigen::Index>(first + k));
    first += count;
  } while (first < total);
}

}  // namespace detail::network

/// Appends the frames of a snapshot's triangles.
template <RealScalar S>
void append_triangles(std::vector<std::byte>& frames, BodySnapshot<S> const& picture) {
  using namespace detail::network;
  append_parts(frames, MessageType::triangles, picture.topology_revision, static_cast<std::uint32_t>(picture.triangles.cols()), PictureFormat::triangle,
               [&](std::byte* to, Eigen::Index t) {
                 for (Eigen::Index k = 0; k < 3; ++k) put(to + 4 * k, static_cast<std::uint32_t>(picture.triangles(k, t)));
                 auto const place = static_cast<std::size_t>(t);
                 to[12] = static_cast<std::byte>(place < picture.is_wound.size() && picture.is_wound[place] != 0 ? 1 : 0);
               });
}
/// Appends the frames of a snapshot's points. False where one of them can not be sent: it is too far away, or no number.
template <RealScalar S>
bool append_points(std::vector<std::byte>& frames, BodySnapshot<S> const& picture) {
  using namespace detail::network;
  bool is_good = true;
  append_parts(frames, MessageType::points, picture.topology_revision, static_cast<std::uint32_t>(picture.points.cols()), PictureFormat::point,
               [&](std::byte* to, Eigen::Index p) {
                 for (Eigen::Index k = 0; k < 3; ++k) {
                   is_good = is_good && std::abs(picture.points(k, p)) <= S(farthest);
                   put(to + 4 * k, std::bit_cast<std::uint32_t>(static_cast<float>(picture.points(k, p))));
                 }
               });
  return is_good;
}

/// Puts the parts of pictures together. What is no part of one, comes out of order, or contradicts what came before is a problem, and the picture is as it was.
class PictureAssembly {
 public:
  /// Another connection begins.
  void reset() noexcept { triangles_ = {}, points_ = {}; }

  ProtocolProblem take_triangles(Frame const& frame) {
    ProtocolProblem const problem = take(frame, PictureFormat::triangle, triangles_, [&](std::uint32_t total) {
      corners_.resize(3, total), is_wound_.resize(total), largest_corner_ = 0, ++changes_;
    }, [&](std::byte const* from, std::uint32_t t) {
      for (std::size_t k = 0; k < 3; ++k) {
        auto const corner = detail::network::taken<std::uint32_t>(from + 4 * k);
        largest_corner_ = std::max(largest_corner_, corner);
        corners_(static_cast<Eigen::Index>(k), t) = static_cast<int>(std::min(corner, PictureFormat::max_total));
      }
      is_wound_[t] = static_cast<char>(from[12]);
      return static_cast<std::uint8_t>(from[12]) <= 1;
    });
    return problem;
  }
  ProtocolProblem take_points(Frame const& frame) {
    return take(frame, PictureFormat::point, points_, [&](std::uint32_t total) { columns_.resize(3, total); }, [&](std::byte const* from, std::uint32_t p) {
      bool is_good = true;
      for (std::size_t k = 0; k < 3; ++k) {
        auto const number = std::bit_cast<float>(detail::network::taken<std::uint32_t>(from + 4 * k));
        columns_(static_cast<Eigen::Index>(k), p) = number;
        is_good = is_good && detail::network::within(static_cast<double>(number), detail::network::farthest);
      }
      return is_good;
    });
  }
  /// Whether what came is the picture that is meant.
  ProtocolProblem check(Drawn const& drawn) const noexcept {
    auto const is_whole = [&](Part const& part, std::uint32_t total) {
      return part.has_begun && part.revision == drawn.revision && part.total == total && part.got == total;
    };
    if (!is_whole(triangles_, drawn.triangles) || !is_whole(points_, drawn.points)) return ProtocolProblem::order;
    return drawn.triangles == 0 || largest_corner_ < drawn.points ? ProtocolProblem::none : ProtocolProblem::number;
  }
  /// How often triangles came; the snapshot's `topology_revision`, since a server that was started again counts anew.
  std::size_t changes() const noexcept { return changes_; }
  /// The picture that was checked, into a snapshot of earlier times.
  void draw(Drawn const& drawn, BodySnapshot<float>& to) const {
    if (to.topology_revision != changes_ || to.triangles.cols() != corners_.cols()) to.triangles = corners_, to.is_wound = is_wound_;
    to.points = columns_;
    to.topology_revision = changes_;
    to.time = drawn.time;
    to.tip = drawn.tip.cast<float>();
    to.phase = drawn.phase;
    to.tools.clear();
    if (drawn.has_hand) to.tools.push_back({.pose = {.position = to.tip, .orientation = drawn.orientation.cast<float>()}, .phase = drawn.phase});
  }

 private:
  struct Part {
    bool has_begun = false;
    std::uint64_t revision = 0;
    std::uint32_t total = 0, got = 0;
  };

  template <class Begin, class Read>
  static ProtocolProblem take(Frame const& frame, std::size_t bytes, Part& part, Begin const& begin, Read const& read) {
    using detail::network::taken;
    if (frame.body.size() < PictureFormat::part) return ProtocolProblem::size;
    std::byte const* from = frame.body.data();
    auto const revision = taken<std::uint64_t>(from);
    auto const total = taken<std::uint32_t>(from + 8), first = taken<std::uint32_t>(from + 12), count = taken<std::uint32_t>(from + 16);
    if (frame.body.size() - PictureFormat::part != std::size_t{count} * bytes) return ProtocolProblem::size;
    if (total > PictureFormat::max_total || first > total || count > total - first || (count == 0 && total > 0)) return ProtocolProblem::number;
    if (first == 0) {
      part = {.has_begun = true, .revision = revision, .total = total};
      begin(total);
    }
    if (!part.has_begun || revision != part.revision || total != part.total || first != part.got) return ProtocolProblem::order;
    from += PictureFormat::part;
    for (std::uint32_t k = 0; k < count; ++k, from += bytes)
      if (!read(from, first + k)) return ProtocolProblem::number;
    part.got = first + count;
    return ProtocolProblem::none;
  }

  Part triangles_{}, points_{};
  Matrix<int, 3, Dynamic> corners_;
  std::vector<char> is_wound_;
  Matrix3X<float> columns_;
  std::uint32_t largest_corner_ = 0;
  std::size_t changes_ = 0;
};

}  // namespace palpate
