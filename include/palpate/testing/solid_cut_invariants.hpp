// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/concept.hpp>
#include <palpate/collision/closest_point.hpp>
#include <palpate/core/random.hpp>
#include <palpate/mesh/components.hpp>
#include <palpate/mesh/tetrahedral_mesh.hpp>
#include <palpate/mesh/tetrahedral_topology.hpp>
#include <palpate/testing/cut_springs.hpp>
#include <palpate/testing/tetrahedral_topology.hpp>
#include <palpate/testing/violations.hpp>
#include <palpate/tissue/element.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace palpate::testing {

struct SolidCutChecks {
  double min_height = 0;   ///< m, of a tetrahedron that a cut has made
  int queries = 3;           ///< how many random points the search tree is asked for, against a search of all triangles
  int most = 20;             ///< stop after so many violations
  Seed seed{1};
  bool linear = false;       ///< small strain: a turned body is strained, so pieces are moved by u = ω × X instead
};

/// Tissue whose elements are its tetrahedra, as those of FiniteElements are.
template <class T>
concept HasTetrahedralElements = requires(T const& tissue, int i) {
  tissue.list().elements;
  tissue.elements_at(i);
  tissue.stars();
};

/// What has been taken away from a solid besides, by its report.
struct SolidTaken {
  double volume = 0, mass = 0;   // m³, kg

  bool is_some() const noexcept { return volume > 0; }
};

/// What no cut through a solid may change, however the blade goes: taken from a body before the cut, checked after every tick.
///
///   testing::SolidCutInvariants before(body);
///   knife.advance(body, blade);
///   CHECK(testing::to_text(before.check(body)) == "");
///
/// Topology   what check_tetrahedral_topology checks: each face has one or two tetrahedra, the border is closed.
/// Shape      at rest each tetrahedron has a positive volume, all together what there was; those that are new are no lower than min_height, or than the lowest
///            there was.
/// Border     an edge has two triangles, if it had before; the area of the skin is what it was; wounds face each other: the sum of their areas as vectors is what
///            it was.
/// Pieces     tetrahedra that hang together at all do so over faces: nothing dangles on a vertex that a cut has made.
/// Particles  Σ m and Σ m X are as they were; each mass is positive, and of elements what its tetrahedra weigh, but where an explicit integrator has masses evened
///            out; one of no tetrahedron weighs nothing and is nailed.
/// Tissue     neighbours are those of a search of all; row bounds those of a sum over all.
/// Elements   where there are any, they are the tetrahedra, with their volume.
/// Springs    the same: links are the edges of the tetrahedra, one each; rest lengths are those of the undeformed shape; Σ weight · k L² (the energy of a
///            uniform stretch) and the sums of the home springs are as they were.
/// Search     nearest point and nearest vertex are those of a search of all.
/// Taken      where tetrahedra were taken away, volume and mass are less by what is said; the skin is not larger, and the border is a manifold at its vertices
///            wherever it was. Blades may let cavities meet in a vertex: where they have cut since, make one of these anew before tissue is taken away.
/// At a stroke's end, by check_end(), of elements of one material that remember nothing; where two materials meet a stretch pulls, cut or not:
/// Stretch    the energy of a uniform stretch is what it was, however it was divided and opened, and no particle inside is pulled: a patch test.
/// Rigid      each piece may be turned and moved by itself without any energy: six modes each.
/// Tolerances 1e-12 (double) or 1e-5 (float) of the total; row bounds 1e-6 or 1e-3.
template <class Body>
class SolidCutInvariants {
 public:
  using Scalar = typename Body::Scalar;
  using Vector = Vector3<Scalar>;

