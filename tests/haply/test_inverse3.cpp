// SPDX-License-Identifier: MIT
#include "catch.hpp"

#include "allocation_trap.hpp"
#include "device/message.hpp"
#include "haply/mock_service.hpp"
#include "servo_guard.hpp"

#include <palpate/device/session.hpp>
#include <palpate/haply/address.hpp>
#include <palpate/haply/inverse3.hpp>
#include <palpate/testing/device_laws.hpp>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <thread>
#include <utility>
#include <vector>

using namespace palpate;
using palpate_test::comes_true;
using palpate_test::InventoryText;
using palpate_test::message_of;
using palpate_test::MockPlan;
using palpate_test::MockService;
using palpate_test::StateText;
using palpate_test::unsaid;

namespace {

using SteadyClock = std::chrono::steady_clock;

double since(SteadyClock::time_point begin) { return std::chrono::duration<double>(SteadyClock::now() - begin).count(); }

/// Options for the mock. A busy machine must not look like a silent service: only tests of silence are impatient.
Inverse3Options at(MockService const& service, Inverse3Options options = {}) {
  options.host = "127.0.0.1";
  options.port = service.port();
  if (options.stall == Inverse3Options{}.stall) options.stall = 5.0;
  return options;
}

Wrench<double> push(double x, double y = 0.0, double z = 0.0) { return {.force = {x, y, z}}; }

/// Writes this again and again until that holds; false when it does not in ten seconds.
template <class Holds>
bool pushing(Inverse3Device& device, Wrench<double> const& wrench, Holds holds) {
  return comes_true([&] {
    static_cast<void>(device.write(wrench));
    return holds();
  });
}

double largest(std::vector<palpate_test::MockMessage> const& messages) {
  double most = 0.0;
  for (auto const& message : messages) most = std::max(most, message.force.norm());
  return most;
}
bool is_zero_last(MockService const& service) {
  auto const messages = service.messages();
  return !messages.empty() && messages.back().force.isZero(0.0);
}

}  // namespace

TEST_CASE("an Inverse3 is read in SI units and says what is known of it", "[haply]") {
  MockService service({.answer = [](int) { return StateText{.buttons = R"({"a":false,"b":true,"c":false})"}.text(); }});
  Inverse3Device device(at(service));
  CHECK(device.capabilities().buttons == 0);
  CHECK_FALSE(device.capabilities().workspace.known());
  device.open();
  DeviceState<double> state;
  state.angular_velocity.setConstant(7.0);
  REQUIRE(device.read(state) == DeviceStatus::ok);   // the state that opening asked for
  CHECK(state.position == Vector3<double>(0.05, 0.15, 0.12));   // the service: 0.05 right, 0.12 towards the user, 0.15 up
  CHECK(state.velocity == Vector3<double>(0.1, -0.3, -0.2));
  CHECK(state.buttons == 2u);
  CHECK(state.angular_velocity.x() == 7.0);   // not measured, not touched

  Capabilities const capabilities = device.capabilities();
  CHECK(capabilities.max_force == 3.0);
  CHECK(capabilities.max_force.provenance == Provenance::guessed);
  CHECK(capabilities.workspace.provenance == Provenance::guessed);
  CHECK((capabilities.workspace.lower.array() < state.position.array()).all());
  CHECK((capabilities.workspace.upper.array() > state.position.array()).all());
  CHECK(capabilities.buttons == 3);
  CHECK(capabilities.reports_orientation);
  CHECK(capabilities.moves_a_hand);
  CHECK(device.description().serial == "049D");
  CHECK(device.description().driver == "Inverse Service 3.5.0");
  CHECK(device.report().frame.matrix()(2, 1) == -1.0);
  CHECK(unsaid(message_of([&] { device.open(); }), "open already") == "");

  Inverse3Device moved(std::move(device));
  CHECK(is_usable(moved.read(state)));
  CHECK(device.read(state) == DeviceStatus::disconnected);   // NOLINT: what was moved away is closed
  device.close();
  moved.close();
  CHECK(moved.read(state) == DeviceStatus::disconnected);
  CHECK(service.violations().empty());
}

