// SPDX-License-Identifier: MIT
#pragma once

// The one place where the version is written: CMake reads it from here.
#define PALPATE_VERSION_MAJOR 0
#define PALPATE_VERSION_MINOR 1
#define PALPATE_VERSION_PATCH 0

/// 10000 · major + 100 · minor + patch, for comparisons in `#if`.
#define PALPATE_VERSION (PALPATE_VERSION_MAJOR * 10000 + PALPATE_VERSION_MINOR * 100 + PALPATE_VERSION_PATCH)
#define PALPATE_VERSION_STRING "0.1.0"
