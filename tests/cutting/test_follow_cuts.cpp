// SPDX-License-Identifier: MIT
// What a cut leaves of the packs that forces are computed in: followed edit by edit it is what a plain loop over the tetrahedra says, and what gathering anew makes.
#include "allocation_trap.hpp"
#include "solid_strokes.hpp"

#include <palpate/body/soft_body.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/material/neo_hookean.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/region/zone_of_influence.hpp>
#include <palpate/tissue/finite_elements.hpp>
#include <palpate/tissue/linear_spring.hpp>
#include <palpate/tissue/mass_spring.hpp>
#include <palpate/tissue/supported.hpp>

#include <Eigen/SVD>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <type_traits>
#include <utility>
#include <vector>

namespace {

using namespace palpate;
using namespace palpate_test;

template <class S>
using Solid = FiniteElements<S, StableNeoHookean<S>>;

static_assert(FollowsEdits<Solid<double>> && FollowsEdits<Supported<Solid<double>, LinearSpring<double>>> && !FollowsEdits<MassSpring<double>>);

template <class S>
Solid<S> make_solid(std::array<int, 3> const& n, bool is_nodal = false, S damping = S(1e-3)) {
  Solid<S> tissue(make_block<S>(n[0], n[1], n[2], S(0.015 / (n[0] - 1)), BlockPattern::alternating),
                  {.density = 1000, .material = {.young = S(1e4), .poisson = S(0.4)}, .damping = {.alpha = S(0.5), .beta = damping},
                   .pressure = is_nodal ? Pressure::nodal : Pressure::element});
  std::vector<int> hard;
  for (int t = 0; t < tissue.tetrahedra(); t += 3) hard.push_back(t);
  if (!is_nodal) tissue.set_material(hard, {.young = S(5e4), .poisson = S(0.3)}, 1100);
  for (int i = 0; i < n[0] * n[1]; ++i) tissue.nail(i);
  return tissue;
}

template <class S>
Matrix3X<S> some_columns(Eigen::Index n, double size, double turn) {
  Matrix3X<S> made(3, n);
  for (Eigen::Index k = 0; k < made.size(); ++k) made(k) = static_cast<S>(size * std::sin(turn * double(k + 1) + 0.3 * double(k % 7)));
  return made;
}

/// Force and energy of each tetrahedron of the body's own tetrahedra, from where their corners rest: f = −V P ∇N, P = ∂ψ/∂F. In double.
struct PlainLoop {
  Matrix3X<double> force;
  double energy = 0, least = 1e300;

