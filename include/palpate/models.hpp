// SPDX-License-Identifier: MIT
#pragma once

/// models: other ways to make a body of tissue, beside springs and finite elements. Not part of palpate.hpp.
#include <palpate/tissue/cubes/cubes.hpp>
#include <palpate/tissue/long_elements/long_elements.hpp>
#include <palpate/tissue/tensor_mass/tensor_mass.hpp>
#include <palpate/tissue/vertex_rings/vertex_rings.hpp>
