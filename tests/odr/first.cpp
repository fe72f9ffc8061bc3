// SPDX-License-Identifier: MIT
#include <palpate/palpate.hpp>
#include <palpate/palpate.hpp>
#include <palpate/fitting.hpp>
#include <palpate/organs.hpp>
#include <palpate/training.hpp>

#include "units.hpp"

int first_unit_version() { return PALPATE_VERSION; }
