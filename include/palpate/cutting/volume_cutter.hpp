// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/cutting/detail/blade_sweep.hpp>
#include <palpate/cutting/detail/material_blade.hpp>
#include <palpate/mesh/tetrahedral_adjacency.hpp>
#include <palpate/tissue/concept.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

namespace palpate {

/// A straight cutting edge of a blade, from one end to the other [m, world].
template <RealScalar Scalar>
struct BladeSegment {
  Vector3<Scalar> from = Vector3<Scalar>::Zero(), to = Vector3<Scalar>::Zero();
};

/// How a VolumeCutter cuts.
template <RealScalar Scalar>
struct VolumeCutOptions {
  Scalar puncture_depth = 0;     ///< m: how deep below the skin the blade has to be before it cuts
  Scalar snap = Scalar(0.15);    ///< a crossing of an edge goes to the edge's end where that is nearer than this share of it,
  Scalar least_snap = Scalar(0.05);      ///< or than this share of the mesh's mean edge
  Scalar least_height = Scalar(0.02);    ///< of a tetrahedron that a cut makes, in mean edges; a crossing that would make a lower one goes to an end
  int most_tetrahedra = 1000;            ///< that a tick may make, about; the blade follows in the next ones

  void validate() const {
    if (!(puncture_depth >= 0) || !std::isfinite(puncture_depth))
      throw InvalidArgument(detail::message("VolumeCutter: the puncture depth is ", puncture_depth, " m; it must be finite and not negative"));
    if (!(snap >= 0 && snap < Scalar(0.5))) throw InvalidArgument(detail::message("VolumeCutter: snap is ", snap, "; it must be from 0 to below 0.5 of an edge"));
    if (!(least_snap >= 0 && least_snap < Scalar(0.5)))
      throw InvalidArgument(detail::message("VolumeCutter: least_snap is ", least_snap, "; it must be from 0 to below 0.5 mean edges"));
    if (!(least_height >= 0 && least_height < Scalar(0.5)))
      throw InvalidArgument(detail::message("VolumeCutter: least_height is ", least_height, "; it must be from 0 to below 0.5 mean edges"));
    if (most_tetrahedra < 1) throw InvalidArgument(detail::message("VolumeCutter: most_tetrahedra is ", most_tetrahedra, "; it must be at least 1"));
  }
};

/// What a stroke has cut so far: from where the blade came into the tissue until it has left it. The next stroke begins at zero.
struct VolumeCutReport {
  double area = 0;              ///< m², of the faces that are cut, undeformed
  double lip_area = 0;          ///< m², of both walls of what has opened
  int particles_added = 0;
  int tetrahedra_added = 0;
  int edges_divided = 0;
  int snapped = 0;              ///< crossings that went to an end of their edge
  int too_thin = 0;             ///< of those, because a tetrahedron would have become too low
  int closed_faces = 0;         ///< cut, and not open: no vertex of them has split
};

/// Cuts a solid with the edge of a blade, as far as the blade has come.
///
///   VolumeCutter<double> knife;
///   knife.advance(body, {{x, y, -0.01}, {x, y, 0.05}});   // once a tick, then step
///
/// The blade is followed in the undeformed solid: what it sweeps there is the cut, so that the same tetrahedra are cut however the tissue moves. Each edge that it
/// goes through gets a vertex there, and the tetrahedra round the edge are divided in two; all are whole tetrahedra with common faces at any time. Where all
/// corners of a face are on the cut, and it lies between its two sides, it is cut; a vertex splits where the faces cut round it part its tetrahedra. The cut
/// ends, meanwhile, at the last edges that the blade has crossed: beyond them nothing is open.
///   case                         tetrahedra after
///   three edges at a corner      4
///   four edges                   6
///   a vertex and two edges       3
///   two vertices and an edge     2
///   three vertices               1, a face opens
///   one edge, so far             2
/// Snapping   a crossing near an end of its edge goes to that end, which stays where it is; nothing else does.
/// Diagonals  edges are divided in the order that the blade comes to them, so it does not matter how finely a way is divided into ticks; at one time, those of
///            larger vertex numbers first, so that a face's diagonal goes to the smaller of the old vertices.
/// Blade      moves straight between two ticks; in a deformed solid it is followed at points half a mean edge apart.
/// Cost       O(tetrahedra near the way of the blade); and for the step after it O(moving tetrahedra), whose assembly is made anew. Memory grows as the body does.
/// Errors     InvalidArgument where the blade is not finite, or longer than 4,000 mean edges; the body stays as it was.
/// Limits     a stroke that crosses itself within one edge's length opens what lies between as well. Two edges with a gap between them
///            are one blade of three pieces.
/// Source     the sweep in material coordinates is that of \cite zheng2006 for surfaces.
template <RealScalar Scalar>
class VolumeCutter {
  using Vector = Vector3<Scalar>;

