// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/core/sparse_table.hpp>
#include <palpate/cutting/concept.hpp>
#include <palpate/cutting/detail/blade_sweep.hpp>
#include <palpate/cutting/detail/solid_opening.hpp>
#include <palpate/mesh/solid_edit.hpp>
#include <palpate/mesh/tetrahedral_adjacency.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

namespace palpate {

/// What a stroke has cut so far: from where the blade came into the tissue until it has left it. The next stroke begins at zero.
struct VolumeCutReport : CutReport {
  double area = 0;              ///< m², of the faces that are cut, undeformed
  double lip_area = 0;          ///< m², of both walls of what has opened
  int tetrahedra_added = 0;
  int edges_divided = 0;
  int snapped = 0;              ///< crossings that went to an end of their edge
  int too_thin = 0;             ///< of those, because a tetrahedron would have become too low
  int joined = 0;               ///< slices of a few tetrahedra, thinner than the snap, that stayed at their lip
  int closed_faces = 0;         ///< cut, and not open: no vertex of them has split
  bool unresolved = false;      ///< it went on for more than a mean edge with less than that of the blade in the tissue, and cut no face: the blade is shorter
                                ///< than the mesh resolves, unless all was cut there already
};

namespace detail {

/// How near to a vertex a crossing goes there, in shares of an edge and in m; how high a tetrahedron and how thick a slice has to be at least [m].
struct SolidSnap {
  double share, distance, height, thickness;
};

/// The cut that one stroke makes in a solid: which vertices lie on it, and which faces it has cut.
/// A face is cut whose corners are on the cut, and whose tetrahedra are on different sides of it. A crossing is dealt with as a whole, with the faces at it, before
/// the next one in the order of time: so it does not matter how a stroke is divided into ticks.
template <RealScalar Scalar>
class SolidCut {
  using Corners = TetrahedralAdjacency::Corners;
  static constexpr double turned_back = 0.9, parallel = 0.8, bends = 0.7;   // cosines, of 26°, 37° and 45°

 public:
  /// Of this stroke, or of the last one that cut something, or that went on for more than an edge in the tissue and did not.
  VolumeCutReport const& report() const noexcept { return is_worth_a_report() ? report_ : last_; }
  /// m², of all strokes.
  double area() const noexcept { return area_; }
  /// Whether something was cut since the last end().
  bool has_cut() const noexcept { return report_.edges_divided > 0 || report_.area > 0; }
  /// The blade has moved by so much, with so much of it in the tissue [m].
  void has_moved(double way, double length, double edge) noexcept {
    way_ += way, longest_ = std::max(longest_, length), is_under_way_ = way_ > edge;
    report_.unresolved = is_under_way_ && report_.area == 0 && longest_ < edge;
  }
  void forget() noexcept {
    if (is_worth_a_report()) last_ = report_;
    report_ = {}, way_ = longest_ = 0, is_under_way_ = false;
    on_.clear(), sides_.clear(), all_on_.clear(), near_.clear(), opening_.clear();
    particles_ = 0;
  }
  /// What is farther from a blade of these points in the undeformed solid than this [m] is behind it: it is as a cut of another stroke, that this one may cross.
  template <class Body>
  void leave_behind(Body const& body, std::span<Vector3<double> const> blade, double distance) {
    auto const is_near = [&](int v) {
      Vector3<double> const x = rest(body, v);
      double far = distance;
      body.tissue().for_each_joined(v, [&](int i) { far = std::max(far, 1.5 * (rest(body, i) - x).norm()); });
      for (std::size_t k = 0; k + 1 < blade.size(); ++k) {
        Vector3<double> const along = blade[k + 1] - blade[k], off = x - blade[k];
        double const length = along.squaredNorm(), u = length > 0 ? std::clamp(off.dot(along) / length, 0.0, 1.0) : 0;
        if ((off - u * along).squaredNorm() < far * far) return true;
      }
      return false;
    };
    std::erase_if(near_, [&](int v) {
      if (is_near(v)) return false;
      On& own = on_[v];
      own.is_on = false, own.side = 0;
      for (int const t : body.tissue().topology().tetrahedra_at(v)) sides_[t] = 0;
      return true;
    });
  }