TEST_CASE("what the user knows better replaces what is guessed", "[haply]") {
  MockPlan plan;
  InventoryText moved;
  moved.mount = R"("mount":{"position":{"x":0.1,"y":0,"z":0}},)";
  moved.grips = "";
  plan.inventory = moved.text();
  plan.answer = [](int) { return StateText{.grip = false}.text(); };
  MockService service(plan);
  DeviceWorkspace const box{.lower = {-1, -1, -1}, .upper = {1, 1, 1}, .provenance = Provenance::datasheet};
  Inverse3Device device(at(service, {.max_force = datasheet(8.0), .workspace = box}));
  device.open();
  CHECK(device.capabilities().max_force.provenance == Provenance::datasheet);
  CHECK(device.capabilities().workspace.provenance == Provenance::datasheet);
  CHECK_FALSE(device.capabilities().reports_orientation);
  CHECK(device.capabilities().buttons == 0);
  device.close();
  Inverse3Device other(at(service));
  other.open();
  CHECK_FALSE(other.capabilities().workspace.known());   // a guess says nothing of a device that was mounted elsewhere
}

TEST_CASE("an Inverse3 keeps the laws of devices, with and without a grip, opened twice", "[haply]") {
  for (bool const grip : {true, false}) {
    MockPlan plan;
    InventoryText inventory;
    if (!grip) inventory.grips = "";
    plan.inventory = inventory.text();
    plan.answer = [grip](int) { return StateText{.velocity = R"({"x":0,"y":0,"z":0})", .grip = grip}.text(); };
    MockService service(plan);
    Inverse3Device device(at(service, {.ramp = 0.0}));
    auto const violations = testing::check_device(device, {.ticks = 120, .force = 2.0, .paced = true});
    for (auto const& violation : violations) UNSCOPED_INFO(violation);
    CHECK(violations.empty());
    CHECK(service.violations().empty());
    CHECK(comes_true([&] { return service.goodbyes() == 2; }));
    CHECK(comes_true([&] { return is_zero_last(service); }));
    CHECK(largest(service.messages()) > 0.0);
    for (auto const& message : service.messages()) REQUIRE_FALSE(message.early);   // one request at a time
  }
}

TEST_CASE("zero comes first, then the force rises along the ramp, and never above the cap", "[haply]") {
  MockService service;
  Inverse3Device device(at(service, {.ramp = 0.5, .held = 5.0}));   // held: no pause of a busy machine starts it anew
  device.open();
  REQUIRE(pushing(device, push(60.0, 80.0), [&] { return device.counts().exchanges > 20; }));
  CHECK(largest(service.messages()) == 0.0);   // not armed
  auto const begin = SteadyClock::now();
  device.arm();
  REQUIRE(pushing(device, push(60.0, 80.0), [&] { return largest(service.messages()) > 0.05; }));
  auto const messages = service.messages();
  double const passed = since(begin);
  CHECK(messages.front().force.isZero(0.0));
  double before = 0.0;
  for (auto const& message : messages) {
    double const size = message.force.norm();
    REQUIRE(size >= before);
    REQUIRE(size <= 3.0 * passed / 0.5 + 1e-12);   // the ramp at the time of looking
    before = size;
  }
  REQUIRE(pushing(device, push(60.0, 80.0), [&] { return largest(service.messages()) >= 3.0 - 1e-9; }));
  device.disarm();
  CHECK(comes_true([&] { return is_zero_last(service); }));
  auto const all = service.messages();
  CHECK(largest(all) <= 3.0 + 1e-12);
  auto const most = std::max_element(all.begin(), all.end(), [](auto const& a, auto const& b) { return a.force.norm() < b.force.norm(); });
  CHECK((most->force - Eigen::Vector3d(1.8, 0.0, 2.4)).norm() < 1e-9);   // right, and up is the service's z: the direction is kept
  device.close();
  CHECK(service.violations().empty());
}