 public:
  using Options = VolumeCutOptions<Scalar>;
  using Segment = BladeSegment<Scalar>;
  using Report = VolumeCutReport;

  VolumeCutter() = default;
  explicit VolumeCutter(Options const& options) : options_(options) { options_.validate(); }

  /// One tick: the blade is here now, and the tissue as it is.
  template <class Body>
  void advance(Body& body, Segment const& blade) {
    std::array const ends{blade.from, blade.to};
    advance(body, std::span<Vector const>(ends));
  }
  /// The same of a blade of several straight pieces, from point to point [m, world]; their number stays while it cuts.
  template <class Body>
  void advance(Body& body, std::span<Vector const> blade) {
    static_assert(CuttableSolid<typename Body::Tissue>, "VolumeCutter: this tissue is no solid that can be cut; FiniteElements is. ProgressiveCutter cuts surfaces.");
    if (blade.size() < 2) throw InvalidArgument(detail::message("VolumeCutter: a blade of ", blade.size(), " points; it takes at least two"));
    for (Vector const& point : blade)
      if (!is_finite(point)) throw InvalidArgument("VolumeCutter: the blade is not finite; the tick was not taken");
    Scalar const edge = body.mean_edge(), length = length_of(blade);
    if (!(length <= 4000 * edge))
      throw InvalidArgument(detail::message("VolumeCutter: the blade is ", length, " m long, more than 4000 edges of ", edge, " m; is it in m?"));
    if (restorations_ != body.restorations() || body.size() < size_ || pieces_ != blade.size()) forget();
    restorations_ = body.restorations(), pieces_ = blade.size();
    follow(body, blade, length);
    size_ = body.size();
  }

  /// The blade is taken away: what it has cut is opened as far as that goes, and it may come back anywhere.
  template <class Body>
  void lift(Body& body) {
    if (cuts_) end_stroke(body);
    forget();
  }

  /// Whether it is in the tissue, and has cut it.
  bool is_cutting() const noexcept { return cuts_; }
  Report const& report() const noexcept { return report_; }
  Options const& options() const noexcept { return options_; }

 private:
  using Corners = TetrahedralAdjacency::Corners;

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

  /// Where the blade went by a vertex that is on the cut, and the normal of the sheet there; zero: it is not.
  struct On {
    Vector3<double> at = Vector3<double>::Zero(), normal = Vector3<double>::Zero();
    int order = 0;   // of those that came to it
  };

  void forget() noexcept {
    cuts_ = punctured_ = false;
    before_.clear(), on_.clear(), sides_.clear();
  }

  static Scalar length_of(std::span<Vector const> blade) noexcept {
    Scalar length = 0;
    for (std::size_t k = 1; k < blade.size(); ++k) length += (blade[k] - blade[k - 1]).norm();
    return length;
  }
  /// At a share of its pieces: each counts the same.
  static Vector point_of(std::span<Vector const> blade, Scalar share) noexcept {
    Scalar const pieces = static_cast<Scalar>(blade.size() - 1);
    std::size_t const k = std::min(static_cast<std::size_t>(share * pieces), blade.size() - 2);
    Scalar const u = share * pieces - static_cast<Scalar>(k);
    return (1 - u) * blade[k] + u * blade[k + 1];
  }