  /// Cuts what is swept, beginning the search for it at these tetrahedra.
  template <class Body>
  void sweep(Body& body, BladeSweep const& swept, std::span<int const> starts, SolidSnap const& snap) {
    take_edits(body);
    gather(body, swept, starts);
    snap_ = snap;
    crossings_.clear();
    for (auto const& [a, b] : edges_) find_crossings(body, swept, a, b, -std::numeric_limits<double>::infinity());
    if (crossings_.empty()) return;
    while (!crossings_.empty()) {
      std::pop_heap(crossings_.begin(), crossings_.end(), later);
      Crossing const crossing = crossings_.back();
      crossings_.pop_back();
      cross(body, swept, crossing);
    }
    open(body);
    body.finish_edits();
    has_taken_edits(body);
  }

  /// The blade has left: an edge within what is cut and closed, or which parts would only touch along, is divided, so that its middle splits.
  template <class Body>
  void end(Body& body) {
    if (!has_cut()) return forget();
    take_edits(body);
    auto const& solid = body.tissue().topology();
    std::sort(all_on_.begin(), all_on_.end());
    all_on_.erase(std::unique(all_on_.begin(), all_on_.end()), all_on_.end());   // some came to it twice
    for (int const v : all_on_) opening_.add(v);
    open_and_divide_held(body);
    for (std::size_t n = 0; n < all_on_.size(); ++n) {   // those that are made meanwhile come last
      int const v = all_on_[n];
      auto const part = [&] {
        auto const around = solid.tetrahedra_at(v);
        return std::any_of(around.begin(), around.end(), [&](int t) { return divide_middle(body, v, end_within_cut(body, t, v)); });
      };
      while (part()) open_and_divide_held(body);
    }
    body.finish_edits();
    int faces = 0;
    for (int const v : all_on_)
      for (int const t : solid.tetrahedra_at(v))
        for (int k = 0; k < 4; ++k) faces += body.tissue().is_cut(t, k) && solid.corner_of(t, v) != k ? 1 : 0;
    report_.closed_faces = faces / 6;   // seen from three corners and two sides
    forget();
  }

 private:
  bool is_worth_a_report() const noexcept { return has_cut() || (is_under_way_ && (report_.snapped > 0 || report_.unresolved)); }

  /// That an edge of two vertices is crossed, in the order in which crossings are dealt with.
  struct Crossing {
    double time;
    int low, high;   // a < b
    double s;        // from low to high
    Vector3<double> normal;
    bool operator<(Crossing const& other) const noexcept {
      return std::tuple(time, -low, -high, s) < std::tuple(other.time, -other.low, -other.high, other.s);
    }
  };
  static bool later(Crossing const& a, Crossing const& b) noexcept { return b < a; }

  /// Where the blade went by a vertex that is on the cut, and the normal of the sheet there.
  struct On {
    Vector3<double> at = Vector3<double>::Zero(), normal = Vector3<double>::Zero();
    int order = 0;          // of those that came to it
    bool is_on = false;
    signed char side = 0;   // of the vertex itself, on the cut or not: 1 ahead of the sheet, −1 behind it, 0 in it or not known
  };

  template <class Body>
  static Vector3<double> rest(Body const& body, int i) {
    return body.tissue().rest_position(i).template cast<double>();
  }
  template <class Body>
  static Vector3<double> now(Body const& body, int i) {
    return body.positions().col(i).template cast<double>();
  }

