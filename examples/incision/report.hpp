// SPDX-License-Identifier: MIT
#pragma once

#include "options.hpp"
#include "outcome.hpp"
#include "scene.hpp"

#include <string>
#include <vector>

namespace incision {

/// The summary for a person, in lines.
std::string summary(Options const& options, Organ const& organ, Hand const& hand, Outcome const& outcome,
                    std::vector<std::string> const& written);

}  // namespace incision
