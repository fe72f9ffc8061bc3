// SPDX-License-Identifier: MIT
#pragma once

#include "strokes.hpp"

#include <filesystem>

namespace cutting {

/// Where pictures go and how large they are, 4 : 3.
struct Canvas {
  std::filesystem::path folder;
  int width = 1280;   // pixels
};

/// Writes folder/name_wireframe.png and folder/name_shaded.png: the same view of the same mesh. Below the borders of a surface walls are drawn; a solid has its
/// own, as triangles that are turned inside out.
void write_pictures(Canvas const& canvas, std::string const& name, Mesh const& mesh, Vector const& seen_from, bool is_solid = false);

}  // namespace cutting
