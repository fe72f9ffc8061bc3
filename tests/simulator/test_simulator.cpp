// SPDX-License-Identifier: MIT
// Yardsticks: a flat sheet, whose depth is −z of the tip; the order in which a device is used; equal bytes; the statics of a sheet by
// Newton's method on springs of its own (tests/haptics/sheet.hpp).
#include "catch.hpp"

#include "allocation_trap.hpp"
#include "device/message.hpp"
#include "haptics/sheet.hpp"
#include "simulator/puppet.hpp"
#include "simulator/scene.hpp"

#include <palpate/cutting/no_cutter.hpp>
#include <palpate/cutting/progressive_cutter.hpp>
#include <palpate/cutting/separating_cutter.hpp>
#include <palpate/device/scripted_device.hpp>
#include <palpate/force/cutting_force.hpp>
#include <palpate/force/liver.hpp>
#include <palpate/force/noise.hpp>
#include <palpate/force/organ_force.hpp>
#include <palpate/force/tissue_reaction.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/mesh/validation.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/region/zone_of_influence.hpp>
#include <palpate/simulator/budget.hpp>
#include <palpate/simulator/simulator.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

using namespace palpate;
using palpate_test::message_of;
using palpate_test::skin;
using palpate_test::stroke;
using palpate_test::unsaid;

namespace {

template <class S>
auto published_force() {
  return CuttingForce(liver_hysteresis<S>(), OrganForce<S>{.coefficient = S(1)}, WhiteGaussianNoise<S>({.snr_db = 30.0, .seed = 7}));
}

/// Golden program 05 with a shorter stroke.
template <class S, class D = S>
auto session(double share = 0.25, ScriptedDeviceOptions const& options = {}) {
  return Simulator(ScriptedDevice<D>(stroke<D>(0.010, share), options), skin<S>(ZoneOfInfluence{.rings = 4}),
                   ProgressiveCutter<S>({.puncture_depth = S(0.006), .snap = S(5e-4)}), published_force<S>());
}

}  // namespace

TEMPLATE_TEST_CASE("the same run gives the same bytes", "[simulator]", PALPATE_TEST_SCALARS) {
  auto first = session<TestType>(), second = session<TestType>();
  std::string const text = first.run(0.9).to_csv();
  CHECK(text == second.run(0.9).to_csv());
  CHECK(first.cutter().report().particles_added > 0);
  CHECK(std::count(text.begin(), text.end(), '\n') == 901);
}

TEST_CASE("a run that is continued gives the bytes of one run", "[simulator]") {
  auto whole = session<double>(), parts = session<double>();
  std::string const expected = whole.run(0.9).to_csv();
  std::string text = parts.run(0.3).to_csv();
  for (double const seconds : {0.001, 0.0, 0.299, 0.3}) {
    std::string const more = parts.run(seconds).to_csv();
    text += more.substr(more.find('\n') + 1);
  }
  CHECK(text == expected);
  CHECK(parts.time() == Approx(0.9));
  CHECK(parts.time() == whole.time());
}

TEST_CASE("a run without time is an empty recording, and one that makes no sense is refused", "[simulator]") {
  auto simulator = session<double>();
  CHECK(simulator.run(0.0).ticks().empty());
  CHECK(simulator.time() == 0.0);
  CHECK(unsaid(message_of([&] { simulator.run(-1.0); }), "-1 s", "negative") == "");
  CHECK(unsaid(message_of([&] { simulator.run(std::numeric_limits<double>::quiet_NaN()); }), "run of") == "");
  CHECK(unsaid(message_of([&] { simulator.run(1e12); }), "100000000 ticks and more") == "");
  CHECK(unsaid(message_of([&] { simulator.run_realtime(-1.0); }), "-1 s") == "");
  CHECK(simulator.run(0.01).ticks().size() == 10);   // nothing of this did harm

  auto const with = [](SimulatorOptions const& options) {
    return message_of([&] { Simulator(ScriptedDevice<double>(stroke<double>()), skin<double>(WholeBody{}), NoCutter<double>{}, NoForce{}, options); });
  };
  CHECK(unsaid(with({.max_body_steps = 0}), "max_body_steps is 0") == "");
  CHECK(unsaid(with({.body_rate = 0.0}), "0 Hz") == "");
  CHECK(unsaid(with({.snapshot_rate = -5.0}), "-5 Hz") == "");
  CHECK(unsaid(with({.coupling = {.stiffness = -1.0}}), "contact stiffness", "-1 N/m") == "");
  CHECK(with({}) == "(no exception)");
}