TEST_CASE("a force that is not written anew becomes zero, and one from before arming is never given", "[haply]") {
  MockService service;
  Inverse3Device device(at(service, {.ramp = 0.0, .held = 0.05}));
  device.open();
  static_cast<void>(device.write(push(2.0)));
  device.arm();
  auto const seen = device.counts().exchanges;
  REQUIRE(comes_true([&] { return device.counts().exchanges > seen + 5; }));
  CHECK(largest(service.messages()) == 0.0);
  REQUIRE(pushing(device, push(2.0), [&] { return largest(service.messages()) > 0.0; }));
  REQUIRE(comes_true([&] { return device.counts().unattended > 0; }));
  CHECK(comes_true([&] { return is_zero_last(service); }));
  static_cast<void>(device.write(push(std::numeric_limits<double>::quiet_NaN(), 1.0)));
  auto const then = device.counts().exchanges;
  REQUIRE(comes_true([&] { return device.counts().exchanges > then + 3; }));
  CHECK(service.violations().empty());   // no NaN on the way
  CHECK(largest(service.messages()) == 2.0);
}

TEST_CASE("each fault ends the session, the next message is zero and the last", "[haply]") {
  struct Row {
    char const* name;
    std::string answer;   // the bad one; empty: none comes
    HaplyProblem problem;
    DeviceStatus status;
    char const* words;
  };
  constexpr auto protocol = HaplyProblem::protocol;
  constexpr auto fault_status = DeviceStatus::fault, lost = DeviceStatus::disconnected;
  Row const rows[] = {
      {"no JSON", "{\"inverse3\":[", protocol, fault_status, "no JSON"},
      {"not an object", "\"\"", protocol, fault_status, "not an object"},
      {"NaN", StateText{.position = R"({"x":NaN,"y":0,"z":0})"}.text(), protocol, fault_status, "no JSON"},
      {"null", StateText{.velocity = R"({"x":0,"y":null,"z":0})"}.text(), protocol, fault_status, "cursor_velocity.y as null"},
      {"text", StateText{.position = R"({"x":"0","y":0,"z":0})"}.text(), protocol, fault_status, "cursor_position.x as \"0\""},
      {"missing", StateText{.position = R"({"x":0,"y":0})"}.text(), protocol, fault_status, "cursor_position without z"},
      {"vanished", StateText{.device = "04BA"}.text(), HaplyProblem::vanished, lost, "no longer has 049D"},
      {"moved", StateText{.transform = R"({"position":{"x":1,"y":0,"z":0}})"}.text(), HaplyProblem::frame_changed, fault_status, "workspace of 049D"},
      {"too long", std::string(2 << 20, ' '), protocol, fault_status, "no WebSocket message, or is longer than 1048576 bytes"},
      {"gone", "", HaplyProblem::gone, lost, "ended the connection"},
      {"silent", "", HaplyProblem::silent, fault_status, "silent"},
  };
  for (Row const& row : rows) {
    INFO(row.name);
    bool const silent = row.problem == HaplyProblem::silent, gone = row.problem == HaplyProblem::gone;
    std::atomic<bool> spoilt{false};
    std::atomic<int> bad{0};   // the first bad answer
    MockPlan plan;
    plan.answer = [&](int n) {
      bool const now = spoilt && !row.answer.empty();
      if (now && bad == 0) bad = n;
      return now ? row.answer : StateText{}.text();
    };
    plan.late = [&](int n) {
      if (!silent || !spoilt || bad != 0) return 0;
      bad = n;
      return 500;
    };
    plan.cut = [&](int n) {
      if (gone && spoilt) bad = n;
      return gone && spoilt;
    };
    MockService service(plan);
    Inverse3Device device(at(service, {.ramp = 0.0, .stall = silent ? 0.25 : 5.0}));
    device.open();
    device.arm();
    REQUIRE(pushing(device, push(1.0), [&] { return largest(service.messages()) == 1.0; }));
    spoilt = true;
    DeviceState<double> state;
    DeviceStatus status = DeviceStatus::ok;
    REQUIRE(pushing(device, push(1.0), [&] {
      status = device.read(state);
      return !is_usable(status);
    }));
    CHECK(status == row.status);
    CHECK(device.write(push(1.0)) == row.status);
    state.position.setConstant(7.0);
    CHECK(device.read(state) == row.status);
    CHECK(state.position.x() == 7.0);   // a failed read leaves the state alone
    auto const fault = device.pop_fault();
    REQUIRE(fault);
    CHECK(fault->status == row.status);
    CHECK(fault->native_code == static_cast<int>(row.problem));
    CHECK(unsaid(fault->what, row.words) == "");
    CHECK_FALSE(device.pop_fault());
    CHECK(unsaid(message_of([&] { device.arm(); }), "no force", row.words, "open it again") == "");

    bool const over = gone || row.answer.size() > (1u << 20);   // nothing can be sent any more
    auto const expected = static_cast<std::size_t>(over ? bad.load() : bad + 1);   // zero after the bad answer, if anybody is there
    REQUIRE(comes_true([&] { return service.messages().size() >= expected; }));
    device.close();
    auto const messages = service.messages();
    REQUIRE(messages.size() == expected);
    if (!over) CHECK(messages.back().force.isZero(0.0));
    for (std::size_t k = 0; k < messages.size(); ++k) REQUIRE(messages[k].early == (silent && k + 1 == messages.size()));
    CHECK(service.violations().empty());

    spoilt = false;
    device.open();   // each session is new
    CHECK(device.read(state) == DeviceStatus::ok);
    CHECK_FALSE(device.pop_fault());
  }
}

