// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>

namespace palpate {

/// What an edit has done to the tetrahedra of a solid, for whoever keeps something of each: read in order, all since the solid was made tell how each
/// tetrahedron of now has come about; vertices that are inserted and split off have the numbers after those of before, in this order. See BodyShape::solid_edits().
///   inserted     a new vertex on the edge from vertex `first` to vertex `second`, at s; the tetrahedra round it are divided next
///   divided      tetrahedron `first` at s on the way from its corner `from` to its corner `to`: it keeps `from`, the new last one, `second`, has `to`
///   removed      tetrahedron `first` is gone; the last one, `second`, has its number now
///   split        some tetrahedra at vertex `first` have the new last vertex, `second`, in its place
template <RealScalar Scalar>
struct SolidEdit {
  enum class Kind : signed char { inserted, divided, split, removed };
  Kind kind = Kind::inserted;
  signed char from = 0, to = 0;
  int first = -1, second = -1;
  Scalar s = 0;

  bool operator==(SolidEdit const&) const = default;
};

}  // namespace palpate