// Hooke's law for a sheet that does not give way: a ball of radius r, its centre c above the sheet, is r − c deep and pushed out with k (r − c).
TEMPLATE_TEST_CASE("a ball is as deep as it reaches below the sheet, whichever cutter holds it, and is felt as that", "[simulator]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto const check = [](auto const& cutter) {
    MassSpring<S> sheet(make_grid<S>(11, 11, S(0.005)), {.mass = {.total = S(0.1)}, .link = {.stiffness = 80}});
    for (int i = 0; i < sheet.size(); ++i) sheet.nail(i);
    auto path = Trajectory<S>::start({S(0.0262), S(0.0233), S(0.006)});
    path.line({S(0.0262), S(0.0233), S(0.001)}, 0.1).hold(0.1);
    Simulator simulator(ScriptedDevice<S>(path), SoftBody(std::move(sheet)), cutter, TissueReaction{}, {.coupling = {.stiffness = 100.0, .damping = 0.0}});
    Recording const recording = simulator.run(0.2);
    Tick const& last = recording.ticks().back();
    CHECK(simulator.cutter().contact().depth == Approx(0.003));
    CHECK(last.phase == CuttingPhase::indenting);
    CHECK(last.depth == Approx(0.003));
    CHECK(last.force.z() == Approx(0.3));
    CHECK(last.force.template head<2>().norm() < 1e-6);
    CHECK(recording.ticks()[39].depth == 0.0);   // the centre 4.05 mm above it
    CHECK(recording.ticks()[41].depth == Approx(5e-5).epsilon(0.01));
  };
  check(NoCutter<S>({.tip_radius = S(0.004)}));
  check(ProgressiveCutter<S>({.puncture_depth = S(0.02), .tip_radius = S(0.004)}));
  check(SeparatingCutter<S>({.puncture_depth = S(0.02), .tip_radius = S(0.004)}));
}

TEMPLATE_TEST_CASE("depth on a flat sheet is how far the tip is below it, and phases follow one another", "[simulator]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto simulator = session<S>(1.0, {.max_force = 100.0});
  Recording const recording = simulator.run(3.6);
  REQUIRE(recording.ticks().size() == 3600);
  double const close = std::is_same_v<S, float> ? 1e-7 : 1e-12;
  // Contact from the first tick at or below the sheet, puncture at the first tick 6 mm deep, free again above the sheet.
  double off = 0.0, aside = 0.0, pulls = 0.0;
  int wrong_phase = 0, touched_too_early = 0, changes = 0;
  CuttingPhase phase = CuttingPhase::no_contact;
  for (Tick const& tick : recording.ticks()) {
    double const below = -tick.tip.z();
    if (tick.phase != phase) ++changes;
    phase = tick.phase;
    if (std::abs(below) < 1e-6 || std::abs(below - 0.006) < 1e-6) continue;
    off = std::max(off, std::abs(tick.depth - std::max(0.0, below)));
    bool const free = tick.time < 0.5 ? below < 0 : tick.time > 3.2 && below < 0;
    bool const before_puncture = tick.time < 1.0 && below < 0.006;
    CuttingPhase const expected = free ? CuttingPhase::no_contact : before_puncture ? CuttingPhase::indenting : CuttingPhase::moving;
    if (tick.phase != expected) ++wrong_phase;
    if (free && !tick.force.isZero(0.0)) ++touched_too_early;
    if (tick.phase == CuttingPhase::indenting) {   // along the normal of the flat sheet, outwards
      aside = std::max(aside, tick.force.head<2>().norm());
      pulls = std::min(pulls, tick.force.z());
      CHECK(tick.force.z() == Approx(3.0 / 0.018 * below).epsilon(1e-4));   // the default spring: 3 N at 18 mm
    }
  }
  CHECK(off < close);
  CHECK(wrong_phase == 0);
  CHECK(touched_too_early == 0);
  CHECK(changes == 3);
  CHECK(aside == 0.0);
  CHECK(pulls == 0.0);
  CHECK(simulator.statistics().body_counts.diverged == 0);
}

