// SPDX-License-Identifier: MIT
#include "catch.hpp"

#include "device/message.hpp"
#include "device/temporary_folder.hpp"
#include "training/sessions.hpp"

#include <palpate/device/built_in_devices.hpp>
#include <palpate/training/replay_address.hpp>

#include <string>

using namespace palpate;
using palpate_test::message_of;
using palpate_test::unsaid;

TEST_CASE("a session's file is a device by name, in both formats", "[training]") {
  // Yardstick: the samples that went into the file.
  palpate_test::TemporaryFolder const folder;
  Session const session = palpate_test::random_session(3, 50, true);
  write_session(folder / "hand.session", session);
  write_session_csv(folder / "hand.csv", session);
  auto devices = built_in_devices();
  add_replay(devices);
  for (char const* const name : {"hand.session", "hand.csv"}) {
    auto device = devices.make("replay:" + (folder / name).string());
    CHECK(device.capabilities().rate == 500.0);
    bool same = true;
    for (HandSample const& sample : session.hand) {
      DeviceState<double> state;
      same = same && device.read(state) == sample.read;
      if (is_usable(sample.read)) same = same && state.position == sample.position && state.velocity == sample.velocity;
      same = same && device.write({}) == sample.written;
    }
    INFO(name);
    CHECK(same);
  }
  CHECK(unsaid(message_of([&] { devices.make("replay:"); }), "replay:FILE") == "");
  CHECK(unsaid(message_of([&] { devices.make("replay:nowhere"); }), "nowhere") == "");
  CHECK(unsaid(message_of([&] { devices.make("replay:x?rate=3"); }), "replay has no option rate") == "");
}
