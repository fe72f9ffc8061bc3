// SPDX-License-Identifier: MIT
// expect: palpate: the spring law has no member damping; declare: Scalar damping = 0, in N s/m
// The law battery for a spring law without damping.
#include <palpate/palpate.hpp>

#include <palpate/testing/spring_law.hpp>

struct Cubic {
  double stiffness = 80.0;
  double cubic = 1e6;
  double tension(double elongation, double) const { return elongation * (stiffness + cubic * elongation * elongation); }
};

bool check() { return palpate::testing::check_spring_law(Cubic{}, 0.01).empty(); }