TEST_CASE("the touched particle follows the tip by more than half the depth before the puncture", "[simulator]") {
  auto simulator = session<double>(1.0);
  double least = 1.0, at_puncture = 0.0;
  simulator.run(1.0, [&](Tick const& tick) {
    if (tick.phase != CuttingPhase::indenting || tick.depth < 1e-4) return;
    auto& body = simulator.body();
    int const touched = body.nearest_vertex(tick.tip);
    double const share = -body.displacement(touched).z() / tick.depth;
    least = std::min(least, share);
    at_puncture = share;
  });
  CHECK(simulator.cutter().state() == CuttingPhase::moving);
  CHECK(at_puncture > 0.5);
  CHECK(least > 0.3);   // the tip is not on the particle, and just after the touch the particle has not got going
}

TEST_CASE("forces are limited to what the device renders", "[simulator]") {
  auto free = session<double>(0.25, {.max_force = 100.0}), weak = session<double>(0.25, {.max_force = 0.4});
  Recording const all = free.run(0.9), cut_off = weak.run(0.9);
  REQUIRE(all.largest_force() > 0.9);
  CHECK(cut_off.largest_force() == Approx(0.4).epsilon(1e-12));
  std::uint64_t limited = 0;
  double worst = 0.0;
  for (std::size_t i = 0; i < all.ticks().size(); ++i) {
    Vector3<double> const wanted = all.ticks()[i].force;
    Vector3<double> const expected = wanted.norm() > 0.4 ? Vector3<double>(0.4 * wanted / wanted.norm()) : wanted;
    if (wanted.norm() > 0.4) ++limited;
    worst = std::max(worst, (cut_off.ticks()[i].force - expected).norm());
  }
  CHECK(worst < 1e-15);
  CHECK(weak.statistics().servo_counts.safety.limited == limited);
  CHECK(free.statistics().servo_counts.safety.limited == 0);
}

namespace {

/// Gives something else than a number while the depth is in a certain range.
struct Sick {
  Vector3<double> operator()(ToolContact<double> const& contact) noexcept {
    double const bad = contact.depth > 0.002 && contact.depth < 0.003 ? std::numeric_limits<double>::quiet_NaN() : 0.0;
    return Vector3<double>(0.0, bad, contact.depth);
  }
};

}  // namespace

TEST_CASE("a force model that fails is silent for those ticks and no longer", "[simulator]") {
  Simulator simulator(ScriptedDevice<double>(stroke<double>(0.005, 0.2)), skin<double>(ZoneOfInfluence{.rings = 3}), NoCutter<double>{}, Sick{});
  Recording const recording = simulator.run(0.2);
  std::uint64_t silent = 0;
  for (Tick const& tick : recording.ticks()) {
    bool const sick = tick.depth > 0.002 && tick.depth < 0.003;
    CHECK(tick.force.z() == (sick ? 0.0 : tick.depth));
    silent += sick ? 1 : 0;
  }
  CHECK(silent > 10);
  CHECK(simulator.statistics().servo_counts.safety.not_finite == silent);
}

TEST_CASE("a device without a pose moves no tool, and its loss ends the force", "[simulator]") {
  palpate_test::Strings<double> strings;
  strings.next.position = {std::numeric_limits<double>::quiet_NaN(), 0, 0};
  Simulator simulator(palpate_test::Puppet<double>(strings), skin<double>(ZoneOfInfluence{.rings = 3}), NoCutter<double>{}, CuttingForce());
  Recording recording = simulator.run(0.05);
  CHECK(recording.largest_force() == 0.0);
  CHECK(simulator.statistics().servo_counts.unread == 50);
  CHECK(simulator.cutter().state() == CuttingPhase::no_contact);

  strings.next.position = {0.05, 0.05, 0.01};
  simulator.run(0.01);
  strings.next.position.z() = -0.006;
  recording = simulator.run(0.02);
  CHECK(recording.ticks().back().force.z() == Approx(1.0));
  strings.reads = DeviceStatus::disconnected;
  recording = simulator.run(0.01, [&](Tick const&) { strings.reads = DeviceStatus::ok; });   // gone for one tick
  CHECK(recording.largest_force() == 0.0);
  CHECK(simulator.statistics().servo_counts.faulted == 10);
  recording = simulator.run(0.01);   // opened again
  CHECK(recording.ticks().back().force.z() == Approx(1.0));
}

