// SPDX-License-Identifier: MIT
// Strokes through solids, whatever they are made of, and what is asked of a solid after them.
#pragma once

#include "catch.hpp"
#include "shrink_lists.hpp"

#include <palpate/core/random.hpp>
#include <palpate/cutting/volume_cutter.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/components.hpp>
#include <palpate/mesh/validation.hpp>
#include <palpate/testing/cut_motion.hpp>
#include <palpate/testing/solid_cut_invariants.hpp>
#include <palpate/tissue/concept.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace palpate_test {

using Place = palpate::Vector3<double>;

inline std::uint64_t from_environment(char const* name, std::uint64_t otherwise) {
  char const* const asked = std::getenv(name);
  return asked != nullptr ? std::stoull(asked) : otherwise;
}

int pieces(auto const& body) { return static_cast<int>(palpate::connected_components(body.rest_solid()).size()); }

/// Each tetrahedron by where its corners rest, in order: the same for two bodies whatever their numbers are.
auto shape(auto const& body) {
  auto const mesh = body.rest_solid();
  std::vector<std::array<std::array<long, 3>, 4>> all;
  for (Eigen::Index t = 0; t < mesh.tetrahedra.cols(); ++t) {
    auto& corners = all.emplace_back();
    for (std::size_t k = 0; k < 4; ++k)
      for (std::size_t d = 0; d < 3; ++d)
        corners[k][d] = std::lround(1e9 * mesh.points(static_cast<int>(d), mesh.tetrahedra(static_cast<int>(k), t)));
    std::sort(corners.begin(), corners.end());
  }
  std::sort(all.begin(), all.end());
  return all;
}

/// Sweeps a blade of these ends along a way, in so many ticks.
template <class Body>
void stroke(palpate::VolumeCutter<double>& knife, Body& body, Place const& from, Place const& to, Place const& way, int ticks) {
  for (int tick = 0; tick <= ticks; ++tick) {
    Place const off = way * (static_cast<double>(tick) / ticks);
    knife.advance(body, {from + off, to + off});
  }
}

/// A plane stroke of any direction through a block of 15 mm: the blade and its way.
struct Drawn {
  Place middle, blade, way;
  explicit Drawn(std::uint64_t seed) {
    palpate::Random random(palpate::Seed{seed});
    auto const any = [&] { return Place(random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0)); };
    middle = Place::Constant(0.0075) + 0.004 * any();
    blade = any().normalized(), way = any().normalized();
  }
  template <class Body>
  void cut(palpate::VolumeCutter<double>& knife, Body& body, int ticks) const {
    stroke(knife, body, middle - 0.01 * way - 0.007 * blade, middle - 0.01 * way + 0.006 * blade, 0.02 * way, ticks);
  }
};

/// A plane of any direction, through all of a cube of this side.
struct AnyPlane {
  Place at, normal;
  AnyPlane(palpate::Random& random, double side) {
    auto const any = [&] { return Place(random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0)); };
    normal = any().normalized(), at = Place::Constant(side / 2) + 0.1 * side * any();
  }
  template <class Body>
  palpate::VolumeCutReport cut(Body& body, double side, bool moves) const {
    Place const blade = normal.unitOrthogonal(), way = normal.cross(blade);
    palpate::VolumeCutter<double> knife;
    for (int tick = 0; tick <= 40; ++tick) {
      Place const o = at + way * (2 * side * (tick / 20.0 - 1));
      knife.advance(body, {o - 2 * side * blade, o + 2 * side * blade});
      if (moves) body.step(2e-3);
    }
    knife.lift(body);
    return knife.report();
  }
};

/// A tetrahedron with a corner at 0 and edges of 10 mm along the axes, and planes through it. A corner is cut off: 3 vertices on edges, each twice; four edges: 4;
/// X, Y: the vertices of the plane split too. Triangles and edges are those of both pieces.
inline palpate::TetrahedralMesh<double> one_tetrahedron() {
  palpate::TetrahedralMesh<double> mesh{palpate::Matrix3X<double>(3, 4), palpate::Matrix<int, 4, palpate::Dynamic>(4, 1)};
  mesh.points << 0, 0.01, 0, 0, 0, 0, 0.01, 0, 0, 0, 0, 0.01;
  mesh.tetrahedra << 0, 1, 2, 3;
  return mesh;
}
struct PlaneCase {
  char const* name;
  Place at, normal;
  int tetrahedra, particles, triangles, edges;

