// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/collision/closest_point.hpp>
#include <palpate/collision/surface_tree.hpp>
#include <palpate/core/random.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/components.hpp>
#include <palpate/mesh/triangle_mesh.hpp>
#include <palpate/testing/cut_springs.hpp>
#include <palpate/testing/violations.hpp>
#include <palpate/tissue/concept.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace palpate::testing {

struct CutChecks {
  int queries = 3;      ///< how many random points the search tree is asked for, against a search of all triangles
  int most = 20;        ///< stop after so many violations
  Seed seed{1};
  bool moves_vertices = false;   ///< a cut along edges, whose vertices may move: see "Separating"
};

/// What no cut may change, however the blade goes: taken from a body before the cut, checked after every tick.
///
///   testing::CutInvariants before(body);
///   cutter.advance(body, tip);
///   CHECK(testing::to_text(before.check(body)) == "");
///
/// Mesh       indices are valid; every directed edge belongs to one triangle; no two triangles have the same corners; the triangles at a
///            vertex are one fan; every particle is in a triangle; the lists "triangles at a vertex" say the same.
/// Pieces     2 · pieces − lips and borders − Euler characteristic, which is twice the number of handles, has not risen: cuts open and
///            part a surface, they do not join it.
/// Rest shape no triangle is without area or turned over; all lie on the surface there was; their area is the area there was.
/// Particles  Σ m and Σ m X are as they were, and so are the sums of the home springs; no mass is ≤ 0; a new particle is nailed
///            exactly when all that it lies between were.
/// Springs    links join exactly the ends of the mesh's edges; rest lengths are those of the undeformed shape; Σ weight · k L² is as it was (the energy of a uniform stretch).
/// Search     nearest point and nearest vertex are those of a search of all.
/// Separating with `moves_vertices` the triangles are those there were, and none is turned over against itself; the surface, its area and the
///            first moment may change, and Σ weight · k is as it was.
/// Tolerances 1e-12 (double) or 1e-5 (float) of the total for area, mass and its first moment; else 1e-9 or 2e-4 of the total or length in question.
template <class Body>
class CutInvariants {
 public:
  using Scalar = typename Body::Scalar;
  using Vector = Vector3<Scalar>;

  explicit CutInvariants(Body const& body, CutChecks const& checks = {})
      : checks_(checks), rest_(body.rest_mesh()), tree_(rest_), sums_(sums(body, checks.moves_vertices)), handles_(twice_the_handles(rest_)), size_((rest_.points.rowwise().maxCoeff() - rest_.points.rowwise().minCoeff()).norm()) {
    nailed_.reserve(static_cast<std::size_t>(body.size()));
    for (int i = 0; i < body.size(); ++i) nailed_.push_back(body.tissue().nailed(i));
  }

  /// All that is not as it must be. The body is only asked; asking fits its search tree to where it is.
  Violations check(Body& body) const {
    Violations found;
    check_mesh(body, found);
    if (!found.empty()) return found;   // the rest would only repeat it
    check_pieces(body, found);
    check_rest_shape(body, found);
    check_particles(body, found);
    check_links(body, found);
    check_search(body, found);
    return found;
  }

 private:
  static constexpr double exact = sizeof(Scalar) == sizeof(float) ? 1e-5 : 1e-12;
  static constexpr Scalar tolerance = sizeof(Scalar) == sizeof(float) ? Scalar(2e-4) : Scalar(1e-9);

  struct Sums {
    double area = 0, mass = 0;
    SpringSums springs;
    Vector3<double> moment = Vector3<double>::Zero();
  };

  template <class... Parts>
  void report(Violations& found, Parts const&... parts) const {
    if (static_cast<int>(found.size()) < checks_.most) found.push_back(palpate::detail::message(parts...));
  }

  static Vector3<double> twice_area(TriangleMesh<Scalar> const& mesh, Eigen::Index t) {
    Vector3<double> const a = mesh.points.col(mesh.triangles(0, t)).template cast<double>();
    Vector3<double> const b = mesh.points.col(mesh.triangles(1, t)).template cast<double>() - a;
    Vector3<double> const c = mesh.points.col(mesh.triangles(2, t)).template cast<double>() - a;
    return b.cross(c);
  }