  // --- the blade in the undeformed solid ------------------------------------------------------------------------------
  /// From where it is in the tissue to where it is now, in ways of half an edge: the tissue may have moved meanwhile.
  template <class Body>
  void follow(Body& body, std::span<Vector const> blade, Scalar length) {
    Scalar const edge = body.mean_edge();
    Vector low = blade[0], high = blade[0];
    for (Vector const& point : blade) low = low.cwiseMin(point), high = high.cwiseMax(point);
    Vector const middle = (low + high) / 2;
    detail::MaterialFrame<Body> const frame(body);
    bool const is_far = [&] {
      auto const near = body.nearest_point(middle);
      return !near.found() || (near.distance > (high - low).norm() / 2 + edge && !frame.find(middle, -1).inside);
    }();
    if (is_far && before_.empty()) return;
    if (before_.empty()) points_ = 2 + static_cast<std::size_t>(2 * length / edge);
    from_.clear(), to_.clear();
    Scalar way = 0;
    for (std::size_t i = 0; i < points_; ++i) {
      to_.push_back(point_of(blade, static_cast<Scalar>(i) / static_cast<Scalar>(points_ - 1)));
      from_.push_back(before_.empty() ? to_.back() : frame.now(before_[i]));
      way = std::max(way, (to_.back() - from_.back()).norm());
    }
    int const parts = way < 1000 * edge ? 1 + static_cast<int>(2 * way / edge) : 1, made = body.tissue().topology().tetrahedron_count();
    for (int k = 1; k <= parts && body.tissue().topology().tetrahedron_count() - made < options_.most_tetrahedra; ++k) {
      Scalar const share = static_cast<Scalar>(k) / static_cast<Scalar>(parts);
      move(body, share);
    }
    if (is_far) forget();
  }
  template <class Body>
  void move(Body& body, Scalar share) {
    detail::MaterialFrame<Body> const frame(body);
    double const edge = static_cast<double>(body.mean_edge());
    now_.resize(points_);
    bool near_any = false;
    Scalar depth = 0;
    for (std::size_t i = 0; i < now_.size(); ++i) {
      Vector const x = share < 1 ? Vector((1 - share) * from_[i] + share * to_[i]) : to_[i];
      int const near = i < before_.size() && before_[i].inside ? before_[i].tetrahedron : i > 0 && now_[i - 1].inside ? now_[i - 1].tetrahedron : -1;
      now_[i] = frame.find(x, near);
      near_any = near_any || now_[i].inside || now_[i].in_wound || now_[i].distance < edge / 2;   // between two points it may be inside
      if (!punctured_ && options_.puncture_depth > 0 && now_[i].inside) depth = std::max(depth, body.nearest_point(x).distance);
    }
    bool const was_punctured = std::exchange(punctured_, punctured_ || !(depth < options_.puncture_depth) || !(options_.puncture_depth > 0));
    if (was_punctured && before_.size() == now_.size()) sweep(body);
    before_.swap(now_);
    if (near_any) return;
    if (cuts_) end_stroke(body);
    punctured_ = !(options_.puncture_depth > 0);
  }

  // --- a sweep ----------------------------------------------------------------------------------------------------------
  template <class Body>
  void sweep(Body& body) {
    detail::BladeSweep const swept(before_, now_, reaches_);
    gather(body, swept);
    crossings_.clear();
    for (auto const& [a, b] : edges_) find_crossings(body, swept, a, b, 0);
    new_on_.clear();
    while (!crossings_.empty()) {
      std::pop_heap(crossings_.begin(), crossings_.end(), later);
      Crossing const crossing = crossings_.back();
      crossings_.pop_back();
      cross(body, swept, crossing);
    }
    if (new_on_.empty()) return;
    mark(body);
    open(body);
    body.finish_edits();
  }

  static bool later(Crossing const& a, Crossing const& b) noexcept { return b < a; }

