// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/collision/surface_tree.hpp>
#include <palpate/core/columns.hpp>
#include <palpate/core/error.hpp>
#include <palpate/core/index_lists.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/detail/simplices.hpp>
#include <palpate/mesh/normals.hpp>
#include <palpate/mesh/solid_edit.hpp>
#include <palpate/mesh/surface_topology.hpp>
#include <palpate/mesh/tetrahedral_mesh.hpp>
#include <palpate/mesh/tetrahedral_topology.hpp>
#include <palpate/mesh/triangle_mesh.hpp>
#include <palpate/volume/detail/divided_solid.hpp>
#include <palpate/volume/detail/hang_together.hpp>
#include <palpate/volume/detail/parted_triangles.hpp>
#include <palpate/volume/detail/shadow_search.hpp>
#include <palpate/volume/detail/triangle_parts.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <unordered_map>
#include <utility>
#include <vector>

namespace palpate {

/// A fine skin that coarse tetrahedra carry: for pictures, picking and touch.
///   skin point = Σ_k w_k x_k,   w the barycentric coordinates at rest in the tetrahedron that holds it, else in that of the nearest face of the border
///
///   auto const scan = read_mesh("liver.stl", metres_per("mm"));
///   auto const solid = fill(scan, {.edge = 0.01});
///   EmbeddedSurface skin(scan, solid.mesh);
///   SoftBody body(FiniteElements(solid.mesh, …));
///   knife.advance(body, blade), body.step(0.01), skin.follow(body);
///   auto const touched = skin.nearest(tip);
///   skin.for_each_weight(touched, [&](int particle, double weight) { body.apply_force(particle, weight * force); });
///
/// Cuts       a triangle that an open wound crosses is parted there, and has vertices of both lips, at one place at rest. The side of a point outside of
///            the tetrahedra is that of the tetrahedron below it, along the skin's normal there: its shadow. No triangle has corners on two sides of an
///            opened face. Triangles that no wound crosses stay whole, and vertices keep their numbers; those of the lips have higher ones. What lies over
///            tetrahedra that are taken away goes with them.
/// Units      m.
/// Invariant  weights of a point sum to 1, so a force that is spread by them keeps its sum, and its moment about any point; at rest, and after any affine
///            motion, the skin is exact. Its area at rest is what it was, however it is cut, less what was taken away.
/// Errors     InvalidMesh: a skin without triangles, corners that are no points; tetrahedra that are flat or none. InvalidArgument: a body of other tetrahedra.
/// Cost       O(skin) an update with its normals; neither update nor nearest nor for_each_weight allocates, all are noexcept. follow() besides that
///            O(edits of the body) comparisons, and O(triangles in the tetrahedra, as they were made, that were edited); it allocates where there are any.
/// Limits     made for the tetrahedra that the body is made of, before it is cut. Where it lies outside of them, by up to `farthest_outside`, it is carried on
///            past their border, and a turn of the border there is magnified. Points that no triangle has any more stay in points().
template <RealScalar Scalar>
class EmbeddedSurface {
 public:
  using Vector = Vector3<Scalar>;
  /// Particles, and the weights with which they carry a point.
  struct Carrier {
    std::array<int, 4> particle;
    std::array<Scalar, 4> weight;
  };

  EmbeddedSurface(TriangleMesh<Scalar> const& skin, TetrahedralMesh<Scalar> const& volume) : particles_(static_cast<int>(volume.points.cols())) {
    detail::check_corners(skin);
    detail::check_corners(volume);
    if (skin.triangles.cols() == 0) throw InvalidMesh("the skin has no triangles, so there is nothing to carry");
    if (volume.tetrahedra.cols() == 0) throw InvalidMesh("there are no tetrahedra to carry a skin");
    points_ = Columns<Scalar, 3>(skin.points), rest_ = skin.points;
    normals_ = Columns<Scalar, 3>(vertex_normals(skin, NormalWeight::area));
    made_ = SurfaceTopology(static_cast<int>(skin.points.cols()), skin.triangles);
    embed(volume);
    triangles_ = detail::PartedTriangles<Scalar>(skin);
  }

