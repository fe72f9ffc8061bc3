// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/mesh/grid.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include "body/naive_body.hpp"

#include <vector>

namespace palpate_test {

/// One grid of tissue, described once, made in the library and in the plain loop.
struct GridScene {
  int nx = 5, ny = 4;
  double spacing = 0.01, mass = 0.02;
  double link = 50.0, link_damping = 0.02, home = 5.0, home_damping = 0.01, prestrain = 0.0;
  std::vector<int> nails{};

  template <class S = double>
  palpate::MassSpring<S> tissue() const {
    palpate::MassSpring<S> tissue(palpate::make_grid<S>(nx, ny, S(spacing)),
                                  {.mass = {.total = S(mass), .lumping = palpate::Lumping::equal},
                                   .link = {.stiffness = S(link), .damping = S(link_damping)},
                                   .home = {.stiffness = S(home), .damping = S(home_damping)},
                                   .link_prestrain = S(prestrain)});
    tissue.nail(nails);
    return tissue;
  }
  NaiveBody plain() const {
    NaiveBody body = naive_grid(nx, ny, spacing, link, link_damping, prestrain);
    body.mass.assign(body.mass.size(), mass / (nx * ny));
    body.home_stiffness.assign(body.mass.size(), home);
    body.home_damping.assign(body.mass.size(), home_damping);
    for (int const i : nails) body.fixed[static_cast<std::size_t>(i)] = 1;
    return body;
  }
};

}  // namespace palpate_test