  template <class Body>
  PlainLoop(Body const& body, std::vector<char> const& chosen, Matrix3X<double> const& x) : force(Matrix3X<double>::Zero(3, body.size())) {
    auto const mesh = body.rest_solid();
    for (Eigen::Index t = 0; t < mesh.tetrahedra.cols(); ++t) {
      bool acts = false;
      for (int k = 0; k < 4; ++k) acts = acts || chosen[std::size_t(mesh.tetrahedra(k, t))] != 0;
      if (!acts) continue;
      Matrix<double, 3, 3> rest, now;
      for (int k = 0; k < 3; ++k) {
        rest.col(k) = (mesh.points.col(mesh.tetrahedra(k + 1, t)) - mesh.points.col(mesh.tetrahedra(0, t))).template cast<double>();
        now.col(k) = x.col(mesh.tetrahedra(k + 1, t)) - x.col(mesh.tetrahedra(0, t));
      }
      double const volume = rest.determinant() / 6;
      Matrix<double, 3, 3> const F = now * rest.inverse();
      auto const& element = body.tissue().list().elements[std::size_t(t)];
      // ψ of StableNeoHookean, see there: m/2 (I − 3) + l/2 (J − α)² − m/2 ln(I + 1), less its value at F = 1.
      double const young = element.density() > 1050 ? 5e4 : 1e4, poisson = element.density() > 1050 ? 0.3 : 0.4;
      double const mu = young / (2 * (1 + poisson)), lambda = young * poisson / ((1 + poisson) * (1 - 2 * poisson));
      double const m = 4 * mu / 3, l = lambda + 5 * mu / 6, alpha = 1 + m / l - m / (4 * l);
      double const I = F.squaredNorm(), J = F.determinant();
      auto const psi = [&](double of_I, double of_J) { return m / 2 * (of_I - 3) + l / 2 * (of_J - alpha) * (of_J - alpha) - m / 2 * std::log(of_I + 1); };
      Matrix<double, 3, 3> const P = m * (1 - 1 / (I + 1)) * F + l * (J - alpha) * J * F.inverse().transpose();
      Matrix<double, 3, 3> const pull = -volume * P * rest.inverse().transpose();
      for (int k = 0; k < 3; ++k) force.col(mesh.tetrahedra(k + 1, t)) += pull.col(k), force.col(mesh.tetrahedra(0, t)) -= pull.col(k);
      energy += volume * (psi(I, J) - psi(3, 1));
      least = std::min(least, J);
    }
  }
};

/// An assembly that has followed the body's cuts so far, against one that is built anew and, without nodal pressure, the plain loop.
template <class Body, class Assembly>
void compare(Body const& body, std::vector<int> const& chosen, Assembly& followed) {
  using S = typename Body::Scalar;
  double const digits = sizeof(S) == 4 ? 2e-5 : 1e-12;
  auto const& tissue = body.tissue();
  tissue.follow_edits(chosen, followed);
  Assembly anew;
  tissue.assemble(chosen, anew);
  REQUIRE(followed.moving() == static_cast<int>(chosen.size()));
  std::vector<char> is_chosen(std::size_t(body.size()), 0);
  REQUIRE(std::equal(chosen.begin(), chosen.end(), followed.particles().begin()));
  for (int const i : chosen) is_chosen[std::size_t(i)] = 1;
  Matrix3X<double> x = some_columns<double>(body.size(), 2e-4, 1.7), v = some_columns<double>(body.size(), 1e-2, 2.3), d = some_columns<double>(body.size(), 1.0, 3.1);
  for (int i = 0; i < body.size(); ++i) x.col(i) += tissue.rest_position(i).template cast<double>();
  x = x.template cast<S>().template cast<double>().eval();
  auto const own = [&](Assembly const& assembly, Matrix3X<double> const& all, bool with_border) {
    PaddedColumns<S> columns;
    columns.resize(static_cast<int>(assembly.particles().size()));
    for (std::size_t k = 0; k < assembly.particles().size(); ++k)
      if (with_border || k < chosen.size()) columns[static_cast<int>(k)] = all.col(assembly.particles()[k]).template cast<S>();
    return columns;
  };
  auto const difference = [&](auto const& a, auto const& b) { return ((a - b).template leftCols<Dynamic>(Eigen::Index(chosen.size())).template cast<double>()).norm(); };
  struct Answers {
    Matrix3X<S> force, damped, product, diagonal;
    double energy, lowest;
  };
  auto const ask = [&](Assembly& assembly) {
    auto const px = own(assembly, x, true), pv = own(assembly, v, true), pd = own(assembly, d, false);
    Matrix3X<S> const still = Matrix3X<S>::Zero(3, px.size());
    Answers a{still, still, still, still, 0, 0};
    assembly.add_forces(px.view(), still, a.force);
    assembly.add_forces(px.view(), pv.view(), a.damped);
    assembly.linearise(px.padded_view(), nullptr);
    PaddedColumns<S> out;
    out.resize(px.size());
    assembly.multiply_tangent(S(0), S(0.5), S(2), pd.padded_view().data(), out.padded_view().data());
    a.product = out.view();
    assembly.tangent_diagonal(S(1), S(0.5), S(2), out.padded_view().data());
    a.diagonal = out.view();
    a.energy = static_cast<double>(assembly.energy(px.padded_view().data()));
    a.lowest = static_cast<double>(assembly.lowest_determinant(px.padded_view().data()).value);
    for (auto* columns : {&a.force, &a.damped, &a.product, &a.diagonal}) *columns = columns->leftCols(Eigen::Index(chosen.size())).eval();
    return a;
  };
  Answers const a = ask(followed), b = ask(anew);
  CHECK(difference(a.force, b.force) <= digits * b.force.template cast<double>().norm());
  CHECK(difference(a.damped, b.damped) <= digits * b.damped.template cast<double>().norm());
  CHECK(difference(a.product, b.product) <= digits * b.product.template cast<double>().norm());
  CHECK(difference(a.diagonal, b.diagonal) <= digits * b.diagonal.template cast<double>().norm());
  CHECK(std::abs(a.energy - b.energy) <= digits * b.energy);
  CHECK(a.lowest == b.lowest);
  if (!tissue.stars().empty()) return;
  PlainLoop const plain(body, is_chosen, x);
  Matrix3X<double> force(3, Eigen::Index(chosen.size()));
  for (std::size_t k = 0; k < chosen.size(); ++k) force.col(Eigen::Index(k)) = plain.force.col(chosen[k]);
  CHECK((a.force.template cast<double>() - force).norm() <= 10 * digits * force.norm());
  CHECK(std::abs(a.energy - plain.energy) <= 10 * digits * plain.energy);
  CHECK(std::abs(a.lowest - plain.least) <= 10 * digits);
}

}  // namespace