  /// The skin as it is now: its points, triangles, unit normals of its points weighted by area; and a copy as a mesh.
  auto points() const noexcept { return points_.view(); }
  auto triangles() const noexcept { return triangles_.view(); }
  auto normals() const noexcept { return normals_.view(); }
  TriangleMesh<Scalar> mesh() const { return {points(), triangles()}; }
  /// Counts how often follow() has changed triangles.
  std::size_t revision() const noexcept { return revision_; }
  /// The triangle that this one is, or is a part of, as the skin was made.
  int whole(int triangle) const noexcept { return triangles_.whole(triangle); }
  Carrier const& carrier(int point) const noexcept { return carriers_[at(point)]; }
  /// The point of the undeformed tetrahedra that decides on which side of a cut a point is: itself, or one below it where it lies outside.
  Vector3<double> shadow(int point) const noexcept { return is_added(point) ? added(point).shadow : Vector3<double>(shadow_.col(point)); }
  /// How far it lies outside of the tetrahedra at rest, at most [m]: what of its shape they do not have.
  Scalar farthest_outside() const noexcept { return farthest_outside_; }

  /// Follows a body of these tetrahedra, or a copy in its place: what cuts have done to it since the last time, and where its particles are. Where nothing
  /// was cut it is update().
  template <class Body>
  void follow(Body const& body) {
    auto const edits = body.solid_edits();
    bool const is_copy = edits.size() < seen_.size() || !std::equal(seen_.begin(), seen_.end(), edits.begin());   // put in the body's place
    bool const anew = is_copy || restorations_ != body.restorations();
    bool const is_other = solid_.size() != body.tissue().topology().tetrahedron_count() || particles_ != body.size();
    if (anew || is_other || seen_.size() < edits.size()) take_edits(body, edits, anew);
    update(body.positions());
  }
  /// Follows the particles of a body that was not cut since, in the order of the tetrahedral mesh, to x (3 × particles).
  template <class X>
  void update(X const& x) noexcept {
    eigen_assert(x.cols() >= particles_);
    for (int i = 0; i < points_.size(); ++i) points_[i] = carried(carriers_[at(i)], x);
    normals_.view().setZero();
    for (int t = 0; t < triangles_.size(); ++t) {
      auto const c = triangles_[t];
      Vector const n = triangle_area_vector<Scalar>(points_[c[0]], points_[c[1]], points_[c[2]]);
      for (int const i : c) normals_[i] += n;
    }
    for (int i = 0; i < normals_.size(); ++i) {
      Vector sum = normals_[i];
      if (Scalar const largest = sum.cwiseAbs().maxCoeff(); largest > 0) sum /= largest, normals_[i] = sum.normalized();
    }
    triangles_.tree().refit(points_.view());
  }

  /// The nearest point of the skin as it is now; see SurfaceTree.
  SurfacePoint<Scalar> nearest(Vector const& query, int hint = -1) const noexcept { return triangles_.tree().nearest(points_.view(), query, hint); }
  /// visit(particle, weight) for what carries a point of the skin, as nearest() gives it: up to twelve, a particle may come again. Of no point nothing.
  template <class Visit>
  void for_each_weight(SurfacePoint<Scalar> const& point, Visit&& visit) const noexcept {
    if (point.triangle < 0 || point.triangle >= triangles_.size()) return;
    for (int c = 0; c < 3; ++c) {
      Carrier const& carrier = carriers_[at(triangles_[point.triangle][at(c)])];
      for (std::size_t k = 0; k < 4; ++k) visit(carrier.particle[k], point.barycentric[c] * carrier.weight[k]);
    }
  }

