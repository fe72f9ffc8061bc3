// SPDX-License-Identifier: MIT
#pragma once

#include "row.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace work_precision {

/// A chart for each scene, and one of implicit steps beside leapfrog's: PNG files, whose names are returned. Where they can not be drawn: none, and a line that
/// says why.
std::vector<std::filesystem::path> write_charts(std::filesystem::path const& folder, Rows const& rows, std::vector<std::string> const& integrators);

}  // namespace work_precision