  template <class Body>
  void cut(palpate::VolumeCutter<double>& knife, Body& body) const {
    Place const blade = normal.unitOrthogonal(), way = normal.normalized().cross(blade);
    stroke(knife, body, at - 0.03 * blade - 0.0301 * way, at + 0.03 * blade - 0.0301 * way, 0.06 * way, 40);
  }
};
inline std::array<PlaneCase, 5> plane_cases() {
  return {PlaneCase{"A: three edges", Place(0.004, 0, 0), Place::UnitX(), 4, 10, 12, 18}, PlaneCase{"B: four edges", Place(0, 0.0042, 0), Place(0, 1, 1), 6, 12, 16, 24},
          PlaneCase{"X: a vertex and two edges", Place(0, 0, 0.01), Place(1, 1, 0.4), 3, 9, 10, 15},
          PlaneCase{"Y: two vertices and an edge", Place(0, 0, 0), Place(0.6, -0.4, 0), 2, 8, 8, 12},
          PlaneCase{"Y: another", Place(0.0041, 0, 0), Place(1 / 0.0041, 100, 100), 2, 8, 8, 12}};
}

/// Where a blade goes in a tick, end to end, and whether the body takes a step after it.
struct BladeTick {
  Place from, to;
  bool steps;
};
/// Strokes through the solid that a seed makes.
struct SolidCase {
  std::uint64_t seed;
  std::vector<std::vector<BladeTick>> strokes;
};
inline std::string to_text(SolidCase const& all) {
  std::string text = "seed " + std::to_string(all.seed);
  for (std::size_t n = 0; n < all.strokes.size(); ++n)
    for (BladeTick const& tick : all.strokes[n]) {
      char line[300];
      std::snprintf(line, sizeof line, "\n  stroke %d: (%.17g, %.17g, %.17g) to (%.17g, %.17g, %.17g)%s", static_cast<int>(n), tick.from[0], tick.from[1], tick.from[2],
                    tick.to[0], tick.to[1], tick.to[2], tick.steps ? ", a step" : "");
      text += line;
    }
  return text;
}

/// Blocks, balls, shells, bent and very uneven ones; now and then one that is not valid.
inline palpate::TetrahedralMesh<double> solid_of(std::uint64_t seed) {
  using namespace palpate;
  TetrahedralMesh<double> mesh = make_block<double>(4, 4, 4, 0.005, seed % 2 == 0 ? BlockPattern::alternating : BlockPattern::kuhn);
  std::uint64_t const kind = seed % 5;
  if (kind == 1 || kind == 3)   // a ball
    for (Eigen::Index i = 0; i < mesh.points.cols(); ++i) {
      Place const p = mesh.points.col(i) - Place::Constant(0.0075);
      if (double const far = p.cwiseAbs().maxCoeff(); far > 0) mesh.points.col(i) = Place::Constant(0.0075) + p * (far / p.norm());
    }
  if (kind == 3)   // an organ: flat, and bent
    for (Eigen::Index i = 0; i < mesh.points.cols(); ++i) {
      Place const p = mesh.points.col(i) - Place::Constant(0.0075);
      mesh.points.col(i) = Place::Constant(0.0075) + Place(1.5 * p[0], p[1] + 30 * p[0] * p[0], 0.6 * p[2]);
    }
  if (kind == 4) {   // a shell: no tetrahedra in the middle
    Eigen::Index kept = 0;
    for (Eigen::Index t = 0; t < mesh.tetrahedra.cols(); ++t) {
      Place middle = Place::Zero();
      for (int const v : mesh.tetrahedra.col(t)) middle += mesh.points.col(v) / 4;
      if ((middle - Place::Constant(0.0075)).cwiseAbs().maxCoeff() > 0.0025) mesh.tetrahedra.col(kept++) = mesh.tetrahedra.col(t);
    }
    mesh.tetrahedra.conservativeResize(4, kept);
  }
  if (kind == 2)   // very uneven
    mesh.points.row(0) = 0.015 * (mesh.points.row(0).array() / 0.015).square().matrix() * 0.9 + 0.1 * mesh.points.row(0);
  return mesh;
}
/// Three strokes of any kind.
inline SolidCase strokes_of(std::uint64_t seed) {
  palpate::Random random(palpate::Seed{seed});
  auto const any = [&] { return Place(random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0)); };
  SolidCase all{seed, {}};
  for (int n = 0; n < 3; ++n) {
    Place const middle = Place::Constant(0.0075) + 0.006 * any(), blade = any().normalized(), way = any().normalized();
    Place const turn = 0.01 * random.uniform(0.0, 1.0) * any();
    double const length = random.uniform(0.002, 0.03), far = random.uniform(0.001, 0.03);
    int const ticks = 2 + static_cast<int>(random.below(20));
    bool const back = random.below(4) == 0, moves = random.below(2) == 0;
    auto& own = all.strokes.emplace_back();
    for (int tick = 0; tick <= ticks; ++tick) {
      double u = static_cast<double>(tick) / ticks;
      if (back) u = 1 - std::abs(2 * u - 1);
      Place const at = middle + (2 * u - 1) * far * way;
      own.push_back({at - length / 2 * blade - u * turn, at + length / 2 * blade + u * turn, moves});
    }
  }
  return all;
}

