// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/mesh/triangle_mesh.hpp>
#include <palpate/mesh/validation.hpp>
#include <palpate/volume/winding_number.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace palpate::detail {

/// Cubes of a regular grid, and which corners they share: those of cubes that are linked around a corner, face by face. A face between two
/// cubes that is opened links them no more; where that leaves cubes around a corner unlinked, each part has a vertex of its own there.
/// Numbers    corner 4 z + 2 y + x of a cube; side 2 axis + 1 looks along the axis, side 2 axis against it.
/// Invariant  vertices of cubes without opened faces keep their numbers; those that come by opening follow them. That depends on the opened faces alone, not on
///            their order.
class CubeGrid {
 public:
  using Place = std::array<int, 3>;

  /// The cubes of this edge [m] whose middle is inside a surface.
  template <RealScalar Scalar>
  CubeGrid(TriangleMesh<Scalar> const& mesh, double edge) {
    require_valid(mesh, {.closed = true});
    WindingNumber const winding(mesh);
    auto const [low, high] = low_and_high(mesh.points);
    if (Vector3<double> const extent = (high - low).template cast<double>(); !(edge <= extent.maxCoeff() * (1 + 1e-4)))
      throw InvalidArgument(message("Cubes: an edge of ", edge, " m is longer than the surface, which is ", extent.maxCoeff(), " m; give a shorter one, in metres"));
    double all = 1;
    Place count;
    for (int a = 0; a < 3; ++a) {
      double const size = static_cast<double>(high[a]) - static_cast<double>(low[a]), n = std::max(1.0, std::ceil(size / edge - 1e-4));
      all *= n, count[at(a)] = static_cast<int>(std::min(n, 1e6));
      corner_[a] = static_cast<double>(low[a]) - (n * edge - size) / 2;
    }
    if (all > most)
      throw InvalidArgument(message("Cubes: an edge of ", edge, " m makes a grid of ", all, " cubes, at most ", most, " are possible; give an edge above ",
                                    edge * std::cbrt(all / most), " m, or the surface in metres (it may be in millimetres)"));
    std::vector<int> number(static_cast<std::size_t>(all), -1);
    auto const cell = [&](Place const& p) -> int& { return number[(at(p[2]) * at(count[1]) + at(p[1])) * at(count[0]) + at(p[0])]; };
    for (int z = 0; z < count[2]; ++z)
      for (int y = 0; y < count[1]; ++y)
        for (int x = 0; x < count[0]; ++x)
          if (winding(corner_ + edge * Vector3<double>(x + 0.5, y + 0.5, z + 0.5)) > 0.5) cell({x, y, z}) = size(), places_.push_back({x, y, z});
    if (places_.empty())
      throw InvalidMesh(message("no cube of ", edge, " m has its middle inside the surface: it is thinner all over; give a smaller edge"));
    beside_.resize(places_.size()), opened_.assign(places_.size(), 0);
    for (int c = 0; c < size(); ++c)
      for (int side = 0; side < 6; ++side) {
        Place p = place(c);
        int& along = p[at(side / 2)] += side % 2 != 0 ? 1 : -1;
        beside_[at(c)][at(side)] = along < 0 || along >= count[at(side / 2)] ? -1 : cell(p);
      }
    share_corners();
    uncut_ = corners_, uncut_vertices_ = vertices();
  }

  int size() const noexcept { return static_cast<int>(places_.size()); }
  Place const& place(int c) const noexcept { return places_[at(c)]; }
  Vector3<double> const& corner() const noexcept { return corner_; }   // m, of the place (0, 0, 0)
  int beside(int c, int side) const noexcept { return beside_[at(c)][at(side)]; }
  bool is_opened(int c, int side) const noexcept { return (opened_[at(c)] >> side & 1) != 0; }
  /// The cube across a side that is linked to this one, or −1.
  int linked(int c, int side) const noexcept { return is_opened(c, side) ? -1 : beside(c, side); }

