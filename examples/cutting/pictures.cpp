// SPDX-License-Identifier: MIT
#include "pictures.hpp"

#include <palpate/vtk/picture.hpp>

#include <array>

namespace cutting {

void write_pictures(Canvas const& canvas, std::string const& name, Mesh const& mesh, Vector const& seen_from, bool is_solid) {
  palpate::PictureStyle style;
  style.width = canvas.width, style.height = 3 * canvas.width / 4;
  style.wound_depth = is_solid ? 0.0 : 0.008;
  if (is_solid) style.tissue = {0.86, 0.64, 0.55};   // skin
  style.interior = is_solid ? style.wound : std::array{0.24, 0.02, 0.03};
  palpate::Camera const camera = palpate::framing(mesh, seen_from, Vector::UnitZ());
  palpate::write_picture(canvas.folder / (name + "_shaded.png"), mesh, camera, {}, style);

  style.tissue = {0.93, 0.86, 0.80};   // pale, so that the lines are seen
  style.wound = {0.80, 0.08, 0.08};
  style.interior = is_solid ? style.wound : std::array{0.10, 0.12, 0.20};
  style.line_width = canvas.width / 960.0;
  palpate::write_picture(canvas.folder / (name + "_wireframe.png"), mesh, camera, {}, style);
}

}  // namespace cutting
