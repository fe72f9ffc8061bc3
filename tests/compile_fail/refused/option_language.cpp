// SPDX-License-Identifier: MIT
// expect: palpate needs C++20: compile with -std=c++20
// Compiled as C++17.
#include <palpate/palpate.hpp>
