// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>

namespace fit_example {

/// Loads a force file into a simulator, presses and cuts a small sheet with it, and says in a few lines what the hand felt.
/// Throws FileError for a file that is none, Error for a force that is not finite.
std::string check_force(std::filesystem::path const& file);

}  // namespace fit_example