namespace {

/// Writes down what is done to it.
struct Diary {
  std::string* log;
  double z = 0.005;

  Capabilities capabilities() const noexcept { return {.max_force = 3.3, .rate = 1000.0, .moves_a_hand = false}; }
  DeviceStatus read(DeviceState<double>& state) noexcept {
    z -= 0.001;
    state.position = {0.05, 0.05, z};
    return DeviceStatus::ok;
  }
  DeviceStatus write(Wrench<double> const& wrench) noexcept {
    *log += wrench.force.isZero(0.0) ? '0' : 'F';
    return DeviceStatus::ok;
  }
  void open() { *log += "open "; }
  void close() noexcept { *log += " close"; }
  void arm() { *log += "arm "; }
  void disarm() noexcept { *log += " disarm"; }
};
static_assert(HapticDevice<Diary> && OpensAndCloses<Diary> && Armable<Diary>);

/// A device that turns the tool by 40 degrees about z, and says so or not.
struct Turning {
  bool reports;
  Capabilities capabilities() const { return {.max_force = 3.3, .rate = 1000.0, .reports_orientation = reports, .moves_a_hand = false}; }
  DeviceStatus read(DeviceState<double>& state) noexcept {
    state.position = {0.05, 0.05, 0.01};
    if (reports) state.orientation = Eigen::AngleAxis<double>(40.0 / 180.0 * 3.14159265358979323846, Vector3<double>::UnitZ());
    return DeviceStatus::ok;
  }
  DeviceStatus write(Wrench<double> const&) noexcept { return DeviceStatus::ok; }
};

/// A blunt tool that remembers its pose.
struct Posed : NoCutter<double> {
  template <class Body>
  void advance(Body& body, ToolPose<double> const& tool) {
    pose = tool;
    NoCutter<double>::advance(body, tool);
  }
  ToolPose<double> pose{};
};

/// A cutter that gives up at a certain depth.
struct Brittle : NoCutter<double> {
  template <class Body>
  void advance(Body& body, ToolPose<double> const& tool) {
    NoCutter<double>::advance(body, tool);
    if (tool.position.z() < -0.0035) throw std::runtime_error("the blade broke");
  }
};

}  // namespace

/// Comes down on the skin by 10 mm/s, from 1 mm above it.
struct Descent {
  bool moves_a_hand;
  double max_force = 3.3;   // N
  long ticks = 0;

  Capabilities capabilities() const noexcept { return {.max_force = max_force, .rate = 1000.0, .moves_a_hand = moves_a_hand}; }
  DeviceStatus read(DeviceState<double>& state) noexcept {
    state.position = {0.0512, 0.0533, 0.001 - 1e-5 * static_cast<double>(ticks++)};
    return DeviceStatus::ok;
  }
  DeviceStatus write(Wrench<double> const&) noexcept { return DeviceStatus::ok; }
};

