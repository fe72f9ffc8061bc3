// SPDX-License-Identifier: MIT
#pragma once

#include "case.hpp"

#include <string>
#include <vector>

namespace work_precision {

/// Everything about every integrator in one scene.
void compare_all(Rows& rows, Case const& at, Effort const& effort);

/// The names of all integrators, in order.
std::vector<std::string> integrator_names();

}  // namespace work_precision
