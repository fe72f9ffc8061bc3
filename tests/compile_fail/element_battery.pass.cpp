// SPDX-License-Identifier: MIT
// The same without the mistake.
#include <palpate/extend/tissue.hpp>

struct Tether {
  static constexpr int nodes = 1;
  palpate::Vector3<double> rest;
  double energy(palpate::Vector3<double> const& x) const { return 5.0 * (x - rest).squaredNorm(); }
  palpate::Vector3<double> force(palpate::Vector3<double> const& x) const { return -10.0 * (x - rest); }
  palpate::Matrix<double, 3, 3> stiffness(palpate::Vector3<double> const&) const { return 10.0 * palpate::Matrix<double, 3, 3>::Identity(); }
};

bool check() { return palpate::testing::check_element<double>(Tether{{0.0, 0.0, 0.0}}, {0.0, 0.0, 0.0}, {.reach = 0.01, .isolated = false}).empty(); }