  /// The edges of all tetrahedra that the sweep may meet, from those that the blade's points are in or near.
  template <class Body>
  void gather(Body const& body, detail::BladeSweep const& swept) {
    auto const& solid = body.tissue().topology();
    double const margin = 1e-6 * static_cast<double>(body.mean_edge());
    seen_.resize(static_cast<std::size_t>(solid.tetrahedron_count()), 0);
    ++look_;
    queue_.clear(), edges_.clear();
    auto const consider = [&](int t) {
      if (t < 0 || t >= solid.tetrahedron_count() || std::exchange(seen_[static_cast<std::size_t>(t)], look_) == look_) return;
      Corners const c = solid.corners(t);
      if (swept.may_meet({rest(body, c[0]), rest(body, c[1]), rest(body, c[2]), rest(body, c[3])}, margin)) queue_.push_back(t);
    };
    for (auto const* points : {&before_, &now_})
      for (auto const& point : *points)
        if (point.tetrahedron >= 0 && point.tetrahedron < solid.tetrahedron_count())
          for (int const i : solid.corners(point.tetrahedron))
            for (int const t : solid.tetrahedra_at(i)) consider(t);
    for (std::size_t k = 0; k < queue_.size(); ++k)
      for (int face = 0; face < 4; ++face) consider(solid.neighbour(queue_[k], face));
    for (int const t : queue_) {
      Corners c = solid.corners(t);
      std::sort(c.begin(), c.end());
      for (std::size_t i = 0; i < 4; ++i)
        for (std::size_t j = i + 1; j < 4; ++j) edges_.emplace_back(c[i], c[j]);
    }
    std::sort(edges_.begin(), edges_.end());
    edges_.erase(std::unique(edges_.begin(), edges_.end()), edges_.end());
  }
  template <class Body>
  static Vector3<double> rest(Body const& body, int i) {
    return body.tissue().rest_position(i).template cast<double>();
  }

  template <class Body>
  void find_crossings(Body const& body, detail::BladeSweep const& swept, int a, int b, double earliest) {
    if (a > b) std::swap(a, b);
    swept.for_each_crossing(rest(body, a), rest(body, b), [&](detail::SweepCrossing const& found) {
      double const digits = 1e6;   // what differs by rounding alone is at one time
      crossings_.push_back({std::max(earliest, std::round(found.time * digits) / digits), a, b, found.s, found.normal});
      std::push_heap(crossings_.begin(), crossings_.end(), later);
    });
  }

  template <class Body>
  void cross(Body& body, detail::BladeSweep const& swept, Crossing const& at) {
    auto const& solid = body.tissue().topology();
    auto const around = solid.tetrahedra_at(at.low);
    if (std::none_of(around.begin(), around.end(), [&](int t) { return solid.corner_of(t, at.high) >= 0; })) return;   // divided meanwhile
    if (!cuts_) report_ = {}, cuts_ = true;
    if (is_cut_at(body, at.low, at) || is_cut_at(body, at.high, at)) return;
    double const length = (rest(body, at.high) - rest(body, at.low)).norm(), edge = static_cast<double>(body.mean_edge());
    double const tolerance = std::min(0.5, std::max(static_cast<double>(options_.snap), static_cast<double>(options_.least_snap) * edge / length));
    int const nearer = at.s < 0.5 ? at.low : at.high;
    On const on{(1 - at.s) * rest(body, at.low) + at.s * rest(body, at.high), at.normal, 0};
    int end = std::min(at.s, 1 - at.s) < tolerance || !(at.s > 0 && at.s < 1) ? nearer : -1;
    for (int const v : {nearer, nearer == at.low ? at.high : at.low})
      if (end < 0 && is_on_old_cut(body, v, at)) end = v;
    if (end >= 0) {
      if (put_on(end, on)) ++report_.snapped;
      return;
    }
    if (lowest_height(body, at) < static_cast<double>(options_.least_height) * edge) {
      if (put_on(nearer, on)) ++report_.snapped, ++report_.too_thin;
      return;
    }
    int const before = solid.tetrahedron_count();
    int const n = body.insert_on_edge(at.low, at.high, static_cast<Scalar>(at.s));
    put_on(n, on);
    for (int const t : solid.tetrahedra_at(n))
      if (static_cast<std::size_t>(t) < sides_.size()) sides_[static_cast<std::size_t>(t)] = 0;
    ++report_.edges_divided, ++report_.particles_added, report_.tetrahedra_added += solid.tetrahedron_count() - before;
    neighbours_.clear();
    solid.for_each_neighbour(n, [&](int v) { neighbours_.push_back(v); });
    for (int const v : neighbours_) find_crossings(body, swept, n, v, at.time);
  }

