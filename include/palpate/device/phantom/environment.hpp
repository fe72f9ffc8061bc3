// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <system_error>
#include <vector>

#if defined(__unix__)
#include <unistd.h>
#endif

namespace palpate {

/// What of this machine matters to a PHANToM's driver, in one line: its variables, and the ports that a device can be at. Errors of `open()` end with
/// it.
inline std::string phantom_environment() {
  std::string text;
  auto const add = [&](auto const&... parts) { text += (text.empty() ? "" : ", ") + detail::message(parts...); };
  for (char const* name : {"PALPATE_LIBHD", "GTDD_HOME", "OH_SDK_BASE"}) {
    char const* const value = std::getenv(name);
    if (value == nullptr || *value == '\0')
      add(name, " is not set");
    else
      add(name, " is ", value);
  }
#if defined(__unix__)
  if (::geteuid() == 0) add("this user is root, whose home may lack the device's files");
  std::vector<std::string> ports;
  std::error_code problem;
  for (auto entry = std::filesystem::directory_iterator("/dev", problem); !problem && entry != std::filesystem::directory_iterator();
       entry.increment(problem)) {
    std::string const name = entry->path().filename().string();
    bool const firewire = name.starts_with("fw") && name.size() > 2 && name[2] >= '0' && name[2] <= '9';
    if (name.starts_with("ttyACM") || name.starts_with("hidraw") || firewire) ports.push_back(entry->path().string());
  }
  std::sort(ports.begin(), ports.end());
  if (ports.empty()) add("there is no /dev/ttyACM*, /dev/hidraw* or /dev/fw*");
  for (std::string const& port : ports)
    add(port, ::access(port.c_str(), R_OK | W_OK) == 0 ? " can be used" : " can not be read and written by this user");
#endif
  return text;
}

}  // namespace palpate