TEST_CASE("a service that is late for a moment is waited for, and nobody takes an old state for new", "[haply]") {
  for (int const ms : {5, 50}) {
    MockPlan plan;
    plan.late = [ms](int n) { return n == 20 ? ms : 0; };
    MockService service(plan);
    Inverse3Device device(at(service, {.ramp = 0.0}));
    device.open();
    device.arm();
    DeviceState<double> state;
    double oldest = 0.0;
    bool usable = true, honest = true;
    REQUIRE(pushing(device, push(1.0), [&] {
      DeviceStatus const status = device.read(state);
      usable = usable && is_usable(status);
      double const age = device.state_age();
      if (age > oldest && status == DeviceStatus::stale) oldest = age;
      if (age < 0.0) honest = false;
      return device.counts().exchanges > 60;
    }));
    CHECK(usable);
    CHECK(honest);
    CHECK_FALSE(device.pop_fault());
    if (ms < 20) continue;
    CHECK(oldest > 0.02);
    CHECK(device.counts().gaps > 0);   // longer than .held: the force began at zero again
  }
}

TEST_CASE("a state that nobody asked for is no answer: what is read stays as new as it says", "[haply]") {
  // Yardstick: the stand-in's own count of messages, which it writes into the position.
  struct Row {
    char const* name;
    std::function<int(int)> times;
  };
  for (Row const& row : {Row{"each answer three times", [](int) { return 3; }}, Row{"thirty at once", [](int n) { return n == 20 ? 30 : 1; }}}) {
    INFO(row.name);
    MockPlan plan;
    plan.answer = [](int n) { return StateText{.position = R"({"x":)" + std::to_string(n) + R"(e-6,"y":0,"z":0})"}.text(); };
    plan.times = row.times;
    MockService service(plan);
    Inverse3Device device(at(service));
    device.open();
    DeviceState<double> state;
    for (std::uint64_t const end : {100u, 200u, 300u}) {
      REQUIRE(comes_true([&] { return device.counts().exchanges >= end; }));
      REQUIRE(is_usable(device.read(state)));
      CHECK(1e6 * state.position.x() > static_cast<double>(end) - 5.0);   // a copy that comes after the next request is that one's answer
    }
    device.close();
    CHECK(is_zero_last(service));
    CHECK(comes_true([&] { return service.goodbyes() == 1; }));
    CHECK(service.violations().empty());
  }
}