  /// Whether it is at this vertex that the sheet goes through the edge: the vertex is on the cut already, as far off the sheet as it was then.
  template <class Body>
  bool is_cut_at(Body const& body, int v, Crossing const& at) const {
    if (!is_on(v)) return false;
    On const& on = on_[static_cast<std::size_t>(v)];
    double const own = std::abs(on.normal.dot(rest(body, v) - on.at));
    return height_over(body, v, at) <= own + static_cast<double>(options_.least_height * body.mean_edge());
  }
  /// Whether a vertex is on the wall of an earlier cut along the sheet, and as near to it as such a wall may be to its own: the cut is there already.
  template <class Body>
  bool is_on_old_cut(Body const& body, int v, Crossing const& at) const {
    auto const& surface = body.tissue().surface();
    auto const around = surface.triangles_at(v);
    auto const is_along = [&](int t) {
      auto const c = surface.corners(t);
      Vector3<double> const area = (rest(body, c[1]) - rest(body, c[0])).cross(rest(body, c[2]) - rest(body, c[0]));
      return body.tissue().is_wound(t) && std::abs(area.dot(at.normal)) > 0.8 * area.norm();
    };
    if (std::none_of(around.begin(), around.end(), is_along)) return false;
    double longest = 0;
    for (int const t : body.tissue().topology().tetrahedra_at(v))
      for (int const i : body.tissue().topology().corners(t)) longest = std::max(longest, (rest(body, i) - rest(body, v)).norm());
    return height_over(body, v, at) <= static_cast<double>(options_.snap) * longest;
  }
  /// How far an end of a crossed edge is from the sheet.
  template <class Body>
  static double height_over(Body const& body, int v, Crossing const& at) {
    return (v == at.low ? at.s : 1 - at.s) * std::abs(at.normal.dot(rest(body, at.high) - rest(body, at.low)));
  }

  /// What the lowest height of a tetrahedron would be with a new vertex on the edge.
  template <class Body>
  static double lowest_height(Body const& body, Crossing const& at) {
    auto const& solid = body.tissue().topology();
    Vector3<double> const n = (1 - at.s) * rest(body, at.low) + at.s * rest(body, at.high);
    double lowest = std::numeric_limits<double>::infinity();
    for (int const t : solid.tetrahedra_at(at.low)) {
      if (solid.corner_of(t, at.high) < 0) continue;
      Corners const c = solid.corners(t);
      for (int const end : {at.low, at.high}) {
        std::array<Vector3<double>, 4> x;
        for (std::size_t k = 0; k < 4; ++k) x[k] = c[k] == end ? n : rest(body, c[k]);
        double const volume = (x[1] - x[0]).cross(x[2] - x[0]).dot(x[3] - x[0]);
        double widest = 0;
        for (std::size_t k = 0; k < 4; ++k) {
          auto const &p = x[(k + 1) % 4], &q = x[(k + 2) % 4], &r = x[(k + 3) % 4];
          widest = std::max(widest, (q - p).cross(r - p).norm());
        }
        lowest = std::min(lowest, volume / widest);
      }
    }
    return lowest;
  }

