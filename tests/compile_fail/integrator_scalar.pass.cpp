// SPDX-License-Identifier: MIT
// An integrator that computes in the body's scalar.
#include <palpate/palpate.hpp>

struct SymplecticEuler2 {
  template <class System>
  void step(System& system, typename System::Scalar h) const {
    system.velocities() += h * system.acceleration(system.positions(), system.velocities());
    system.positions() += h * system.velocities();
  }
};

void step() {
  using namespace palpate;
  SoftBody body(MassSpring<float>(make_grid<float>(3, 3, 0.01f), {}), SymplecticEuler2{}, WholeBody{});
  body.step(1e-3f);
}
