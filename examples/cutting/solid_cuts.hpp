// SPDX-License-Identifier: MIT
#pragma once

#include "pictures.hpp"

namespace cutting {

/// Cuts a block of tissue under pre-strain in six ways, each anew, and writes two pictures of each; one line a cut to standard output. Returns whether all that
/// no cut may change holds.
bool show_solid_cuts(Canvas const& canvas);

}  // namespace cutting
