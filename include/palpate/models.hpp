// SPDX-License-Identifier: MIT
#pragma once

/// models: other ways to make a body of tissue, beside springs and finite elements. Not part of palpate.hpp.
#include <palpate/integrator/node_steps.hpp>
#include <palpate/mesh/thigh.hpp>
#include <palpate/tissue/cubes/cubes.hpp>
#include <palpate/tissue/long_elements/long_elements.hpp>
#include <palpate/tissue/tensor_mass/corotated_tensor_mass.hpp>
#include <palpate/tissue/tensor_mass/tensor_mass.hpp>
#include <palpate/tissue/two_layers.hpp>
#include <palpate/tissue/vertex_rings/vertex_rings.hpp>
#include <palpate/tissue/young_springs.hpp>