  // --- what others have cut meanwhile -----------------------------------------------------------------------------------
  template <class Body>
  void has_taken_edits(Body const& body) noexcept {
    edits_ = body.solid_edits().size(), particles_ = body.size();
  }
  /// A vertex on an edge that is on the cut, or beside it, is there too, and so are the parts of a tetrahedron and the copy of a vertex.
  template <class Body>
  void take_edits(Body const& body) {
    auto const edits = body.solid_edits();
    for (std::size_t k = edits_; particles_ > 0 && k < edits.size(); ++k) {
      using Kind = typename SolidEdit<typename Body::Scalar>::Kind;
      auto const& [kind, from, to, first, second, s] = edits[k];
      if (kind == Kind::inserted) {
        On const a = on_at(first), b = on_at(second);
        double const share = static_cast<double>(s);
        int const n = particles_++;
        if (a.is_on && b.is_on)
          put_on(n, {(1 - share) * a.at + share * b.at, (a.normal + (looks_back(a.normal, b.normal) ? -1 : 1) * b.normal).normalized()});
        else if (int const side = std::clamp(a.side + b.side, -1, 1); side != 0)
          entry(n).side = static_cast<signed char>(side);
      } else if (kind == Kind::split) {
        ++particles_;
        On const whole = on_at(first);
        if (whole.is_on) put_on(second, whole);
        if (whole.side != 0) entry(second).side = whole.side;
      } else if (signed char const* const side = kind == Kind::divided ? sides_.find(first) : nullptr; side != nullptr) {
        signed char const same = *side;
        sides_[second] = same;
      }
    }
    has_taken_edits(body);
  }
  On on_at(int v) const noexcept {
    On const* const on = on_.find(v);
    return on == nullptr ? On{} : *on;
  }

  // --- what is crossed --------------------------------------------------------------------------------------------------
  /// The edges of all tetrahedra that the sweep may meet, from those given.
  template <class Body>
  void gather(Body const& body, BladeSweep const& swept, std::span<int const> starts) {
    auto const& solid = body.tissue().topology();
    double const margin = 1e-6 * static_cast<double>(body.mean_edge());
    seen_.clear(), queue_.clear(), edges_.clear();
    auto const consider = [&](int t) {
      if (t < 0 || t >= solid.tetrahedron_count() || std::exchange(seen_[t], true)) return;
      Corners const c = solid.corners(t);
      if (swept.may_meet({now(body, c[0]), now(body, c[1]), now(body, c[2]), now(body, c[3])}, margin)) queue_.push_back(t);
    };
    for (int const t : starts) consider(t);
    for (std::size_t k = 0; k < queue_.size(); ++k)
      for (int face = 0; face < 4; ++face) consider(solid.neighbour(queue_[k], face));
    met_.clear();
    for (int const t : queue_) {
      Corners const c = solid.corners(t);
      for (std::size_t i = 0; i < 4; ++i)
        for (std::size_t j = i + 1; j < 4; ++j) {
          auto const [low, high] = std::minmax(c[i], c[j]);
          if (std::exchange(met_[static_cast<std::uint64_t>(low) << 32 | static_cast<std::uint64_t>(high)], true)) continue;
          edges_.emplace_back(low, high);
        }
    }
  }

  /// From a time on. What a new edge meets of a sheet that bends where the blade was before is not crossed: in the next tick it would not be seen either.
  template <class Body>
  void find_crossings(Body const& body, BladeSweep const& swept, int a, int b, double earliest) {
    if (a > b) std::swap(a, b);
    swept.for_each_crossing(now(body, a), now(body, b), [&](SweepCrossing const& found) {
      double const digits = 1e6, time = std::round(found.time * digits) / digits;   // what differs by rounding alone is at one time
      if (time < earliest - 1.5 / digits) return;
      crossings_.push_back({std::max(earliest, time), a, b, found.s, found.normal});
      std::push_heap(crossings_.begin(), crossings_.end(), later);
    });
  }