TEST_CASE("a jump of the position begins the force anew", "[haply]") {
  std::atomic<bool> jumps{false};
  MockService service({.answer = [&](int) { return StateText{.position = jumps ? R"({"x":0,"y":9,"z":0})" : R"({"x":0,"y":0,"z":0})"}.text(); }});
  Inverse3Device device(at(service, {.held = 5.0}));
  device.open();
  device.arm();
  REQUIRE(pushing(device, push(1.0), [&] { return largest(service.messages()) > 0.01; }));
  jumps = true;
  REQUIRE(pushing(device, push(1.0), [&] { return device.counts().jumps > 0; }));
  auto const then = device.counts().exchanges;
  REQUIRE(pushing(device, push(1.0), [&] { return device.counts().exchanges > then + 10; }));
  CHECK(device.counts().jumps == 1);
  auto const messages = service.messages();
  int falls = 0;
  for (std::size_t k = 1; k < messages.size(); ++k)
    if (messages[k].force.norm() < messages[k - 1].force.norm()) {
      ++falls;
      CHECK(messages[k].force.isZero(0.0));
    }
  CHECK(falls == 1);
  CHECK(messages.back().force.norm() > 0.0);
}

TEST_CASE("what keeps an Inverse3 from opening is said with where and what to check", "[haply]") {
  int free_port = 0;
  {
    MockService const gone;
    free_port = gone.port();
  }
  auto const error = [](Inverse3Options const& options) {
    Inverse3Device device(options);
    try {
      device.open();
    } catch (HaplyError const& refused) {
      DeviceState<double> state;
      if (device.read(state) != DeviceStatus::disconnected) FAIL("open after all");
      return std::pair(refused.problem(), std::string(refused.what()));
    }
    return std::pair(HaplyProblem::none, std::string("(no exception)"));
  };
  auto const refused_with = [&](MockPlan const& plan, HaplyProblem problem, std::string const& words, Inverse3Options options = {}) {
    MockService service(plan);
    auto const [is, text] = error(at(service, options));
    CHECK(is == problem);
    CHECK(unsaid(text, words) == "");
  };
  auto const [problem, text] = error({.host = "127.0.0.1", .port = free_port});
  CHECK(problem == HaplyProblem::not_reachable);
  CHECK(unsaid(text, "127.0.0.1:" + std::to_string(free_port), "Inverse Service running") == "");
  CHECK(unsaid(error({.host = "::1", .port = free_port}).second, "[::1]:" + std::to_string(free_port)) == "");   // as RFC 3986 writes it

  refused_with({.refuses = true}, HaplyProblem::handshake_refused, "takes no WebSocket");
  refused_with({.mute = true}, HaplyProblem::silent, "did not answer in time", {.dialect = HaplyDialect::vector, .timeout = 0.1});
  refused_with({.inventory = "hello"}, HaplyProblem::protocol, "no JSON: hello");
  refused_with({.inventory = R"({"inverse3":[]})"}, HaplyProblem::no_device, "has no Inverse3");
  refused_with({}, HaplyProblem::no_device, "no Inverse3 \"1234\"; it has 049D", {.device = "1234"});
  InventoryText two;
  two.devices = two.one() + "," + InventoryText{.device = "04BA"}.one();
  refused_with({.inventory = two.text()}, HaplyProblem::no_device, "several Inverse3s: 049D, 04BA; say which");
  InventoryText large;
  large.mount = R"("mount":{"scale":{"x":2,"y":2,"z":2}},)";
  refused_with({.inventory = large.text()}, HaplyProblem::frame, "by 2, 2, 2");
  refused_with({.answer = [](int) { return std::string("{}"); }}, HaplyProblem::vanished, "no longer has 049D");
  refused_with({.cut = [](int) { return true; }}, HaplyProblem::gone, "ended the connection");

  InventoryText unplugged;
  unplugged.power = "false";
  MockService service({.inventory = unplugged.text()});
  Inverse3Device device(at(service));
  CHECK(unsaid(message_of([&] { device.arm(); }), "needs an open device") == "");
  device.open();
  CHECK(unsaid(message_of([&] { device.arm(); }), "no power supply", "plug it in") == "");
}

