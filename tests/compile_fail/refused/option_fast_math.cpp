// SPDX-License-Identifier: MIT
// expect: add -fno-finite-math-only, or define PALPATE_FINITE_MATH_ONLY
// Compiled with -ffast-math.
#include <palpate/palpate.hpp>