  template <class Body>
  void cross(Body& body, BladeSweep const& swept, Crossing at) {
    auto const& solid = body.tissue().topology();
    auto const around = solid.tetrahedra_at(at.low);
    if (std::none_of(around.begin(), around.end(), [&](int t) { return solid.corner_of(t, at.high) >= 0; })) return;   // divided meanwhile
    at.normal = undeformed(body, at);
    if (is_cut_at(body, at.low, at) || is_cut_at(body, at.high, at)) return;
    double const length = (rest(body, at.high) - rest(body, at.low)).norm();
    double const tolerance = std::min(0.5, std::max(snap_.share, snap_.distance / length));
    int const nearer = at.s < 0.5 ? at.low : at.high;
    int end = std::min(at.s, 1 - at.s) < tolerance || !(at.s > 0 && at.s < 1) ? nearer : -1;
    for (int const v : {nearer, nearer == at.low ? at.high : at.low})
      if (end < 0 && is_on_old_cut(body, v, at)) end = v;
    bool const is_thin = end < 0 && lowest_height(body, at) < snap_.height;
    if (is_thin) end = nearer;
    if (end >= 0 && is_on(end)) return;
    align(body, at);
    On const on{(1 - at.s) * rest(body, at.low) + at.s * rest(body, at.high), at.normal, 0};
    part_ends(body, at);
    if (end >= 0) {
      ++report_.snapped, report_.too_thin += is_thin ? 1 : 0;
      put_on(end, on);
      mark(body, end);
      return;
    }
    int const n = divide(body, at, on);
    mark(body, n);
    neighbours_.clear();
    body.tissue().for_each_joined(n, [&](int v) { neighbours_.push_back(v); });
    for (int const v : neighbours_) find_crossings(body, swept, n, v, at.time);
  }

  /// The normal of the sheet in the undeformed solid, by a tetrahedron at the edge: N ∝ Fᵀ n.
  template <class Body>
  static Vector3<double> undeformed(Body const& body, Crossing const& at) {
    auto const& solid = body.tissue().topology();
    for (int const t : solid.tetrahedra_at(at.low)) {
      if (solid.corner_of(t, at.high) < 0) continue;
      Corners const c = solid.corners(t);
      Vector3<double> const o = rest(body, c[0]), x = now(body, c[0]), a = rest(body, c[1]) - o, b = rest(body, c[2]) - o, d = rest(body, c[3]) - o;
      double const one = at.normal.dot(now(body, c[1]) - x), two = at.normal.dot(now(body, c[2]) - x), three = at.normal.dot(now(body, c[3]) - x);
      Vector3<double> const normal = one * b.cross(d) + two * d.cross(a) + three * a.cross(b);
      if (double const length = normal.norm(); length > 0) return normal / length;
    }
    return at.normal;
  }

  /// Returns the new vertex, which is on the cut.
  template <class Body>
  int divide(Body& body, Crossing const& at, On const& on) {
    auto const& solid = body.tissue().topology();
    int const before = solid.tetrahedron_count(), triangles = solid.border().triangle_count();
    int const n = body.insert_on_edge(at.low, at.high, static_cast<Scalar>(at.s));
    put_on(n, on);
    for (int const t : solid.tetrahedra_at(n)) sides_[t] = 0;
    ++report_.edges_divided, ++report_.particles_added;
    report_.tetrahedra_added += solid.tetrahedron_count() - before, report_.triangles_added += solid.border().triangle_count() - triangles;
    return n;
  }

