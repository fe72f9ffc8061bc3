// SPDX-License-Identifier: MIT
// The same without the mistake.
#include <palpate/palpate.hpp>

/// Of the user: resists, and pulls the hand to the middle.
struct Guided {
  palpate::Vector3<double> operator()(palpate::ToolContact<double> const& contact) noexcept { return contact.tissue_force; }
  palpate::Vector3<double> overlay(palpate::ToolMotion<double> const& motion) noexcept { return -10.0 * motion.tip; }
};

void run() {
  using namespace palpate;
  MassSpring<double> tissue(make_grid<double>(3, 3, 0.01), {});
  SoftBody body(std::move(tissue));
  Simulator simulator(NullDevice<double>(), std::move(body), NoCutter<double>(), Guided{});
  simulator.run(0.1);
}
