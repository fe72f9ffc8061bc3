// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/detail/text.hpp>
#include <palpate/core/error.hpp>
#include <palpate/device/device_registry.hpp>
#include <palpate/device/force_dimension.hpp>

#include <string>

namespace palpate {

/// Adds dhd:INDEX to the devices that a program knows by name; dhd: alone is dhd:0, the first device.
inline void add_force_dimension(DeviceRegistry<double>& devices) {
  devices.add({.name = "dhd",
               .path = "INDEX",
               .about = "a delta, omega, sigma or lambda of Force Dimension, through the vendor's library that this machine has",
               .options = {{"library", "file of libdrd or libdhd"},
                           {"rate", "Hz, 1000"},
                           {"max_force", "N, the device's"},
                           {"ramp", "s, 0.5: how the force begins"}},
               .make = [](DeviceAddress const& address) {
                 ForceDimensionOptions options{.library = address.text("library", "")};
                 if (std::string const& index = address.path; !index.empty()) {
                   auto const number = detail::to_number<int>(index);
                   if (!number) throw InvalidArgument(detail::message("\"", index, "\" is no index of a device; write dhd:0 for the first"));
                   options.device = *number;
                 }
                 detail::take_driver_options(address, options);
                 return AnyDevice<double>(ForceDimensionDevice(options));
               }});
}

}  // namespace palpate
