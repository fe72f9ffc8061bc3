// SPDX-License-Identifier: MIT
#include "units.hpp"

int main() { return first_unit_version() == second_unit_version() ? 0 : 1; }
