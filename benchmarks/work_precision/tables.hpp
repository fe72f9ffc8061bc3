// SPDX-License-Identifier: MIT
#pragma once

#include "case.hpp"

namespace work_precision {

/// The scene, and how good its reference is.
void print_reference(Case const& at);

/// What the manual shows: for each scene the cost of an error of 1 % and of 1e-4, stability limits, energy, the thesis's table beside ours, and
/// implicit steps beside leapfrog's on the stiff body.
void print_tables(Rows const& rows);

}  // namespace work_precision
