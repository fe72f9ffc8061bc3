// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/device/device_registry.hpp>
#include <palpate/device/phantom.hpp>

namespace palpate {

/// Adds hd:NAME to the devices that a program knows by name: hd: for the driver's default device, hd:Left Device for one of several.
inline void add_phantom(DeviceRegistry<double>& devices) {
  devices.add({.name = "hd",
               .path = "NAME",
               .about = "a PHANToM or Touch, through the vendor's libHD that this machine has; without NAME the driver's default device",
               .options = {{"library", "file of libHD"},
                           {"rate", "Hz, 1000"},
                           {"max_force", "N, the device's"},
                           {"ramp", "s, 0.5: how the force begins"},
                           {"patience", "s, that arming waits for the user to calibrate, 0"}},
               .make = [](DeviceAddress const& address) {
                 PhantomOptions options{.device = address.path, .library = address.text("library", "")};
                 detail::take_driver_options(address, options);
                 options.calibration_patience = address.number("patience", options.calibration_patience);
                 return AnyDevice<double>(PhantomDevice(options));
               }});
}

}  // namespace palpate
