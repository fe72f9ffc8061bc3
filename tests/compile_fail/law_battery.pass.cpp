// SPDX-License-Identifier: MIT
// The law battery for a spring law with damping.
#include <palpate/palpate.hpp>

#include <palpate/testing/spring_law.hpp>

struct Cubic {
  double stiffness = 80.0;
  double cubic = 1e6;
  double damping = 0.1;
  double tension(double elongation, double) const { return elongation * (stiffness + cubic * elongation * elongation); }
};

bool check() { return palpate::testing::check_spring_law(Cubic{}, 0.01).empty(); }
