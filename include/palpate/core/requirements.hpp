// SPDX-License-Identifier: MIT
#pragma once

// What the library needs of a compiler and its options: told here, before the compiler tells of what it stumbles over. A file that is not there ends what it says.

#if defined(_MSVC_LANG) ? _MSVC_LANG < 202002L : __cplusplus < 202002L
#error "palpate needs C++20: compile with -std=c++20, or link to the CMake target palpate::palpate, which asks for it"
#include <palpate_needs_another_language_standard>
#endif

#if !defined(__cpp_exceptions)
#error "palpate refuses what makes no sense by exceptions, in set-up calls alone: compile without -fno-exceptions"
#include <palpate_needs_exceptions>
#endif

#if defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__ && !defined(PALPATE_FINITE_MATH_ONLY)
#error "palpate looks for values that are not finite, which -ffast-math and -ffinite-math-only leave out: add -fno-finite-math-only, or define PALPATE_FINITE_MATH_ONLY and have no such checks"
#include <palpate_needs_numbers_that_are_not_finite>
#endif

#include <cstddef>   // from here on libstdc++ has no macros min and max, if they were defined before all of it
#if defined(min) || defined(max) || defined(near) || defined(far) || defined(small)
#error "palpate: min, max, near, far or small is a macro here, as windows.h makes them: include palpate before that, or #undef it"
#include <palpate_needs_names_that_are_no_macros>
#endif
