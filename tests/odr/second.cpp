// SPDX-License-Identifier: MIT
#include "every_header_reversed.hpp"
#include "units.hpp"

int second_unit_version() { return PALPATE_VERSION; }
