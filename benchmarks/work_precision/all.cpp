// SPDX-License-Identifier: MIT
#include "all.hpp"

#include "integrators.hpp"
#include "sweep.hpp"

namespace work_precision {

void compare_all(Rows& rows, Case const& at, Effort const& effort) {
  for_each_integrator([&](char const* name, auto const& integrator) { compare(rows, at, name, integrator, effort); });
}

std::vector<std::string> integrator_names() {
  std::vector<std::string> names;
  for_each_integrator([&](char const* name, auto const&) { names.emplace_back(name); });
  return names;
}

}  // namespace work_precision