  /// What is to be drawn between the lips of wounds and their walls, the body's border triangles with is_wound(): a strip from each lip to the wall below it.
  /// With the skin and the walls it leaves no gap. Allocates; O(skin).
  template <class Body>
  TriangleMesh<Scalar> skirt(Body const& body) const {
    detail::HangTogether<Body> const solid(body);
    std::vector<std::array<int, 2>> lips = boundary_edges(mesh());
    std::erase_if(lips, [&](auto const& edge) { return was_border(edge[0], edge[1]); });
    std::vector<int> ends;
    for (auto const& edge : lips) ends.insert(ends.end(), edge.begin(), edge.end());
    detail::sort_each_once(ends);
    TriangleMesh<Scalar> strip{Matrix3X<Scalar>(3, 2 * std::ssize(ends)), Matrix<int, 3, Dynamic>(3, 2 * std::ssize(lips))};
    Eigen::Index column = 0;
    for (int const i : ends) {   // each point, and its shadow on the wall
      strip.points.col(column++) = points_[i];
      strip.points.col(column++) = carried(carrier_of(tetrahedron_at(i), shadow(i), solid), body.positions());
    }
    column = 0;
    auto const place = [&](int i) { return 2 * static_cast<int>(std::lower_bound(ends.begin(), ends.end(), i) - ends.begin()); };
    for (auto const& [a, b] : lips) {
      strip.triangles.col(column++) << place(b), place(a), place(a) + 1;
      strip.triangles.col(column++) << place(b), place(a) + 1, place(b) + 1;
    }
    return strip;
  }

 private:
  using Point = Vector3<double>;
  using Parts = detail::TriangleParts;
  using Corners = std::array<int, 3>;
  /// Where a point that cuts have added lies on the skin as it was made: at a corner (the key of an edge from it to itself), on an edge, or in a triangle.
  struct Place {
    std::uint64_t key;
    double share;   // of the way along the edge from the end with the smaller number; in a triangle its number there
  };
  struct Added : Place {
    int leaf = -1;   // on whose side of the wound it is
    Point shadow = Point::Zero();
  };

  static constexpr double same = sizeof(Scalar) == sizeof(float) ? 1e-5 : 1e-7;   // of a triangle: points so near to each other are one

  static std::size_t at(int i) noexcept { return static_cast<std::size_t>(i); }
  static std::uint64_t key_in(int f) noexcept { return (std::uint64_t{1} << 63) + static_cast<std::uint64_t>(f); }
  template <class X>
  static Vector carried(Carrier const& carrier, X const& x) noexcept {
    Vector sum = Vector::Zero();
    for (std::size_t k = 0; k < 4; ++k) sum += carrier.weight[k] * x.col(carrier.particle[k]);
    return sum;
  }
  template <class Body>
  static Carrier carrier_of(int t, Point const& p, detail::HangTogether<Body> const& solid) noexcept {
    Carrier carrier{solid.corners(t), {}};
    for (int k = 0; Scalar& weight : carrier.weight) weight = static_cast<Scalar>(solid.weights(t, p)[k++]);
    return carrier;
  }

  bool is_added(int i) const noexcept { return i >= made_.vertex_count(); }
  Added const& added(int i) const noexcept { return added_[at(i - made_.vertex_count())]; }
  Point rest(int i) const noexcept { return rest_.col(i).template cast<double>(); }
  int tetrahedron_at(int i) const noexcept { return solid_.tetrahedron(is_added(i) ? added(i).leaf : solid_.find(root_[at(i)], shadow_.col(i))); }

