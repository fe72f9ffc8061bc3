// SPDX-License-Identifier: MIT
#include "catch.hpp"

#include "device/message.hpp"
#include "haply/mock_service.hpp"

#include <palpate/haply/detail/messages.hpp>

#include <cmath>
#include <random>
#include <string>
#include <vector>

using namespace palpate;
using palpate_test::InventoryText;
using palpate_test::message_of;
using palpate_test::StateText;
using palpate_test::unsaid;

namespace {

Inverse3Report report_of(InventoryText const& inventory, Inverse3Options const& options = {}, std::string const& version = "3.5.0") {
  return detail::haply::read_inventory(inventory.text(), options, version);
}
DeviceState<double> state_of(StateText const& text, Inverse3Report const& report) {
  DeviceState<double> state;
  detail::haply::read_state(text.text(), report, state);
  return state;
}
InventoryText with_basis(std::string const& permutation) {
  InventoryText inventory;
  inventory.basis = R"("basis":{"permutation":")" + permutation + R"("},)";
  return inventory;
}
std::string xyz(double x, double y, double z) {
  return R"({"x":)" + std::to_string(x) + R"(,"y":)" + std::to_string(y) + R"(,"z":)" + std::to_string(z) + "}";
}

}  // namespace

// The vendor's pages: x right, y forward, z up; "YZX" means that the application's X is Haply's Y, its Y Haply's Z, its Z Haply's X.
TEST_CASE("C10-M3: one hand, one force and one turn in every basis of the service", "[haply]") {
  struct Row {
    char const* basis;
    double position[3];   // what the service says of a hand 0.1 to the right, 0.2 forward, 0.3 up
    double force[3];   // what it has to be told for 1 N to the right, 2 N up, 3 N towards the user
    double turn[3];   // axis of a quarter turn about up; a mirror turns it round
  };
  Row const rows[] = {
      {"XYZ", {0.1, 0.2, 0.3}, {1, -3, 2}, {0, 0, 1}},   {"XZY", {0.1, 0.3, 0.2}, {1, 2, -3}, {0, -1, 0}},
      {"X-YZ", {0.1, -0.2, 0.3}, {1, 3, 2}, {0, 0, -1}}, {"ZXY", {0.3, 0.1, 0.2}, {2, 1, -3}, {1, 0, 0}},
      {"YZX", {0.2, 0.3, 0.1}, {-3, 2, 1}, {0, 1, 0}},   {"+XZ-Y", {0.1, 0.3, -0.2}, {1, 2, 3}, {0, 1, 0}},
  };
  for (Row const& row : rows) {
    INFO("basis " << row.basis);
    auto const report = report_of(with_basis(row.basis));
    double const half = std::sqrt(0.5);
    auto const told = [](double const* v) { return xyz(v[0], v[1], v[2]); };
    StateText text{.position = told(row.position), .velocity = told(row.position)};
    text.orientation = R"({"w":0.70710678118654752,"x":)" + std::to_string(half * row.turn[0]) + R"(,"y":)" + std::to_string(half * row.turn[1]) +
                       R"(,"z":)" + std::to_string(half * row.turn[2]) + "}";
    auto const state = state_of(text, report);
    CHECK((state.position - Vector3<double>(0.1, 0.3, -0.2)).norm() < 1e-15);
    CHECK((state.velocity - Vector3<double>(0.1, 0.3, -0.2)).norm() < 1e-15);
    Vector3<double> const turned = state.orientation * Vector3<double>(1.0, 0.0, 0.0);   // from the right to away from the user
    CHECK((turned - Vector3<double>(0.0, 0.0, -1.0)).norm() < 1e-5);
    CHECK(report.frame.to_service(Vector3<double>(1.0, 2.0, 3.0)) == Vector3<double>(row.force[0], row.force[1], row.force[2]));
    CHECK(report.basis == row.basis);
  }
}

