// SPDX-License-Identifier: MIT
// The two-thread runner. Yardsticks: the script, sample by sample, and what must hold at any pace. Nothing here depends on how fast the
// machine is: the hands wait for the body (`Patient`). Run it under the thread sanitizer (preset `tsan`) to see that the threads share
// nothing but what they hand over.
#include "catch.hpp"

#include "device/message.hpp"
#include "forked.hpp"
#include "simulator/scene.hpp"
#include "simulator/thread_facts.hpp"

#include <palpate/cutting/no_cutter.hpp>
#include <palpate/cutting/progressive_cutter.hpp>
#include <palpate/device/any_device.hpp>
#include <palpate/device/scripted_device.hpp>
#include <palpate/force/cutting_force.hpp>
#include <palpate/force/liver.hpp>
#include <palpate/force/noise.hpp>
#include <palpate/force/tissue_reaction.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/region/zone_of_influence.hpp>
#include <palpate/simulator/budget.hpp>
#include <palpate/simulator/simulator.hpp>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <iostream>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

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
    requires requires(Cutter& cutter, Body& body, ToolPose<typename Body::Scalar> const& tool, More... more) { cutter.advance(body, tool, more...); }
  void advance(Body& body, ToolPose<typename Body::Scalar> const& tool, More... more) {
    Cutter::advance(body, tool, more...);
    ++*ticks;
  }

  std::atomic<long>* ticks;
};

/// A hand that waits for the body: never more than ten samples for each of its ticks. Gives up after 20 s, so that a body that hangs
/// fails the test and does not stop it. Where the test asks, one sample takes 30 ms.
template <class Device, class S = double>
struct Patient : Device {
  Patient(Device device, std::atomic<long>& count) : Device(std::move(device)), ticks(&count) {}

  DeviceStatus read(DeviceState<S>& state) noexcept {
    for (; reads >= 10 * (ticks->load() + 1) && waits < 20000; ++waits) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    if (reads++ == late_at) std::this_thread::sleep_for(std::chrono::milliseconds(30));
    return Device::read(state);
  }

  std::atomic<long>* ticks;
  long reads = 0, waits = 0, late_at = -1;
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

/// A hand that follows a script with a scalpel, in step with the body.
template <class S>
auto scalpel_run(Trajectory<S> const& script, double cap, std::atomic<long>& ticks, SafetyOptions const& safety = {}) {
  return Simulator(Patient<ScriptedDevice<S>, S>(ScriptedDevice<S>(script, {.max_force = cap}), ticks), skin<S>(ZoneOfInfluence{.rings = 4}),
                   Counted(ProgressiveCutter<S>({.puncture_depth = S(0.006), .snap = S(5e-4)}), ticks),
                   CuttingForce(liver_hysteresis<S>(), WhiteGaussianNoise<S>({.snr_db = 30.0, .seed = 7})), {.max_body_steps = 200, .servo = {.safety = safety}});
}

}  // namespace

