// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/collision/detail/sided_sets.hpp>
#include <palpate/contact/region_shapes.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/core/refill.hpp>
#include <palpate/tissue/concept.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <compare>
#include <cstddef>
#include <limits>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

namespace palpate {

/// Two copies of a vertex that a cut has made, and what has become of them.
template <RealScalar Scalar>
struct PartedVertex {
  std::array<int, 2> copies{};   ///< vertices, ascending
  Scalar time = 0;               ///< s for which their lips have been parted there; infinite once it was long enough
  bool are_opposite = false;     ///< the lips face each other there, and have not come past each other beside
};

namespace detail {

/// The lips of a body's cuts: pairs of border triangles that were one face inside the uncut body. Between the two, a and b, is a volume, and where they have gone
/// through each other it is negative:
///   V = Σ vᵢ,   vᵢ = (bᵢ − aᵢ)·N/6,   N = (N(a) + 4 N((a + b)/2) + N(b))/6,   N(x) = (x₁ − x₀) × (x₂ − x₀)
/// That is the volume between a triangle and its twin with ruled walls, which the neighbours share. It does not ask where the front of the cut is, where lips have
/// vertices in common. Where some corners have crossed and others have not, the part counts of which the depth, linear from corner to corner, is positive: so forces
/// go to zero with it.
/// A fresh pair says nothing: both lie on each other, and rounding alone would push them apart. It does once all copies of its corners have been parted long enough.
/// Nor does one whose copies are beside each other by more than two mean edges, or turned away from each other, as those of a piece that was laid aside and a flap
/// that is folded back; it does again when it has come in front of its twin.
/// Regions    what hangs together by two copies of a vertex and the same two: where cuts cross each wall is a region of its own.
/// Cost       O(wounds) a step, O(wounds log wounds) after edits, which allocate.
/// Limits     triangles of which a later cut has divided one only, or both in different places, have no twin.
template <RealScalar Scalar>
class CutLips {
  using Place = Vector3<double>;

 public:
  using Parted = PartedVertex<Scalar>;

  /// Reads which triangles are wounds anew.
  template <class Body>
  void read(Body const& body) {
    faces_.clear(), known_.swap(parted_), parted_.clear();
    if constexpr (TellsWounds<std::remove_cvref_t<decltype(body.tissue())>>) {
      find_faces(body);
      list_parted();
    }
  }
  /// h seconds have passed: what is further apart than `enough` mean edges, on average round a vertex, for so long [s], is not fresh any more.
  template <class Body>
  void part(Body const& body, Scalar enough, Scalar time, Scalar h) {
    refill(round_, parted_.size(), Round{});
    for (Face& face : faces_) {
      double const faces_other = measure(body, face);
      for (std::size_t i = 0; i < 3; ++i) {
        if (face.parted[i] < 0) continue;
        Round& round = round_[at(face.parted[i])];
        round.volume += face.volume(), round.area += face.normal.norm() / 2, round.facing += faces_other;
        face.a[i] < face.b[i] ? void(round.normal += face.normal) : void(round.normal -= face.normal);
      }
    }
    double const edge = static_cast<double>(body.mean_edge());
    for (std::size_t p = 0; p < parted_.size(); ++p) {
      Parted& one = parted_[p];
      Round const& round = round_[p];
      if (round.volume > static_cast<double>(enough) * edge * round.area) {
        one.time += h;
        if (one.time >= time) one.time = std::numeric_limits<Scalar>::infinity();
      } else if (std::isfinite(one.time)) {
        one.time = 0;
      }
      Place const way = Vector3<Scalar>(body.positions().col(one.copies[1]) - body.positions().col(one.copies[0])).template cast<double>();
      double const size = round.normal.squaredNorm(), across = way.dot(round.normal);
      bool const is_beside = !(way.squaredNorm() - (size > 0 ? across * across / size : 0) < 4 * edge * edge);
      one.are_opposite = !is_beside && round.facing > 0 && (round.volume > 0 || one.are_opposite);
    }
  }
  /// Adds the volumes by which lips are in each other, but where a contour has found it.
  template <class Body>
  void press(Body const& body, RegionShapes<Scalar>& shapes) {
    choose(body, shapes);
    if (pressing_.empty()) return;
    unite();
    for (std::size_t k = 0; k < pressing_.size(); ++k) {
      auto const [set, is_second] = sets_.of(static_cast<int>(k));
      order_[k] = {set, static_cast<int>(k), is_second};
    }
    std::sort(order_.begin(), order_.end());
    for (std::size_t k = 0; k < order_.size();) {
      std::size_t end = k;
      while (end < order_.size() && order_[end].set == order_[k].set) ++end;
      add_region(body, shapes, std::span(order_).subspan(k, end - k));
      k = end;
    }
  }