  // --- cuts -------------------------------------------------------------------------------------------------------------
  /// `anew`: all that was touched before is looked at again.
  template <class Body, class Edits>
  void take_edits(Body const& body, Edits const& edits, bool anew) {
    auto const& topology = body.tissue().topology();
    auto const since = edits.subspan(anew ? 0 : seen_.size());
    std::ptrdiff_t count = anew ? solid_.roots() : solid_.size(), particles = anew ? solid_.vertices() : particles_;
    for (auto const& edit : since) {
      using Kind = typename SolidEdit<Scalar>::Kind;
      (edit.kind == Kind::divided || edit.kind == Kind::removed ? count : particles) += edit.kind == Kind::removed ? -1 : 1;
    }
    if (count != topology.tetrahedron_count() || particles != body.size())
      throw InvalidArgument(detail::message("the skin was made for ", solid_.roots(), " tetrahedra of ", solid_.vertices(),
                                            " vertices, and the body had other ones before it was cut; make the skin from the mesh that its tissue was made of"));
    std::vector<int> vertices, roots;
    if (anew) solid_.forget(), roots = touched_;
    for (auto const& edit : since) {
      if (edit.kind == decltype(edit.kind)::split)
        vertices.push_back(edit.first), vertices.push_back(edit.second);
      else
        roots.push_back(solid_.root_of(edit.first));
      solid_.follow(edit);
    }
    restorations_ = body.restorations(), seen_.assign(edits.begin(), edits.end());
    detail::sort_each_once(vertices);
    for (int const v : vertices)
      for (int const t : topology.tetrahedra_at(v)) roots.push_back(solid_.root_of(t));
    detail::sort_each_once(roots);
    touched_.insert(touched_.end(), roots.begin(), roots.end());
    detail::sort_each_once(touched_);

    detail::HangTogether<Body> solid(body);
    std::vector<int> triangles;
    for (int const root : roots) {
      for (int const i : vertices_in_[root])
        if (int const t = tetrahedron_at(i); t >= 0)
          carriers_[at(i)] = carrier_of(t, rest(i), solid);
        else   // triangles beside it that are still there need another point
          for (int const f : made_.triangles_at(i)) triangles.push_back(f);
      for (int const f : triangles_in_[root]) triangles.push_back(f);
    }
    detail::sort_each_once(triangles);
    part(triangles, body.positions(), solid);
    particles_ = body.size(), ++revision_;
  }

  /// Parts these triangles anew, and those beside them where that changes their points.
  template <class X, class Hang>
  void part(std::vector<int> const& triangles, X const& x, Hang& solid) {
    std::vector<Parts> divided;
    std::vector<int> all = triangles;
    for (int const f : triangles) {
      auto const c = made_.corners(f);
      bool const open = divide(f, divided.emplace_back(), solid);
      open_.erase(f);
      for (int p = 3; open && p < std::ssize(divided.back().points); ++p)
        if (divided.back().side_of(p) >= 0) open_[f].push_back(place(f, divided.back(), p));
      for (std::size_t k = 0; k < 3; ++k) {
        take_away(detail::edge_key(c[k], c[k])), take_away(detail::edge_key(c[k], c[(k + 1) % 3]));
        for (int const other : made_.triangles_at(c[k])) all.push_back(other);
      }
    }
    detail::sort_each_once(all);
    for (int const f : all) {
      auto const listed = std::lower_bound(triangles.begin(), triangles.end(), f);
      bool const is_listed = listed != triangles.end() && *listed == f;
      if (!is_listed && is_plain(f)) continue;
      take_away(key_in(f));
      Parts parts;
      if (is_listed)
        parts = std::move(divided[static_cast<std::size_t>(listed - triangles.begin())]);
      else
        divide(f, parts, solid);
      auto const now = triangles_of(f, parts, x, solid);   // adds points
      triangles_.set_parts(f, now, points_.view());
    }
  }
  /// Divides a triangle as its shadow is by the tetrahedra; whether they do not all hang together, or not all are there any more.
  template <class Hang>
  bool divide(int f, Parts& parts, Hang& solid) const {
    auto const c = made_.corners(f);
    solid_.divide(parts, {shadow(c[0]), shadow(c[1]), shadow(c[2])}, root_[at(c[0])]);
    bool open = false;
    parts.for_each_side([&](int one, int a, int b, int other) {
      if (open || other < one) return;
      auto const t = [&](int n) { return solid_.tetrahedron(parts.parts[at(n)].leaf); };
      open = !solid(t(one), t(other), of_corners(f, (parts.at(a) + parts.at(b)) / 2, shadow_));
    });
    return open;
  }
  template <class Columns>
  Point of_corners(int f, Point const& w, Columns const& columns) const noexcept {
    auto const c = made_.corners(f);
    Point sum = Point::Zero();
    for (int k = 0; k < 3; ++k) sum += w[k] * columns.col(c[at(k)]).template cast<double>();
    return sum;
  }
  /// Where the point of parts of a triangle lies.
  Place place(int f, Parts const& parts, int p) const noexcept {
    auto const c = made_.corners(f);
    int const k = parts.side_of(p), i = (k + 1) % 3, j = (k + 2) % 3;
    if (p < 3) return {detail::edge_key(c[at(p)], c[at(p)]), 0};
    if (k < 0) return {key_in(f), static_cast<double>(p)};
    return {detail::edge_key(c[at(i)], c[at(j)]), parts.at(p)[c[at(i)] < c[at(j)] ? j : i]};
  }
  /// The triangle on the other side of the edge from corner k on.
  int beside(Corners const& c, std::size_t k) const noexcept { return made_.triangle_with_edge(c[(k + 1) % 3], c[k]); }
  /// Whether it is whole, and nothing near it makes it otherwise.
  bool is_plain(int f) const noexcept {
    auto const c = made_.corners(f);
    for (std::size_t k = 0; k < 3; ++k)
      if (copies_.contains(detail::edge_key(c[k], c[k])) || open_.contains(beside(c, k))) return false;
    return triangles_.is_whole(f, c);
  }

