// SPDX-License-Identifier: MIT
// The law battery for a force that does not throw.
#include <palpate/palpate.hpp>

#include <palpate/extend/force.hpp>

struct Spring {
  palpate::Vector3<double> operator()(palpate::ToolContact<double> const& contact) const noexcept { return 100 * contact.depth * contact.normal; }
};

bool check() { return palpate::testing::check_force(Spring{}).empty(); }