TEMPLATE_TEST_CASE("the packs of a solid follow its cuts: forces, energy and tangent are those of the cut mesh", "[volume_cutter]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  struct Case {
    std::array<int, 3> vertices;
    bool is_zone, is_nodal;
    int strokes;
  };
  Case const c = GENERATE(Case{{4, 4, 4}, false, false, 12}, Case{{4, 4, 4}, true, false, 12}, Case{{4, 4, 4}, false, true, 12}, Case{{5, 5, 5}, true, true, 4}, Case{{18, 18, 14}, false, false, 4});
  SoftBody body(make_solid<S>(c.vertices, c.is_nodal), BackwardEuler{});
  body.reserve(4 * body.size(), 8 * int(body.triangles().cols()));
  std::vector<int> chosen;
  auto const choose = [&](int from) {
    for (int i = from; i < body.size(); ++i)
      if (!body.tissue().nailed(i) && (from > 0 || !c.is_zone || body.tissue().rest_position(i)[0] < S(0.008))) chosen.push_back(i);
  };
  choose(0);
  typename Solid<S>::Assembly followed;
  body.tissue().follow_edits(chosen, followed);
  int more = 0;
  for (std::uint64_t seed = 1; seed <= std::uint64_t(c.strokes); ++seed) {
    Drawn const drawn(seed);
    VolumeCutter<S> knife;
    for (int tick = 0; tick <= 16; ++tick) {
      Place const off = drawn.middle + (0.02 * tick / 16 - 0.01) * drawn.way;
      int const before = body.size();
      knife.advance(body, {Place(off - 0.007 * drawn.blade).cast<S>(), Place(off + 0.006 * drawn.blade).cast<S>()});
      choose(before);
      if (before == body.size()) continue;
      ++more;
      if (tick % 4 == 3 || c.vertices[0] > 4) {
        body.tissue().follow_edits(chosen, followed);
        if (c.vertices[0] > 4 && tick % 8 != 7) continue;
        compare(body, chosen, followed);
      }
    }
    compare(body, chosen, followed);
  }
  CHECK(more > 2 * c.strokes);
}

// Yardsticks: the plain loop, and a body that was touched at both places from the first step on. What was touched later had no elastic force.
TEST_CASE("particles of another place that join those that move are gathered with what acts on them", "[volume_cutter]") {
  bool const is_nodal = GENERATE(false, true);
  SoftBody body(make_solid<double>({6, 5, 5}, is_nodal), BackwardEuler{});
  std::vector<int> chosen;
  for (int i = 30; i < 42; ++i) chosen.push_back(i);
  Solid<double>::Assembly followed;
  body.tissue().follow_edits(chosen, followed);
  chosen.push_back(body.size() - 2), chosen.push_back(body.size() - 1);
  compare(body, chosen, followed);
}

TEST_CASE("what is touched far from where a zone moves already resists as it would alone", "[volume_cutter]") {
  Solid<double> tissue = make_solid<double>({12, 5, 5});
  SoftBody body(std::move(tissue), BackwardEuler{}, ZoneOfInfluence{.rings = 1});
  auto other = body;
  int const last = body.size() - 1;
  auto const touch = [&](auto& on, bool both) {
    for (int const i : {73, 74, 75}) on.apply_force(i, {0, 0, -1e-9});
    if (both) on.apply_force(last, {0, 0, 1e-3});
    CHECK(on.step(1e-3));
  };
  for (int k = 0; k < 5; ++k) touch(body, false);
  for (int k = 0; k < 60; ++k) touch(body, true), touch(other, true);
  double const way = (other.positions().col(last) - other.tissue().rest_position(last)).norm();
  CHECK(way > 1e-5);
  CHECK((body.positions().col(last) - other.positions().col(last)).norm() < 1e-6 * way);
}

