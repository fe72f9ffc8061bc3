// SPDX-License-Identifier: MIT
// expect: palpate: min, max, near, far or small is a macro here
// Compiled with a macro small.
#include <palpate/palpate.hpp>
