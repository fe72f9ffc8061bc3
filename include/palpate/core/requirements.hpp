// SPDX-License-Identifier: MIT
#pragma once

// What the library needs of a compiler and its options: told here, before the compiler tells of what it stumbles over.

#if defined(_MSVC_LANG) ? _MSVC_LANG < 202002L : __cplusplus < 202002L
#error "palpate needs C++20: compile with -std=c++20, or link to the CMake target palpate::palpate, which asks for it"
#endif

#if !defined(__cpp_exceptions)
#error "palpate refuses what makes no sense by exceptions, in set-up calls alone: compile without -fno-exceptions"
#endif

#if defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__ && !defined(PALPATE_FINITE_MATH_ONLY)
#error "palpate looks for values that are not finite, which -ffast-math and -ffinite-math-only leave out: add -fno-finite-math-only, or define PALPATE_FINITE_MATH_ONLY and have no such checks"
#endif