// Yardstick: all gathered anew. A tetrahedron that was only measured, in a star that a cut has brought among those that act, left it unseen.
TEST_CASE("a star that acts since a cut is followed where its tetrahedra are only measured", "[volume_cutter]") {
  auto const tissue = make_solid<double>({5, 5, 5}, true);
  auto const& solid = tissue.topology();
  auto const has = [](auto const& corners, int i) { return std::find(corners.begin(), corners.end(), i) != corners.end(); };
  int compared = 0;
  for (int first = 0; first < tissue.tetrahedra() && compared < 5; first += 7) {
    auto const own = solid.corners(first);   // these move
    std::vector<int> chosen(own.begin(), own.end());
    std::sort(chosen.begin(), chosen.end());
    std::vector<char> is_beside(std::size_t(tissue.size()), 0), acts(std::size_t(tissue.tetrahedra()), 0);
    for (int const i : own)
      for (int const t : solid.tetrahedra_at(i)) {
        acts[std::size_t(t)] = 1;
        for (int const j : solid.corners(t)) is_beside[std::size_t(j)] = 1;
      }
    auto const try_one = [&](int left, int beside, int far) {   // `left` holds `far`, beside what moves; an edge from there to `beside` will be divided
      std::vector<int> hard;   // of another star
      for (int const t : solid.tetrahedra_at(far))
        if (t != left && !has(solid.corners(t), beside)) hard.push_back(t);
      if (hard.empty()) return;
      auto softer = tissue;
      softer.set_material(hard, {.young = 1e5, .poisson = 0.45});
      SoftBody body(std::move(softer), BackwardEuler{});
      Solid<double>::Assembly followed;
      body.tissue().follow_edits(chosen, followed);
      auto now = chosen;
      now.push_back(body.insert_on_edge(beside, far, 0.5));
      body.finish_edits();
      body.tissue().follow_edits(now, followed);
      body.split_vertex(far, std::array{left});
      body.finish_edits();
      compare(body, now, followed);
      ++compared;
    };
    for (int left = 0, before = compared; left < tissue.tetrahedra() && compared == before; ++left) {
      auto const corners = solid.corners(left);
      auto const far = std::find_if(corners.begin(), corners.end(), [&](int i) { return !is_beside[std::size_t(i)]; });
      if (acts[std::size_t(left)] || far == corners.end() || std::none_of(corners.begin(), corners.end(), [&](int i) { return is_beside[std::size_t(i)]; })) continue;
      for (int const t : solid.tetrahedra_at(*far))
        for (int const i : solid.corners(t))
          if (compared == before && is_beside[std::size_t(i)] && !has(own, i) && !has(corners, i)) try_one(left, i, *far);
    }
  }
  CHECK(compared == 5);
}

TEST_CASE("a solid on support springs follows cuts: the forces are those of each particle by itself", "[volume_cutter]") {
  Supported<Solid<double>, LinearSpring<double>> tissue(make_solid<double>({4, 4, 4}), LinearSpring<double>{.stiffness = 20.0}, {0.0071, 0.0076, 0.0078});
  SoftBody body(std::move(tissue), BackwardEuler{});
  std::remove_cvref_t<decltype(body.tissue())>::Assembly followed;
  std::vector<int> chosen;
  VolumeCutter<double> knife;
  for (int tick = 0; tick <= 20; ++tick) {
    for (int i = int(chosen.size()); i < body.size(); ++i) chosen.push_back(i);
    body.tissue().follow_edits(chosen, followed);
    Matrix3X<double> x = some_columns<double>(body.size(), 2e-4, 1.7), v = some_columns<double>(body.size(), 1e-2, 2.3), force = Matrix3X<double>::Zero(3, body.size());
    x += body.positions();
    followed.add_forces(x, v, force);
    for (int i = 0; i < body.size(); ++i) CHECK((force.col(i) - body.tissue().internal_force(i, x, v)).norm() <= 1e-12 * (1e-3 + force.norm()));
    knife.advance(body, {{0.0071, -0.002 + 0.019 * tick / 20, 0.0052}, {0.0083, -0.002 + 0.019 * tick / 20, 0.02}});
  }
  CHECK(body.size() > 80);
}

