// SPDX-License-Identifier: MIT
// The two-thread runner. Yardsticks: the script, sample by sample, and what must hold at any pace. Nothing here depends on how fast the
// machine is: the hands wait for the body (`Patient`). Run it under the thread sanitizer (preset `tsan`) to see that the threads share
// nothing but what they hand over.
#include "catch.hpp"

#include "device/message.hpp"
#include "simulator/scene.hpp"

#include <palpate/cutting/no_cutter.hpp>
#include <palpate/cutting/progressive_cutter.hpp>
#include <palpate/device/scripted_device.hpp>
#include <palpate/force/cutting_force.hpp>
#include <palpate/force/liver.hpp>
#include <palpate/force/noise.hpp>
#include <palpate/force/tissue_reaction.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/region/zone_of_influence.hpp>
#include <palpate/simulator/simulator.hpp>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>

using namespace palpate;
using palpate_test::message_of;
using palpate_test::skin;
using palpate_test::stroke;

namespace {

/// A cutter that counts its ticks for another thread.
template <class Cutter>
struct Counted : Cutter {
  Counted(Cutter cutter, std::atomic<long>& count) : Cutter(std::move(cutter)), ticks(&count) {}

  template <class Body, class... More>
    requires requires(Cutter& cutter, Body& body, typename Body::Vector const& tip, More... more) { cutter.advance(body, tip, more...); }
  void advance(Body& body, typename Body::Vector const& tip, More... more) {
    Cutter::advance(body, tip, more...);
    ++*ticks;
  }

  std::atomic<long>* ticks;
};

/// A hand that waits for the body: never more than ten samples for each of its ticks. Gives up after 20 s, so that a body that hangs
/// fails the test and does not stop it.
template <class Device, class S = double>
struct Patient : Device {
  Patient(Device device, std::atomic<long>& count) : Device(std::move(device)), ticks(&count) {}

  DeviceStatus read(DeviceState<S>& state) noexcept {
    for (; reads >= 10 * (ticks->load() + 1) && waits < 20000; ++waits) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    ++reads;
    return Device::read(state);
  }

  std::atomic<long>* ticks;
  long reads = 0, waits = 0;
};

/// Runs a renderer on its own thread for as long as it lives and checks what it is given.
template <class S>
class Renderer {
 public:
  explicit Renderer(SnapshotChannel<S>& channel) : thread_([this, &channel] { draw(channel); }) {}
  ~Renderer() { stop(); }

  void stop() {
    done_.store(true);
    if (thread_.joinable()) thread_.join();
  }
  long seen() const { return seen_; }       // after stop()
  long broken() const { return broken_; }
  std::size_t revision() const { return revision_; }

 private:
  void draw(SnapshotChannel<S>& channel) {
    double time = -1.0;
    for (bool last = false; !last;) {
      last = done_.load();
      if (!channel.fetch()) {
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
        continue;
      }
      BodySnapshot<S> const& shot = channel.latest();
      bool const whole = shot.points.cols() >= 441 && shot.triangles.cols() >= 800 && shot.triangles.minCoeff() >= 0 &&
                         shot.triangles.maxCoeff() + 1 == shot.points.cols() && shot.points.allFinite() && shot.tip.allFinite() &&
                         shot.topology_revision >= revision_ && shot.time >= time;
      if (!whole) ++broken_;
      ++seen_;
      revision_ = shot.topology_revision;
      time = shot.time;
    }
  }

  std::atomic<bool> done_{false};
  long seen_ = 0, broken_ = 0;
  std::size_t revision_ = 0;
  std::thread thread_;
};

}  // namespace

