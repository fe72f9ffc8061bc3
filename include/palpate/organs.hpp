// SPDX-License-Identifier: MIT
#pragma once

/// organs: surfaces like a liver and a heart to try things on, and the surface of any implicit function. Not part of palpate.hpp.
#include <palpate/mesh/heart.hpp>
#include <palpate/mesh/implicit.hpp>
#include <palpate/mesh/organ.hpp>
