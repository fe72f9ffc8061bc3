// SPDX-License-Identifier: MIT
#pragma once

/// A body of one's own: tissue that is no sum of forces on particles with masses, and moves by a rule of its own. The page to this header is docs/new_body.md.
///
/// A tissue alone is less work: SoftBody(tissue, integrator), see extend/tissue.hpp. A body that is known by its skin derives from SkinBody<Scalar>, which has all that
/// tools and renderers ask for but what moves it. Then required, together the concept SimulatedBody<B>
///   void apply_force(int i, Vector const& force)           N, for the next step; adds up, check(i) and check_force(i, force) refuse what makes no sense
///   Report step(Scalar h)                                  s, ≥ 0, check_step(h): moves vertices by displace(i, u, v). Report: false where it diverged; int moving
///   Vector predicted_acceleration(int i, Scalar h) const   of the next step's mean velocity, with the forces applied so far [m/s²]
///   Scalar mobility(int i, int j, Scalar h) const          what a force on j adds to that at most [1/kg], symmetric; 0 of nailed ones     StatesMobility
///   State save() const, void restore(State const&)         all that its future is made of; of the skin save_skin(), restore_skin(…)
/// Of SkinBody: positions(), velocities(), displacement(i), tissue().nailed(i), mark_nailed(i), size(), mesh(), rest_mesh(), mean_edge(), home_diagonal()
///   stable_step(), guaranteed_stable_step(), stable_step_fell()    any step is stable, if you do not say otherwise
/// Optional
///   visit_triangles_in_box(low, high, visit)               tools longer than a point; SkinBody has it                                     SearchableBody
///   static constexpr bool any_step_is_stable = true        whatever happens to it: its stable step is asked for once                   AnyStepIsStable
///   auto forecast(Scalar h)                                an optional MotionForecast: how particles give way together in a step        ForecastsSteps
///   std::size_t renumberings() const                       where triangles get other numbers                                              CountsRenumberings
///   static constexpr bool renumbers_particles = true       then particles get other numbers too                                          RenumbersParticles
/// Battery
///   testing::to_text(testing::check_body(my_body)) == ""

#include <palpate/body/concept.hpp>
#include <palpate/testing/body.hpp>
#include <palpate/tissue/skin_body.hpp>

namespace palpate::testing {

/// The least body: nothing moves it.
template <RealScalar ScalarType>
class BodyArchetype : public SkinBody<ScalarType> {
 public:
  using Scalar = ScalarType;
  using Vector = Vector3<Scalar>;
  struct Report {
    int moving = 0;
    explicit operator bool() const noexcept { return true; }
  };
  using State = typename SkinBody<Scalar>::SkinState;

  explicit BodyArchetype(TriangleMesh<Scalar> const& skin) : SkinBody<Scalar>(skin, {}) {
    for (int i = 0; i < this->size(); ++i) this->mark_nailed(i);
  }
  void apply_force(int i, Vector const& force) { this->check(i), this->check_force(i, force); }
  Report step(Scalar h) { return (this->check_step(h), Report{}); }
  Vector predicted_acceleration(int, Scalar) const { return Vector::Zero(); }
  Scalar mobility(int, int, Scalar) const { return 0; }
  State save() const { return this->save_skin(); }
  void restore(State const& state) { this->restore_skin(state); }
};

}  // namespace palpate::testing