TEMPLATE_TEST_CASE("a stroke on two threads", "[simulator][realtime][threads]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  double const cap = 0.8;
  auto const script = stroke<S>(0.010, 0.4);
  std::atomic<long> ticks{0};
  Simulator simulator(Patient<ScriptedDevice<S>, S>(ScriptedDevice<S>(script, {.max_force = cap}), ticks), skin<S>(ZoneOfInfluence{.rings = 4}),
                      Counted(ProgressiveCutter<S>({.puncture_depth = S(0.006), .snap = S(5e-4)}), ticks),
                      CuttingForce(liver_hysteresis<S>(), WhiteGaussianNoise<S>({.snr_db = 30.0, .seed = 7})), {.most_body_steps = 200});
  Renderer<S> renderer(simulator.snapshots());
  Recording const recording = simulator.run_realtime(1.5);
  renderer.stop();

  REQUIRE(recording.ticks().size() == 1500);
  CHECK(recording.dropped() == 0);
  CHECK(simulator.time() == Approx(1.5));
  int changes = 0, wrong = 0;
  CuttingPhase phase = CuttingPhase::no_contact;
  for (std::size_t i = 0; i < recording.ticks().size(); ++i) {
    Tick const& tick = recording.ticks()[i];
    if (tick.phase != phase) ++changes;
    phase = tick.phase;
    bool const good = std::abs(tick.time - 1e-3 * double(i)) < 1e-9 && tick.force.allFinite() &&
                      tick.tip == Vector3<double>(script.at(double(i) / 1000.0).position.template cast<double>()) &&
                      tick.force.norm() <= cap * (1 + 1e-6) && tick.depth >= 0 && tick.depth < 0.011 &&
                      (tick.phase != CuttingPhase::no_contact || (tick.force.isZero(0.0) && tick.depth == 0.0));
    if (!good) ++wrong;
  }
  CHECK(wrong == 0);
  CHECK(changes == 3);   // indenting, moving, and out
  CHECK(phase == CuttingPhase::no_contact);
  CHECK(recording.largest_force() > 0.1);
  CHECK(simulator.cutter().report().particles_added > 0);
  CHECK(simulator.body().positions().allFinite());

  SimulatorStatistics const statistics = simulator.statistics();
  CHECK(statistics.servo.ticks() == 1500);
  CHECK(statistics.servo.period().count() == 1499);
  CHECK(statistics.servo.target() == std::chrono::milliseconds(1));
  CHECK(statistics.servo_counts.ticks == 1500);
  CHECK(statistics.body.ticks() > 0);
  CHECK(statistics.body.target() == std::chrono::milliseconds(2));
  CHECK(statistics.body_counts.ticks >= statistics.body.ticks());
  CHECK(statistics.body_counts.diverged == 0);
  CHECK(renderer.seen() > 0);
  CHECK(renderer.broken() == 0);
  CHECK(renderer.revision() == simulator.body().topology_revision());   // the last one is drawn
}

namespace {

/// Takes its time to give the first sample of a session, so that the body's thread ticks before it knows of a tool.
struct Sleepy : ScriptedDevice<double> {
  using ScriptedDevice<double>::ScriptedDevice;
  bool asleep = false;

  DeviceStatus read(DeviceState<double>& state) noexcept {
    if (std::exchange(asleep, false)) std::this_thread::sleep_for(std::chrono::milliseconds(80));
    return ScriptedDevice<double>::read(state);
  }
};

}  // namespace

TEST_CASE("real time and lock-step go on from each other", "[simulator][realtime][threads]") {
  std::atomic<long> ticks{0};
  Simulator simulator(Patient(Sleepy(stroke<double>(0.004, 0.2)), ticks), skin<double>(ZoneOfInfluence{.rings = 3}),
                      Counted(NoCutter<double>{}, ticks), CuttingForce());
  Renderer<double> renderer(simulator.snapshots());
  CHECK(simulator.run(0.1).ticks().size() == 100);
  simulator.device().asleep = true;
  Recording const middle = simulator.run_realtime(0.2);
  REQUIRE(middle.ticks().size() == 200);
  CHECK(middle.ticks().front().time == Approx(0.1));
  CHECK(middle.ticks().back().phase == CuttingPhase::indenting);
  Recording const last = simulator.run(0.1);
  CHECK(last.ticks().front().time == Approx(0.3));
  CHECK(last.ticks().front().phase == CuttingPhase::indenting);
  CHECK(simulator.statistics().servo_counts.ticks == 400);
  CHECK(simulator.run_realtime(0.0).ticks().empty());
  renderer.stop();
  CHECK(renderer.seen() > 0);
  CHECK(renderer.broken() == 0);   // time never goes back
}

namespace {

/// Goes down by itself and keeps what it was told last; the test looks after the run.
struct Falling {
  std::string* log;
  double* last;
  double z = 0.002;

  Capabilities capabilities() const noexcept { return {.max_force = 3.3, .rate = 1000.0}; }
  DeviceStatus read(DeviceState<double>& state) noexcept {
    z = std::max(-0.008, z - 1e-5);
    state.position = {0.05, 0.0533, z};
    return DeviceStatus::ok;
  }
  DeviceStatus write(Wrench<double> const& wrench) noexcept {
    *last = wrench.force.norm();
    return DeviceStatus::ok;
  }
  void open() { *log += "open "; }
  void close() noexcept { *log += "close"; }
};

/// A cutter that throws once it is deep enough.
struct Brittle : NoCutter<double> {
  Brittle() : NoCutter<double>(0.0) {}
  template <class Body>
  void advance(Body& body, Vector3<double> const& tip) {
    NoCutter<double>::advance(body, tip);
    if (tip.z() < -0.002) throw std::runtime_error("the blade broke");
  }
};

}  // namespace