  /// The triangles that are to be in the place of one.
  template <class X, class Hang>
  std::vector<Corners> triangles_of(int f, Parts& parts, X const& x, Hang& solid) {
    auto const c = made_.corners(f);
    std::vector<int> round{0, 1, 2};
    for (std::size_t k = 0; k < 3; ++k)
      if (auto const other = open_.find(beside(c, k)); other != open_.end())
        for (auto const& [key, share] : other->second)
          if (int const next = c[(k + 1) % 3]; key == detail::edge_key(c[k], next))
            round.push_back(parts.insert_on_side(static_cast<int>(k), c[k] < next ? share : 1 - share, same));
    std::vector<Corners> all;
    auto const add = [&](std::vector<int> const& polygon, auto const& leaf) {
      auto const number = [&](int p) { return point(f, parts, p, leaf(p), x, solid); };
      parts.triangulate(polygon, [&](int p, int q, int r) {
        Corners const corners{number(p), number(q), number(r)};
        if (corners[0] != corners[1] && corners[1] != corners[2] && corners[2] != corners[0]) all.push_back(corners);
      });
    };
    if (open_.contains(f)) {
      for (auto const& part : parts.parts)
        if (solid_.tetrahedron(part.leaf) >= 0) add(part.corners, [&](int) { return part.leaf; });
    } else if (solid_.tetrahedron(parts.parts[0].leaf) >= 0) {   // whole, but for points that those beside it have
      std::sort(round.begin(), round.end(), [&](int p, int q) { return parts.way_round(p) < parts.way_round(q); });
      round.erase(std::unique(round.begin(), round.end()), round.end());
      add(round, [&](int p) { return parts.leaf_at(p); });
    }
    return all;
  }
  /// The point of the skin at a point of parts of a triangle, on the side of a leaf.
  template <class X, class Hang>
  int point(int f, Parts const& parts, int p, int leaf, X const& x, Hang& solid) {
    int const t = solid_.tetrahedron(leaf);
    Added wanted{place(f, parts, p), leaf, of_corners(f, parts.at(p), shadow_)};
    if (p < 3)
      if (int const own = made_.corners(f)[at(p)]; solid(t, tetrahedron_at(own), wanted.shadow)) return own;
    Point undeformed = of_corners(f, parts.at(p), rest_);
    std::vector<int>& there = copies_[wanted.key];
    for (int const i : there) {
      if (!(std::abs(added(i).share - wanted.share) < 2 * same)) continue;
      if (solid(t, solid_.tetrahedron(added(i).leaf), wanted.shadow)) return i;
      if (double const share = added(i).share; share != wanted.share)   // another lip of the same place of an edge: nothing is lost between them
        wanted.share = share, undeformed = (1 - share) * rest(detail::key_first(wanted.key)) + share * rest(detail::key_second(wanted.key));
    }
    int i = points_.size();
    if (free_.empty())
      points_.push_back(Vector::Zero()), normals_.push_back(Vector::Zero()), carriers_.emplace_back(), added_.emplace_back();
    else
      i = free_.back(), free_.pop_back();
    there.push_back(i);
    added_[at(i - made_.vertex_count())] = wanted;
    carriers_[at(i)] = carrier_of(t, undeformed, solid);
    points_[i] = carried(carriers_[at(i)], x);
    return i;
  }
  /// The points that cuts have added there are free.
  void take_away(std::uint64_t key) {
    auto const there = copies_.find(key);
    if (there == copies_.end()) return;
    for (int const i : there->second) carriers_[at(i)] = {{0, 0, 0, 0}, {1, 0, 0, 0}}, free_.push_back(i);
    copies_.erase(there);
  }
  /// Whether an edge was on the border of the skin as it was made.
  bool was_border(int a, int b) const noexcept {
    std::array<int, 4> ends{a, a, b, b};
    for (std::size_t k = 0; k < 4; k += 2)
      if (is_added(ends[k])) {
        std::uint64_t const key = added(ends[k]).key;
        if (key >= key_in(0)) return false;
        ends[k] = detail::key_first(key), ends[k + 1] = detail::key_second(key);
      }
    std::sort(ends.begin(), ends.end());
    bool const are_two = std::unique(ends.begin(), ends.end()) - ends.begin() == 2;
    return are_two && (made_.triangle_with_edge(ends[0], ends[1]) < 0 || made_.triangle_with_edge(ends[1], ends[0]) < 0);
  }