  bool is_on(int v) const noexcept { return static_cast<std::size_t>(v) < on_.size() && on_[static_cast<std::size_t>(v)].normal.squaredNorm() > 0; }
  bool put_on(int v, On on) {   // by value: it may be one of those that move
    if (is_on(v)) return false;
    if (on_.size() <= static_cast<std::size_t>(v)) on_.resize(static_cast<std::size_t>(v) + 1);
    on_[static_cast<std::size_t>(v)] = on;
    on_[static_cast<std::size_t>(v)].order = ++last_order_;
    new_on_.push_back(v);
    return true;
  }

  // --- faces ------------------------------------------------------------------------------------------------------------
  /// Marks the faces that lie on the cut and between its two sides, of those at vertices that have come to it.
  template <class Body>
  void mark(Body& body) {
    auto const& solid = body.tissue().topology();
    to_open_.assign(new_on_.begin(), new_on_.end());   // also those on faces that are cut already, and closed
    for (int const v : new_on_)
      for (int const t : solid.tetrahedra_at(v))
        for (int k = 0; k < 4; ++k) {
          int const u = solid.neighbour(t, k);
          if (u < 0 || body.tissue().is_cut(t, k)) continue;
          auto const f = solid.face(t, k);
          if (!std::all_of(f.begin(), f.end(), [&](int i) { return is_on(i); })) continue;
          if (is_ahead(body, t) == is_ahead(body, u)) continue;
          body.mark_cut(t, k);
          report_.area += (rest(body, f[1]) - rest(body, f[0])).cross(rest(body, f[2]) - rest(body, f[0])).norm() / 2;
          for (int const i : f) to_open_.push_back(i);
        }
  }

  /// On which side of the cut a tetrahedron is: that of its corner off the cut; with all four on it that of the one that came to it last, of those that do not
  /// lie in the sheet itself. So it does not matter when it is asked.
  template <class Body>
  bool is_ahead(Body const& body, int t) {
    if (sides_.size() <= static_cast<std::size_t>(t)) sides_.resize(static_cast<std::size_t>(body.tissue().topology().tetrahedron_count()), 0);
    signed char& side = sides_[static_cast<std::size_t>(t)];
    if (side != 0) return side > 0;
    Corners c = body.tissue().topology().corners(t);
    auto const order = [&](int i) { return is_on(i) ? on_[static_cast<std::size_t>(i)].order : std::numeric_limits<int>::max(); };
    std::sort(c.begin(), c.end(), [&](int i, int j) { return std::pair(order(i), i) > std::pair(order(j), j); });
    double const digits = 1e-7 * static_cast<double>(body.mean_edge());
    double farthest = 0;
    for (int const i : c) {
      double const height = height_over_cut(body, c, i);
      if (std::abs(farthest) < std::abs(height)) farthest = height;
      if (std::abs(farthest) > digits) break;
    }
    side = farthest >= 0 ? 1 : -1;
    return side > 0;
  }
  /// Of a corner over the sheet that went by those that are on the cut, in the mean.
  template <class Body>
  double height_over_cut(Body const& body, Corners const& corners, int corner) const {
    Vector3<double> ahead = Vector3<double>::Zero();
    double sum = 0;
    for (int const i : corners) {
      if (!is_on(i)) continue;
      On const& on = on_[static_cast<std::size_t>(i)];
      double const sign = on.normal.dot(ahead) < 0 ? -1 : 1;
      ahead += sign * on.normal, sum += sign * on.normal.dot(rest(body, corner) - on.at);
    }
    return sum / 4;
  }