// Yardstick: Hooke's law at the depth of each tick, 3 N / 18 mm: 1 N is met at 6 mm, and 12 mm are 2 N.
TEST_CASE("a limit that cut off the force is told by statistics, text and recording", "[simulator]") {
  auto const pressed = [](Descent const& device) {
    Simulator simulator(device, skin<double>(ZoneOfInfluence{.rings = 3}), NoCutter<double>{}, CuttingForce());
    Recording recording = simulator.run(1.301);   // the last tick is 12 mm deep
    auto const statistics = simulator.statistics();
    CHECK(statistics.servo_counts.saturation.ticks == recording.saturation().ticks);
    std::string const text = to_text(recording.saturation());
    CHECK(unsaid(budget_text(statistics), text) == "");
    return std::pair(std::move(recording), text);
  };
  SECTION("a device that may move a hand has 1 N of its 3.3 N") {
    auto const [recording, text] = pressed({.moves_a_hand = true});
    CHECK(recording.largest_force() == Approx(1.0));
    CHECK(recording.saturation().max_force == 1.0);
    CHECK(recording.saturation().device_max_force == 3.3);
    CHECK(recording.saturation().protects_a_hand);
    CHECK(recording.saturation().ticks == Approx(600).margin(2));   // of the last 6 mm
    CHECK(recording.saturation().max_wanted == Approx(2.0).epsilon(0.01));
    CHECK(unsaid(text, "1 N is written of the 3.3 N that the device can", std::to_string(recording.saturation().ticks) + " ticks wanted more, up to 2 N",
                 "SafetyOptions::max_force", "moves_a_hand = false") == "");
  }
  SECTION("with a smaller maximum of its own it says so") {
    auto const [recording, text] = pressed({.moves_a_hand = false, .max_force = 1.5});
    CHECK(recording.largest_force() == Approx(1.5));
    CHECK(recording.saturation().ticks == Approx(300).margin(2));
    CHECK(unsaid(text, "at most 1.5 N", "Capabilities::max_force") == "");
  }
  SECTION("one that nobody holds has all, and there is nothing to say") {
    auto const [recording, text] = pressed({.moves_a_hand = false});
    CHECK(recording.largest_force() == Approx(2.0).epsilon(0.01));
    CHECK(recording.saturation().ticks == 0);
    CHECK(text.empty());
  }
}

TEST_CASE("a limit that no force met is told too", "[simulator]") {
  Simulator simulator(Descent{.moves_a_hand = true}, skin<double>(ZoneOfInfluence{.rings = 3}), NoCutter<double>{}, CuttingForce());
  CHECK(to_text(simulator.run(0.3).saturation()) ==
        "force: at most 1 N is written of the 3.3 N that the device can; no more was wanted; a hand is protected: raise SafetyOptions::max_force, "
        "or say moves_a_hand = false in the device's Capabilities if nobody holds it\n");
  simulator.run(1.0);
  CHECK(simulator.run(0.001).saturation().ticks == 1);   // of its own session alone
}

// By hand: turns about one axis add up.
TEST_CASE("the cutter is told how the tool is turned in the scene", "[simulator]") {
  double const degree = 3.14159265358979323846 / 180.0;
  WorkspaceMapping<double> const turned(Similarity<double>::make(1.0, Eigen::Quaternion<double>(Eigen::AngleAxis<double>(30 * degree, Vector3<double>::UnitZ())), {0, 0, 0}));
  for (bool const real_time : {false, true})
    for (bool const reports : {false, true}) {
      Simulator simulator(Turning{reports}, skin<double>(ZoneOfInfluence{.rings = 1}), Posed{}, NoForce{}, {.servo = {.mapping = turned}});
      real_time ? simulator.run_realtime(0.05) : simulator.run(0.01);
      Vector3<double> const x = simulator.cutter().pose.orientation * Vector3<double>::UnitX();
      CHECK(std::atan2(x.y(), x.x()) / degree == Approx(reports ? 70.0 : 0.0));
      CHECK(simulator.cutter().pose.position.head<2>().norm() == Approx(0.05 * std::sqrt(2.0)));
    }
}

TEST_CASE("a session opens, arms, plays, lets go, disarms and closes", "[simulator]") {
  std::string log;
  Simulator simulator(Diary{&log}, skin<double>(ZoneOfInfluence{.rings = 3}), NoCutter<double>{}, CuttingForce());
  simulator.run(0.008);
  CHECK(log == "open arm 00000FFF0 disarm close");   // ticks at 4, 3, 2, 1, 0 mm above and 1, 2, 3 mm below, then the last zero
  log.clear();
  simulator.run(0.002);
  CHECK(log == "open arm FF0 disarm close");
}

TEST_CASE("an exception on the way ends with a force of zero and a closed device", "[simulator]") {
  std::string log;
  Simulator simulator(Diary{&log}, skin<double>(ZoneOfInfluence{.rings = 3}), Brittle{}, CuttingForce());
  CHECK(message_of([&] { simulator.run(1.0); }) == "the blade broke");
  CHECK(log == "open arm 00000FFF0 disarm close");
  log.clear();
  simulator.device().z = 0.006;
  CHECK(message_of([&] { simulator.run(0.1, [](Tick const& tick) {
          if (tick.tip.z() < 0.0025) throw std::runtime_error("enough");
        }); }) == "enough");
  CHECK(log == "open arm 00000 disarm close");   // at 5, 4, 3, 2 mm, then the last zero
}

