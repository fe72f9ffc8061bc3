// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/random.hpp>
#include <palpate/core/matrix.hpp>

#include <algorithm>
#include <array>
#include <span>
#include <vector>

namespace palpate_test {

/// The triangles around a particle in order, as they follow each other across its edges; starts at the border where there is one.
template <class Surface>
std::vector<int> ordered_fan(Surface const& surface, int p) {
  int first = surface.triangles_at(p).front();
  auto const corner = [&](int t, int ahead) { return surface.corners(t)[static_cast<std::size_t>((surface.corner_of(t, p) + ahead) % 3)]; };
  for (std::size_t k = 0; k < surface.triangles_at(p).size(); ++k) {
    int const before = surface.triangle_with_edge(corner(first, 1), p);
    if (before < 0) break;
    first = before;
  }
  std::vector<int> fan{first};
  while (true) {
    int const next = surface.triangle_with_edge(p, corner(fan.back(), 2));
    if (next < 0 || next == first) return fan;
    fan.push_back(next);
  }
}

/// Divides a random triangle or edge, well away from its corners. Returns the new particle.
template <class Editable, class Surface>
int random_insertion(Editable& editable, Surface const& surface, palpate::Random& random) {
  int const t = static_cast<int>(random.below(static_cast<std::uint64_t>(surface.triangle_count())));
  using Scalar = typename Editable::Scalar;
  if (random.uniform() < 0.5) {
    palpate::Vector3<Scalar> w(random.uniform(Scalar(0.2), Scalar(1)), random.uniform(Scalar(0.2), Scalar(1)), random.uniform(Scalar(0.2), Scalar(1)));
    w /= w.sum();
    return editable.insert_in_triangle(t, w);
  }
  auto const corners = surface.corners(t);
  auto const k = static_cast<std::size_t>(random.below(3));
  return editable.insert_on_edge(corners[k], corners[(k + 1) % 3], random.uniform(Scalar(0.3), Scalar(0.7)));
}

/// Splits a random particle with two triangles or more: a slit along two of its edges. Returns {particle, copy}.
template <class Editable, class Surface>
std::array<int, 2> random_split(Editable& editable, Surface const& surface, palpate::Random& random) {
  while (true) {
    int const p = static_cast<int>(random.below(static_cast<std::uint64_t>(surface.vertex_count())));
    std::vector<int> const fan = ordered_fan(surface, p);
    if (fan.size() < 2 || fan.size() != surface.triangles_at(p).size()) continue;
    std::size_t const part = 1 + static_cast<std::size_t>(random.below(fan.size() - 1));
    return {p, editable.split_particle(p, std::span<int const>(fan).first(part))};
  }
}

}  // namespace palpate_test