  static Sums sums(Body const& body, bool moves_vertices) {
    Sums s;
    auto const rest = body.rest_mesh();
    for (Eigen::Index t = 0; t < rest.triangles.cols(); ++t) s.area += twice_area(rest, t).norm() / 2;
    for (int i = 0; i < body.size(); ++i) {
      double const m = static_cast<double>(body.tissue().mass(i));
      s.mass += m;
      s.moment += m * rest.points.col(i).template cast<double>();
    }
    s.springs = SpringSums::of(body.tissue(), !moves_vertices);
    return s;
  }

  void check_mesh(Body const& body, Violations& found) const {
    auto const triangles = body.triangles();
    auto const& surface = body.tissue().surface();
    int const n = body.size();
    int const count = static_cast<int>(triangles.cols());
    if (body.positions().cols() != n || body.velocities().cols() != n || body.tissue().size() != n || surface.vertex_count() != n)
      report(found, "the body, its tissue and its surface do not count the same particles");
    if (!found.empty()) return;
    std::vector<std::array<int, 3>> directed;   // from, to, triangle
    std::vector<std::vector<int>> at(static_cast<std::size_t>(n));
    for (int t = 0; t < count; ++t)
      for (int k = 0; k < 3; ++k) {
        int const from = triangles(k, t), to = triangles((k + 1) % 3, t);
        if (from < 0 || from >= n || from == to) {
          report(found, "triangle ", t, " has the corners ", triangles(0, t), " ", triangles(1, t), " ", triangles(2, t), " of ", n, " particles");
          continue;
        }
        directed.push_back({from, to, t});
        at[static_cast<std::size_t>(from)].push_back(t);
      }
    if (!found.empty()) return;
    std::sort(directed.begin(), directed.end());
    for (std::size_t e = 1; e < directed.size(); ++e)
      if (directed[e][0] == directed[e - 1][0] && directed[e][1] == directed[e - 1][1])
        report(found, "triangles ", directed[e - 1][2], " and ", directed[e][2], " both hold the edge ", directed[e][0], " -> ", directed[e][1]);
    std::vector<std::array<int, 3>> corners;
    for (int t = 0; t < count; ++t) {
      corners.push_back({triangles(0, t), triangles(1, t), triangles(2, t)});
      std::sort(corners.back().begin(), corners.back().end());
    }
    std::sort(corners.begin(), corners.end());
    if (auto const twice = std::adjacent_find(corners.begin(), corners.end()); twice != corners.end())
      report(found, "two triangles have the corners ", (*twice)[0], " ", (*twice)[1], " ", (*twice)[2]);
    for (int v = 0; v < n; ++v) {
      auto const& here = at[static_cast<std::size_t>(v)];
      if (here.empty()) {
        report(found, "particle ", v, " is in no triangle");
        continue;
      }
      auto const listed = surface.triangles_at(v);
      if (!std::is_permutation(listed.begin(), listed.end(), here.begin(), here.end()))
        report(found, "the list of triangles at particle ", v, " is not that of the mesh");
      if (fan(triangles, here, v) != here.size()) report(found, "the ", here.size(), " triangles at particle ", v, " are more than one fan");
    }
  }

  /// How many of the triangles at a vertex hang together over edges at it.
  template <class Triangles>
  static std::size_t fan(Triangles const& triangles, std::vector<int> const& here, int v) {
    std::vector<int> reached{here.front()};
    auto const holds = [&](int t, int u) { return triangles(0, t) == u || triangles(1, t) == u || triangles(2, t) == u; };
    for (std::size_t i = 0; i < reached.size(); ++i)
      for (int const t : here) {
        if (std::find(reached.begin(), reached.end(), t) != reached.end()) continue;
        for (int k = 0; k < 3; ++k)
          if (int const u = triangles(k, t); u != v && holds(reached[i], u)) {
            reached.push_back(t);
            break;
          }
      }
    return reached.size();
  }