  /// Whether it is at this vertex that the sheet goes through the edge: the vertex is on the cut already, as far off the sheet as it was then. One that is left
  /// behind is, where the blade comes back along the sheet.
  template <class Body>
  bool is_cut_at(Body const& body, int v, Crossing const& at) const {
    On const on = on_at(v);
    if (!on.is_on && !(std::abs(on.normal.dot(at.normal)) > parallel)) return false;
    double const own = std::abs(on.normal.dot(rest(body, v) - on.at));
    return height_over(body, v, at) <= own + snap_.height;
  }
  /// Whether a vertex is on the wall of an earlier cut along the sheet, and as near to it as such a wall may be to its own: the cut is there already. Walls of this
  /// stroke do not count: they open with the ticks.
  template <class Body>
  bool is_on_old_cut(Body const& body, int v, Crossing const& at) const {
    auto const& surface = body.tissue().surface();
    auto const around = surface.triangles_at(v);
    auto const is_along = [&](int t) {
      if (!body.tissue().is_wound(t)) return false;
      auto const c = surface.corners(t);
      if (std::ranges::all_of(c, [&](int i) { return is_on(i); })) return false;
      Vector3<double> const area = (rest(body, c[1]) - rest(body, c[0])).cross(rest(body, c[2]) - rest(body, c[0]));
      return std::abs(area.dot(at.normal)) > parallel * area.norm();
    };
    if (std::none_of(around.begin(), around.end(), is_along)) return false;
    double longest = 0;
    for (int const t : body.tissue().topology().tetrahedra_at(v))
      for (int const i : body.tissue().topology().corners(t)) longest = std::max(longest, (rest(body, i) - rest(body, v)).norm());
    return height_over(body, v, at) <= snap_.share * longest;
  }
  /// How far an end of a crossed edge is from the sheet.
  template <class Body>
  static double height_over(Body const& body, int v, Crossing const& at) {
    return (v == at.low ? at.s : 1 - at.s) * std::abs(at.normal.dot(rest(body, at.high) - rest(body, at.low)));
  }

  /// What the lowest height of a tetrahedron would be with a new vertex on the edge; infinite where no tetrahedron holds the edge.
  template <class Body>
  static double lowest_height(Body const& body, Crossing const& at) {
    auto const& solid = body.tissue().topology();
    Vector3<double> const a = rest(body, at.low), b = rest(body, at.high), n = (1 - at.s) * a + at.s * b;
    double lowest = std::numeric_limits<double>::infinity();
    for (int const t : solid.tetrahedra_at(at.low)) {
      int const k = solid.corner_of(t, at.high);
      if (k < 0) continue;
      std::array<Vector3<double>, 2> other;   // the corners that stay
      std::size_t found = 0;
      for (int const i : solid.corners(t))
        if (i != at.low && i != at.high) other[found++] = rest(body, i);
      auto const& [c, d] = other;
      Vector3<double> const opposite = (c - n).cross(d - n);   // of the face that both parts share
      for (Vector3<double> const& end : {a, b}) {
        Vector3<double> const to_c = c - end, to_d = d - end, to_n = n - end;
        double const widest = std::max({opposite.squaredNorm(), to_c.cross(to_d).squaredNorm(), to_n.cross(to_c).squaredNorm(), to_n.cross(to_d).squaredNorm()});
        lowest = std::min(lowest, std::abs(opposite.dot(to_n)) / std::sqrt(widest));
      }
    }
    return lowest;
  }

