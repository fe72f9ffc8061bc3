// SPDX-License-Identifier: MIT
// Models that are tissues of a SoftBody, under their own weight and a ball that presses them at 1 kHz. Yardsticks: nails bear weight and force together; the coupling's
// spring; the battery of bodies.
#include "allocation_trap.hpp"
#include "catch.hpp"

#include <palpate/body/soft_body.hpp>
#include <palpate/cutting/no_cutter.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/simulator/body_loop.hpp>
#include <palpate/testing/body.hpp>
#include <palpate/tissue/tensor_mass/corotated_tensor_mass.hpp>
#include <palpate/tissue/tensor_mass/tensor_mass.hpp>
#include <palpate/tissue/two_layers.hpp>

#include <algorithm>
#include <cmath>
#include <tuple>
#include <type_traits>
#include <utility>

using namespace palpate;
using namespace palpate_test;

namespace {

template <template <class> class Tissue>
struct Tensor {
  template <class S>
  static auto tissue(TetrahedralMesh<S> const& mesh) {
    return Tissue<S>(mesh, {.density = 1000, .material = {.young = S(5000), .poisson = S(0.4)}, .damping = {.alpha = 20, .beta = S(0.01)}});
  }
};
struct Layers {
  template <class S>
  static auto tissue(TetrahedralMesh<S> const& mesh) {
    return two_layers(mesh, LinearSpring<S>{.stiffness = 60, .damping = S(0.3)}, LockingSpring<S>{.stiffness = 30, .largest_tension = 2, .damping = S(0.3)},
                      {.mass = {.total = S(0.1)}});
  }
};
using Models = std::tuple<Tensor<TensorMass>, Tensor<CorotatedTensorMass>, Layers>;

/// 50 × 50 × 30 mm, nailed below.
template <class Model, class S>
auto block() {
  auto tissue = Model::tissue(make_block<S>(6, 6, 4, S(0.01), BlockPattern::alternating));
  for (int i = 0; i < tissue.size(); ++i)
    if (tissue.rest_position(i)[2] < S(1e-6)) tissue.nail(i);
  return SoftBody(std::move(tissue), BackwardEuler{.tolerance = std::is_same_v<S, float> ? 1e-4 : 1e-6});
}

template <class Model, class S>
void press() {
  REQUIRE(trap_works());
  auto body = block<Model, S>();
  body.set_gravity({0, 0, S(-9.81)});
  S weight = 0;
  for (int i = 0; i < body.size(); ++i) weight += body.tissue().mass(i) * S(9.81);
  BodyLoop loop(std::move(body), NoCutter<S>({.tip_radius = S(0.004)}), ContactCoupling{.stiffness = 500}, 100);
  S least = 1e9, most = 0;
  auto const tip = [](int k) { return ToolPose<S>{.position = {S(0.0262), S(0.0241), S(0.035) - S(0.005) * std::clamp(S(k - 500) / 100, S(0), S(1))}}; };
  auto const tick = [&](int k) { return loop.tick(tip(k), S(1e-3)).tissue_force; };
  for (int k = 0; k < 700; ++k) tick(k);
  auto const at_save = loop.body();
  auto const saved = at_save.save();
  AllocationCount const allocations;
  for (int k = 700; k < 1500; ++k) {
    S const force = tick(k).norm();
    if (k >= 1400) least = std::min(least, force), most = std::max(most, force);
  }
  long const count = allocations.count();
  CHECK(count == 0);
  CHECK(loop.counts().diverged == 0);
  CAPTURE(least, most, weight);
  CHECK(least > S(0.05));
  CHECK(most - least < S(5e-3) * most);
  auto const& contact = loop.cutter().contact();
  CHECK(most == Approx(S(500) * (S(0.004) - (tip(1500).position - contact.point).dot(contact.normal))).epsilon(0.02));
  Vector3<S> borne = Vector3<S>::Zero();
  for (int i = 0; i < loop.body().size(); ++i)
    if (loop.body().tissue().nailed(i)) borne += loop.body().reaction(i);
  CHECK(std::abs(borne[2]) == Approx(weight + most * contact.normal[2]).epsilon(0.02));
  // Saved while it was pressed: it is back, and goes on as the body that was never anywhere else.
  auto again = loop.body(), once = at_save;
  again.restore(saved);
  CHECK(again.positions() == once.positions());
  for (int k = 0; k < 50; ++k) again.step(S(1e-3)), once.step(S(1e-3));
  CHECK(again.positions() == once.positions());
}

}  // namespace

TEMPLATE_LIST_TEST_CASE("models that are tissues bear their weight and a tool at 1 kHz, steadily, and allocate nothing", "[tissue][models]", Models) {
  [&]<class... Scalars>(std::type_identity<std::tuple<Scalars...>>) { (press<TestType, Scalars>(), ...); }(std::type_identity<std::tuple<PALPATE_TEST_SCALARS>>());
}

TEMPLATE_LIST_TEST_CASE("bodies of models that are tissues keep the laws of bodies", "[tissue][models]", Models) {
  auto const check = []<class S>(S) { CHECK(testing::to_text(testing::check_body(block<TestType, S>())) == ""); };
  [&]<class... Scalars>(std::type_identity<std::tuple<Scalars...>>) { (check(Scalars()), ...); }(std::type_identity<std::tuple<PALPATE_TEST_SCALARS>>());
}