  std::span<Parted const> parted() const noexcept { return parted_; }
  /// What the next read() knows.
  void know(std::span<Parted const> parted) { parted_.assign(parted.begin(), parted.end()); }

 private:
  struct Face {
    std::array<int, 3> a, b;                     // corners; a in its order, b[i] the copy of a[i]
    std::array<int, 3> parted{-1, -1, -1};       // of each corner's copies; −1 where both are one
    std::array<double, 3> gaps{};                // m³, v of each corner
    Place normal = Place::Zero();                // N [m²]
    double volume() const noexcept { return gaps[0] + gaps[1] + gaps[2]; }
  };
  struct Round {   // of the faces at two copies
    double volume = 0, area = 0, facing = 0;   // m³, m²; m⁴, negative where they are turned away from each other
    Place normal = Place::Zero();              // from the first copy to the second
  };
  struct Key {   // a wound, by the first copies of its corners
    std::array<int, 3> corners;
    int triangle;
    friend auto operator<=>(Key const&, Key const&) = default;
  };
  struct Ordered {
    int set, number;
    bool is_second;
    friend auto operator<=>(Ordered const&, Ordered const&) = default;
  };
  struct Part {
    int side, vertex, face;
    Place gradient;
    auto key() const noexcept { return std::tuple(side, vertex, face); }
  };
  static std::size_t at(int i) noexcept { return static_cast<std::size_t>(i); }

  template <class Body>
  void find_faces(Body const& body) {
    auto const& tissue = body.tissue();
    auto const& surface = tissue.surface();
    copies_.clear(), keys_.clear();
    for (int t = 0; t < surface.triangle_count(); ++t)
      if (tissue.is_wound(t))
        for (int const i : surface.corners(t)) copies_.push_back(i);
    auto const place = [&](int i) {
      auto const x = tissue.rest_position(i);
      return std::tuple(x[0], x[1], x[2]);
    };
    std::sort(copies_.begin(), copies_.end(), [&](int i, int j) { return std::tuple(place(i), i) < std::tuple(place(j), j); });
    first_.resize(static_cast<std::size_t>(body.positions().cols()));
    for (std::size_t k = 0, first = 0; k < copies_.size(); ++k) {
      if (place(copies_[k]) != place(copies_[first])) first = k;
      first_[at(copies_[k])] = copies_[first];
    }
    for (int t = 0; t < surface.triangle_count(); ++t)
      if (tissue.is_wound(t)) {
        auto const c = surface.corners(t);
        Key key{{first_[at(c[0])], first_[at(c[1])], first_[at(c[2])]}, t};
        std::sort(key.corners.begin(), key.corners.end());
        keys_.push_back(key);
      }
    std::sort(keys_.begin(), keys_.end());
    for (std::size_t k = 0; k + 1 < keys_.size(); ++k) {
      if (keys_[k].corners != keys_[k + 1].corners) continue;
      auto const a = surface.corners(keys_[k].triangle), b = surface.corners(keys_[k + 1].triangle);
      Face face{.a = {a[0], a[1], a[2]}, .b = {a[0], a[1], a[2]}};
      for (std::size_t i = 0; i < 3; ++i)
        for (int const j : b)
          if (first_[at(j)] == first_[at(a[i])]) face.b[i] = j;
      faces_.push_back(face), ++k;
    }
  }
  void list_parted() {
    for (Face const& face : faces_)
      for (std::size_t i = 0; i < 3; ++i)
        if (face.a[i] != face.b[i]) parted_.push_back({copies_of(face, i)});
    auto const less = [](Parted const& one, Parted const& other) { return one.copies < other.copies; };
    std::sort(parted_.begin(), parted_.end(), less);
    parted_.erase(std::unique(parted_.begin(), parted_.end(), [](Parted const& one, Parted const& other) { return one.copies == other.copies; }), parted_.end());
    for (Parted& one : parted_)
      if (auto const was = std::lower_bound(known_.begin(), known_.end(), one, less); was != known_.end() && was->copies == one.copies) one = *was;
    for (Face& face : faces_)
      for (std::size_t i = 0; i < 3; ++i)
        if (face.a[i] != face.b[i])
          face.parted[i] = static_cast<int>(std::lower_bound(parted_.begin(), parted_.end(), Parted{copies_of(face, i)}, less) - parted_.begin());
  }
  static std::array<int, 2> copies_of(Face const& face, std::size_t i) noexcept { return {std::min(face.a[i], face.b[i]), std::max(face.a[i], face.b[i])}; }