  explicit SolidCutInvariants(Body const& body, SolidCutChecks const& checks = {}) : checks_(checks), rest_(body.rest_solid()), sums_(sums(body)) {
    size_ = (rest_.points.rowwise().maxCoeff() - rest_.points.rowwise().minCoeff()).template cast<double>().norm();
    for (Eigen::Index t = 0; t < rest_.tetrahedra.cols(); ++t) lowest_ = std::min(lowest_, height(rest_, t));
    dangling_ = fans_too_many(body);
    pinched_ = static_cast<int>(pinched(body.tissue().topology()).size());
    touching_ = touching(body.tissue().topology()).size();
    if constexpr (HasTetrahedralElements<Tissue>) stretch_energy_ = static_cast<double>(body.tissue().potential_energy(stretched(body)));
  }

  /// What has to hold besides at the end of a stroke, where nothing was taken away: it computes forces of the whole body.
  Violations check_end(Body const& body) const
    requires HasTetrahedralElements<typename Body::Tissue>
  {
    Violations found;
    double const digits = sizeof(Scalar) == sizeof(float) ? 1e-4 : 1e-9;
    Matrix3X<Scalar> x = stretched(body);
    double const energy = static_cast<double>(body.tissue().potential_energy(x));
    if (!(std::abs(energy - stretch_energy_) <= digits * stretch_energy_))
      report(found, "a uniform stretch holds ", energy, " J; it was ", stretch_energy_, " J");
    Matrix3X<Scalar> const still = Matrix3X<Scalar>::Zero(3, x.cols());
    auto const& solid = body.tissue().topology();
    double largest = 0, inside = 0;   // N
    for (int i = 0; i < body.size(); ++i) {
      double const force = static_cast<double>(body.tissue().internal_force(i, x, still).norm());
      largest = std::max(largest, force);
      if (body.tissue().surface().triangles_at(i).empty() && !solid.tetrahedra_at(i).empty()) inside = std::max(inside, force);
    }
    if (!(inside <= 100 * digits * largest))
      report(found, "a uniform stretch pulls a particle inside with ", inside, " N; at the border with up to ", largest, " N");
    Random random(checks_.seed);
    auto const any = [&] { return Vector3<double>(random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0)); };
    for (auto const& piece : connected_components(body.rest_solid())) {
      Matrix<double, 3, 3> const turn = Eigen::AngleAxisd(random.uniform(0.5, 2.5), any().normalized()).toRotationMatrix();
      Matrix<double, 3, 3> const spin = 0.1 * (turn - turn.transpose());
      Vector3<double> const way = (checks_.linear ? 0.1 : 1.0) * size_ * any();
      for (int const i : piece) {
        Vector3<double> const at = x.col(i).template cast<double>(), rest = body.tissue().rest_position(i).template cast<double>();
        x.col(i) = ((checks_.linear ? Vector3<double>(at + spin * rest) : Vector3<double>(turn * at)) + way).template cast<Scalar>();
      }
    }
    double const turned = static_cast<double>(body.tissue().potential_energy(x));
    if (!(std::abs(turned - energy) <= digits * energy)) report(found, "pieces that are turned and moved hold ", turned, " J instead of ", energy, " J");
    return found;
  }

  /// All that is not as it must be. The body is only asked; asking fits its search tree to where it is.
  Violations check(Body& body, SolidTaken const& taken = {}) const {
    auto const& solid = body.tissue().topology();
    if (body.positions().cols() != body.size() || body.tissue().size() != body.size() || solid.vertex_count() != body.size())
      return {"the body, its tissue and its tetrahedra do not count the same particles"};
    auto const mesh = body.rest_solid();
    Violations found = check_tetrahedral_topology(solid);
    if (!found.empty()) return found;   // the rest would only repeat it
    check_shape(body, mesh, taken, found);
    check_edges(solid, found);
    if (taken.is_some()) check_manifold(solid, found);
    check_particles(body, found);
    check_neighbours(body, mesh, found);
    if constexpr (HasTetrahedralElements<Tissue>) check_elements(body, mesh, found);
    check_springs(body, mesh, found);
    check_search(body, found);
    return found;
  }

 private:
  static constexpr double exact = sizeof(Scalar) == sizeof(float) ? 1e-5 : 1e-12, bound_tolerance = sizeof(Scalar) == sizeof(float) ? 1e-3 : 1e-6;
  using Mesh = TetrahedralMesh<Scalar>;
  using Tissue = typename Body::Tissue;

  struct Sums {
    double volume = 0, skin = 0, mass = 0;
    SpringSums springs;
    Vector3<double> moment = Vector3<double>::Zero(), wounds = Vector3<double>::Zero();
  };

  /// Where its particles are under a uniform stretch with shear.
  static Matrix3X<Scalar> stretched(Body const& body) {
    Matrix<Scalar, 3, 3> stretch;
    stretch << Scalar(1.2), Scalar(0.1), Scalar(0), Scalar(0), Scalar(0.9), Scalar(-0.05), Scalar(0.02), Scalar(0), Scalar(1.05);
    return stretch * body.rest_solid().points;
  }

  template <class... Parts>
  void report(Violations& found, Parts const&... parts) const {
    if (static_cast<int>(found.size()) < checks_.most) found.push_back(palpate::detail::message(parts...));
  }
  static Vector3<double> at(Mesh const& mesh, Eigen::Index t, int k) { return mesh.points.col(mesh.tetrahedra(k, t)).template cast<double>(); }
  static double volume(Mesh const& mesh, Eigen::Index t) {
    Vector3<double> const o = at(mesh, t, 0);
    return (at(mesh, t, 1) - o).cross(at(mesh, t, 2) - o).dot(at(mesh, t, 3) - o) / 6;
  }
  static double height(Mesh const& mesh, Eigen::Index t) {
    double widest = 0;
    for (int k = 0; k < 4; ++k) {
      Vector3<double> const p = at(mesh, t, (k + 1) % 4);
      widest = std::max(widest, (at(mesh, t, (k + 2) % 4) - p).cross(at(mesh, t, (k + 3) % 4) - p).norm());
    }
    return 6 * volume(mesh, t) / widest;
  }

  static Sums sums(Body const& body) {
    Sums s;
    auto const mesh = body.rest_solid();
    for (Eigen::Index t = 0; t < mesh.tetrahedra.cols(); ++t) s.volume += volume(mesh, t);
    auto const& surface = body.tissue().surface();
    for (int t = 0; t < surface.triangle_count(); ++t) {
      auto const c = surface.corners(t);
      Vector3<double> const o = mesh.points.col(c[0]).template cast<double>();
      Vector3<double> const area = (mesh.points.col(c[1]).template cast<double>() - o).cross(mesh.points.col(c[2]).template cast<double>() - o) / 2;
      if (body.tissue().is_wound(t))
        s.wounds += area;
      else
        s.skin += area.norm();
    }
    for (int i = 0; i < body.size(); ++i) {
      double const m = static_cast<double>(body.tissue().mass(i));
      s.mass += m, s.moment += m * mesh.points.col(i).template cast<double>();
    }
    s.springs = SpringSums::of(body.tissue());
    return s;
  }
  static int fans_too_many(Body const& body) {
    TetrahedronFans fans;
    int more = 0;
    for (int i = 0; i < body.size(); ++i) body.tissue().topology().fans_at(i, fans), more += std::max(0, fans.size() - 1);
    return more;
  }

  void compare(Violations& found, char const* what, double now, double before, double scale, double share = exact) const {
    if (!(std::abs(now - before) <= share * scale)) report(found, what, " is ", now, ", before the cut it was ", before);
  }

  void check_shape(Body const& body, Mesh const& mesh, SolidTaken const& taken, Violations& found) const {
    double const least = std::min(checks_.min_height, lowest_) * (1 - 1e-6);
    for (Eigen::Index t = 0; t < mesh.tetrahedra.cols(); ++t) {
      if (!(volume(mesh, t) > 0)) report(found, "tetrahedron ", static_cast<int>(t), " has a volume of ", volume(mesh, t), " m3 at rest");
      if (!(height(mesh, t) >= least)) report(found, "tetrahedron ", static_cast<int>(t), " is ", height(mesh, t), " m high, below ", least);
    }
    Sums const now = sums(body);
    compare(found, "the volume", now.volume, sums_.volume - taken.volume, sums_.volume);
    compare(found, "the mass", now.mass, sums_.mass - taken.mass, sums_.mass);
    if (taken.is_some() && !(now.skin <= sums_.skin * (1 + exact))) report(found, "the area of the skin is ", now.skin, ", before it was ", sums_.skin);
    if (!taken.is_some()) compare(found, "the area of the skin", now.skin, sums_.skin, sums_.skin);
    for (int k = 0; k < 3 && !taken.is_some(); ++k) {
      compare(found, "the first moment of the mass", now.moment[k], sums_.moment[k], sums_.mass * size_);
      compare(found, "the sum of the wounds' areas", now.wounds[k], sums_.wounds[k], sums_.skin);
    }
    if (int const dangling = fans_too_many(body); dangling > dangling_) report(found, dangling - dangling_, " vertices hold together what no face does");
  }

  static std::vector<std::pair<int, int>> touching(TetrahedralTopology const& solid) {
    auto const& border = solid.border();
    std::vector<std::pair<int, int>> all, found;
    for (int t = 0; t < border.triangle_count(); ++t) {
      auto const c = border.corners(t);
      for (std::size_t k = 0; k < 3; ++k)
        if (c[k] < c[(k + 1) % 3]) all.emplace_back(c[k], c[(k + 1) % 3]);   // the other triangle goes the other way
    }
    std::sort(all.begin(), all.end());
    for (std::size_t k = 1; k < all.size(); ++k)
      if (all[k] == all[k - 1]) found.push_back(all[k]);
    return found;
  }
  /// Vertices where the border triangles are not one ring: each side there with one triangle on either hand, and a walk round comes to all.
  static std::vector<int> pinched(TetrahedralTopology const& solid) {
    auto const& border = solid.border();
    std::vector<int> found, next;
    for (int v = 0; v < solid.vertex_count(); ++v) {
      auto const around = border.triangles_at(v);
      if (around.empty()) continue;
      auto const after = [&](int triangle, int step) {
        return border.corners(triangle)[static_cast<std::size_t>((border.corner_of(triangle, v) + step) % 3)];
      };
      next.assign(around.size(), 0);
      bool is_ring = true;
      for (std::size_t i = 0; i < around.size(); ++i) {
        int beside = 0;
        for (std::size_t j = 0; j < around.size(); ++j)
          if (after(around[j], 1) == after(around[i], 2)) next[i] = static_cast<int>(j), ++beside;
        is_ring = is_ring && beside == 1;
      }
      std::size_t steps = 1;
      for (int at = next[0]; at != 0 && steps <= around.size(); ++steps) at = next[static_cast<std::size_t>(at)];
      if (!is_ring || steps != around.size()) found.push_back(v);
    }
    return found;
  }
  void check_edges(TetrahedralTopology const& solid, Violations& found) const {
    if (auto const now = touching(solid); now.size() > touching_)
      report(found, now.size(), " edges of the border have more than two triangles, the last is from ", now.back().first, " to ", now.back().second, "; before there were ", touching_);
  }
  void check_manifold(TetrahedralTopology const& solid, Violations& found) const {
    auto const now = pinched(solid);
    if (static_cast<int>(now.size()) > pinched_)
      report(found, "the border is no manifold at ", static_cast<int>(now.size()), " vertices, the last is ", now.back(), "; before it was at ", pinched_);
  }

  void check_particles(Body const& body, Violations& found) const {
    for (int i = 0; i < body.size(); ++i) {
      double const mass = static_cast<double>(body.tissue().mass(i));
      bool const is_left = body.tissue().topology().tetrahedra_at(i).empty() && mass == 0 && body.tissue().nailed(i);   // all round it was taken away
      if (!(mass > 0) && !is_left) report(found, "particle ", i, " weighs ", mass, " kg");
      if (!is_finite(body.positions().col(i)) || !is_finite(body.velocities().col(i))) report(found, "particle ", i, " has no finite state");
      bool const on_border = !body.tissue().surface().triangles_at(i).empty();
      if (on_border && !(std::abs(body.reference_normal(i).norm() - 1) < Scalar(1e-3))) report(found, "particle ", i, " has no unit normal");
    }
  }

  static std::vector<int> sorted(std::vector<int> all) {
    std::sort(all.begin(), all.end());
    all.erase(std::unique(all.begin(), all.end()), all.end());
    return all;
  }
  static constexpr bool has_wide_stencil(Tissue const& tissue) {   // then neighbours and row bounds are not those of the tetrahedra alone
    if constexpr (HasTetrahedralElements<Tissue>)
      return !tissue.stars().empty();
    else
      return false;
  }

  void check_neighbours(Body const& body, Mesh const& mesh, Violations& found) const {
    if (has_wide_stencil(body.tissue())) return;
    std::vector<std::vector<int>> near(static_cast<std::size_t>(body.size()));
    for (Eigen::Index t = 0; t < mesh.tetrahedra.cols(); ++t)
      for (int k = 0; k < 12; ++k) near[static_cast<std::size_t>(mesh.tetrahedra(k / 3, t))].push_back(mesh.tetrahedra((k / 3 + 1 + k % 3) % 4, t));
    for (int i = 0; i < body.size(); ++i) {
      std::vector<int> listed;
      body.tissue().for_each_neighbour(i, [&](int j) { listed.push_back(j); });
      if (sorted(listed) != sorted(near[static_cast<std::size_t>(i)])) report(found, "the neighbours of particle ", i, " are not those of the mesh");
    }
  }

  void check_elements(Body const& body, Mesh const& mesh, Violations& found) const {
    auto const& tissue = body.tissue();
    auto const& list = tissue.list();
    if (list.size() != mesh.tetrahedra.cols()) return report(found, "there are ", list.size(), " elements of ", mesh.tetrahedra.cols(), " tetrahedra");
    double const length = 1 - static_cast<double>(tissue.link_prestrain());
    std::vector<std::vector<int>> here(static_cast<std::size_t>(body.size()));
    std::vector<double> bounds(here.size(), 0.0), weighs(bounds);
    for (int e = 0; e < list.size(); ++e) {
      auto const& nodes = list.nodes[static_cast<std::size_t>(e)];
      auto const& element = list.elements[static_cast<std::size_t>(e)];
      if (nodes != tissue.topology().corners(e)) report(found, "element ", e, " does not join the corners of its tetrahedron");
      double const is = static_cast<double>(element.volume()), must = volume(mesh, e) * length * length * length;
      if (!(std::abs(is - must) <= 1e4 * exact * must)) report(found, "element ", e, " has a volume of ", is, " m3, its tetrahedron ", must);
      NodeColumns<Scalar, 4> rest;
      for (int k = 0; k < 4; ++k) rest.col(k) = mesh.points.col(nodes[static_cast<std::size_t>(k)]);
      palpate::detail::add_bounds_at_rest<std::remove_cvref_t<decltype(element)>, Scalar>(
          element, rest, [&](int k, Scalar stiffness, Scalar) { bounds[static_cast<std::size_t>(nodes[static_cast<std::size_t>(k)])] += static_cast<double>(stiffness); });
      for (int const i : nodes) here[static_cast<std::size_t>(i)].push_back(e), weighs[static_cast<std::size_t>(i)] += static_cast<double>(element.mass()) / 4;
    }
    for (int i = 0; i < body.size(); ++i) {
      auto const k = static_cast<std::size_t>(i);
      auto const listed = tissue.elements_at(i);
      if (sorted({listed.begin(), listed.end()}) != here[k]) report(found, "the list of elements at particle ", i, " is not that of the mesh");
      double const mass = static_cast<double>(tissue.mass(i));
      if (AnyStepIsStable<Body> && !(std::abs(mass - weighs[k]) <= 1e3 * exact * weighs[k])) report(found, "particle ", i, " weighs ", mass, " kg, its tetrahedra ", weighs[k]);
      if (!has_wide_stencil(tissue)) check_bound(body, i, bounds[k], found);
    }
  }
  void check_bound(Body const& body, int i, double must, Violations& found) const {
    double const bound = static_cast<double>(body.tissue().stiffness_bound(i));
    if (!(std::abs(bound - must) <= bound_tolerance * must)) report(found, "the row bound of particle ", i, " is ", bound, " N/m, the sum over what acts on it ", must);
  }

  void check_springs(Body const& body, Mesh const& mesh, Violations& found) const {
    if constexpr (HasLinks<Tissue>) {
      SpringSums const now = SpringSums::of(body.tissue()), &before = sums_.springs;
      compare(found, "the sum of the home stiffness", now.stiffness, before.stiffness, before.stiffness);
      compare(found, "the sum of the home damping", now.damping, before.damping, before.damping);
      compare(found, "the sum of weight k L^2 over all links", now.stretch, before.stretch, before.stretch, 100 * exact);
      std::vector<std::pair<int, int>> edges;
      for (Eigen::Index t = 0; t < mesh.tetrahedra.cols(); ++t)
        for (int a = 0; a < 4; ++a)
          for (int b = a + 1; b < 4; ++b) edges.push_back(std::minmax(int{mesh.tetrahedra(a, t)}, int{mesh.tetrahedra(b, t)}));
      check_links(body.tissue(), std::move(edges), exact * size_, [&](auto const&... parts) { report(found, parts...); });
      std::vector<double> bounds(static_cast<std::size_t>(body.size()), 0.0);
      for (int i = 0; i < body.size(); ++i)
        if constexpr (HasHomeSprings<Tissue>) bounds[static_cast<std::size_t>(i)] += static_cast<double>(body.tissue().home(i).stiffness);
      for (int l = 0; l < body.tissue().links().size(); ++l) {
        auto const& link = body.tissue().links()[l];
        double const twice = 2 * static_cast<double>(link.weight * tangent_stiffness_of(link.law, Scalar(0), link.rest_length));
        bounds[static_cast<std::size_t>(link.a)] += twice, bounds[static_cast<std::size_t>(link.b)] += twice;
      }
      for (int i = 0; i < body.size(); ++i) check_bound(body, i, bounds[static_cast<std::size_t>(i)], found);
    }
  }

  void check_search(Body& body, Violations& found) const {
    Random random(checks_.seed);
    auto const x = body.positions();
    Vector const low = x.rowwise().minCoeff(), high = x.rowwise().maxCoeff();
    Scalar const size = static_cast<Scalar>(size_), tolerance = sizeof(Scalar) == sizeof(float) ? Scalar(2e-4) : Scalar(1e-9);
    auto const triangles = body.triangles();
    for (int q = 0; q < checks_.queries; ++q) {
      Vector query = x.col(body.size() - 1);   // the last query is beside the newest particle: where edits are
      for (int k = 0; k < 3; ++k)
        query[k] = q + 1 < checks_.queries ? random.uniform(low[k] - size / 10, high[k] + size / 10) : query[k] + random.uniform(-size, size) / 100;
      Scalar nearest = std::numeric_limits<Scalar>::infinity();
      for (Eigen::Index t = 0; t < triangles.cols(); ++t)
        nearest = std::min(nearest, (closest_point_on_triangle<Scalar>(query, x.col(triangles(0, t)), x.col(triangles(1, t)), x.col(triangles(2, t))).point - query).norm());
      auto const on = body.nearest_point(query);
      if (!(std::abs(on.distance - nearest) <= tolerance * size))
        report(found, "nearest_point finds a point at ", on.distance, " m, a search of all triangles one at ", nearest, " m");
    }
  }

  SolidCutChecks checks_;
  Mesh rest_;
  Sums sums_;
  double size_ = 0, lowest_ = std::numeric_limits<double>::infinity();
  int dangling_ = 0, pinched_ = 0;
  std::size_t touching_ = 0;
  double stretch_energy_ = 0;   // J
};

}  // namespace palpate::testing
