// SPDX-License-Identifier: MIT
#include <palpate/palpate.hpp>
#include <palpate/palpate.hpp>

#include "units.hpp"

int first_unit_version() { return PALPATE_VERSION; }
