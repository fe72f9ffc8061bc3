// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/device/device_registry.hpp>
#include <palpate/training/replay.hpp>
#include <palpate/training/session_io.hpp>

namespace palpate {

/// Adds replay:FILE to the devices that a program knows: the hand of a session, from a file of `write_session`, or of `write_session_csv` if its
/// name ends in .csv. As `replay_whatever`: whether the simulator repeats the session to the byte is not asked; `replay` does.
/// Errors     as those of the readers, when a device is made.
template <RealScalar Scalar>
void add_replay(DeviceRegistry<Scalar>& devices) {
  devices.add({.name = "replay",
               .path = "FILE",
               .about = "the hand of a session that was kept; .csv or binary",
               .options = {},
               .make = [](DeviceAddress const& address) {
                 if (address.path.empty()) throw InvalidArgument("replay: needs the file of a session; write replay:FILE");
                 return AnyDevice<Scalar>(replay_whatever<Scalar>(read_session(address.path)));
               }});
}

}  // namespace palpate
