// SPDX-License-Identifier: MIT
// The same without the mistake.
#include <palpate/palpate.hpp>

/// Springs from four corners to where they rest.
struct Tethers {
  static constexpr int nodes = 4;
  using Columns = palpate::NodeColumns<double, 4>;
  Columns rest;
  double energy(Columns const& x) const { return (x - rest).squaredNorm(); }
  Columns force(Columns const& x) const { return -2.0 * (x - rest); }
  palpate::NodeMatrix<double, 4> stiffness(Columns const&) const { return 2.0 * palpate::NodeMatrix<double, 4>::Identity(); }
};

void build() {
  using namespace palpate;
  auto const mesh = make_block<double>(2, 2, 2, 0.01);
  ElementTissue const tissue(mesh, {.total = 0.1}, make_elements(mesh.points, mesh.tetrahedra, [](auto const& rest) { return Tethers{rest.template cast<double>()}; }));
  tissue.size();
}