TEST_CASE("nodal pressure follows cuts: stars, neighbours and row bounds are those of a search of all tetrahedra", "[volume_cutter]") {
  auto tissue = make_solid<double>({4, 4, 4}, true);
  std::vector<int> hard;
  for (int t = 0; t < tissue.tetrahedra(); ++t)
    if (tissue.rest_position(tissue.topology().corners(t)[0])[2] > 0.006) hard.push_back(t);
  tissue.set_material(hard, {.young = 1e5, .poisson = 0.45});
  SoftBody body(std::move(tissue), BackwardEuler{});
  VolumeCutter<double> knife;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    Drawn const drawn(seed);
    drawn.cut(knife, body, 10);
    knife.lift(body);
    auto const& now = body.tissue();
    auto const& stars = now.stars();
    auto const& nodes = now.list().nodes;
    std::map<std::pair<int, bool>, std::vector<int>> must;   // node, of the stiff material
    auto const is_stiff = [&](int t) { return now.list().elements[std::size_t(t)].law().bulk_modulus() > 1e5; };
    for (int t = 0; t < now.tetrahedra(); ++t)
      for (int const i : nodes[std::size_t(t)]) must[{i, is_stiff(t)}].push_back(t);
    std::vector<std::vector<int>> near(std::size_t(body.size()));
    std::vector<double> row(std::size_t(body.size()), 0.0);   // Σ_j ‖K_ij‖, with K at rest part by part
    Matrix3X<double> const rest = now.rest_positions();
    auto const columns = [&](int t) {
      NodeColumns<double, 4> all;
      for (int k = 0; k < 4; ++k) all.col(k) = rest.col(nodes[std::size_t(t)][std::size_t(k)]);
      return all;
    };
    for (int t = 0; t < now.tetrahedra(); ++t) {
      auto const& element = now.list().elements[std::size_t(t)];
      auto const law = element.law();
      NodeMatrix<double, 4> const K = element.with_law(WithPressure<double, std::remove_cvref_t<decltype(law)>>{law, law.bulk_modulus(), 0.0}).stiffness(columns(t));
      for (int a = 0; a < 4; ++a)
        for (int b = 0; b < 4; ++b) row[std::size_t(nodes[std::size_t(t)][std::size_t(a)])] += Eigen::JacobiSVD<Eigen::Matrix3d>(K.block<3, 3>(3 * a, 3 * b)).singularValues()[0];
    }
    int used = 0;
    for (auto const& [key, all] : must) {
      std::vector<int> found;
      double volume = 0;
      int star = -1;
      for (std::size_t k = 0; k < 4; ++k)
        if (nodes[std::size_t(all[0])][k] == key.first) star = stars.at_corners(all[0])[k];
      for (int const t : all) {
        volume += now.list().elements[std::size_t(t)].volume();
        for (std::size_t k = 0; k < 4; ++k)
          if (nodes[std::size_t(t)][k] == key.first) CHECK(stars.at_corners(t)[k] == star);
      }
      found.assign(stars.elements(star).begin(), stars.elements(star).end());
      std::sort(found.begin(), found.end());
      CHECK(found == all);
      CHECK(stars.node(star) == key.first);
      CHECK(stars.volume(star) == Approx(volume).epsilon(1e-12));
      CHECK(stars.bulk_modulus(star) == now.list().elements[std::size_t(all[0])].law().bulk_modulus());
      ++used;
      std::vector<int> in_star;
      for (int const t : all) in_star.insert(in_star.end(), nodes[std::size_t(t)].begin(), nodes[std::size_t(t)].end());
      for (int const i : in_star)
        for (int const j : in_star)
          if (j != i) near[std::size_t(i)].push_back(j);
      std::map<int, Eigen::Vector3d> grows;
      for (int const t : all) {
        NodeColumns<double, 4> const gradient = now.list().elements[std::size_t(t)].volume_gradient(columns(t));
        for (int k = 0; k < 4; ++k) {
          auto const place = grows.try_emplace(nodes[std::size_t(t)][std::size_t(k)], Eigen::Vector3d::Zero()).first;
          place->second += gradient.col(k);
        }
      }
      for (auto const& [i, a] : grows)
        for (auto const& [j, b] : grows) row[std::size_t(i)] += now.list().elements[std::size_t(all[0])].law().bulk_modulus() / (4 * volume) * a.norm() * b.norm();
    }
    int alive = 0;
    for (int s = 0; s < stars.size(); ++s) alive += stars.elements(s).empty() ? 0 : 1;
    CHECK(alive == used);
    for (int i = 0; i < body.size(); ++i) {
      auto& all = near[std::size_t(i)];
      std::sort(all.begin(), all.end());
      all.erase(std::unique(all.begin(), all.end()), all.end());
      std::vector<int> listed;
      now.for_each_neighbour(i, [&](int j) { listed.push_back(j); });
      CHECK(listed == all);
      CHECK(now.stiffness_bound(i) == Approx(row[std::size_t(i)]).epsilon(1e-9));
      CHECK(now.stiffness_bound(i) <= now.stiffness_bound(i, rest) * (1 + 1e-12));   // its norms are bounds
    }
  }
  CHECK(body.size() > 100);
}