  /// Splits the vertices of faces that were marked, where those part the tetrahedra round them.
  template <class Body>
  void open(Body& body) {
    std::sort(to_open_.begin(), to_open_.end());
    to_open_.erase(std::unique(to_open_.begin(), to_open_.end()), to_open_.end());
    for (int const v : to_open_) split(body, v);
  }
  template <class Body>
  bool split(Body& body, int v) {
    auto const& solid = body.tissue().topology();
    solid.fans_at(v, fans_, [&](int t, int k) { return body.tissue().is_cut(t, k); });
    for (int fan = 1; fan < fans_.size(); ++fan) {
      int const opened = solid.border().triangle_count();
      int const copy = body.split_vertex(v, fans_[fan]);
      put_on(copy, on_[static_cast<std::size_t>(v)]);
      ++report_.particles_added;
      for (int t = opened; t < solid.border().triangle_count(); ++t) {
        auto const c = solid.border().corners(t);
        report_.lip_area += (rest(body, c[1]) - rest(body, c[0])).cross(rest(body, c[2]) - rest(body, c[0])).norm() / 2;
      }
    }
    return fans_.size() > 1;
  }

  /// The blade has left: an edge within what is cut and closed is divided, so that its middle splits.
  template <class Body>
  void end_stroke(Body& body) {
    auto const& solid = body.tissue().topology();
    new_on_.clear();
    for (int v = 0; v < std::min(body.size(), static_cast<int>(on_.size())); ++v)
      for (bool divided = is_on(v); divided;) {
        divided = false;
        for (int const i : solid.tetrahedra_at(v)) {
          int const w = end_within_cut(body, i, v);
          if (w < 0) continue;
          Crossing const middle{0, std::min(v, w), std::max(v, w), 0.5, on_[static_cast<std::size_t>(v)].normal};
          if (lowest_height(body, middle) < static_cast<double>(options_.least_height * body.mean_edge())) continue;
          int const before = solid.tetrahedron_count();
          int const n = body.insert_on_edge(middle.low, middle.high, Scalar(0.5));
          put_on(n, {rest(body, n), middle.normal, 0});
          ++report_.edges_divided, ++report_.particles_added, report_.tetrahedra_added += solid.tetrahedron_count() - before;
          split(body, n);
          divided = true;
          break;
        }
      }
    body.finish_edits();
    int faces = 0;
    for (int v = 0; v < std::min(body.size(), static_cast<int>(on_.size())); ++v)
      for (int const t : is_on(v) ? solid.tetrahedra_at(v) : std::span<int const>())
        for (int k = 0; k < 4; ++k) faces += body.tissue().is_cut(t, k) && solid.corner_of(t, v) != k ? 1 : 0;
    report_.closed_faces = faces / 6;   // seen from three corners and two sides
    cuts_ = false;
    on_.clear(), sides_.clear();
  }
  /// A vertex w of a tetrahedron at v so that the edge between them is one of two faces that are cut and closed, or −1.
  template <class Body>
  static int end_within_cut(Body const& body, int t, int v) {
    auto const& solid = body.tissue().topology();
    for (int const w : solid.corners(t)) {
      if (w == v) continue;
      int faces = 0;
      solid.for_each_round(v, w, [&](int u) {
        for (int k = 0; k < 4; ++k) faces += body.tissue().is_cut(u, k) && solid.corner_of(u, v) != k && solid.corner_of(u, w) != k ? 1 : 0;
      });
      if (faces >= 4) return w;   // each from two sides
    }
    return -1;
  }

  Options options_;
  Report report_;
  std::vector<Vector> from_, to_;   // the points of the blade, where they were in the tissue as it is now, and where they are
  std::size_t points_ = 2, pieces_ = 0, restorations_ = 0;
  int size_ = 0;                  // of the body, after the last tick
  bool punctured_ = false, cuts_ = false;
  std::vector<detail::MaterialPoint> before_, now_;
  std::vector<std::array<double, 2>> reaches_;
  std::vector<On> on_;            // of each vertex
  std::vector<signed char> sides_;   // of each tetrahedron at a face that is on the cut: 1 ahead, −1 behind
  std::vector<int> new_on_, to_open_, neighbours_, queue_;
  std::vector<std::pair<int, int>> edges_;
  std::vector<Crossing> crossings_;   // a heap: the earliest first
  std::vector<unsigned> seen_;        // which look at the sweep saw each tetrahedron last
  unsigned look_ = 0;
  int last_order_ = 0;
  TetrahedronFans fans_;
};

}  // namespace palpate
