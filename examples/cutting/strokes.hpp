// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/mesh/triangle_mesh.hpp>

#include <string>
#include <vector>

namespace cutting {

using Vector = palpate::Vector3<double>;
using Mesh = palpate::TriangleMesh<double>;

/// Where the tip of a blade is, tick by tick: it comes down from above, cuts, and is lifted. The tip is in the frame of the mesh [m].
using Tips = std::vector<Vector>;

/// What a scalpel does to a liver, and how it is looked at afterwards.
struct Stroke {
  std::string name;
  std::vector<Tips> blades{};   // they cut at the same time
  std::vector<Tips> afterwards{};   // more strokes, one after the other, each when the wounds before have opened
  Vector part = Vector::Zero();   // m, how far the smaller piece is drawn away, if the cut frees one
  Vector seen_from = Vector::UnitZ();
};

/// The six strokes over a liver that lies as make_organ makes it: the dome up (+z), the right lobe at −x.
std::vector<Stroke> strokes_over(Mesh const& liver);

}  // namespace cutting