  bool is_on(int v) const noexcept {
    On const* const on = on_.find(v);
    return on != nullptr && on->is_on;
  }
  void put_on(int v, On on) {   // by value: it may be one of those that move
    if (!is_on(v)) all_on_.push_back(v);
    On& own = entry(v);
    on.side = own.side, on.order = ++last_order_, on.is_on = true;
    own = on;
    opening_.add(v);
  }
  /// Of a vertex that gets something that is known of it.
  On& entry(int v) {
    On& own = on_[v];
    if (!own.is_on && own.side == 0) near_.push_back(v);
    return own;
  }
  int side_of(int v) const noexcept { return on_at(v).side; }
  /// By the crossing that came last: where the sheet bends, an edge to the vertex may have been crossed before.
  template <class Body>
  void put_aside(Body& body, int v, int side) {
    if (is_on(v) || side_of(v) == side) return;
    entry(v).side = static_cast<signed char>(side);
    bool changes = false;
    for (int const t : body.tissue().topology().tetrahedra_at(v))
      if (signed char const* const known = sides_.find(t); known != nullptr && *known == -side) sides_[t] = 0, changes = true;
    if (changes) mark(body, v);
  }
  /// The ends of a crossed edge are on different sides of the sheet.
  template <class Body>
  void part_ends(Body& body, Crossing const& at) {
    double const across = at.normal.dot(rest(body, at.high) - rest(body, at.low)), digits = 1e-7 * static_cast<double>(body.mean_edge());
    int const side = across < 0 ? -1 : 1;
    if (at.s * std::abs(across) > digits) put_aside(body, at.low, -side);
    if ((1 - at.s) * std::abs(across) > digits) put_aside(body, at.high, side);
  }
  /// Whether a blade that came back goes by here: sheets that look nearly the other way are one; others meet at a bend.
  static bool looks_back(Vector3<double> const& normal, Vector3<double> const& other) noexcept { return normal.dot(other) < -turned_back; }
  /// Looking as the sheet does at the vertices beside. One that was left behind is on the cut again where the blade comes back to it along its sheet, as where a
  /// way closes: on an arc from the one place to the other the mean of both normals is across the chord.
  template <class Body>
  void align(Body const& body, Crossing& at) {
    int back = 0;
    again_.clear();
    for (int const end : {at.low, at.high})
      body.tissue().for_each_joined(end, [&](int i) {
        On const* const on = on_.find(i);
        if (on == nullptr) return;
        double const cosine = on->normal.dot(at.normal);
        if (on->is_on) back += cosine < -turned_back ? 1 : cosine > turned_back ? -1 : 0;
        if (on->is_on || std::abs(cosine) < parallel) return;
        Vector3<double> const chord = on->at - ((1 - at.s) * rest(body, at.low) + at.s * rest(body, at.high));
        if (std::abs((on->normal + std::copysign(1.0, cosine) * at.normal).dot(chord)) < snap_.thickness) again_.push_back(i);
      });
    if (back > 0) at.normal = -at.normal;
    for (int const i : again_)
      if (!is_on(i)) put_on(i, on_at(i));
  }

  // --- faces ------------------------------------------------------------------------------------------------------------
  template <class Body>
  bool is_all_on(Body const& body, int t, int but) const {
    Corners const c = body.tissue().topology().corners(t);
    for (int k = 0; k < 4; ++k)
      if (k != but && !is_on(c[static_cast<std::size_t>(k)])) return false;
    return true;
  }

  /// Marks the faces of the tetrahedra at a vertex that has come to the cut that lie on it and between its two sides.
  template <class Body>
  void mark(Body& body, int v) {
    auto const& solid = body.tissue().topology();
    for (int const t : solid.tetrahedra_at(v))
      for (int k = 0; k < 4; ++k) {
        int const u = solid.neighbour(t, k);
        if (u < 0 || (u < t && solid.corner_of(u, v) >= 0) || body.tissue().is_cut(t, k) || !is_all_on(body, t, k)) continue;
        if (!lies_between(body, t, u)) continue;
        if ((joins_slice(body, t) || joins_slice(body, u)) && !lies_between(body, t, u)) continue;
        mark_face(body, t, k);
      }
  }
  template <class Body>
  void mark_face(Body& body, int t, int k) {
    auto const f = body.tissue().topology().face(t, k);
    body.mark_cut(t, k);
    double const area = (rest(body, f[1]) - rest(body, f[0])).cross(rest(body, f[2]) - rest(body, f[0])).norm() / 2;
    report_.area += area, area_ += area;
    for (int const v : f) opening_.add(v);
  }