/// Cuts a body so, with all invariants after each tick and where a stroke ends; after the last one the blade stays. What is wrong first, or nothing. `made`: how
/// many tetrahedra. Where masses are evened out momentum may go into nails.
template <class Body, class Before, class S>
std::string cut_and_check(SolidCase const& all, Body& body, Before const& before, palpate::VolumeCutter<S>& knife, int& made) {
  using namespace palpate;
  bool keeps_momentum = true;
  if constexpr (RedistributesMass<typename Body::Tissue>)
    for (int i = 0; i < body.size(); ++i) keeps_momentum = keeps_momentum && !body.tissue().nailed(i);
  std::string wrong;
  for (std::size_t n = 0; n < all.strokes.size(); ++n) {
    for (std::size_t tick = 0; tick < all.strokes[n].size(); ++tick) {
      auto const& [from, to, steps] = all.strokes[n][tick];
      testing::CutMotion const motion(body);
      knife.advance(body, {from.template cast<S>(), to.template cast<S>()});
      auto moved = motion.check(body);
      if (!keeps_momentum) std::erase_if(moved, [](std::string const& sentence) { return sentence.starts_with("the momentum"); });
      wrong = testing::to_text(before.check(body)) + testing::to_text(moved);
      if (!wrong.empty()) return "stroke " + std::to_string(n) + ", tick " + std::to_string(tick) + ":\n" + wrong;
      if (steps) body.step(S(1e-3));
    }
    made += knife.report().tetrahedra_added;
    if (n + 1 < all.strokes.size()) knife.lift(body);
    wrong = testing::to_text(before.check(body));
    if constexpr (testing::HasTetrahedralElements<std::remove_cvref_t<decltype(body.tissue())>>) wrong += testing::to_text(before.check_end(body));
    if (!wrong.empty()) return "stroke " + std::to_string(n) + ", at its end:\n" + wrong;
  }
  return "";
}

/// Strokes of any kind, three through each solid of which make(mesh, seed) makes a body; a solid is restored in mid-cut. Reports the first three that fail, made as
/// short as they still fail, and returns how many tetrahedra were made.
/// `linear`: turned pieces are strained, so that they are turned by displacements that a linear body does not feel.
/// PALPATE_SOLID_STROKES sets how many strokes, PALPATE_SEED with which seed they begin.
template <class S, class Make>
int cut_at_random(std::uint64_t otherwise, Make const& make, bool linear = false) {
  using namespace palpate;
  std::uint64_t const strokes = from_environment("PALPATE_SOLID_STROKES", otherwise), first = from_environment("PALPATE_SEED", 1);
  int failures = 0, made = 0;
  for (std::uint64_t seed = first; 3 * (seed - first) < strokes && failures < 3; ++seed) {
    TetrahedralMesh<double> const mesh = solid_of(seed);
    TetrahedralMesh<S> const solid{mesh.points.cast<S>(), mesh.tetrahedra};
    if (!validate(solid).empty()) continue;
    auto const invariants = [seed, linear](auto const& body) {
      return testing::SolidCutInvariants(body, {.min_height = 0.0199 * static_cast<double>(body.mean_edge()), .seed = Seed{seed}, .linear = linear});
    };
    auto body = make(solid, seed);
    int const particles = body.size();
    auto const saved = body.save();
    auto const before = invariants(body);
    VolumeCutter<S> knife;
    SolidCase const drawn = strokes_of(seed);
    if (std::string const wrong = cut_and_check(drawn, body, before, knife, made); !wrong.empty()) {
      ++failures;
      std::string left = wrong;
      SolidCase const least = with_fewer_ticks(drawn, [&](SolidCase const& smaller) {
        auto other = make(solid, seed);
        VolumeCutter<S> blade;
        int again = 0;
        std::string const now = cut_and_check(smaller, other, invariants(other), blade, again);
        if (!now.empty()) left = now;
        return !now.empty();
      });
      FAIL_CHECK(wrong << "what is left of it: " << left << to_text(least));
    }
    body.restore(saved);   // in mid-cut, too
    CHECK(testing::to_text(before.check(body)) == "");
    knife.advance(body, {Vector3<S>::Constant(1), Vector3<S>::Constant(S(1.01))});
    CHECK(body.size() == particles);
  }
  CHECK(made > 10 * static_cast<int>(strokes));
  return made;
}

}  // namespace palpate_test