  // --- as it was made ---------------------------------------------------------------------------------------------------
  /// Finds for each point the tetrahedron that carries it, and its shadow; and what each tetrahedron carries.
  void embed(TetrahedralMesh<Scalar> const& volume) {
    TetrahedralTopology const topology(volume);
    detail::ShadowSearch<Scalar> search(volume, topology);
    solid_ = detail::DividedSolid(volume, topology);
    shadow_.resize(3, points_.size());
    for (int root = 0; root < solid_.roots(); ++root) vertices_in_.add_list(), triangles_in_.add_list();
    for (int i = 0; i < points_.size(); ++i) {
      Vector const p = rest_.col(i);
      if (!is_finite(p)) throw InvalidMesh(detail::message("vertex ", i, " of the skin is not finite; repair it first"));
      auto const found = search.find(p, normals_[i]);
      farthest_outside_ = std::max(farthest_outside_, found.outside);
      shadow_.col(i) = found.point;
      root_.push_back(found.tetrahedron), vertices_in_.add(found.tetrahedron, i, 0);
      auto const w = search.weights(found.tetrahedron, p);
      Carrier& carrier = carriers_.emplace_back();
      for (int k = 0; k < 4; ++k) carrier.particle[at(k)] = volume.tetrahedra(k, found.tetrahedron), carrier.weight[at(k)] = static_cast<Scalar>(w[k]);
    }
    for (int f = 0; f < made_.triangle_count(); ++f) {
      auto const c = made_.corners(f);
      Parts parts;
      solid_.divide(parts, {shadow(c[0]), shadow(c[1]), shadow(c[2])}, root_[at(c[0])]);
      for (auto const& part : parts.parts) triangles_in_.add(part.leaf, f, 0);
    }
  }

  Columns<Scalar, 3> points_, normals_;   // first those of the skin as it was made
  detail::PartedTriangles<Scalar> triangles_;
  std::vector<Carrier> carriers_;
  int particles_;   // of the body
  Scalar farthest_outside_ = 0;
  std::size_t revision_ = 0;

  // As it was made
  SurfaceTopology made_;
  Matrix3X<Scalar> rest_;
  Matrix3X<double> shadow_;   // of each point: itself, or a point of the tetrahedra below it
  std::vector<int> root_;     // the tetrahedron that holds that
  IndexLists vertices_in_, triangles_in_;   // of each tetrahedron
  // Cuts
  detail::DividedSolid solid_;
  std::vector<SolidEdit<Scalar>> seen_;   // edits of the body,
  std::size_t restorations_ = 0;          // and how often it was restored
  std::vector<int> touched_;              // tetrahedra, as they were made, that were ever edited
  std::vector<Added> added_;
  std::vector<int> free_;
  std::unordered_map<std::uint64_t, std::vector<int>> copies_;   // added points at each place
  std::unordered_map<int, std::vector<Place>> open_;             // triangles that an open wound crosses: its points on their edges
};

}  // namespace palpate
