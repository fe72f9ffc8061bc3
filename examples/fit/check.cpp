// SPDX-License-Identifier: MIT
#include "check.hpp"

#include <palpate/json/force_file.hpp>
#include <palpate/palpate.hpp>

#include <cstdio>
#include <utility>

namespace fit_example {

std::string check_force(std::filesystem::path const& file) {
  using namespace palpate;
  auto force = read_force<double>(file);

  auto const sheet = make_grid<double>(21, 21, 0.005);
  MassSpring<double> tissue(sheet, {.mass = {.total = 0.1}, .link = {.stiffness = 80.0, .damping = 0.2}, .home = {.stiffness = 8.0, .damping = 0.1}});
  tissue.nail(boundary_vertices(sheet));
  constexpr double puncture_depth = 0.006;   // m
  auto const hand = Trajectory<double>::start({0.0312, 0.0533, 0.002})
                        .line({0.0312, 0.0533, -0.012}, 1.4)
                        .line({0.0712, 0.0533, -0.012}, 2.0)
                        .line({0.0712, 0.0533, 0.010}, 1.1);
  double const seconds = hand.duration();
  Simulator simulator(ScriptedDevice<double>(hand), SoftBody(std::move(tissue), LeapfrogVerlet{}, ZoneOfInfluence{.rings = 4}),
                      ProgressiveCutter<double>({.puncture_depth = puncture_depth, .snap = 5e-4}), std::move(force));
  Recording const session = simulator.run(seconds);

  Tick before{}, after{};   // the puncture, where the force is largest
  std::size_t in_contact = 0;
  for (Tick const& tick : session.ticks()) {
    if (!tick.force.allFinite())
      throw Error(detail::message(file.string(), ": the force is not finite at ", 1000 * tick.depth, " mm; do not use it"));
    in_contact += tick.phase != CuttingPhase::no_contact;
    Tick& largest = tick.phase == CuttingPhase::indenting ? before : after;
    if (tick.force.norm() > largest.force.norm()) largest = tick;
  }
  auto const& loaded = simulator.force();
  char text[1024];
  std::snprintf(text, sizeof text,
                "A sheet pressed and cut 12 mm deep, punctured at %g mm; %zu ticks, %zu of them in contact. The largest force:\n"
                "  before the puncture %.3f N at %.1f mm\n"
                "  after it            %.3f N at %.1f mm\n"
                "Measured at %g to %g mm/s; in %llu ticks it was faster along the normal, and got the force of the fastest.\n",
                1000 * puncture_depth, session.ticks().size(), in_contact, before.force.norm(), 1000 * before.depth, after.force.norm(),
                1000 * after.depth, 1000 * loaded.speeds().low, 1000 * loaded.speeds().high, static_cast<unsigned long long>(loaded.too_fast()));
  return detail::message(file.string(), ": ", loaded.source(), "\n", text, force_disclaimer, "\n");
}

}  // namespace fit_example
