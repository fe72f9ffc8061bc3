// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/random.hpp>
#include <palpate/testing/violations.hpp>
#include <palpate/tissue/element.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <concepts>
#include <initializer_list>

namespace palpate::testing {

struct ElementChecks {
  double reach = 0;        ///< m, how far nodes are moved from `rest`; 0: a tenth of the largest distance between two of them
  bool isolated = true;    ///< nothing ties it to the world: the forces have no sum and stay when it is shifted
  bool turns = true;       ///< isolated, and the forces have no torque and turn with it; a law of small strains does not
  bool relaxed = true;     ///< no force at `rest`
  int places = 20;         ///< where all of this is looked at
  Seed seed{1};
};

/// Checks an element at random positions of its nodes around `rest`, 3 × nodes: force = −∇energy and stiffness = −∂force/∂x by central differences, the
/// stiffness symmetric, its semidefinite part and the damping symmetric and positive semidefinite; what it answers without matrices and the bounds it
/// states against the matrices; with `isolated` and `turns` that neither force nor torque is left over, nor damping of a
/// motion as a whole.
/// Tolerances 1e-6 (double) or 2e-2 (float) of the largest force or stiffness met; of differences ten times that.
template <RealScalar Scalar, Element<Scalar> E>
Violations check_element(E const& element, NodeColumns<Scalar, E::nodes> const& rest, ElementChecks const& checks = {}) {
  using palpate::detail::message;
  constexpr int nodes = E::nodes;
  using Columns = NodeColumns<Scalar, nodes>;
  constexpr bool single = std::same_as<Scalar, float>;
  constexpr Scalar tolerance = single ? Scalar(2e-2) : Scalar(1e-6);
  Violations found;
  auto const say = [&](auto const&... parts) {
    auto text = message(parts...);
    if (std::find(found.begin(), found.end(), text) == found.end()) found.push_back(std::move(text));
  };
  Scalar reach = static_cast<Scalar>(checks.reach);
  if (!(reach > 0))
    for (int a = 0; a < nodes; ++a)
      for (int b = 0; b < a; ++b) reach = std::max(reach, (rest.col(a) - rest.col(b)).norm() / 10);
  if (!(reach > 0)) return {"the nodes rest at one place; say how far they are to be moved: ElementChecks{.reach = ...}"};

  // Vectors and matrices of any size: one set of templates for all elements.
  using Vector = Matrix<Scalar, Dynamic, 1>;
  using Square = Matrix<Scalar, Dynamic, Dynamic>;
  constexpr int n = 3 * nodes;
  auto const columns = [](Vector const& v) { return Columns(Eigen::Map<Columns const>(v.data())); };
  auto const vector = [](Columns const& c) { return Vector(Eigen::Map<Vector const>(c.data(), n)); };
  auto const square = [](NodeMatrix<Scalar, nodes> const& m) { return Square(Eigen::Map<Square const>(m.data(), n, n)); };
  auto const energy = [&](Vector const& x) { return static_cast<Scalar>(element.energy(columns(x))); };
  auto const force_at = [&](Vector const& x) { return vector(element.force(columns(x))); };
  auto const stiffness_at = [&](Vector const& x) { return square(element.stiffness(columns(x))); };
  auto const indefinite = [&](NodeMatrix<Scalar, nodes> const& m) { return (square(palpate::detail::semidefinite_part<Scalar, n>(m)) - square(m)).norm(); };
  auto const node = [](Vector const& v, int k) { return Vector3<Scalar>(v.data() + 3 * k); };
  Random random(checks.seed);
  auto const noise = [&](Scalar size) {
    Vector v(n);
    for (int k = 0; k < n; ++k) v[k] = random.uniform(-size, size);
    return v;
  };

  Vector const start = vector(rest);
  Square const stiffness_at_rest = stiffness_at(start);
  Scalar const step = reach * (single ? Scalar(3e-2) : Scalar(1e-4)), min_scale = stiffness_at_rest.norm();
  if (!(min_scale > 0) || !std::isfinite(min_scale)) return {message("the stiffness at rest is ", min_scale, " N/m; it must be finite and positive")};
  if (checks.relaxed && !(force_at(start).norm() <= tolerance * min_scale * reach)) say("there is a force at rest; with pre-tension say relaxed = false");

  for (int place = 0; place < checks.places; ++place) {
    Vector const x = start + noise(reach), d = noise(1), v = noise(reach), force = force_at(x);
    Square const stiffness = stiffness_at(x);
    if (!is_finite(force) || !is_finite(stiffness) || !std::isfinite(energy(x))) {
      say("energy, force or stiffness is not finite");
      continue;
    }
    Scalar const scale = std::max(min_scale, stiffness.norm()), force_scale = std::max(force.norm(), scale * reach);
    auto const differ = [&](auto const& a, auto const& b, Scalar size) { return !((a - b).norm() <= tolerance * size); };
    for (int k = 0; k < n; ++k) {
      Vector ahead = x, behind = x;
      ahead[k] += step, behind[k] -= step;
      if (!(std::abs((energy(ahead) - energy(behind)) / (2 * step) + force[k]) <= 10 * tolerance * force_scale))
        say("force must be -gradient of energy: on node ", k / 3, " it is not");
      if (differ(Vector((force_at(behind) - force_at(ahead)) / (2 * step)), Vector(stiffness.col(k)), 10 * scale))
        say("stiffness must be -d force/dx: in the columns of node ", k / 3, " it is not");
    }
    if (differ(stiffness, Square(stiffness.transpose()), scale)) say("the stiffness is not symmetric");
    auto const part = palpate::detail::semidefinite_stiffness(element, columns(x));
    if (differ(square(part), Square(square(part).transpose()), scale)) say("the semidefinite stiffness is not symmetric");
    if (!(indefinite(part) <= tolerance * scale)) say("the semidefinite stiffness is not positive semidefinite");
    Square damping = Square::Zero(n, n);
    if constexpr (HasElementDamping<E, Scalar>) {
      NodeMatrix<Scalar, nodes> const stated = element.damping(columns(x));
      damping = square(stated);
      if (differ(damping, Square(damping.transpose()), damping.norm())) say("the damping is not symmetric");
      if (!(indefinite(stated) <= tolerance * damping.norm())) say("the damping is not positive semidefinite");
    }
    if constexpr (HasElementProducts<E, Scalar>) {
      if (differ(vector(element.force(columns(x), columns(v))), Vector(force - damping * v), force_scale + damping.norm() * reach))
        say("force(x, v) is not force(x) - C v");
      if (differ(vector(element.stiffness_product(columns(x), columns(d))), Vector(square(part) * d), scale * d.norm()))
        say("stiffness_product(x, d) is not the semidefinite K d");
      if (differ(vector(element.damping_product(columns(x), columns(v))), Vector(damping * v), damping.norm() * v.norm())) say("damping_product(x, v) is not C v");
    }
    if (checks.isolated) {
      Vector along = d;
      for (int k = 0; k < nodes; ++k) along.segment(3 * k, 3) = node(d, 0);
      if (!((damping * along).norm() <= tolerance * damping.norm() * along.norm())) say("the damping brakes an element that moves as a whole");
    }
    if constexpr (HasElementMass<E, Scalar>)
      if (Scalar const mass = static_cast<Scalar>(element.mass()); !(mass > 0) || !std::isfinite(mass)) say("the mass is ", mass, " kg; it must be finite and positive");
    Vector unit = d;
    for (int k = 0; k < nodes; ++k) unit.segment(3 * k, 3).normalize();
    auto const largest_pull = [&](Square const& matrix, int k) {   // of nodes that are moved by 1 each, where that pulls most at node k
      Vector moved = unit;
      for (int round = 0; round < 8; ++round) {
        Vector3<Scalar> const towards = (matrix.middleRows(3 * k, 3) * moved).normalized();
        moved = matrix.middleRows(3 * k, 3).transpose() * towards;
        for (int j = 0; j < nodes; ++j) moved.segment(3 * j, 3).normalize();
      }
      return (matrix.middleRows(3 * k, 3) * moved).norm();
    };
    for (int k = 0; k < nodes; ++k) {
      if (!(largest_pull(stiffness, k) <= palpate::detail::stiffness_bound(element, columns(x), k) * (1 + tolerance)))
        say("the stiffness bound at x of node ", k, " is too low");
      if (checks.relaxed && !(largest_pull(stiffness_at_rest, k) <= palpate::detail::stiffness_bound_at_rest(element, rest, k) * (1 + tolerance)))
        say("the stiffness bound at rest of node ", k, " is too low");
    }
    if constexpr (HasElementBounds<E, Scalar>)
      for (int k = 0; k < nodes; ++k)
        if (!(largest_pull(damping, k) <= static_cast<Scalar>(element.damping_bound()) * (1 + tolerance))) say("the damping bound of node ", k, " is too low");
    if (!checks.isolated) continue;
    Vector3<Scalar> const shift = Vector3<Scalar>(3, -2, 1) * reach;
    Matrix<Scalar, 3, 3> const turn = Eigen::AngleAxis<Scalar>(Scalar(0.7), Vector3<Scalar>(1, -2, Scalar(0.5)).normalized()).toRotationMatrix();
    Vector3<Scalar> sum = Vector3<Scalar>::Zero(), torque = sum;
    Vector shifted = x, turned = x, turned_force = force;
    for (int k = 0; k < nodes; ++k) {
      sum += node(force, k), torque += (node(x, k) - node(x, 0)).cross(node(force, k));
      shifted.segment(3 * k, 3) += shift;
      turned.segment(3 * k, 3) = turn * node(x, k), turned_force.segment(3 * k, 3) = turn * node(force, k);
    }
    if (!(sum.norm() <= tolerance * force_scale)) say("the forces on the nodes have a sum; it must be zero");
    if (differ(force_at(shifted), force, force_scale)) say("the forces change when the element is shifted");
    if (!checks.turns) continue;
    if (!(torque.norm() <= 10 * tolerance * force_scale * reach)) say("the forces on the nodes have a torque; it must be zero");
    if (differ(force_at(turned), turned_force, force_scale)) say("the forces do not turn with the element");
  }
  return found;
}

/// For what is no element: says why.
template <RealScalar Scalar, class E, class Rest = std::initializer_list<Scalar>>
  requires(!Element<E, Scalar>)
Violations check_element(E const&, Rest const&, ElementChecks const& = {}) {
  static_assert(sizeof(palpate::detail::ElementSentences<E, Scalar>) > 0);
  return {};
}

}  // namespace palpate::testing
