// SPDX-License-Identifier: MIT
#pragma once

#include "options.hpp"
#include "organ.hpp"
#include "pressing.hpp"

#include <string>
#include <vector>

namespace palpation {

/// Writes palpation.csv, palpation.pvd with its frames, and the pictures. Without a display these are left out with one line on standard error. Returns the names
/// of what was written.
std::vector<std::string> write_outputs(Options const& options, Organ const& organ, std::vector<Press> const& with, std::vector<Press> const& without);

}  // namespace palpation