TEST_CASE("C10-M4: the axes of the frame can be chosen, a mirror can not", "[haply]") {
  auto const report = report_of({}, {.axes = "XYZ"});   // z up, as Haply's
  CHECK(state_of({.position = xyz(0.1, 0.2, 0.3)}, report).position == Vector3<double>(0.1, 0.2, 0.3));
  for (char const* axes : {"XZY", "XXZ", "XY", "XYZX", "xyz", ""})
    CHECK(unsaid(message_of([&] { Inverse3Options{.axes = axes}.validate(); }), std::string(".axes is \"") + axes + "\"", "XZ-Y") == "");
  CHECK(message_of([] { Inverse3Options{.axes = "-X-YZ"}.validate(); }) == "(no exception)");
}

TEST_CASE("options out of their meaning are refused with their name and value", "[haply]") {
  CHECK(unsaid(message_of([] { Inverse3Options{.port = 0}.validate(); }), ".port is 0") == "");
  CHECK(unsaid(message_of([] { Inverse3Options{.host = ""}.validate(); }), ".host is empty") == "");
  CHECK(unsaid(message_of([] { Inverse3Options{.max_force = guessed(-1.0)}.validate(); }), ".max_force is -1 N") == "");
  CHECK(unsaid(message_of([] { Inverse3Options{.exchange_rate = 50.0}.validate(); }), ".exchange_rate is 50 Hz", "two exchanges") == "");
  CHECK(unsaid(message_of([] { Inverse3Options{.stall = 0.0}.validate(); }), ".stall is 0 s") == "");
}

TEST_CASE("the buttons and the orientation are the grip's", "[haply]") {
  auto const report = report_of({});
  CHECK(report.grip_id == "61548");
  CHECK(report.wireless_grip);
  CHECK(state_of({.buttons = R"({"a":true,"b":false,"c":true})"}, report).buttons == 5u);
  CHECK(state_of({.grip = false}, report).buttons == 0u);   // asleep: nothing is held

  DeviceState<double> state;
  state.orientation = Eigen::Quaternion<double>(0.6, 0.8, 0.0, 0.0);
  detail::haply::read_state(StateText{.orientation = R"({"w":0,"x":0,"y":0,"z":0})"}.text(), report, state);
  CHECK(state.orientation.w() == 0.6);   // a quaternion that is none

  InventoryText wired;
  wired.grips = R"(,"verse_grip":[{"device_id":"7","state":{"button":false,"hall":0,"orientation":{"w":1,"x":0,"y":0,"z":0}}}])";
  auto const with_wire = report_of(wired);
  CHECK_FALSE(with_wire.wireless_grip);
  std::string text = StateText{.grip = false}.text();
  text.pop_back();
  text += R"(,"verse_grip":[{"device_id":"7","state":{"button":true,"hall":0,"orientation":{"w":1,"x":0,"y":0,"z":0}}}]})";
  detail::haply::read_state(text, with_wire, state);
  CHECK(state.buttons == 1u);
  CHECK(state.orientation.w() == 1.0);
  CHECK(report_of({}, {.grip = "none"}).grip_id == "");
}

TEST_CASE("device and grip are chosen by their id, or are the only ones", "[haply]") {
  InventoryText two;
  InventoryText const other{.device = "04BA"};
  two.devices = InventoryText{}.one() + "," + other.one();
  CHECK(unsaid(message_of([&] { report_of(two); }), "several Inverse3s: 049D, 04BA", "device=049D") == "");
  CHECK(report_of(two, {.device = "04BA"}).device_id == "04BA");
  CHECK(unsaid(message_of([&] { report_of(two, {.device = "1"}); }), "no Inverse3 \"1\"", "it has 049D, 04BA") == "");
  InventoryText twins;   // the first of them would be read, and both pushed
  twins.devices = twins.one() + "," + twins.one();
  for (std::string const& device : {std::string(), std::string("049D")})
    CHECK(unsaid(message_of([&] { report_of(twins, {.device = device}); }), "several Inverse3s with the id 049D", "unplug all but one") == "");
  InventoryText grips;
  grips.grips = R"(,"wireless_verse_grip":[{"device_id":"1"},{"device_id":"2"}])";
  CHECK(unsaid(message_of([&] { report_of(grips); }), "several verse grips: 1, 2", "grip=1") == "");
  CHECK(report_of(grips, {.grip = "2"}).grip_id == "2");
  CHECK(unsaid(message_of([] { detail::haply::read_inventory(R"({"inverse3":[]})", {}, ""); }), "no Inverse3", "cable") == "");
  CHECK(unsaid(message_of([] { detail::haply::read_inventory("{}", {}, ""); }), "no Inverse3") == "");
}

