// SPDX-License-Identifier: MIT
// expect: palpate: the integrator's step takes another scalar than the body's; declare: template <class System> void step(System& system, typename System::Scalar h) const
// An integrator that computes in double, for a body in float.
#include <palpate/palpate.hpp>

struct SymplecticEuler2 {
  template <class System>
  void step(System& system, double h) const {
    system.velocities() += h * system.acceleration(system.positions(), system.velocities());
    system.positions() += h * system.velocities();
  }
};

void step() {
  using namespace palpate;
  SoftBody body(MassSpring<float>(make_grid<float>(3, 3, 0.01f), {}), SymplecticEuler2{}, WholeBody{});
  body.step(1e-3f);
}