TEST_CASE("tight coupling settles at the force that Newton's method finds", "[simulator]") {
  palpate_test::Sheet const sheet;
  for (Vector3<double> const& at : {Vector3<double>(0.02, 0.02, 0), Vector3<double>(0.0213, 0.0171, 0)}) {
    double const depth = 0.005;
    auto path = Trajectory<double>::start(at + Vector3<double>(0, 0, 0.001));
    path.line(at - Vector3<double>(0, 0, depth), 0.5, Pace::minimum_jerk);
    Simulator simulator(ScriptedDevice<double>(path, {.max_force = 10.0}), SoftBody(sheet.tissue(), LeapfrogVerlet{}, WholeBody{}),
                        NoCutter<double>{}, TissueReaction{}, {.coupling = {.stiffness = 1500, .damping = 1}});
    Recording const recording = simulator.run(6.0);
    SurfaceContact<double> const contact = simulator.cutter().contact();
    auto const rest = sheet.equilibrium(simulator.body().tissue().surface().corners(contact.triangle), contact.barycentric, -depth, 1500);
    CHECK(rest.force > 0.05);
    CHECK(recording.ticks().back().force.norm() == Approx(rest.force).epsilon(1e-6));
    // The point that Newton's method pressed on comes to lie below the tip, so it is the right one.
    CHECK((rest.touched.head<2>() - at.head<2>()).norm() < 1e-8);
  }
}

TEST_CASE("any scalar of device and body goes together", "[simulator]") {
  std::string const doubles = session<double, double>().run(0.5).to_csv();
  auto mixed = session<double, float>();
  auto narrow = session<float, double>();
  Recording const reference = session<double, double>().run(0.5), a = mixed.run(0.5), b = narrow.run(0.5);
  CHECK(a.largest_force() == Approx(reference.largest_force()).epsilon(0.2));   // noise differs
  CHECK(b.largest_force() == Approx(reference.largest_force()).epsilon(0.2));
  for (Recording const* recording : {&a, &b}) {
    double worst = 0.0;
    for (std::size_t i = 0; i < reference.ticks().size(); ++i)
      worst = std::max(worst, std::abs(recording->ticks()[i].depth - reference.ticks()[i].depth));
    CHECK(worst < 1e-6);
  }
}

// Yardstick: the body of before, to the byte; an even fade, by hand.
TEST_CASE("a cut is undone under the tool: the force fades, the tool touches anew, and the same stroke cuts the same way", "[simulator]") {
  auto simulator = session<double>();
  auto const before = simulator.mark();
  Matrix3X<double> const rest = simulator.body().positions();
  auto const triangles = simulator.body().triangles().eval();
  double const mass = simulator.body().total_mass();
  std::optional<decltype(simulator.mark())> mid_cut;
  int ticks = 0, restored_at = -1;
  auto const undo = [&](Tick const& tick) {
    if (restored_at < 0 && tick.phase == CuttingPhase::moving && ++ticks == 150) {
      REQUIRE(simulator.body().size() > rest.cols());
      mid_cut = simulator.mark();
      simulator.restore(before);
      CHECK(simulator.body().positions() == rest);
      CHECK(simulator.body().triangles() == triangles);
      restored_at = static_cast<int>(std::lround(1000 * tick.time));
    }
  };
  Recording const recording = simulator.run(0.9, undo);
  REQUIRE(restored_at > 0);
  auto const& all = recording.ticks();
  auto const at = static_cast<std::size_t>(restored_at);
  REQUIRE(all[at].force.norm() > 0.005);
  for (std::size_t k = 1; k <= 50; ++k) CHECK((all[at + k].force - (1 - 0.02 * static_cast<double>(k)) * all[at].force).norm() < 1e-12);
  for (std::size_t k = at + 51; k < all.size(); ++k) {
    CHECK(all[k].force.isZero(0));   // the stroke goes on inside, and is lifted
    CHECK(all[k].phase == CuttingPhase::no_contact);
  }
  CHECK(simulator.statistics().servo_counts.faded == 50);
  CHECK(simulator.body().triangles() == triangles);

  REQUIRE(mid_cut);   // the cut as far as it was, its end at the blade: it moves on, and is there again, as often as wanted
  for (int times = 0; times < 2; ++times) {
    simulator.restore(*mid_cut);
    CHECK(simulator.body().size() == mid_cut->tissue.size());
    CHECK(simulator.body().temporary_subdivisions().empty());
    CHECK(simulator.body().total_mass() == Approx(mass));
    for (MeshDefect const& defect : validate(simulator.body().rest_mesh()))
      CHECK((defect.kind == MeshDefectKind::duplicate_vertex || defect.kind == MeshDefectKind::open_border));   // lips, the sheet's border
    simulator.run(0.1);
  }

  auto again = session<double>();   // another simulator, not restored: the same stroke over the same body
  again.run(0.9);
  simulator.restore(before);
  simulator.device() = session<double>().device();
  simulator.cutter() = session<double>().cutter();
  simulator.run(0.9);
  CHECK(simulator.body().triangles() == again.body().triangles());
  CHECK(simulator.body().positions() == again.body().positions());
}