TEST_CASE("mount and workspace are reported; a scale is refused unless it is allowed", "[haply]") {
  InventoryText moved;
  moved.mount = R"("mount":{"position":{"x":0.01,"y":0,"z":0},"rotation":{"w":0,"x":0,"y":0,"z":1}},)";
  moved.transform = R"(,"transform":{"position":{"x":0,"y":0.5,"z":0}})";   // parts that are as in the identity are left out
  auto const report = report_of(moved);
  CHECK(report.mount.position.x() == 0.01);
  CHECK(report.mount.rotation.z() == 1.0);
  CHECK(report.workspace.position.y() == 0.5);
  CHECK(report.workspace.keeps_lengths());
  CHECK_FALSE(report.mount.is_identity());
  CHECK(report.handedness == "right");
  CHECK(report.power_supply == true);

  InventoryText large;
  large.mount = R"("mount":{"scale":{"x":2,"y":2,"z":2}},)";
  CHECK(unsaid(message_of([&] { report_of(large); }), "scales the motion of 049D by 2, 2, 2", ".accepts_scale") == "");
  CHECK(report_of(large, {.accepts_scale = true}).mount.scale.x() == 2.0);

  InventoryText old;   // what services before 3.5 say
  old.basis = old.mount = old.transform = "";
  CHECK(report_of(old).basis == "");
  CHECK(report_of(old).mount.is_identity());
  CHECK(unsaid(message_of([] { report_of(with_basis("XXY")); }), "by \"XXY\"", "X, Y and Z") == "");
}

TEST_CASE("the version of the service decides how forces are written", "[haply]") {
  using detail::haply::ForceCommand;
  Vector3<double> const up(0.0, 1.5, 0.0);
  auto const command = [&](std::string const& version, HaplyDialect dialect) {
    return ForceCommand(report_of({}, {.dialect = dialect}, version)).text(up);
  };
  std::string const begin = R"({"inverse3":[{"commands":{"set_cursor_force":{)", end = R"(:{"x":0.0,"y":0.0,"z":1.5}}},"device_id":"049D"}]})";
  CHECK(command("3.5.0", HaplyDialect::by_version) == begin + R"("vector")" + end);
  CHECK(command("4.0", HaplyDialect::by_version) == begin + R"("vector")" + end);
  CHECK(command("", HaplyDialect::by_version) == begin + R"("vector")" + end);
  CHECK(command("3.4.9", HaplyDialect::by_version) == begin + R"("values")" + end);
  CHECK(command("3.1.1", HaplyDialect::by_version) == begin + R"("values")" + end);
  CHECK(command("3.1.1", HaplyDialect::vector) == begin + R"("vector")" + end);
  CHECK(command("3.5.0", HaplyDialect::values) == begin + R"("values")" + end);

  using detail::haply::service_version;
  CHECK(service_version(R"({"git_describe":"3.5.0-2-gce","git_tag":"3.5.0","project_version":"3.5.0.0"})") == "3.5.0");
  CHECK(service_version(R"({"git_tag":"v3.1.1"})") == "3.1.1");
  CHECK(service_version(R"({"git_tag":"","project_version":"3.0.7.0"})") == "3.0.7.0");
  for (char const* text : {"", "{", "[]", "<html>", R"({"git_tag":3})", R"({"git_tag":"main"})", R"({"git_tag":"3"})", R"({"git_tag":"3.x"})"})
    CHECK(service_version(text) == "");
}