TEST_CASE("a solid that is restored before a cut or in it, a copy and another body go on to the byte, whole and in a zone", "[volume_cutter]") {
  auto const blade = [](int tick) { return BladeSegment<double>{{0.0071, -0.002 + 0.019 * tick / 40, 0.0052}, {0.0083, -0.002 + 0.019 * tick / 40, 0.02}}; };
  auto const check_from = [&](auto body, auto other, double h, int from) {
    int const uncut = body.size();
    auto const go = [&](auto& on, VolumeCutter<double>& knife, int first, int last) {
      for (int tick = first; tick < last; ++tick) {
        for (int i = on.size() - 1; i > 0; i -= h > 1e-4 ? 50 : 3) on.apply_force(i, {0.001 * std::sin(1.0 * tick * i), 0, 0.002});
        knife.advance(on, blade(tick));
        if (tick % 3 != 0 && on.size() > uncut) CHECK(on.step(h));   // some edits wait for the next one
      }
    };
    VolumeCutter<double> const sharp({.min_height = 0.1});
    VolumeCutter<double> knife = sharp;
    CHECK(body.step(h));   // what is gathered now is what a cut edits
    go(body, knife, 0, from);
    auto const middle = body.save();
    auto copy = body;
    int const size = body.size();
    VolumeCutter<double> first = sharp, second = sharp, third = sharp;
    go(body, first, from, 41);
    REQUIRE(body.size() > size);
    Matrix3X<double> const at = body.positions(), speed = body.velocities();
    CHECK(speed.norm() > 0);
    go(copy, second, from, 41);
    CHECK(copy.positions() == at);
    other.restore(middle);
    go(other, third, from, 41);
    CHECK(other.positions() == at);
    for (int again = 0; again < 2; ++again) {
      body.restore(middle);
      VolumeCutter<double> anew = sharp;
      go(body, anew, from, 41);
      CHECK(body.positions() == at);
      CHECK(body.velocities() == speed);
    }
  };
  auto const check = [&](auto const& body, auto const& other, double h) {
    check_from(body, other, h, 0);
    check_from(body, other, h, 20);
  };
  SECTION("the whole of it, implicit steps") { check(SoftBody(make_solid<double>({5, 5, 5}), BackwardEuler{}), SoftBody(make_solid<double>({5, 5, 5}), BackwardEuler{}), 1e-3); }
  SECTION("with nodal pressure") {
    check(SoftBody(make_solid<double>({4, 4, 4}, true), BackwardEuler{}), SoftBody(make_solid<double>({4, 4, 4}, true), BackwardEuler{}), 1e-3);
  }
  SECTION("blocks, explicit steps") {
    auto const body = [] { return SoftBody(make_solid<double>({18, 18, 16}, false, 0.0), LeapfrogVerlet{}); };
    check(body(), body(), 5e-7);
  }
  SECTION("a zone") {
    auto const body = [] { return SoftBody(make_solid<double>({5, 5, 5}), BackwardEuler{}, ZoneOfInfluence{.rings = 2}); };
    check(body(), body(), 1e-3);
  }
}

TEST_CASE("packs that follow cuts allocate nothing within what was reserved", "[volume_cutter]") {
  REQUIRE(trap_works());
  SoftBody body(make_solid<double>({5, 5, 5}), BackwardEuler{});
  body.reserve(4 * body.size(), 8 * int(body.triangles().cols()));
  std::vector<int> chosen;
  chosen.reserve(std::size_t(4 * body.size()));
  for (int i = 0; i < body.size(); ++i)
    if (!body.tissue().nailed(i)) chosen.push_back(i);
  Solid<double>::Assembly followed;
  followed.reserve(body.tissue(), 4 * body.size(), 0);
  body.tissue().follow_edits(chosen, followed);
  VolumeCutter<double> knife;
  int followed_times = 0;
  long allocated = 0;
  for (int tick = 0; tick < 30; ++tick) {
    int const before = body.size();
    knife.advance(body, {{0.0071, -0.002 + 0.019 * tick / 30, 0.0052}, {0.0083, -0.002 + 0.019 * tick / 30, 0.02}});
    for (int i = before; i < body.size(); ++i)
      if (!body.tissue().nailed(i)) chosen.push_back(i);
    AllocationCount const allocations;
    body.tissue().follow_edits(chosen, followed);
    allocated += allocations.count();
    followed_times += body.size() > before ? 1 : 0;
  }
  CHECK(followed_times > 3);
  CHECK(allocated == 0);
}
