// SPDX-License-Identifier: MIT
// expect: palpate: the integrator's step is not const; declare: template <class System> void step(System& system, typename System::Scalar h) const
// An integrator whose step changes the integrator itself.
#include <palpate/palpate.hpp>

struct Midpoint {
  static constexpr int order = 2;

  template <class System>
  void step(System& system, typename System::Scalar h) {
    using Matrix = typename System::Matrix;
    Matrix const x = system.positions();
    Matrix const v = system.velocities();
    Matrix const half_v = v + h / 2 * system.acceleration(x, v);
    system.positions() = x + h * half_v;
    system.velocities() = v + h * system.acceleration(x + h / 2 * v, half_v);
  }
};

void step() {
  using namespace palpate;
  SoftBody body(MassSpring<double>(make_grid<double>(3, 3, 0.01), {}), Midpoint{}, WholeBody{});
  body.step(1e-3);
}