  template <class Body>
  static std::array<Place, 3> places(Body const& body, std::array<int, 3> const& of) {
    auto const place = [&](int i) { return Place(Vector3<Scalar>(body.positions().col(i)).template cast<double>()); };
    return {place(of[0]), place(of[1]), place(of[2])};
  }
  static std::array<Place, 3> between(std::array<Place, 3> const& a, std::array<Place, 3> const& b) noexcept {
    return {Place((a[0] + b[0]) / 2), Place((a[1] + b[1]) / 2), Place((a[2] + b[2]) / 2)};
  }
  /// Returns N(a)·N(b) [m⁴].
  template <class Body>
  static double measure(Body const& body, Face& face) {
    auto const normal = [](std::array<Place, 3> const& x) { return Place((x[1] - x[0]).cross(x[2] - x[0])); };
    auto const a = places(body, face.a), b = places(body, face.b);
    Place const its = normal(a), other = normal(b);
    face.normal = (its + 4 * normal(between(a, b)) + other) / 6;
    for (std::size_t i = 0; i < 3; ++i) face.gaps[i] = face.normal.dot(b[i] - a[i]) / 6;
    return its.dot(other);
  }
  /// What of the depths −v is positive, and its derivatives by them: it is the sum of these times the depths.
  static std::array<double, 3> shares(std::array<double, 3> const& gaps) noexcept {
    std::size_t const crossed = static_cast<std::size_t>((gaps[0] < 0) + (gaps[1] < 0) + (gaps[2] < 0));
    if (crossed == 0 || crossed == 3) return crossed == 0 ? std::array{0.0, 0.0, 0.0} : std::array{1.0, 1.0, 1.0};
    std::size_t k = 0;   // the corner on a side of its own
    while ((gaps[k] < 0) != (crossed == 1)) ++k;
    std::size_t const i = (k + 1) % 3, j = (k + 2) % 3;
    // A corner of size p beyond a line, the others q and r on this side of it: p³/((p + q)(p + r)).
    double const p = std::abs(gaps[k]), q = std::abs(gaps[i]), r = std::abs(gaps[j]), to_i = p / (p + q), to_j = p / (p + r);
    std::array<double, 3> share{};
    share[i] = to_i * to_i * to_j, share[j] = to_i * to_j * to_j, share[k] = to_i * to_j * (3 - to_i - to_j);
    if (crossed == 2)
      for (double& one : share) one = 1 - one;
    return share;
  }

