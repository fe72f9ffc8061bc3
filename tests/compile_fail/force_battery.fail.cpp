// SPDX-License-Identifier: MIT
// expect: the force model must be callable, noexcept, with a ToolContact of the body's scalar and return a Vector3 of it in N; declare: Vector3<double>
// The law battery for a force that may throw.
#include <palpate/palpate.hpp>

#include <palpate/extend/force.hpp>

struct Spring {
  palpate::Vector3<double> operator()(palpate::ToolContact<double> const& contact) const { return 100 * contact.depth * contact.normal; }
};

bool check() { return palpate::testing::check_force(Spring{}).empty(); }