TEST_CASE("snapshots come at their rate and at the end", "[simulator]") {
  Simulator simulator(ScriptedDevice<double>(stroke<double>(0.010, 0.25)), skin<double>(ZoneOfInfluence{.rings = 4}),
                      ProgressiveCutter<double>({.puncture_depth = 0.006}), NoForce{}, {.snapshot_rate = 100.0});
  std::vector<double> times;
  Recording const recording = simulator.run(0.2345 + 0.0004, [&](Tick const&) {
    if (simulator.snapshots().fetch()) times.push_back(simulator.snapshots().latest().time);
  });
  REQUIRE(times.size() == 25);   // 0, 10, … 230 ms, and the last tick
  for (std::size_t i = 0; i < 24; ++i) CHECK(times[i] == Approx(0.01 * double(i)).margin(1e-12));
  CHECK(times.back() == recording.ticks().back().time);
  CHECK(simulator.snapshots().latest().tip == recording.ticks().back().tip);
  CHECK(simulator.body().temporary_subdivisions().size() == 1);   // the blade is inside: shown, one vertex more
  CHECK(simulator.snapshots().latest().points == simulator.body().drawn_mesh().points);
  CHECK(simulator.snapshots().latest().triangles == simulator.body().drawn_mesh().triangles);
}

TEST_CASE("a run that was stopped ends with a snapshot of its last tick", "[simulator]") {
  Simulator simulator(ScriptedDevice<double>(stroke<double>(0.010, 0.25)), skin<double>(ZoneOfInfluence{.rings = 4}), NoCutter<double>{}, NoForce{}, {.snapshot_rate = 100.0});
  int ticks = 0;
  Recording const recording = simulator.run(0.25, [&](Tick const&) {
    if (++ticks == 138) simulator.stop();
  });
  REQUIRE(recording.ticks().size() == 138);
  CHECK(simulator.snapshots().fetch());
  CHECK(simulator.snapshots().latest().time == recording.ticks().back().time);
  CHECK(simulator.snapshots().latest().points == simulator.body().drawn_mesh().points);
}

TEST_CASE("statistics say how many ticks ran and how long they took", "[simulator]") {
  auto simulator = session<double>();
  simulator.run(0.5);
  SimulatorStatistics const statistics = simulator.statistics();
  CHECK(statistics.servo.ticks() == 500);
  CHECK(statistics.body.ticks() == 500);
  CHECK(statistics.servo.target() == std::chrono::milliseconds(1));
  CHECK(statistics.servo_counts.ticks == 500);
  CHECK(statistics.body_counts.ticks == 500);
  CHECK(statistics.body_counts.steps >= 500);
  CHECK(statistics.body.compute().max() >= statistics.body.compute().p50());
  simulator.run(0.25);
  CHECK(simulator.statistics().servo.ticks() == 750);
}

