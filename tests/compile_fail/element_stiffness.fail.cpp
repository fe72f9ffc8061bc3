// SPDX-License-Identifier: MIT
// expect: palpate: the element has no stiffness(x) const; declare: NodeMatrix<Scalar, nodes> stiffness(NodeColumns<Scalar, nodes> const& x) const, in N/m.
// An element that forgot its stiffness.
#include <palpate/palpate.hpp>

struct Tether {
  static constexpr int nodes = 1;
  palpate::Vector3<double> rest;
  double energy(palpate::Vector3<double> const& x) const { return 5.0 * (x - rest).squaredNorm(); }
  palpate::Vector3<double> force(palpate::Vector3<double> const& x) const { return -10.0 * (x - rest); }
};

void build() {
  using namespace palpate;
  auto const mesh = make_grid<double>(3, 3, 0.01);
  ElementTissue const tissue(mesh, {.total = 0.1}, make_elements(mesh.points, [](auto const& rest) { return Tether{rest}; }));
  tissue.size();
}
