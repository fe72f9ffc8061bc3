// SPDX-License-Identifier: MIT
// expect: palpate::Overlaid: the second part is no overlay; declare: Vector3<Scalar> operator()(ToolMotion<Scalar> const& motion) noexcept
// An overlay that may throw would not be felt.
#include <palpate/palpate.hpp>

/// Pulls the hand to the middle.
struct Guide {
  palpate::Vector3<double> operator()(palpate::ToolMotion<double> const& motion) { return -10.0 * motion.tip; }
};

void run() {
  using namespace palpate;
  MassSpring<double> tissue(make_grid<double>(3, 3, 0.01), {});
  SoftBody body(std::move(tissue));
  Simulator simulator(NullDevice<double>(), std::move(body), NoCutter<double>(), Overlaid(TissueReaction{}, Guide{}));
  simulator.run(0.1);
}