TEMPLATE_TEST_CASE("a stroke on two threads", "[simulator][realtime][threads]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  double const cap = 0.8;
  auto const script = stroke<S>(0.010, 0.4);
  std::atomic<long> ticks{0};
  auto simulator = scalpel_run<S>(script, cap, ticks);
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

// Yardstick: the stroke runs along y = 53.3 mm on a grid of 5 mm, so what it cuts lies within a cell of that; then the hand is 20 mm beside it. A tick that comes
// late, as on a busy machine, is told to be a gap: without `gap` a hand may have gone 5 mm in each tick that is missing, and the jump is a way.
TEMPLATE_TEST_CASE("a jump on two threads cuts nothing on the way", "[simulator][realtime][threads][safety]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  auto const at = [](double x, double y, double z) { return Vector3<S>(S(x), S(y), S(z)); };
  auto script = Trajectory<S>::start(at(0.0312, 0.0533, 0.002));
  script.line(at(0.0312, 0.0533, -0.010), 0.4).line(at(0.0512, 0.0533, -0.010), 0.4).line(at(0.0512, 0.0733, -0.010), 0.001).line(at(0.0712, 0.0733, -0.010), 0.2);
  bool const jumps = GENERATE(true, false), is_late = GENERATE(true, false);
  CAPTURE(jumps, is_late);
  std::atomic<long> ticks{0};
  SafetyOptions safety;
  if (jumps) safety.jump = 0.005, safety.gap = 0.0025;
  auto simulator = scalpel_run<S>(script, 0.8, ticks, safety);
  if (is_late) simulator.device().late_at = 800;   // the last sample before
  int const whole = simulator.body().size();
  simulator.run_realtime(0.98);
  int beside = 0;
  for (int i = whole; i < simulator.body().size(); ++i)
    if (std::abs(simulator.body().reference_position(i).y() - S(0.0533)) > S(0.005)) ++beside;
  CHECK(simulator.body().size() > whole);
  CHECK((beside == 0) == jumps);
  CHECK((simulator.cutter().state() == CuttingPhase::no_contact) == jumps);
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

  Capabilities capabilities() const noexcept { return {.max_force = 3.3, .rate = 1000.0, .moves_a_hand = false}; }
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
  template <class Body>
  void advance(Body& body, ToolPose<double> const& tool) {
    NoCutter<double>::advance(body, tool);
    if (tool.position.z() < -0.002) throw std::runtime_error("the blade broke");
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

  Capabilities capabilities() const noexcept { return {.max_force = 3.3, .rate = 1000.0, .moves_a_hand = false}; }
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

/// What a hand went through in a run: when each tick was read, what was felt in it, and what is to be done when the force is there and when it is back.
struct Felt {
  double full, gap;   // N; s, the time without a tick that is waited for
  std::function<void()> once_felt{}, once_back{};
  std::vector<std::chrono::steady_clock::time_point> read{};
  std::vector<double> force{};   // N
  std::size_t felt_at = 0;       // the tick before `once_felt`
  bool was_still = false, was_zero = false;

  double time_before(std::size_t tick) const { return std::chrono::duration<double>(read[tick] - read[tick - 1]).count(); }
  void feel(double now) {
    std::size_t const tick = force.size();
    if (tick == read.size()) return;   // the hand is let go
    force.push_back(now);
    if (felt_at == 0 && tick >= 100 && now > 0.999 * full) {
      felt_at = tick;
      once_felt();
    }
    if (felt_at == 0 || tick == felt_at) return;
    was_still = was_still || time_before(tick) > gap;
    was_zero = was_zero || (was_still && now == 0.0);
    if (was_zero && now > 0.999 * full) once_back();
  }
};

/// Says where it is and no more. Stands still, holds the servo up for 20 ms, and is then 1 mm further; a hand that is asked what it felt stands still.
struct Halting {
  Felt* felt = nullptr;
  long reads = 0;

  Capabilities capabilities() const noexcept { return {.max_force = 3.3, .rate = 1000.0, .moves_a_hand = felt != nullptr}; }
  DeviceStatus read(DeviceState<double>& state) noexcept {
    ++reads;
    if (felt != nullptr) {
      felt->read.push_back(std::chrono::steady_clock::now());
    } else if (reads == 20) {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    state.position = {0.05, 0.0533, felt != nullptr || reads <= 20 ? 0.003 : 0.002};
    return DeviceStatus::ok;
  }
  DeviceStatus write(Wrench<double> const& wrench) noexcept {
    if (felt != nullptr) felt->feel(wrench.force.norm());
    return DeviceStatus::ok;
  }
};

/// Keeps the highest speed it was told of, and pushes evenly.
struct Speedometer {
  double* highest;
  double push = 0.0;   // N
  Vector3<double> operator()(ToolContact<double> const& contact) noexcept {
    *highest = std::max(*highest, contact.velocity.norm());
    return {0, 0, push};
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

namespace {

/// Runs a hand that feels 0.15 N and stops the whole process for so many milliseconds; throws, in words, where what was felt is not what it has to be.
/// What has to be follows from how long the process really stood still, so it does not matter how busy the machine is.
void stand_still(int milliseconds) {
  auto const require = [](bool good, char const* what) {
    if (good) return;
    std::cerr << what << std::endl;
    throw std::runtime_error(what);
  };
  palpate_test::Stopper stopper(milliseconds);
  double const push = 0.15;
  Felt felt{.full = push, .gap = 0.9e-3 * milliseconds};
  felt.read.reserve(20000), felt.force.reserve(20000);
  double highest = 0.0;
  Simulator simulator(Halting{&felt}, skin<double>(ZoneOfInfluence{.rings = 3}), NoCutter<double>{}, Speedometer{&highest, push});
  bool asked = false;
  felt.once_felt = [&] { asked = stopper.stop(); };
  felt.once_back = [&] { simulator.stop(); };
  simulator.run_realtime(10.0);

  require(felt.felt_at > 0, "the hand never felt the force");
  require(asked, "nobody stops the process");
  require(felt.was_still, "the process did not stand still");
  require(felt.was_zero, "a force was written after a gap");
  require(felt.force.back() > 0.999 * push, "the force did not come back");
  std::size_t at = felt.felt_at + 1;   // the tick after the longest time without one
  for (std::size_t i = at; i < felt.force.size(); ++i)
    if (felt.time_before(i) > felt.time_before(at)) at = i;
  double const gap = felt.time_before(at);
  std::size_t const zero = felt.force[at] == 0.0 ? at : at + 1;   // the next one where it stood still between looking at the clock and reading
  require(zero < felt.force.size() && felt.force[zero] == 0.0, "a force was written in the first tick after the gap");
  int gaps = 0, long_gaps = 0, armed_after = 0;
  while (auto const event = simulator.events().pop()) {
    if (event->time < 1e-3 * double(felt.felt_at) - 1e-9) continue;
    if (event->what == SafetyEvent::tick_gap) ++gaps;
    if (event->what == SafetyEvent::long_gap) ++long_gaps;
    if (event->what == SafetyEvent::armed) ++armed_after;
  }
  if (gap > 0.052) require(long_gaps >= 1 && armed_after >= 1, "no long gap was told, or it did not disarm");
  if (gap < 0.04) require(gaps >= 1 && long_gaps == 0 && armed_after == 0, "no gap was told, or it disarmed");
  for (std::size_t k = 1; zero + k < felt.force.size() && k <= 100; ++k) {
    double const most = long_gaps == 0 ? push * double(k) / 100 : k <= 3 ? 0.0 : push;   // a ramp of 0.1 s; arms in the fourth tick
    require(felt.force[zero + k] <= most * (1 + 1e-9), "the force came back too fast");
  }
}

}  // namespace

TEST_CASE("C9-X7: a process that is stopped for 25 ms begins the force anew, and for 120 ms disarms", "[simulator][realtime][threads][safety]") {
  for (int const milliseconds : {25, 120}) {
    auto const child = palpate_test::in_child([&] { stand_still(milliseconds); });
    INFO(milliseconds << " ms: " << child.said);
    if (child.ran) CHECK(child.code == 0);
  }
}

namespace {

/// Notes at its first read what the kernel says of the thread it is read by, and whether denormals count there.
struct ThreadWitness {
  palpate_test::ThreadFacts* facts;
  bool* flushed;
  long reads = 0;

  Capabilities capabilities() const noexcept { return {.max_force = 3.3, .rate = 1000.0}; }
  DeviceStatus read(DeviceState<double>& state) noexcept {
    double volatile const tiny = 1e-310, one = 1.0;
    if (++reads == 1) {
      *facts = palpate_test::thread_facts();
      *flushed = tiny * one == 0.0;
    }
    state.position = {0.05, 0.0533, 0.003};
    return DeviceStatus::ok;
  }
  DeviceStatus write(Wrench<double> const&) noexcept { return DeviceStatus::ok; }
};

}  // namespace

TEST_CASE("the servo's thread gets what was asked for it, and only that thread", "[simulator][realtime][threads]") {
  // Yardstick: the kernel's files, read in the servo's thread and in this one.
  palpate_test::ThreadFacts servo;
  bool flushed = false;
  auto const run = [&](RealtimeOptions const& options) {
    Simulator simulator(ThreadWitness{&servo, &flushed}, skin<double>(ZoneOfInfluence{.rings = 3}), NoCutter<double>{}, NoForce{}, {.realtime = options});
    CHECK_FALSE(simulator.realtime_report().priority.asked);   // no run yet
    CHECK(simulator.run_realtime(0.02).ticks().size() == 20);
    return simulator.realtime_report();
  };
  auto const before = palpate_test::thread_facts();
  CHECK(run({}).complete());
  CHECK(servo == before);
  CHECK_FALSE(flushed);
  RealtimeReport const report = run({.fifo = true, .priority = 60, .flush_denormals = true, .spin = std::chrono::microseconds(20)});
  INFO(to_text(report));
  CHECK(report.priority.asked);
  CHECK(report.priority.granted == (servo.policy == 1 && servo.priority == 60));
  CHECK(report.denormals.granted == flushed);
  CHECK_FALSE(report.memory.asked);
  CHECK(palpate_test::thread_facts() == before);
  CHECK(palpate_test::unsaid(message_of([&] { run({.priority = 99}); }), "a real-time priority of 99") == "");
}

TEST_CASE("several threads read the statistics while a run goes on", "[simulator][realtime][threads]") {
  // Yardstick: what was counted can only grow, each histogram holds one entry a tick (one less of periods), and in the end all of it is there.
  std::atomic<long> ticks{0};
  Simulator simulator(Patient(ScriptedDevice<double>(stroke<double>(0.004, 0.1)), ticks), skin<double>(ZoneOfInfluence{.rings = 3}),
                      Counted(NoCutter<double>{}, ticks), CuttingForce());
  struct Watched {
    long reads = 0, wrong = 0, changes = 0;
    std::string text;
  };
  std::vector<Watched> watched(2);
  std::atomic<bool> done{false};
  std::vector<std::thread> watchers;
  for (Watched& mine : watched)
    watchers.emplace_back([&] {
      std::uint64_t servo_ticks = 0, body_ticks = 0, counted = 0;
      for (bool last = false; !last;) {
        last = done.load();
        SimulatorStatistics const now = simulator.live_statistics();
        std::uint64_t const periods = now.servo.period().count();
        bool const good = now.servo.ticks() >= servo_ticks && now.body.ticks() >= body_ticks && now.servo_counts.ticks >= counted &&
                          now.servo.latency().count() == now.servo.ticks() && periods + (now.servo.ticks() > 0) == now.servo.ticks() &&
                          now.servo.ticks() <= 400 && now.servo.compute().p99() <= now.servo.compute().max();
        if (!good) ++mine.wrong;
        if (now.servo.ticks() != servo_ticks) ++mine.changes;
        servo_ticks = now.servo.ticks(), body_ticks = now.body.ticks(), counted = now.servo_counts.ticks;
        ++mine.reads;
        mine.text = budget_text(now);
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
      }
    });
  simulator.run_realtime(0.4);
  done = true;
  for (std::thread& watcher : watchers) watcher.join();
  SimulatorStatistics const last = simulator.statistics(), live = simulator.live_statistics();
  for (Watched const& watcher : watched) {
    CHECK(watcher.wrong == 0);
    CHECK(watcher.reads > 0);
    CHECK(watcher.changes > 0);
    CHECK(watcher.text == budget_text(last));
  }
  CHECK(live.servo.ticks() == 400);
  CHECK(live.body.ticks() == last.body.ticks());
  CHECK(live.servo_counts.ticks == last.servo_counts.ticks);
  CHECK(live.body_counts.steps == last.body_counts.steps);
  simulator.run(0.03);   // lock-step publishes at its end too
  CHECK(simulator.live_statistics().servo.ticks() == 430);
}

TEST_CASE("a device faster than any clock is refused before a thread starts", "[simulator][realtime]") {
  Simulator simulator(ScriptedDevice<double>(stroke<double>(), {.rate = 2e6}), skin<double>(WholeBody{}), NoCutter<double>{}, NoForce{});
  CHECK(palpate_test::unsaid(message_of([&] { simulator.run_realtime(0.1); }), "2000000 Hz") == "");
}

namespace {

/// What the clock of a device does.
struct Clock {
  double rate = 1000.0, declared = 1000.0;            // Hz
  std::uint64_t stops_after = ~std::uint64_t{0};   // calls
  int burst = 1;                                      // calls one after the other, at times that are as much further apart
};

/// A device whose driver calls the servo: a thread of its own, which may stand still after some ticks.
class ClockedDevice {
 public:
  explicit ClockedDevice(Clock const& clock = {}, double speed = 0.01) : state_(std::make_unique<State>()) { state_->clock = clock, state_->speed = speed; }

  Capabilities capabilities() const noexcept { return {.max_force = 3.3, .rate = state_->clock.declared, .moves_a_hand = false}; }
  DeviceStatus read(DeviceState<double>& state) noexcept {
    if (std::this_thread::get_id() != state_->driver) state_->called_elsewhere = true;
    state.position = {0.0312, 0.0533, 0.002 - state_->speed * 1e-3 * double(state_->reads++)};
    return DeviceStatus::ok;
  }
  DeviceStatus write(Wrench<double> const& wrench) noexcept {
    state_->felt = std::max(state_->felt, state_->feels = wrench.force.norm());
    return DeviceStatus::ok;
  }
  void start(void (*tick)(void*) noexcept, void* context) {
    state_->runs = true;
    state_->thread = std::thread([this, tick, context] {
      state_->driver = std::this_thread::get_id();
      auto const burst = static_cast<std::uint64_t>(state_->clock.burst);
      Pacer pacer(state_->clock.rate / state_->clock.burst);
      for (std::uint64_t k = 0; state_->runs.load(); ++k) {
        if (k % burst == 0) pacer.wait();
        auto const before = std::chrono::steady_clock::now();
        double const felt = state_->feels;
        if (k < state_->clock.stops_after) tick(context);
        if (felt == 0.0) state_->rises_from = before;
        if (state_->feels > felt) state_->rose_for = std::chrono::duration<double>(std::chrono::steady_clock::now() - state_->rises_from).count();
      }
    });
  }
  void stop() noexcept {
    state_->runs = false;
    if (state_->thread.joinable()) state_->thread.join();
  }
  bool called_elsewhere() const noexcept { return state_->called_elsewhere; }
  double felt() const noexcept { return state_->felt; }           // N, at most
  double rose_for() const noexcept { return state_->rose_for; }   // s, of the driver's clock, from before the first tick with a force to the end of the last in which it grew

 private:
  struct State {
    std::thread thread;
    std::thread::id driver;
    std::atomic<bool> runs{false};
    Clock clock{};
    std::uint64_t reads = 0;
    bool called_elsewhere = false;
    double speed = 0.0, felt = 0.0, feels = 0.0, rose_for = 0.0;
    std::chrono::steady_clock::time_point rises_from{};
  };
  std::unique_ptr<State> state_;
};
static_assert(SelfClocked<ClockedDevice> && HapticDevice<ClockedDevice>);

}  // namespace

TEST_CASE("a device with a clock of its own calls the servo", "[simulator][realtime][threads]") {
  Simulator simulator(ClockedDevice{}, palpate_test::skin<double>(ZoneOfInfluence{.rings = 2}), NoCutter<double>{}, TissueReaction{});
  Recording const recording = simulator.run_realtime(0.6);
  CHECK(recording.ticks().size() == 600);
  CHECK(recording.largest_force() > 0.0);
  CHECK(simulator.device().felt() == recording.largest_force());
  CHECK_FALSE(simulator.device().called_elsewhere());
  CHECK(simulator.statistics().servo.ticks() == 600);
  CHECK(simulator.time() == Approx(0.6));
}

TEST_CASE("a clock is found in a device that was chosen while the program runs", "[simulator][realtime][threads]") {
  Simulator simulator(AnyDevice<double>(ClockedDevice{}), palpate_test::skin<double>(ZoneOfInfluence{.rings = 2}), NoCutter<double>{}, TissueReaction{});
  CHECK(simulator.run_realtime(0.3).ticks().size() == 300);
  CHECK_FALSE(simulator.realtime_report().timers.asked);   // the thread was the driver's
}

TEST_CASE("ticks that a device's own clock leaves out are counted, also of one chosen while the program runs", "[simulator][realtime][threads]") {
  auto const skipped = [](auto device) {
    Simulator simulator(std::move(device), palpate_test::skin<double>(ZoneOfInfluence{.rings = 2}), NoCutter<double>{}, TissueReaction{});
    Recording const recording = simulator.run_realtime(0.05);   // 50 ticks, 5 ms from each to the next
    std::uint64_t missed = 0;
    for (Tick const& tick : recording.ticks()) missed += tick.missed;
    CHECK(missed == simulator.statistics().servo.skipped());
    return missed;
  };
  CHECK(skipped(ClockedDevice({.rate = 200.0})) >= 150);
  CHECK(skipped(AnyDevice<double>(ClockedDevice({.rate = 200.0}))) >= 150);
}

namespace {

/// Pushes with 3 N from the 300th tick on.
struct Push {
  Vector3<double> operator()(ToolContact<double> const&) const noexcept { return Vector3<double>::Zero(); }
  Vector3<double> overlay(ToolMotion<double> const&) noexcept { return {0, 0, ++ticks > 300 ? 3.0 : 0.0}; }

  int ticks = 0;
};

}  // namespace

// Yardstick: the driver's own watch. At 500 N/s a force of 3 N, of which the first tick brings 0.5 N, takes 5 ms.
TEST_CASE("a clock that calls too often, or in bursts, brings no more force a second", "[simulator][realtime][threads][safety]") {
  SimulatorOptions options;
  options.servo.safety.slew = 500.0;
  for (Clock const& clock : {Clock{}, Clock{.rate = 10000.0}, Clock{.burst = 20}}) {
    Simulator simulator(ClockedDevice(clock, 0.0), palpate_test::skin<double>(ZoneOfInfluence{.rings = 2}), NoCutter<double>{}, Push{}, options);
    INFO(clock.rate << " Hz, " << clock.burst << " at once");
    auto const before = std::chrono::steady_clock::now();
    Recording const recording = simulator.run_realtime(1.0);
    double const passed = std::chrono::duration<double>(std::chrono::steady_clock::now() - before).count();
    std::uint64_t missed = 0;
    for (Tick const& tick : recording.ticks()) missed += tick.missed;
    CHECK(static_cast<double>(missed) <= std::max(0.0, passed * 1000.0 - 1000.0) + 20.0);   // a burst makes up for what was before it
    CHECK(simulator.device().felt() == Approx(3.0));
    CHECK(simulator.device().rose_for() >= 2.5 / 500.0);
  }
}

TEST_CASE("a device whose clock stands still ends the run with a sentence", "[simulator][realtime][threads]") {
  Simulator simulator(ClockedDevice({.stops_after = 50}), palpate_test::skin<double>(ZoneOfInfluence{.rings = 2}), NoCutter<double>{}, NoForce{});
  CHECK_THROWS_WITH(simulator.run_realtime(10.0), says("after 50 ticks", "check that it is connected"));
}

TEST_CASE("where there are several tools the sentence says whose device's clock stands still", "[simulator][realtime][threads]") {
  auto const tool = [](Clock const& clock) { return Tool(ClockedDevice(clock), NoCutter<double>{}, NoForce{}); };
  Simulator simulator(palpate_test::skin<double>(ZoneOfInfluence{.rings = 2}), tool({}), tool({.stops_after = 50}));
  CHECK_THROWS_WITH(simulator.run_realtime(10.0), says("the clock of the device of tool 1 has stopped after 50 ticks", "check that it is connected"));
}

TEST_CASE("a run that is stopped after the device's clock has stopped ends with the ticks there were", "[simulator][realtime][threads]") {
  Simulator simulator(ClockedDevice({.stops_after = 50}), palpate_test::skin<double>(ZoneOfInfluence{.rings = 2}), NoCutter<double>{}, NoForce{});
  std::thread stopper([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    simulator.stop();
  });
  std::size_t ticks = 0;
  CHECK_NOTHROW(ticks = simulator.run_realtime(10.0).ticks().size());
  stopper.join();
  CHECK(ticks == 50);
}

TEST_CASE("who waits for a device's clock is not asked to spin", "[simulator][realtime][threads]") {
  SimulatorOptions options;
  options.realtime.spin = std::chrono::microseconds(50);
  auto const run = [&](auto device) {
    Simulator simulator(std::move(device), palpate_test::skin<double>(ZoneOfInfluence{.rings = 2}), NoCutter<double>{}, NoForce{}, options);
    return simulator.run_realtime(0.001).ticks().size();
  };
  CHECK(run(ClockedDevice({.declared = 30000.0})) == 30);
  CHECK_THROWS_WITH(run(ScriptedDevice<double>(stroke<double>(), {.rate = 30000.0})), says("a spin of 50000 ns"));
}

TEST_CASE("a run is stopped from another thread, which hears of every tick", "[simulator][realtime][threads]") {
  Simulator simulator(ScriptedDevice<double>(palpate_test::stroke<double>()), palpate_test::skin<double>(ZoneOfInfluence{.rings = 2}), NoCutter<double>{}, TissueReaction{});
  std::vector<double> heard;
  std::thread listener([&] {
    while (heard.size() < 200)
      if (auto const tick = simulator.live_ticks().pop())
        heard.push_back(tick->time);
      else
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    simulator.stop();
  });
  Recording const recording = simulator.run_realtime(60.0);
  listener.join();
  REQUIRE(recording.ticks().size() >= 200);
  CHECK(recording.ticks().size() < 30000);
  for (std::size_t k = 0; k < heard.size(); ++k) REQUIRE(heard[k] == recording.ticks()[k].time);
  CHECK(simulator.device().last_wrench().force.isZero(0));
  CHECK(simulator.run_realtime(0.05).ticks().size() == 50);   // the next one goes on
  CHECK(simulator.run(1.0, [&](Tick const&) { simulator.stop(); }).ticks().size() == 1);
}

namespace {

/// A blunt tool whose body's tick takes 400 ms from the 120th on: as a cut through a large organ might.
struct SlowTool : NoCutter<double> {
  int ticks = 0;
  template <class Body>
  void advance(Body& body, ToolPose<double> const& tool) {
    if (++ticks > 120) std::this_thread::sleep_for(std::chrono::milliseconds(400));
    NoCutter<double>::advance(body, tool);
  }
};

/// Presses, and knows when the last force and the first zero after it were written.
class Watched {
 public:
  using Clock = std::chrono::steady_clock;
  Capabilities capabilities() const noexcept { return {.max_force = 3.3, .rate = 1000.0, .moves_a_hand = false}; }
  DeviceStatus read(DeviceState<double>& state) noexcept {
    state.position = {0.0512, 0.0533, std::max(-0.003, 0.002 - 5e-5 * reads_++)};
    return DeviceStatus::ok;
  }
  DeviceStatus write(Wrench<double> const& wrench) noexcept {
    if (!wrench.force.isZero(0))
      last_force_ = Clock::now(), released_ = false;
    else if (!released_)
      zero_ = Clock::now(), released_ = true;
    return DeviceStatus::ok;
  }
  double held() const { return std::chrono::duration<double>(zero_ - last_force_).count(); }
  bool felt() const { return last_force_ != Clock::time_point{}; }

 private:
  int reads_ = 0;
  bool released_ = true;
  Clock::time_point last_force_{}, zero_{};
};

}  // namespace

// By hand: the servo's last tick and the zero after it are next to each other, however long the body's thread takes to end.
TEST_CASE("a hand is let go at the end of a run, also while the body is still busy", "[simulator][realtime][threads]") {
  Simulator simulator(Watched{}, palpate_test::skin<double>(ZoneOfInfluence{.rings = 2}), SlowTool{}, TissueReaction{});
  simulator.run_realtime(0.4);
  CHECK(simulator.device().felt());
  CHECK(simulator.device().held() < 0.1);
}