  /// Whether a tetrahedron would be parted from all others, alone or with some: they go to the other side then, if none is thicker than what snaps, and they are
  /// a crumb or lie between this cut and the wall of an earlier one.
  template <class Body>
  bool joins_slice(Body const& body, int t) {
    auto const& solid = body.tissue().topology();
    constexpr std::size_t most = 64;
    slice_.assign(1, t);
    double volume = 0;
    bool is_between_walls = true;
    for (std::size_t n = 0; n < slice_.size(); ++n) {
      Corners const c = solid.corners(slice_[n]);
      for (int const i : c) {
        if (is_on(i)) continue;
        if (thickness(body, slice_[n], i) > snap_.thickness) return false;
        auto const border = body.tissue().surface().triangles_at(i);
        is_between_walls = is_between_walls && std::ranges::any_of(border, [&](int triangle) { return body.tissue().is_wound(triangle); });
      }
      volume += (rest(body, c[1]) - rest(body, c[0])).cross(rest(body, c[2]) - rest(body, c[0])).dot(rest(body, c[3]) - rest(body, c[0])) / 6;
      if (!is_between_walls && 4 * volume > snap_.thickness * snap_.thickness * snap_.thickness) return false;
      for (int k = 0; k < 4; ++k) {
        int const u = solid.neighbour(slice_[n], k);
        if (u < 0 || std::find(slice_.begin(), slice_.end(), u) != slice_.end() || body.tissue().is_cut(slice_[n], k)) continue;
        if (is_all_on(body, slice_[n], k) && lies_between(body, u, slice_[n])) continue;
        if (slice_.size() == most) return false;
        slice_.push_back(u);
      }
    }
    for (int const s : slice_) {
      int const side = side_of_tetrahedron(body, s);
      sides_[s] = static_cast<signed char>(-2 * side);   // it stays so
    }
    ++report_.joined;
    return true;
  }
  /// Of a corner over those of the tetrahedron that are on the cut, of a face in the mean: at a bend on different sides.
  template <class Body>
  double thickness(Body const& body, int t, int corner) const {
    double sum = 0;
    for (int const i : body.tissue().topology().corners(t))
      if (is_on(i)) sum += std::abs(on_.find(i)->normal.dot(rest(body, corner) - on_.find(i)->at));
    return sum / 3;
  }

  /// On which side of the cut a tetrahedron is, 1 ahead and −1 behind: that of its corners off the cut, else that of the last one that the cut has bent to, which is
  /// off the sheet itself. 0 where a corner lies in the sheet, and the blade has not come there. Once known it stays.
  template <class Body>
  int side_of_tetrahedron(Body const& body, int t) {
    signed char& side = sides_[t];
    if (side != 0) return side > 0 ? 1 : -1;
    Corners const c = body.tissue().topology().corners(t);
    int off = 0, bent = 0, last = 0;
    double high = 0;
    bool is_on_cut = true;
    for (int const i : c) {
      if (!is_on(i)) {
        is_on_cut = false;
        off += side_of(i), high += height_over_cut(body, c, i);
        continue;
      }
      On const& on = *on_.find(i);
      if (on.side != 0 && on.order > last) last = on.order, bent = on.side;
    }
    double const digits = 1e-7 * static_cast<double>(body.mean_edge());
    if (is_on_cut)
      side = bent < 0 ? -1 : 1;
    else if (off != 0 || std::abs(high) > digits)
      side = (off != 0 ? off > 0 : high > 0) ? 1 : -1;
    return side;
  }
  template <class Body>
  bool lies_between(Body const& body, int t, int u) {
    return side_of_tetrahedron(body, t) * side_of_tetrahedron(body, u) < 0;
  }
  /// Of a corner over the sheet that went by those that are on the cut, in the mean. Where it bends, over that side of the bend which is nearer.
  template <class Body>
  double height_over_cut(Body const& body, Corners const& corners, int corner) const {
    std::array<On, 4> sheets;
    std::size_t count = 0;
    double mean = 0, low = std::numeric_limits<double>::infinity(), high = -low, bend = 0, least = 1;
    for (int const i : corners) {
      if (!is_on(i)) continue;
      On& own = sheets[count++] = *on_.find(i);
      if (looks_back(own.normal, sheets[0].normal)) own.normal = -own.normal;
      double const height = own.normal.dot(rest(body, corner) - own.at);
      mean += height / 4, low = std::min(low, height), high = std::max(high, height);
      for (std::size_t k = 0; k + 1 < count; ++k) {
        bend += (own.normal - sheets[k].normal).dot(sheets[k].at - own.at);
        least = std::min(least, own.normal.dot(sheets[k].normal));
      }
    }
    return least > bends ? mean : bend > 0 ? low : high;
  }