TEST_CASE("two devices at one service have a force and a state each, and one that vanishes ends its own session", "[haply]") {
  InventoryText inventory;
  inventory.devices = inventory.one() + "," + InventoryText{.device = "04BA"}.one();
  StateText const right{.device = "04BA", .position = R"({"x":-0.05,"y":-0.1,"z":0.2})", .grip = false};
  std::string const of_left = StateText{.grip = false}.text(), of_right = right.text();
  std::size_t const begin = std::string(R"({"inverse3":[)").size();
  std::string const both = of_left.substr(0, of_left.size() - 2) + "," + of_right.substr(begin);
  std::atomic<bool> is_there{true};
  MockService service({.inventory = inventory.text(), .answer = [&](int) { return is_there.load() ? both : of_left; }});
  Inverse3Device one(at(service, {.device = "049D", .ramp = 0.0})), other(at(service, {.device = "04BA", .ramp = 0.0}));
  one.open(), other.open(), one.arm(), other.arm();
  DeviceState<double> here, there;
  REQUIRE(comes_true([&] { return one.read(here) == DeviceStatus::ok; }));
  REQUIRE(comes_true([&] { return other.read(there) == DeviceStatus::ok; }));
  CHECK(here.position == Vector3<double>(0.05, 0.15, 0.12));
  CHECK(there.position == Vector3<double>(-0.05, 0.2, 0.1));
  auto const pushed = [&](char const* device) {
    double most = 0.0;
    for (auto const& message : service.messages())
      if (message.device == device) most = std::max(most, message.force.norm());
    return most;
  };
  REQUIRE(pushing(one, push(1.0), [&] { return pushed("049D") > 0.0; }));
  REQUIRE(pushing(other, push(0.0, 2.0), [&] { return pushed("04BA") > 0.0; }));
  CHECK(pushed("049D") == 1.0);
  CHECK(pushed("04BA") == 2.0);

  Inverse3Device third(at(service, {.device = "049D"}));   // two would send the same motors their forces in turn
  std::vector<char const*> names{"127.0.0.1", "localhost", "LOCALHOST"};
#if defined(__linux__)
  names.insert(names.end(), {"127.1", "0.0.0.0"});   // elsewhere a resolver may not know the one, nor a connection be made to the other
#endif
  for (char const* host : names) {
    auto options = at(service, {.device = "049D"});
    options.host = host;
    Inverse3Device again(options);
    try {
      again.open();
      FAIL("a device was opened twice, as one of " << host);
    } catch (HaplyError const& error) {
      CHECK(error.problem() == HaplyProblem::in_use);
      CHECK(unsaid(error.what(), "049D is open in this program already", "close it there first") == "");
    }
  }
  is_there.store(false);
  REQUIRE(comes_true([&] { return other.read(there) == DeviceStatus::disconnected; }));
  auto const fault = other.pop_fault();
  REQUIRE(fault.has_value());
  CHECK(fault->native_code == static_cast<int>(HaplyProblem::vanished));
  CHECK(unsaid(fault->what, "no longer has 04BA") == "");
  CHECK(comes_true([&] { return one.read(here) == DeviceStatus::ok; }));
  CHECK_FALSE(one.pop_fault().has_value());
  one.close();
  third.open();
  CHECK(comes_true([&] { return third.read(here) == DeviceStatus::ok; }));
  third.close(), other.close();
  auto const messages = service.messages();
  for (char const* device : {"049D", "04BA"}) {
    auto const last = std::find_if(messages.rbegin(), messages.rend(), [&](auto const& message) { return message.device == device; });
    REQUIRE(last != messages.rend());
    CHECK(last->force.isZero(0.0));
  }
}

TEST_CASE("the dialect follows the service's version, or what was asked for", "[haply]") {
  struct Row {
    char const *version, *spoken;
    HaplyDialect asked;
  };
  for (Row const& row : {Row{"3.1.1", "values", HaplyDialect::by_version}, Row{"", "vector", HaplyDialect::by_version},
                         Row{"3.5.0", "values", HaplyDialect::values}}) {
    MockService service({.version = row.version, .dialect = row.spoken});
    Inverse3Device device(at(service, {.dialect = row.asked, .ramp = 0.0}));
    device.open();
    device.arm();
    REQUIRE(pushing(device, push(1.0), [&] { return largest(service.messages()) == 1.0; }));
    device.close();
    CHECK(service.violations().empty());
  }
}

TEST_CASE("messages in pieces are put together", "[haply]") {
  MockPlan plan;
  plan.piece = 7;
  MockService service(plan);
  Inverse3Device device(at(service));
  device.open();
  REQUIRE(comes_true([&] { return device.counts().exchanges > 10; }));
  DeviceState<double> state;
  REQUIRE(is_usable(device.read(state)));
  CHECK(state.position.y() == 0.15);
}