  template <class Body>
  void choose(Body const& body, RegionShapes<Scalar> const& shapes) {
    pressing_.clear();
    bool const has_contours = !shapes.gradient(0).empty();
    if (has_contours) {
      refill(is_taken_, static_cast<std::size_t>(body.positions().cols()), char{0});
      for (int side = 0; side < 2; ++side)
        for (auto const& one : shapes.gradient(side)) is_taken_[at(one.vertex)] = 1;
    }
    for (int k = 0; k < static_cast<int>(faces_.size()); ++k) {
      Face const& face = faces_[at(k)];
      auto const is_silent = [&](int p) { return p >= 0 && (std::isfinite(parted_[at(p)].time) || !parted_[at(p)].are_opposite); };
      auto const is_taken = [&](int i) { return has_contours && is_taken_[at(i)] != 0; };
      if (std::ranges::none_of(face.gaps, [](double gap) { return gap < 0; }) || std::ranges::any_of(face.parted, is_silent)) continue;
      if (std::ranges::none_of(face.a, is_taken) && std::ranges::none_of(face.b, is_taken)) pressing_.push_back(k);
    }
  }
  /// What has two copies in common is of one region, on the same side of it by these.
  void unite() {
    sets_.reset(pressing_.size()), order_.resize(pressing_.size());
    refill(at_copies_, parted_.size(), std::pair(-1, false));
    for (int k = 0; k < static_cast<int>(pressing_.size()); ++k) {
      Face const& face = faces_[at(pressing_[at(k)])];
      for (std::size_t i = 0; i < 3; ++i) {
        if (face.parted[i] < 0) continue;
        auto& [other, was_turned] = at_copies_[at(face.parted[i])];
        bool const is_turned = face.a[i] > face.b[i];
        if (other >= 0) sets_.unite(other, k, was_turned != is_turned);
        other = k, was_turned = is_turned;
      }
    }
  }
  template <class Body>
  void add_region(Body const& body, RegionShapes<Scalar>& shapes, std::span<Ordered const> faces) {
    auto& region = shapes.begin_region();
    parts_.clear();
    Place first = Place::Zero(), moment = Place::Zero();
    Matrix<double, 3, 3> second = Matrix<double, 3, 3>::Zero();
    double area = 0;
    Place const from = Vector3<Scalar>(body.positions().col(faces_[at(pressing_[at(faces[0].number)])].a[0])).template cast<double>();
    for (auto const& [set, number, is_second] : faces) {
      int const f = pressing_[at(number)];
      Face const& face = faces_[at(f)];
      auto const a = places(body, face.a), b = places(body, face.b), m = between(a, b);
      auto const share = shares(face.gaps);
      double const size = face.normal.norm() / 2 * (share[0] + share[1] + share[2]) / 3;
      Place const way = (share[0] * (b[0] - a[0]) + share[1] * (b[1] - a[1]) + share[2] * (b[2] - a[2])) / 3;
      area += size;
      for (std::size_t i = 0; i < 3; ++i) {
        std::size_t const j = (i + 1) % 3, k = (i + 2) % 3;
        auto const turned = [&](std::array<Place, 3> const& x) { return Place((x[j] - x[k]).cross(way) / 12); };   // ½ way·N by x
        Place const middle = 2 * turned(m), moved = share[i] / 6 * face.normal;
        parts_.push_back({is_second ? 1 : 0, face.a[i], f, moved - turned(a) - middle});
        parts_.push_back({is_second ? 0 : 1, face.b[i], f, -moved - turned(b) - middle});
        double const depth = -share[i] * face.gaps[i];   // m³, the corner's part of the volume
        Place const here = m[i] - from, others = (m[j] - from) + (m[k] - from);
        region.volume += depth;
        moment += depth / 4 * (2 * here + others);
        first += size / 3 * here;
        second += size / 12 * here * (2 * here + others).transpose();
      }
    }
    region.middle = from + moment / region.volume;
    if (area > 0) region.spread = second - first * first.transpose() / area;
    std::sort(parts_.begin(), parts_.end(), [](Part const& one, Part const& other) { return one.key() < other.key(); });
    for (std::size_t k = 0; k < parts_.size();) {
      Place sum = Place::Zero();
      int const side = parts_[k].side, vertex = parts_[k].vertex;
      for (; k < parts_.size() && parts_[k].side == side && parts_[k].vertex == vertex; ++k) sum += parts_[k].gradient;
      shapes.add(side, {vertex, sum.template cast<Scalar>()});
    }
    shapes.end_region();
  }

  std::vector<Face> faces_;
  std::vector<Parted> parted_, known_;          // by their vertices; known_: before the last edits
  std::vector<Round> round_;                    // each of parted_
  std::vector<int> copies_, first_;             // corners of wounds by place; of each vertex, the first of its copies
  std::vector<Key> keys_;
  std::vector<int> pressing_;                   // faces
  std::vector<char> is_taken_;                  // of each vertex
  std::vector<std::pair<int, bool>> at_copies_; // of each of parted_, a face that presses, and whether its second side has the first copy
  SidedSets sets_;
  std::vector<Ordered> order_;
  std::vector<Part> parts_;
};

}  // namespace detail

}  // namespace palpate
