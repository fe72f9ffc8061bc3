// SPDX-License-Identifier: MIT
// expect: palpate: not every body of the scene takes this cutter; give Tool
// One cutter for two bodies.
#include <palpate/palpate.hpp>
#include <palpate/scene.hpp>

using namespace palpate;

int main() {
  auto const body = [] { return SoftBody(MassSpring<double>(make_sphere<double>(0.05, 2), {}), LeapfrogVerlet{}, WholeBody{}); };
  ScriptedDevice<double> hand(Trajectory<double>::start({0, 0, 0.06}), {});
  Simulator simulator(Scene(body(), body()), Tool(hand, PerBody(NoCutter<double>()), TissueReaction{}));
}
