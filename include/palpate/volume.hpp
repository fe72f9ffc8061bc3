// SPDX-License-Identifier: MIT
#pragma once

/// volume: tetrahedra from a surface or from a file, and a fine skin that they carry. Not part of palpate.hpp.
#include <palpate/volume/embedded_surface.hpp>
#include <palpate/volume/fill.hpp>
#include <palpate/volume/organ_volume.hpp>
#include <palpate/volume/read_gmsh.hpp>
#include <palpate/volume/section.hpp>
#include <palpate/volume/winding_number.hpp>
