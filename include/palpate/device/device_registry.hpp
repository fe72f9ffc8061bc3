// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/device/any_device.hpp>
#include <palpate/device/device_address.hpp>

#include <algorithm>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace palpate {

/// One kind of device that can be named.
template <RealScalar Scalar>
struct DeviceScheme {
  struct Option {
    std::string name, meaning;
  };
  std::string name;      ///< "script", or with a path that belongs to it, "sim:touch"
  std::string path;      ///< what follows the colon, for people: "FILE.csv"; empty: nothing may follow
  std::string about;     ///< one line
  std::vector<Option> options;   ///< all that it knows; others are refused before `make` is called
  std::function<AnyDevice<Scalar>(DeviceAddress const&)> make;
};

/// The devices that a program knows by name. Nothing is global: a host makes one, adds what it has and asks it.
///
///   DeviceRegistry<double> devices = built_in_devices();
///   devices.add({.name = "robot", .path = "HOST", .about = "our robot", .options = {{"port", "of the host"}},
///                .make = [](DeviceAddress const& address) {…}});
///   Simulator simulator(devices.make("sim:touch?hand=light"), …);
///
/// A name with a path of its own, as sim:touch, comes before the bare scheme.
/// Errors     `InvalidArgument` that lists the names there are, or the options that a name knows; what a maker throws.
template <RealScalar Scalar>
class DeviceRegistry {
 public:
  using Scheme = DeviceScheme<Scalar>;

  void add(Scheme scheme) {
    DeviceAddress const address = parse_device_address(scheme.name.find(':') == std::string::npos ? scheme.name + ":" : scheme.name);
    std::string name = address.path.empty() ? address.scheme : address.scheme + ":" + address.path;
    if (!address.options.empty() || name != scheme.name)
      throw InvalidArgument(detail::message("DeviceRegistry: \"", scheme.name, "\" is no name; give small letters, as robot or sim:robot"));
    if (!scheme.make) throw InvalidArgument(detail::message("DeviceRegistry: ", name, " has no .make; give a function from address to device"));
    if (schemes_.count(name) != 0) throw InvalidArgument(detail::message("DeviceRegistry: ", name, " is there already; names are taken once"));
    schemes_.emplace(std::move(name), std::move(scheme));
  }

  /// The device of that name, not opened yet.
  AnyDevice<Scalar> make(std::string_view text) const {
    DeviceAddress const address = parse_device_address(text);
    Scheme const& scheme = find(address);
    for (auto const& [option, value] : address.options) {
      bool const known = std::any_of(scheme.options.begin(), scheme.options.end(), [&wanted = option](auto const& one) { return one.name == wanted; });
      if (!known) refuse(address, scheme.name, " has no option ", option, "; it has ", options_of(scheme));
    }
    if (scheme.path.empty() && !address.path.empty() && scheme.name == address.scheme)
      refuse(address, "nothing follows ", scheme.name, ": but options");
    try {
      return scheme.make(address);
    } catch (InvalidArgument const& error) {
      refuse(address, error.what());
    }
  }

  bool knows(std::string_view name) const { return schemes_.find(name) != schemes_.end(); }
  /// All names, with what they are and their options, for a program's --help.
  std::string help() const {
    std::string text;
    for (auto const& [name, scheme] : schemes_) {
      text += usage(scheme) + "\n    " + scheme.about + "\n";
      for (auto const& option : scheme.options) text += "    " + option.name + "=    " + option.meaning + "\n";
    }
    return text;
  }

 private:
  template <class... Parts>
  [[noreturn]] static void refuse(DeviceAddress const& address, Parts const&... parts) {
    throw InvalidArgument(detail::message("device \"", to_string(address), "\": ", parts...));
  }
  static std::string usage(Scheme const& scheme) {
    return scheme.name.find(':') == std::string::npos ? scheme.name + ":" + scheme.path : scheme.name;
  }
  static std::string options_of(Scheme const& scheme) {
    std::string all;
    for (auto const& option : scheme.options) (all += all.empty() ? "" : ", ") += option.name;
    return all.empty() ? "none" : all;
  }

  Scheme const& find(DeviceAddress const& address) const {
    auto found = schemes_.find(address.scheme + ":" + address.path);
    if (found == schemes_.end() || address.path.empty()) found = schemes_.find(address.scheme);
    if (found != schemes_.end()) return found->second;
    std::string all, near;
    for (auto const& [name, scheme] : schemes_) {
      (all += all.empty() ? "" : ", ") += usage(scheme);
      if (name.compare(0, address.scheme.size() + 1, address.scheme + ":") == 0) (near += near.empty() ? "" : ", ") += name;
    }
    if (!near.empty()) refuse(address, address.scheme, " knows no \"", address.path, "\"; there are ", near);
    refuse(address, "nothing is called ", address.scheme, "; there are ", all.empty() ? "none" : all);
  }

  std::map<std::string, Scheme, std::less<>> schemes_;
};

}  // namespace palpate
