// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/detail/text.hpp>
#include <palpate/core/error.hpp>
#include <palpate/device/detail/driver.hpp>
#include <palpate/device/device_registry.hpp>
#include <palpate/haply/inverse3.hpp>

#include <string_view>

namespace palpate {

namespace detail::haply {

/// Fills host and port from "//host:port", "//host" or nothing; "[::1]" is a host too.
inline void take_address(std::string_view path, Inverse3Options& options) {
  std::string_view rest = path;
  auto const refuse = [&] {
    throw InvalidArgument(message("\"", legible(path), "\" is no host and port; write haply://localhost:10001, or haply: for that"));
  };
  if (rest.empty()) return;
  if (!rest.starts_with("//")) refuse();
  rest.remove_prefix(2);
  if (rest.ends_with('/')) rest.remove_suffix(1);
  std::size_t const bracket = rest.starts_with('[') ? rest.find(']') : 0;
  if (bracket == std::string_view::npos || rest.find('/') != std::string_view::npos) refuse();
  if (bracket > 0 && bracket + 1 < rest.size() && rest[bracket + 1] != ':') refuse();
  std::size_t const colon = rest.find(':', bracket);
  std::string_view host = rest.substr(0, colon);
  if (bracket > 0) host = host.substr(1, host.size() - 2);
  if (host.empty()) refuse();
  options.host = host;
  if (colon == std::string_view::npos) return;
  auto const port = to_number<decltype(options.port)>(rest.substr(colon + 1));
  if (!port) refuse();
  options.port = *port;
}

}  // namespace detail::haply

/// Adds haply://HOST:PORT to the devices that a program knows by name; haply: alone is haply://localhost:10001.
inline void add_haply(DeviceRegistry<double>& devices) {
  devices.add({.name = "haply",
               .path = "//HOST:PORT",
               .about = "an Inverse3 of Haply, through the vendor's service; without HOST and PORT the one of this machine",
               .options = {{"device", "its id, where the service has several"},
                           {"grip", "id of the verse grip, where the service has several; none: without"},
                           {"dialect", "by_version, vector or values: how forces are written"},
                           {"axes", "XZ-Y: x right, y up, z towards the user, in Haply's x right, y forward, z up"},
                           {"scale", "refuse or accept a service that scales lengths"},
                           {"rate", "Hz, 1000"},
                           {"max_force", "N, 3: a guess, the maker publishes none"},
                           {"ramp", "s, 0.5: how the force begins"},
                           {"stall", "s, 0.1: after which a silent service is a fault"}},
               .make = [](DeviceAddress const& address) {
                 Inverse3Options options;
                 detail::haply::take_address(address.path, options);
                 options.device = address.text("device", "");
                 options.grip = address.text("grip", "");
                 constexpr HaplyDialect dialects[] = {HaplyDialect::by_version, HaplyDialect::vector, HaplyDialect::values};
                 options.dialect = dialects[address.choice("dialect", {"by_version", "vector", "values"})];
                 options.axes = address.text("axes", options.axes);
                 options.accepts_scale = address.choice("scale", {"refuse", "accept"}) == 1;
                 detail::take_driver_options(address, options);
                 options.stall = address.number("stall", options.stall);
                 return AnyDevice<double>(Inverse3Device(options));
               }});
}

}  // namespace palpate
