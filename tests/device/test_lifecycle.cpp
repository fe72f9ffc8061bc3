// SPDX-License-Identifier: MIT
#include "catch.hpp"

#include <palpate/device/lifecycle.hpp>

#include <cstddef>
#include <set>
#include <string>
#include <tuple>
#include <vector>

using namespace palpate;

namespace {

std::vector<DeviceStage> every_stage() {
  std::vector<DeviceStage> all;
  for (std::size_t i = 0; i < device_stages; ++i) all.push_back(static_cast<DeviceStage>(i));
  return all;
}

std::vector<DeviceEvent> every_event() {
  std::vector<DeviceEvent> all;
  for (std::size_t i = 0; i < device_events; ++i) all.push_back(static_cast<DeviceEvent>(i));
  return all;
}

bool is_request(DeviceEvent event) {
  return event == DeviceEvent::opened || event == DeviceEvent::arm || event == DeviceEvent::ramped || event == DeviceEvent::calibrated;
}

std::string arrow(DeviceStage from, DeviceEvent event) { return std::string(to_string(from)) + " + " + to_string(event); }

static_assert(next(DeviceStage::running, DeviceEvent::fault) == DeviceStage::faulted, "the table can be asked while compiling");
static_assert(!next(DeviceStage::closed, DeviceEvent::arm));

}  // namespace

TEST_CASE("every stage and every event has a name of its own", "[device]") {
  std::set<std::string> names;
  for (DeviceStage const stage : every_stage()) names.insert(to_string(stage));
  for (DeviceEvent const event : every_event()) names.insert(to_string(event));
  CHECK(names.size() == device_stages + device_events);
  CHECK(names.count("unknown") == 0);
  CHECK(std::string(to_string(static_cast<DeviceStage>(device_stages))) == "unknown");
  CHECK(std::string(to_string(static_cast<DeviceEvent>(device_events))) == "unknown");
}

// The whole table against the drawing: the arrows that change the stage are these and no others.
TEST_CASE("the arrows between stages are those of the drawing", "[device]") {
  using enum DeviceStage;
  using Arrow = std::tuple<DeviceStage, DeviceEvent, DeviceStage>;
  std::set<Arrow> drawn{
      {closed, DeviceEvent::opened, open},
      {open, DeviceEvent::arm, arming},
      {calibrating, DeviceEvent::calibrated, open},
      {arming, DeviceEvent::ramped, running},
      {running, DeviceEvent::data_late, stale},
      {stale, DeviceEvent::data_fresh, running},
      {running, DeviceEvent::interrupted, arming},
      {stale, DeviceEvent::interrupted, arming},
  };
  for (DeviceStage const from : {arming, running, stale}) drawn.insert({from, DeviceEvent::disarm, open});
  for (DeviceStage const from : {open, arming, running, stale}) drawn.insert({from, DeviceEvent::calibration_lost, calibrating});
  for (DeviceStage const from : every_stage()) {
    if (from != faulted) drawn.insert({from, DeviceEvent::fault, faulted});
    if (from != closed) drawn.insert({from, DeviceEvent::close, closed});
  }
  std::set<Arrow> found;
  for (DeviceStage const from : every_stage())
    for (DeviceEvent const event : every_event())
      if (auto const to = next(from, event); to && *to != from) found.insert({from, event, *to});
  CHECK(found == drawn);
}

TEST_CASE("facts are never refused, requests lead somewhere else or are refused", "[device]") {
  for (DeviceStage const from : every_stage())
    for (DeviceEvent const event : every_event()) {
      auto const to = next(from, event);
      INFO(arrow(from, event));
      if (is_request(event)) CHECK((!to || *to != from));
      else CHECK(to.has_value());
    }
}

TEST_CASE("no fact switches the force on, a fault and a closing always switch it off", "[device]") {
  for (DeviceStage const from : every_stage()) {
    INFO(to_string(from));
    CHECK_FALSE(may_render(next(from, DeviceEvent::fault).value()));
    CHECK_FALSE(may_render(next(from, DeviceEvent::close).value()));
    CHECK_FALSE(may_render(next(from, DeviceEvent::disarm).value()));
    CHECK_FALSE(may_render(next(from, DeviceEvent::calibration_lost).value()));
    for (DeviceEvent const event : every_event()) {
      auto const to = next(from, event);
      if (to && may_render(*to) && !may_render(from)) {
        INFO(to_string(event));
        CHECK(event == DeviceEvent::arm);
        CHECK(*to == DeviceStage::arming);   // and never past the ramp
      }
    }
  }
}

// All stages that any sequence of events can reach: a search of the graph.
TEST_CASE("every stage is reached, and closing and opening again leads out of every one", "[device]") {
  for (DeviceStage const begin : every_stage()) {
    std::set<DeviceStage> reached{begin};
    for (bool grew = true; grew;) {
      std::size_t const before = reached.size();
      for (DeviceStage const from : std::set<DeviceStage>(reached))
        for (DeviceEvent const event : every_event())
          if (auto const to = next(from, event)) reached.insert(*to);
      grew = reached.size() > before;
    }
    INFO(to_string(begin));
    CHECK(reached.size() == device_stages);
  }
  // A fault is left by closing alone.
  for (DeviceEvent const event : every_event())
    if (auto const to = next(DeviceStage::faulted, event)) CHECK((*to == DeviceStage::faulted || event == DeviceEvent::close));
}

TEST_CASE("a lifecycle remembers its stage and refuses what is out of order", "[device]") {
  DeviceLifecycle life;
  CHECK(life.stage() == DeviceStage::closed);
  CHECK_FALSE(life.handle(DeviceEvent::arm));
  CHECK(life.stage() == DeviceStage::closed);
  CHECK(life.handle(DeviceEvent::opened));
  CHECK(is_open(life.stage()));
  CHECK_FALSE(life.may_render());
  CHECK(life.handle(DeviceEvent::calibration_lost));
  CHECK_FALSE(life.handle(DeviceEvent::arm));
  CHECK(life.handle(DeviceEvent::calibrated));
  CHECK(life.handle(DeviceEvent::arm));
  CHECK(life.may_render());
  CHECK(life.handle(DeviceEvent::ramped));
  CHECK(life.handle(DeviceEvent::data_late));
  CHECK(life.stage() == DeviceStage::stale);
  CHECK(life.may_render());
  CHECK(life.handle(DeviceEvent::data_fresh));
  CHECK(life.stage() == DeviceStage::running);
  CHECK(life.handle(DeviceEvent::fault));
  CHECK_FALSE(is_open(life.stage()));
  CHECK_FALSE(life.handle(DeviceEvent::opened));
  CHECK(life.handle(DeviceEvent::close));
  CHECK(life.handle(DeviceEvent::opened));
}
