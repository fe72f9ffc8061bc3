// SPDX-License-Identifier: MIT
#pragma once

// Catch2 2.13 (Debian 12) and Catch2 3 under one name. Tests include this and nothing else of Catch2; both give ::Approx.
#if __has_include(<catch2/catch_all.hpp>)
#include <catch2/catch_all.hpp>
using Catch::Approx;
#else
#include <catch2/catch.hpp>
#endif

// What a test is run with that says nothing of one of them alone. The sanitizers take double only; a test that looks at how numbers lie in
// memory names both by itself.
#ifndef PALPATE_TEST_SCALARS
#define PALPATE_TEST_SCALARS float, double
#endif