  int vertices() const noexcept { return static_cast<int>(first_.size()); }
  /// A number of how cubes share corners before any cut, another one for nearly every other grid (FNV-1a).
  std::uint64_t mark() const noexcept {
    std::uint64_t mark = 0xcbf29ce484222325U;
    for (auto const& corners : uncut_)
      for (int const v : corners) mark = (mark ^ static_cast<std::uint64_t>(v)) * 0x100000001b3U;
    return mark;
  }
  std::array<int, 8> const& corners(int c) const noexcept { return corners_[at(c)]; }
  /// A cube that has the vertex, and which of its corners it is.
  std::pair<int, int> first(int v) const noexcept { return {first_[at(v)] / 8, first_[at(v)] % 8}; }
  Vector3<double> vertex_place(int v) const noexcept {   // in edges
    auto const [c, k] = first(v);
    return Vector3<double>(place(c)[0] + (k & 1), place(c)[1] + (k >> 1 & 1), place(c)[2] + (k >> 2));
  }

  /// Opens the face between two cubes; false where there is none, or it is open. share_corners() makes the vertices of it.
  bool open(int c, int side) {
    int const other = linked(c, side);
    if (other < 0) return false;
    opened_[at(c)] = static_cast<std::uint8_t>(opened_[at(c)] | 1 << side);
    opened_[at(other)] = static_cast<std::uint8_t>(opened_[at(other)] | 1 << (side ^ 1));
    order_.push_back(6 * c + side), order_.push_back(6 * other + (side ^ 1));
    return true;
  }
  /// 6 cube + side of each opened face, from both sides, in the order in which they were opened.
  std::vector<int> const& opened() const noexcept { return order_; }
  void set_opened(std::vector<int> const& order) {
    order_ = order;
    std::fill(opened_.begin(), opened_.end(), std::uint8_t{0});
    for (int const one : order_) opened_[at(one / 6)] = static_cast<std::uint8_t>(opened_[at(one / 6)] | 1 << one % 6);
    share_corners();
  }

  void share_corners() {
    corners_.assign(places_.size(), {-1, -1, -1, -1, -1, -1, -1, -1});
    first_.assign(at(uncut_vertices_), -1);
    for (int c = 0; c < size(); ++c)
      for (int k = 0; k < 8; ++k)
        if (corners_[at(c)][at(k)] < 0) {
          int v = uncut_.empty() ? -1 : uncut_[at(c)][at(k)];
          if (v < 0 || first_[at(v)] >= 0) v = vertices(), first_.push_back(-1);
          first_[at(v)] = 8 * c + k;
          give(c, k, v);
        }
  }

  /// The cubes linked to one around its edge between two sides, it first; how many.
  int around_edge(int c, int side, int other_side, std::array<int, 4>& found) const noexcept {
    int n = 0;
    found[at(n++)] = c;
    int const a = linked(c, side), b = linked(c, other_side);
    int across = a >= 0 ? linked(a, other_side) : -1;
    if (across < 0 && b >= 0) across = linked(b, side);
    int const by_a = a < 0 && across >= 0 ? linked(across, other_side ^ 1) : a, by_b = b < 0 && across >= 0 ? linked(across, side ^ 1) : b;
    for (int const one : {by_a, by_b, across})
      if (one >= 0) found[at(n++)] = one;
    return n;
  }

  /// Corner k of a side, counter-clockwise seen from outside.
  static int side_corner(int side, int k) noexcept {
    int const axis = side / 2, u = 1 << (axis + 1) % 3, v = 1 << (axis + 2) % 3, far = side % 2;
    int const turned = far != 0 ? k : 3 - k;
    return (far << axis) + (turned == 1 || turned == 2 ? u : 0) + (turned >= 2 ? v : 0);
  }

 private:
  static constexpr double most = 2e7;
  static std::size_t at(int i) noexcept { return static_cast<std::size_t>(i); }

  void give(int c, int k, int v) noexcept {
    corners_[at(c)][at(k)] = v;
    for (int axis = 0; axis < 3; ++axis)
      if (int const next = linked(c, 2 * axis + (k >> axis & 1)); next >= 0 && corners_[at(next)][at(k ^ 1 << axis)] < 0) give(next, k ^ 1 << axis, v);
  }

  Vector3<double> corner_;
  std::vector<Place> places_;
  std::vector<std::array<int, 6>> beside_;
  std::vector<std::uint8_t> opened_;              // a bit for each side
  std::vector<int> order_;
  std::vector<std::array<int, 8>> corners_, uncut_;
  std::vector<int> first_;                        // of each vertex: 8 cube + corner
  int uncut_vertices_ = 0;
};

}  // namespace palpate::detail