// Yardstick: the stable step of leapfrog that the body itself states, over the tick of run_realtime.
TEST_CASE("a simulator says before its first tick, and after a cut, whether the body will keep up", "[simulator][budget]") {
  auto const sheet = [](double stiffness) {
    MassSpring<double> tissue(make_grid<double>(11, 11, 0.005), {.mass = {.total = 0.1}, .link = {.stiffness = stiffness}});
    tissue.nail(0);
    return Simulator(ScriptedDevice<double>(stroke<double>()), SoftBody(std::move(tissue), LeapfrogVerlet{}, WholeBody{}), NoCutter<double>{}, NoForce{});
  };
  auto soft = sheet(20.0), stiff = sheet(2e9);
  StepForecast const before = soft.forecast();
  CHECK(before.stable_step == Approx(soft.body().stable_step()).epsilon(1e-3));
  CHECK(before.period == 1.0 / SimulatorOptions{}.body_rate);
  CHECK(before.steps == static_cast<int>(std::ceil(before.period / before.stable_step)));
  CHECK(before.step_cost > 0.0);
  CHECK(before.step_cost < 0.1);
  CHECK(stiff.forecast().falls_behind());
  CHECK(stiff.forecast().steps > SimulatorOptions{}.max_body_steps);
  CHECK(stiff.statistics().body_counts.capped == 0);   // nothing has happened yet
  auto same = sheet(20.0);
  std::string const expected = same.run(0.1).to_csv();
  CHECK(soft.run(0.1).to_csv() == expected);   // the forecast changed nothing

  auto cut = session<double>();
  double const whole = cut.forecast().stable_step;
  cut.run(0.9);
  REQUIRE(cut.cutter().report().particles_added > 0);
  CHECK(cut.forecast().stable_step < whole);   // smaller triangles
  CHECK(cut.forecast().stable_step >= cut.body().guaranteed_stable_step());
}

TEMPLATE_TEST_CASE("a lock-step tick of palpation allocates nothing", "[simulator]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  REQUIRE(palpate_test::trap_works());
  auto const run = [](auto region) {
    auto path = Trajectory<S>::start({S(0.0312), S(0.0533), S(0.002)});
    path.tap({S(0.02), 0, S(-0.008)}, 0.5, 2).tap({S(0.02), 0, S(-0.008)}, 0.5, 2);
    Simulator simulator(ScriptedDevice<S>(path), skin<S>(region), NoCutter<S>{},
                        CuttingForce(liver_hysteresis<S>(), TissueReaction{}, WhiteGaussianNoise<S>({.seed = 1})));
    long before = 0, after = 0;
    int tick = 0;
    palpate_test::AllocationCount const allocations;
    Recording const recording = simulator.run(1.0, [&](Tick const&) {
      if (++tick == 400) before = allocations.count();
      after = allocations.count();
    });
    CHECK(recording.largest_force() > 0.5);
    return after - before;
  };
  CHECK(run(WholeBody{}) == 0);
  CHECK(run(ZoneOfInfluence{.rings = 4}) == 0);
}

TEST_CASE("with room reserved, a cut like an earlier one allocates nothing", "[simulator]") {
  REQUIRE(palpate_test::trap_works());
  // The first stroke makes the cutter's own lists as long as a stroke needs; the second one, beside it, finds everything in place.
  auto path = stroke<double>(0.010, 0.5);
  path.line({0.0312, 0.0683, 0.002}, 0.2).line({0.0312, 0.0683, -0.010}, 0.5).line({0.0712, 0.0683, -0.010}, 1.0).line({0.0712, 0.0683, 0.01}, 0.3);
  Simulator simulator(ScriptedDevice<double>(path), skin<double>(ZoneOfInfluence{.rings = 4}),
                      ProgressiveCutter<double>({.puncture_depth = 0.006, .snap = 5e-4}), published_force<double>(),
                      {.snapshot_rate = 0.01});   // the first snapshot alone: a snapshot is a copy of the mesh
  simulator.body().reserve(1000, 2000);
  simulator.run(2.0);
  int const particles = simulator.body().size();
  long before = 0, after = 0;
  palpate_test::AllocationCount const allocations;
  simulator.run(1.98, [&](Tick const& tick) {
    if (tick.time < 2.05) before = allocations.count();
    if (tick.time < 3.97) after = allocations.count();   // the last tick publishes
  });
  CHECK(simulator.cutter().report().particles_added > 20);
  CHECK(simulator.body().size() > particles + 20);
  CHECK(after - before == 0);
}
