// SPDX-License-Identifier: MIT
// Yardstick: κ s K by hand, of a plane that is written by hand.
#include "catch.hpp"

#include "simulator/puppet.hpp"

#include <palpate/haptics/overlay.hpp>
#include <palpate/haptics/press_then_cut.hpp>
#include <palpate/haptics/proxy_force.hpp>
#include <palpate/simulator/servo_loop.hpp>

#include <limits>
#include <utility>

using namespace palpate;
using palpate_test::Puppet;
using palpate_test::Strings;

namespace {

struct Silent {
  Vector3<double> operator()(ToolMotion<double> const&) noexcept { return Vector3<double>::Zero(); }
};

/// What a hand feels 0.1 mm of its own way below a plane of 400 N/m [N/m], and how often it was told that this is less than the plane's.
template <class Force>
std::pair<double, int> felt(Strings<double>& strings, double scale, double force_scale, Force force, SafetyOptions const& safety = {}) {
  ServoOptions options{.safety = safety};
  options.mapping = WorkspaceMapping<double>(Similarity<double>::make(scale, Eigen::Quaterniond::Identity(), Vector3<double>::Zero()), force_scale);
  ServoLoop<Puppet<double>, Force, double> servo(Puppet<double>(strings), std::move(force), options);
  LocalModel<double> model;
  model.phase = CuttingPhase::indenting;
  model.surface.sequence = 1;
  model.surface.patch.stiffness = 400.0;
  int told = 0;
  for (int session = 0; session < 2; ++session) {
    servo.begin_session(1000.0);
    ++model.surface.sequence;
    for (int k = 0; k < 10; ++k) {
      strings.next.position = {0, 0, k < 5 ? 1e-3 : -1e-4};
      servo.read(1e-3);
      servo.respond(model, 1e-3 * k);
    }
    while (auto const event = servo.events().pop())
      if (event->what == SafetyEvent::stiffness_clamped) ++told;
  }
  return {strings.felt.force.z() / 1e-4, told};
}

}  // namespace

TEST_CASE("C10-M6: in an enlarged scene a force renders no more than the device stands, and says so once a session", "[simulator][servo_loop]") {
  Strings<double> strings;
  strings.capabilities = {.max_force = 1e3, .rate = 1000.0, .moves_a_hand = false, .max_stiffness = 500.0};
  ProxyForce<double> const plane({.surface = SurfaceKind::plane, .max_stiffness = 800.0, .handover = 1}), soft({.surface = SurfaceKind::plane, .max_stiffness = 400.0, .handover = 1});
  auto const is = [](std::pair<double, int> const& found, double stiffness, int told) {
    CHECK(found.first == Approx(stiffness).epsilon(1e-9));
    CHECK(found.second == told);
  };
  is(felt(strings, 1.0, 1.0, soft), 400.0, 0);
  is(felt(strings, 1.0, 1.0, plane), 400.0, 2);   // told, since it might render 800
  is(felt(strings, 10.0, 10.0, soft), 500.0, 2);   // 40,000 otherwise
  is(felt(strings, 10.0, 0.1, soft), 400.0, 0);    // κ s = 1
  is(felt(strings, 10.0, 10.0, PressThenCut(soft)), 500.0, 2);
  is(felt(strings, 10.0, 10.0, Overlaid(soft, Silent{})), 500.0, 2);
  is(felt(strings, 10.0, 10.0, soft, {.max_stiffness = 300.0}), 300.0, 2);
  is(felt(strings, 10.0, 10.0, soft, {.max_stiffness = std::numeric_limits<double>::infinity()}), 40000.0, 0);
  strings.capabilities.max_stiffness = {};
  is(felt(strings, 10.0, 10.0, soft), 40000.0, 0);   // nobody knows what the device stands
  strings.capabilities.damping = guessed(0.1);
  is(felt(strings, 10.0, 10.0, soft), 40000.0, 0);
  strings.capabilities.damping = datasheet(0.1);
  is(felt(strings, 10.0, 10.0, soft), 200.0, 2);   // 2 b/T
  CHECK_THROWS_AS(felt(strings, 1.0, 1.0, soft, {.max_stiffness = 0.0}), InvalidArgument);
}