  /// 2 · pieces − borders − Euler characteristic. Where each vertex has one fan, each border is one loop.
  static int twice_the_handles(TriangleMesh<Scalar> const& mesh) {
    auto const border = boundary_edges(mesh);
    std::vector<int> next(static_cast<std::size_t>(mesh.points.cols()), -1);
    for (auto const& [from, to] : border) next[static_cast<std::size_t>(from)] = to;
    int loops = 0;
    for (std::size_t v = 0; v < next.size(); ++v)
      if (next[v] >= 0) {
        ++loops;
        for (int at = static_cast<int>(v); at >= 0;) at = std::exchange(next[static_cast<std::size_t>(at)], -1);
      }
    int const faces = static_cast<int>(mesh.triangles.cols()), edges = (3 * faces + static_cast<int>(border.size())) / 2;
    int const euler = static_cast<int>(mesh.points.cols()) - edges + faces;
    return 2 * static_cast<int>(connected_components(mesh).size()) - loops - euler;
  }

  void check_pieces(Body const& body, Violations& found) const {
    int const handles = twice_the_handles(body.rest_mesh());
    if (handles > handles_) report(found, "twice the number of handles is ", handles, ", before the cut it was ", handles_);
  }

  void check_rest_shape(Body const& body, Violations& found) const {
    auto const mesh = body.rest_mesh();
    if (checks_.moves_vertices && mesh.triangles.cols() != rest_.triangles.cols()) {
      report(found, "there are ", mesh.triangles.cols(), " triangles, before the cut there were ", rest_.triangles.cols());
      return;
    }
    double const least = sums_.area / static_cast<double>(rest_.triangles.cols()) * (sizeof(Scalar) == sizeof(float) ? 1e-9 : 1e-13);
    for (Eigen::Index t = 0; t < mesh.triangles.cols(); ++t) {
      bool same = t < rest_.triangles.cols();
      for (int k = 0; k < 3 && same; ++k) same = mesh.points.col(mesh.triangles(k, t)) == rest_.points.col(rest_.triangles(k, t));
      if (same) continue;
      Vector3<double> const normal = twice_area(mesh, t);
      if (!(normal.norm() / 2 > least)) {
        report(found, "triangle ", static_cast<int>(t), " has a rest area of ", normal.norm() / 2, " m2");
        continue;
      }
      if (checks_.moves_vertices) {
        if (!(twice_area(rest_, t).dot(normal) > 0)) report(found, "triangle ", static_cast<int>(t), " is turned over");
        continue;
      }
      Vector const middle = (mesh.points.col(mesh.triangles(0, t)) + mesh.points.col(mesh.triangles(1, t)) + mesh.points.col(mesh.triangles(2, t))) / 3;
      SurfacePoint<Scalar> const on = tree_.nearest(rest_.points, middle);
      if (!(on.distance <= tolerance * size_)) report(found, "triangle ", static_cast<int>(t), " lies ", on.distance, " m off the surface there was");
      if (!(twice_area(rest_, on.triangle).dot(normal) > 0)) report(found, "triangle ", static_cast<int>(t), " is turned over");
    }
  }

  void compare(Violations& found, char const* what, double now, double before, double scale, double share = static_cast<double>(tolerance)) const {
    if (!(std::abs(now - before) <= share * scale)) report(found, what, " is ", now, ", before the cut it was ", before);
  }

  void check_particles(Body const& body, Violations& found) const {
    Sums const now = sums(body, checks_.moves_vertices);
    if (!checks_.moves_vertices) compare(found, "the rest area", now.area, sums_.area, sums_.area, exact);
    compare(found, "the mass", now.mass, sums_.mass, sums_.mass, exact);
    compare(found, "the mass that total_mass() says", static_cast<double>(body.total_mass()), sums_.mass, sums_.mass);
    for (int k = 0; k < 3 && !checks_.moves_vertices; ++k)
      compare(found, "the first moment of the mass", now.moment[k], sums_.moment[k], sums_.mass * static_cast<double>(size_), exact);
    compare(found, "the sum of the home stiffness", now.springs.stiffness, sums_.springs.stiffness, sums_.springs.stiffness);
    compare(found, "the sum of the home damping", now.springs.damping, sums_.springs.damping, sums_.springs.damping);
    compare(found, checks_.moves_vertices ? "the sum of weight k over all links" : "the sum of weight k L^2 over all links", now.springs.stretch, sums_.springs.stretch, sums_.springs.stretch);
    for (int i = 0; i < body.size(); ++i) {
      Scalar const mass = body.tissue().mass(i);
      if (!(mass > 0)) report(found, "particle ", i, " weighs ", mass, " kg");
      if constexpr (HasHomeSprings<typename Body::Tissue>)
        if (!(body.tissue().home(i).stiffness >= 0 && body.tissue().home(i).damping >= 0)) report(found, "particle ", i, " has a negative home spring");
      if (!is_finite(body.positions().col(i)) || !is_finite(body.velocities().col(i))) report(found, "particle ", i, " has no finite state");
      if (!(std::abs(body.reference_normal(i).norm() - 1) < Scalar(1e-3))) report(found, "particle ", i, " has no unit normal");
      check_nail(body, i, found);
    }
  }

