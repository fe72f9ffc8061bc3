// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>

namespace fit_example {

/// A file of measurements that nobody measured, "liver" or "needle": forces of a known model with noise, to try the fits on. Its first lines say so.
/// The same text on every machine.
std::string generated_text(std::string_view which);

}  // namespace fit_example
