// SPDX-License-Identifier: MIT
// A body and a cutter ask no more of tissue than CuttableTissue and SeparableTissue say. Yardstick: the invariants of every cut.
#include <palpate/body/soft_body.hpp>
#include <palpate/cutting/progressive_cutter.hpp>
#include <palpate/cutting/separating_cutter.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/region/zone_of_influence.hpp>
#include <palpate/testing/cut_invariants.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include "catch.hpp"

#include <span>
#include <type_traits>

using namespace palpate;

namespace {

/// Mass-spring tissue of which nothing is to be seen but what a SeparableTissue has to have.
template <RealScalar S>
class OnlySeparable : private MassSpring<S> {
  using Springs = MassSpring<S>;

 public:
  using Scalar = S;

  class Assembly {
   public:
    std::span<int const> particles() const { return inner_.particles(); }
    template <class X, class V, class F>
    void add_forces(X const& x, V const& v, F& f) const {
      inner_.add_forces(x, v, f);
    }

   private:
    friend OnlySeparable;
    typename Springs::Assembly inner_;
  };

  using Springs::Springs;
  using Springs::balance_copies, Springs::change_corner, Springs::cuttable, Springs::damping_bound, Springs::for_each_neighbour, Springs::insert_in_triangle,
      Springs::insert_on_edge, Springs::internal_force, Springs::mass, Springs::merge_last_particle, Springs::move_rest,
      Springs::nail, Springs::nailed, Springs::next_copy, Springs::rest_position, Springs::revision,
      Springs::size, Springs::split_particle, Springs::surface, Springs::triangle_area;
  void assemble(std::span<int const> moving, Assembly& assembly) const { Springs::assemble(moving, assembly.inner_); }
  S stiffness_bound(int i) const { return Springs::stiffness_bound(i); }
};
static_assert(SeparableTissue<OnlySeparable<double>> && SeparableTissue<OnlySeparable<float>>);
static_assert(!RedistributesMass<OnlySeparable<double>> && !HasFusedForces<OnlySeparable<double>> && !ReservesMemory<OnlySeparable<double>> &&
              !HasStiffnessProduct<OnlySeparable<double>> && !HasLinks<OnlySeparable<double>> && !HasHomeSprings<OnlySeparable<double>> &&
              !HasPotentialEnergy<OnlySeparable<double>> && !HasStiffnessRowBoundsAt<OnlySeparable<double>> && !DivisibleTissue<OnlySeparable<double>>);

}  // namespace

TEMPLATE_TEST_CASE("the least tissue that can be cut is cut", "[cutting]", ProgressiveCutter<float>, ProgressiveCutter<double>, SeparatingCutter<float>,
                   SeparatingCutter<double>) {
  using S = typename TestType::Vector::Scalar;
  OnlySeparable<S> tissue(make_grid<S>(11, 11, S(0.01)), {.mass = {.total = S(0.1)}, .link = {.stiffness = 50, .damping = S(0.01)}, .home = {.stiffness = 1}});
  for (int i = 0; i < 11; ++i) tissue.nail(i);
  SoftBody body(tissue, LeapfrogVerlet{}, ZoneOfInfluence{.rings = 3});
  testing::CutInvariants before(body, {.moves_vertices = std::is_same_v<TestType, SeparatingCutter<S>>});
  TestType cutter({.puncture_depth = S(0.002)});
  S const step = body.guaranteed_stable_step() / 2;
  auto const go = [&](double x, double y, double depth) {
    cutter.advance(body, {S(x), S(y), S(-depth)});
    body.step(step);
  };
  for (double const depth : {-0.004, 0.0, 0.003}) go(0.0213, 0.0237, depth);
  for (int k = 1; k <= 60; ++k) {
    go(0.0213 + 1e-3 * k, 0.0237 + 8e-4 * k, 0.003);
    REQUIRE(testing::to_text(before.check(body)) == "");
  }
  go(0.0813, 0.0717, -0.004);
  CHECK(cutter.state() == CuttingPhase::no_contact);
  CHECK(body.size() > 121 + 4);
  CHECK(testing::to_text(before.check(body)) == "");
}
