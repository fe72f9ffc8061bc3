// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/soft_body.hpp>
#include <palpate/core/random.hpp>
#include <palpate/cutting/progressive_cutter.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/mesh/normals.hpp>
#include <palpate/mesh/organ.hpp>
#include <palpate/mesh/sphere.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/region/zone_of_influence.hpp>
#include <palpate/testing/cut_invariants.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

/// A tissue to cut: light, well damped, soft enough that a tick of a millisecond is a few steps.
template <class S>
palpate::MassSpring<S> make_tissue(palpate::TriangleMesh<S> const& mesh, S prestrain = 0) {
  return palpate::MassSpring<S>(mesh, {.mass = {.total = S(0.1)},
                                       .link = {.stiffness = S(60), .damping = S(0.05)},
                                       .home = {.stiffness = S(4), .damping = S(0.02)},
                                       .link_prestrain = prestrain});
}

template <class S>
using Points = std::vector<palpate::Vector3<S>>;

/// The polyline with points at most `step` apart, its corners included.
template <class S>
Points<S> sampled(Points<S> const& corners, S step) {
  Points<S> path{corners.front()};
  for (std::size_t k = 1; k < corners.size(); ++k) {
    palpate::Vector3<S> const way = corners[k] - corners[k - 1];
    int const ticks = std::max(1, static_cast<int>(std::ceil(way.norm() / step)));
    for (int i = 1; i <= ticks; ++i) path.push_back(corners[k - 1] + way * (S(i) / S(ticks)));
  }
  return path;
}

/// Tips for points of a surface: from above down through the first one to `depth`, along all of them at that depth, and up again.
/// `mesh` is the undeformed surface; the points need not lie on it exactly.
template <class S>
Points<S> stroke_over(palpate::TriangleMesh<S> const& mesh, Points<S> const& points, S depth, S height) {
  palpate::SurfaceTree<S> const tree(mesh);
  auto const normals = palpate::vertex_normals(mesh);
  auto const tip = [&](palpate::Vector3<S> const& p, S above) {
    auto const on = tree.nearest(mesh.points, p);
    palpate::Vector3<S> n = palpate::Vector3<S>::Zero();
    for (int k = 0; k < 3; ++k) n += on.barycentric[k] * normals.col(mesh.triangles(k, on.triangle));
    return palpate::Vector3<S>(on.point + above * n.normalized());
  };
  Points<S> tips;
  for (int i = 0; i <= 4; ++i) tips.push_back(tip(points.front(), height - (height + depth) * S(i) / 4));
  for (auto const& p : points) tips.push_back(tip(p, -depth));
  for (int i = 0; i <= 4; ++i) tips.push_back(tip(points.back(), -depth + (height + depth) * S(i) / 4));
  return tips;
}

/// A gently curved stroke of `edges` mean edges along a surface, from a random vertex in a random direction.
template <class S>
Points<S> stroke_along(palpate::TriangleMesh<S> const& mesh, palpate::Random& random, S edge, S edges, S tick) {
  palpate::SurfaceTree<S> const tree(mesh);
  auto const normals = palpate::vertex_normals(mesh);
  palpate::Vector3<S> at = mesh.points.col(static_cast<Eigen::Index>(random.below(static_cast<std::uint64_t>(mesh.points.cols()))));
  palpate::Vector3<S> ahead(random.uniform(S(-1), S(1)), random.uniform(S(-1), S(1)), random.uniform(S(-1), S(1)));
  S const bend = random.uniform(S(-0.1), S(0.1)) * tick / edge;
  Points<S> path;
  for (int i = 0; i <= static_cast<int>(edges * edge / tick); ++i) {
    auto const on = tree.nearest(mesh.points, at);
    palpate::Vector3<S> n = palpate::Vector3<S>::Zero();
    for (int k = 0; k < 3; ++k) n += on.barycentric[k] * normals.col(mesh.triangles(k, on.triangle));
    n.normalize();
    path.push_back(on.point);
    ahead = (ahead - ahead.dot(n) * n).normalized();
    ahead = (ahead + bend * n.cross(ahead)).normalized();
    at = on.point + tick * ahead;
  }
  return stroke_over<S>(mesh, path, S(0.4) * edge, S(0.3) * edge);
}

/// Drives the cutter and checks all invariants after every tick; the first text that is not empty, with the tick, or "".
template <class Body, class Cutter, class S, class Between>
std::string violations_along(Body& body, Cutter& cutter, Points<S> const& tips, palpate::testing::CutInvariants<Body> const& before,
                             Between between) {
  for (std::size_t i = 0; i < tips.size(); ++i) {
    cutter.advance(body, tips[i]);
    if (auto const found = before.check(body); !found.empty())
      return "tick " + std::to_string(i) + " (" + palpate::to_string(cutter.state()) + ")\n" + palpate::testing::to_text(found);
    between(body);
  }
  return {};
}