TEST_CASE("what a state must have is named when it is missing, of another kind or no number", "[haply]") {
  auto const report = report_of({});
  auto const said = [&](StateText const& text) { return message_of([&] { state_of(text, report); }); };
  CHECK(unsaid(said({.position = R"({"x":0.1,"y":0.2})"}), "the state.inverse3[0].state.cursor_position without z") == "");
  CHECK(unsaid(said({.position = R"({"x":"0.1","y":0,"z":0})"}), "cursor_position.x as \"0.1\"", "not a number") == "");
  CHECK(unsaid(said({.position = R"({"x":null,"y":0,"z":0})"}), "cursor_position.x as null") == "");   // how NaN is often written
  CHECK(unsaid(said({.position = R"({"x":NaN,"y":0,"z":0})"}), "no JSON") == "");
  CHECK(unsaid(said({.position = R"({"x":1e999,"y":0,"z":0})"}), "a number that is too large", "1e999") == "");
  CHECK(unsaid(said({.position = "[0,0,0]"}), "cursor_position as [0,0,0]", "not an object") == "");
  CHECK(unsaid(said({.velocity = "null"}), "cursor_velocity as null") == "");
  CHECK(unsaid(said({.buttons = R"({"a":1,"b":false,"c":false})"}), "buttons.a as 1", "true or false") == "");
  CHECK(unsaid(said({.device = "04BA"}), "no longer has 049D") == "");
  CHECK(unsaid(said({.transform = R"({"scale":{"x":2,"y":2,"z":2}})"}), "moved or scaled the workspace of 049D") == "");
  DeviceState<double> state;
  state.position.setConstant(7.0);
  CHECK_THROWS_AS(detail::haply::read_state(StateText{.buttons = "{}"}.text(), report, state), HaplyError);
  CHECK(state.position.x() == 7.0);
}

TEST_CASE("no damage to a message brings out anything but the adapter's own error", "[haply]") {
  auto const report = report_of({});
  std::string const inventory = InventoryText{}.text(), good = StateText{}.text();
  int refused = 0, read = 0;
  auto const feed = [&](std::string const& text) {
    for (int kind = 0; kind < 2; ++kind) {
      DeviceState<double> state;
      try {
        if (kind == 0)
          detail::haply::read_state(text, report, state);
        else
          state.position = detail::haply::read_inventory(text, {}, "").mount.position;
        ++read;
        if (!state.position.allFinite() || !state.velocity.allFinite() || std::abs(state.orientation.norm() - 1.0) > 1e-9) FAIL(text);
      } catch (HaplyError const&) {
        ++refused;
      }
    }
  };
  for (std::string const& text : {inventory, good})
    for (std::size_t length = 0; length < text.size(); ++length) feed(text.substr(0, length));
  CHECK(read == 0);
  std::mt19937 random(6);   // NOLINT: the same each time
  std::string const likely = "{}[]\":,0-+.eEnt\\u\xff\x80 \n";
  for (std::string const& text : {inventory, good})
    for (int k = 0; k < 3000; ++k) {
      std::string damaged = text;
      for (auto n = 1 + random() % 3; n > 0; --n) {
        std::size_t const at = random() % damaged.size();
        if (random() % 3 == 0)
          damaged.erase(at, 1 + random() % 4);
        else
          damaged[at] = random() % 2 == 0 ? likely[random() % likely.size()] : static_cast<char>(random() % 256);
      }
      feed(damaged);
    }
  CHECK(refused > 5000);
  CHECK(read > 500);
  feed(std::string(100000, '['));
  std::string const deep = std::string(400000, '[') + std::string(400000, ']');   // as deep as a message may be long
  for (char const* key : {"device_id", "state"}) feed(R"({"inverse3":[{")" + std::string(key) + "\":" + deep + "}]}");
  feed(deep);
  feed("\xef\xbb\xbf" + good);
}
