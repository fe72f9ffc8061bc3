// SPDX-License-Identifier: MIT
// expect: in set-up calls alone: compile without -fno-exceptions
// Compiled with -fno-exceptions.
#include <palpate/palpate.hpp>