  void check_nail(Body const& body, int i, Violations& found) const {
    bool const is = body.tissue().nailed(i);
    if (i < static_cast<int>(nailed_.size())) {
      if (is != nailed_[static_cast<std::size_t>(i)]) report(found, "particle ", i, is ? " is" : " is not", " nailed; before the cut it was otherwise");
      return;
    }
    SurfacePoint<Scalar> const on = tree_.nearest(rest_.points, body.tissue().rest_position(i));
    bool must = true, may = true;   // weights near zero are undecided
    for (int k = 0; k < 3; ++k) {
      bool const corner = nailed_[static_cast<std::size_t>(rest_.triangles(k, on.triangle))];
      if (on.barycentric[k] > Scalar(1e-4)) may = may && corner;
      must = must && corner;
    }
    if (is ? !may : must) report(found, "the new particle ", i, is ? " is nailed, but lies beside what was not" : " lies between nailed ones, but is not nailed");
  }

  void check_links(Body const& body, Violations& found) const {
    std::vector<std::pair<int, int>> edges;
    auto const triangles = body.triangles();
    for (Eigen::Index t = 0; t < triangles.cols(); ++t)
      for (int k = 0; k < 3; ++k) edges.push_back(std::minmax(int{triangles(k, t)}, int{triangles((k + 1) % 3, t)}));
    testing::check_links(body.tissue(), std::move(edges), static_cast<double>(tolerance * size_), [&](auto const&... parts) { report(found, parts...); });
  }

  void check_search(Body& body, Violations& found) const {
    Random random(checks_.seed);
    auto const x = body.positions();
    Vector const low = x.rowwise().minCoeff(), high = x.rowwise().maxCoeff();
    auto const triangles = body.triangles();
    for (int q = 0; q < checks_.queries; ++q) {
      // The last query is beside the newest particle: where edits are.
      Vector query = x.col(body.size() - 1);
      for (int k = 0; k < 3; ++k)
        query[k] = q + 1 < checks_.queries ? random.uniform(low[k] - size_ / 10, high[k] + size_ / 10) : query[k] + random.uniform(-size_, size_) / 100;
      Scalar nearest = std::numeric_limits<Scalar>::infinity(), vertex = nearest;
      for (Eigen::Index t = 0; t < triangles.cols(); ++t)
        nearest = std::min(nearest, (closest_point_on_triangle<Scalar>(query, x.col(triangles(0, t)), x.col(triangles(1, t)), x.col(triangles(2, t))).point - query).norm());
      for (int i = 0; i < body.size(); ++i) vertex = std::min(vertex, (x.col(i) - query).norm());
      SurfacePoint<Scalar> const on = body.nearest_point(query);
      if (!(std::abs(on.distance - nearest) <= tolerance * size_))
        report(found, "nearest_point finds a point at ", on.distance, " m, a search of all triangles one at ", nearest, " m");
      else if (auto const c = body.tissue().surface().corners(on.triangle);
               !((on.barycentric[0] * x.col(c[0]) + on.barycentric[1] * x.col(c[1]) + on.barycentric[2] * x.col(c[2]) - on.point).norm() <= tolerance * size_))
        report(found, "nearest_point names a triangle that does not hold the point");
      Scalar const reached = (x.col(body.nearest_vertex(query)) - query).norm();
      if (!(std::abs(reached - vertex) <= tolerance * size_))
        report(found, "nearest_vertex finds one at ", reached, " m, a search of all particles one at ", vertex, " m");
    }
  }

  CutChecks checks_;
  TriangleMesh<Scalar> rest_;
  SurfaceTree<Scalar> tree_;
  Sums sums_;
  int handles_;
  Scalar size_;
  std::vector<bool> nailed_;
};

}  // namespace palpate::testing