TEST_CASE("an exception in the body's thread ends the run with a force of zero and comes out", "[simulator][realtime][threads]") {
  std::string log;
  double last = -1.0;
  Simulator simulator(Falling{&log, &last}, skin<double>(ZoneOfInfluence{.rings = 3}), Brittle{}, CuttingForce());
  CHECK(message_of([&] { simulator.run_realtime(30.0); }) == "the blade broke");
  CHECK(last == 0.0);
  CHECK(log == "open close");
  CHECK(simulator.time() < 30.0);   // it counts the ticks that were
  CHECK(simulator.time() == Approx(1e-3 * double(simulator.statistics().servo_counts.ticks)));
}

namespace {

/// Works for a while, then is gone.
struct Unplugged {
  double* last;
  long reads = 0;

  Capabilities capabilities() const noexcept { return {.max_force = 3.3, .rate = 1000.0}; }
  DeviceStatus read(DeviceState<double>& state) noexcept {
    if (++reads > 200) return DeviceStatus::disconnected;
    state.position = {0.05, 0.0533, 0.002 - 4e-5 * double(reads)};
    return DeviceStatus::ok;
  }
  DeviceStatus write(Wrench<double> const& wrench) noexcept {
    *last = wrench.force.norm();
    return DeviceStatus::ok;
  }
};

}  // namespace

TEST_CASE("a device that is lost leaves no force, and the tool stays where it was", "[simulator][realtime][threads]") {
  double last = -1.0;
  std::atomic<long> ticks{0};
  Simulator simulator(Patient(Unplugged{&last}, ticks), skin<double>(ZoneOfInfluence{.rings = 3}), Counted(NoCutter<double>{}, ticks),
                      CuttingForce(TissueReaction{}));
  Recording const recording = simulator.run_realtime(0.3);
  REQUIRE(recording.ticks().size() == 300);
  CHECK(last == 0.0);
  CHECK(recording.ticks()[199].force.z() > 0.0);
  for (std::size_t i = 200; i < 300; ++i) {
    CHECK(recording.ticks()[i].force.isZero(0.0));
    CHECK(recording.ticks()[i].tip == recording.ticks()[199].tip);
  }
  CHECK(simulator.statistics().servo_counts.unread == 100);
  CHECK(simulator.statistics().servo_counts.faulted == 100);
}

namespace {

/// Says where it is and no more. Stands still, holds the servo up for 20 ms, and is then 1 mm further.
struct Halting {
  long reads = 0;

  Capabilities capabilities() const noexcept { return {.max_force = 3.3, .rate = 1000.0}; }
  DeviceStatus read(DeviceState<double>& state) noexcept {
    if (++reads == 20) std::this_thread::sleep_for(std::chrono::milliseconds(20));
    state.position = {0.05, 0.0533, reads <= 20 ? 0.003 : 0.002};
    return DeviceStatus::ok;
  }
  DeviceStatus write(Wrench<double> const&) noexcept { return DeviceStatus::ok; }
};

/// No force; keeps the highest speed it was told of.
struct Speedometer {
  double* highest;
  Vector3<double> operator()(ToolContact<double> const& contact) noexcept {
    *highest = std::max(*highest, contact.velocity.norm());
    return Vector3<double>::Zero();
  }
};

}  // namespace

TEST_CASE("a velocity counts the ticks that were skipped", "[simulator][realtime][threads]") {
  double highest = 0.0;
  Simulator simulator(Halting{}, skin<double>(ZoneOfInfluence{.rings = 3}), NoCutter<double>{}, Speedometer{&highest});
  CHECK(simulator.run_realtime(0.05).ticks().size() == 50);
  CHECK(simulator.statistics().servo.skipped() >= 19);
  CHECK(highest > 0.0);
  CHECK(highest <= 0.001 / 0.020 * (1 + 1e-9));   // 1 mm in at least 20 ms, not in the 1 ms of a tick
}

TEST_CASE("a device faster than any clock is refused before a thread starts", "[simulator][realtime]") {
  Simulator simulator(ScriptedDevice<double>(stroke<double>(), {.rate = 2e6}), skin<double>(WholeBody{}), NoCutter<double>{}, NoForce{});
  CHECK(palpate_test::unsaid(message_of([&] { simulator.run_realtime(0.1); }), "2000000 Hz") == "");
}