TEST_CASE("a servo's thread exchanges state and force without a lock or an allocation, beside the one that opens", "[haply]") {
  REQUIRE(palpate_test::trap_works());
  MockService service;
  Inverse3Device device(at(service, {.ramp = 0.0}));
  {
    DeviceSession const session(device);
    std::atomic<long> allocated{-1};
    std::atomic<int> fresh{0}, stale{0};
    std::thread servo([&] {
      DeviceState<double> state;
      palpate_test::AllocationCount const allocations;
      for (int tick = 0; tick < 20000 && fresh < 20; ++tick) {
        DeviceStatus status;
        bool ended;
        {
          palpate_test::ServoGuard const guard;
          status = device.read(state);
          static_cast<void>(device.write(push(1.0)));
          ended = device.pop_fault().has_value();
        }
        (status == DeviceStatus::ok ? fresh : stale).fetch_add(1);
        if (ended) break;
        std::this_thread::sleep_for(std::chrono::microseconds(100));
      }
      allocated = allocations.count();
    });
    REQUIRE(comes_true([&] { return device.counts().exchanges > 20; }));
    servo.join();
    CHECK(allocated == 0);
    CHECK(fresh == 20);
  }
  CHECK(comes_true([&] { return is_zero_last(service); }));
  auto const sent = service.messages().size();
  std::this_thread::sleep_for(std::chrono::milliseconds(5));
  CHECK(service.messages().size() == sent);   // no message after close
  CHECK(comes_true([&] { return service.goodbyes() == 1; }));
}

TEST_CASE("an Inverse3 is named as haply://HOST:PORT among a program's devices", "[haply]") {
  MockService service;
  DeviceRegistry<double> devices;
  add_haply(devices);
  std::string const where = "haply://127.0.0.1:" + std::to_string(service.port());
  AnyDevice<double> device = devices.make(where + "?device=049D&max_force=0.5&ramp=0&stall=5");
  {
    DeviceSession const session(device);
    REQUIRE(device.get_if<Inverse3Device>() != nullptr);
    CHECK(device.get_if<Inverse3Device>()->report().grip_id == "61548");
    CHECK(device.capabilities().max_force == 0.5);
    CHECK(device.description().vendor == "Haply Robotics");
    DeviceState<double> state;
    CHECK(device.read(state) == DeviceStatus::ok);
  }
  AnyDevice<double> other = devices.make(where + "/?device=04BA");
  CHECK(unsaid(message_of([&] { DeviceSession const session(other); }), "no Inverse3 \"04BA\"; it has 049D") == "");
  CHECK(unsaid(message_of([&] { static_cast<void>(devices.make("haply:?ramp=-1")); }), "haply:?ramp=-1", ".ramp is -1 s") == "");
  CHECK(unsaid(message_of([&] { static_cast<void>(devices.make("haply:?speed=1")); }), "no option speed", "device, grip, dialect, axes") == "");
  CHECK(devices.help().find("haply://HOST:PORT") != std::string::npos);
}

TEST_CASE("host and port of a haply address are taken apart", "[haply]") {
  auto const taken = [](char const* path) {
    Inverse3Options options;
    detail::haply::take_address(path, options);
    return options.host + " " + std::to_string(options.port);
  };
  CHECK(taken("") == "localhost 10001");
  CHECK(taken("//localhost:10001") == "localhost 10001");
  CHECK(taken("//lab.example/") == "lab.example 10001");
  CHECK(taken("//[::1]:4000") == "::1 4000");
  CHECK(taken("//[::1]") == "::1 10001");
  for (char const* path : {"localhost:10001", "//", "//:1", "//host:", "//host:1x", "//host:port", "//[::1", "//[]:1", "//[::1]garbage:80", "//[::1]80", "//host/x:3", "//host/x", "//host:99999999999"})
    CHECK(unsaid(message_of([&] { taken(path); }), path, "is no host and port", "haply://localhost:10001") == "");
  CHECK(unsaid(message_of([] { Inverse3Device const device({.port = 70000}); }), ".port is 70000") == "");
}
