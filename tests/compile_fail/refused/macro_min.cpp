// SPDX-License-Identifier: MIT
// expect: palpate: min, max, near, far or small is a macro here
// A macro min between the standard library and this one.
#include <algorithm>
#define min(a, b) ((a) < (b) ? (a) : (b))
#include <palpate/palpate.hpp>
