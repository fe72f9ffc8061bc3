// SPDX-License-Identifier: MIT
#pragma once

#include "row.hpp"

namespace work_precision {

/// Checks the rows against what is known without this library: the orders of the textbooks, closed forms of the energy of single oscillators,
/// Verlet's limit. Prints each law that does not hold; 0 when all do.
int check_laws(Rows const& rows);

}  // namespace work_precision