  /// Splits the vertices of faces that were marked, where those part the tetrahedra round them.
  template <class Body>
  void open(Body& body) {
    if (opening_.is_empty()) return;
    auto const& border = body.tissue().topology().border();
    opening_.open(
        body, [&](int v) { return on_at(v).order; },
        [&](int v, int copy, int first_triangle) {
          if (On const whole = on_at(v); whole.is_on)
            put_on(copy, whole);
          else if (whole.side != 0)
            entry(copy).side = whole.side;
          ++report_.particles_added, report_.triangles_added += border.triangle_count() - first_triangle;
          for (int t = first_triangle; t < border.triangle_count(); ++t) {
            auto const c = border.corners(t);
            report_.lip_area += (rest(body, c[1]) - rest(body, c[0])).cross(rest(body, c[2]) - rest(body, c[0])).norm() / 2;
          }
        });
  }
  /// Divides an edge in its middle, where there is one and its tetrahedra do not become too low. Returns whether it has.
  template <class Body>
  bool divide_middle(Body& body, int v, int w) {
    if (w < 0) return false;
    Crossing const middle{0, std::min(v, w), std::max(v, w), 0.5, on_at(v).normal};
    if (double const height = lowest_height(body, middle); !(height >= snap_.height && std::isfinite(height))) return false;
    mark(body, divide(body, middle, {(rest(body, v) + rest(body, w)) / 2, middle.normal}));
    return true;
  }
  /// Divides the edges for which vertices wait, again and again; what has split meanwhile may have parted such an edge.
  template <class Body>
  void open_and_divide_held(Body& body) {
    for (bool has_divided = true; std::exchange(has_divided, false);) {
      open(body);
      held_.assign(opening_.held().begin(), opening_.held().end());
      for (auto const& [a, b] : held_) has_divided = divide_middle(body, a, b) || has_divided;
    }
  }

  /// A vertex w of a tetrahedron at v so that the edge between them is one of two faces that are cut and closed, or −1.
  template <class Body>
  int end_within_cut(Body const& body, int t, int v) const {
    auto const& solid = body.tissue().topology();
    for (int const w : solid.corners(t)) {
      if (w == v || opening_.waits(v) || opening_.waits(w)) continue;
      int faces = 0;
      solid.for_each_round(v, w, [&](int u) {
        for (int k = 0; k < 4; ++k) faces += body.tissue().is_cut(u, k) && solid.corner_of(u, v) != k && solid.corner_of(u, w) != k ? 1 : 0;
      });
      if (faces >= 4) return w;   // each from two sides
    }
    return -1;
  }

  VolumeCutReport report_, last_;
  double area_ = 0, way_ = 0, longest_ = 0;   // m², of all strokes; m, of this one
  bool is_under_way_ = false;                 // it has gone more than an edge
  SolidSnap snap_{};
  int last_order_ = 0;
  std::size_t edits_ = 0;   // of the body, that are dealt with
  int particles_ = 0;       // of the body then; 0: before the first sweep
  SparseTable<On> on_;               // of the vertices at the cut
  SparseTable<signed char> sides_;   // of the tetrahedra there: 1 ahead, −1 behind, 0 not known
  std::vector<int> all_on_;          // the vertices that have come to the cut
  std::vector<int> near_;            // those of which something is known
  std::vector<int> neighbours_, again_, queue_, slice_;
  std::vector<std::pair<int, int>> edges_;
  std::vector<Crossing> crossings_;   // a heap: the earliest first
  SparseTable<bool, std::uint64_t> met_;   // edges that were gathered, by both their ends
  SparseTable<bool> seen_;            // the tetrahedra that a look has come to
  SolidOpening opening_;
  std::vector<std::pair<int, int>> held_;   // edges that it waits for
};

}  // namespace detail

}  // namespace palpate
