// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/random.hpp>
#include <palpate/testing/violations.hpp>
#include <palpate/tissue/concept.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <vector>

namespace palpate::testing {

struct TissueChecks {
  double displacement = 0.1;   ///< of the particles while forces are compared, as a share of the distance to the nearest neighbour
  bool isolated = false;       ///< nothing ties the body to the world: no home springs. Momentum and rotation are then checked too
  bool turns = true;           ///< isolated, and the forces have no torque and turn with it; a law of small strains does not
  bool relaxed_at_rest = true; ///< no pre-tension: no force at the rest shape
  Seed seed{1};
};

namespace detail {

/// A tissue with all its particles assembled.
template <TissueModel Tissue>
struct WholeTissue {
  using Scalar = typename Tissue::Scalar;
  using Columns = Matrix3X<Scalar>;

  explicit WholeTissue(Tissue const& tissue) : rest(3, tissue.size()) {
    for (int i = 0; i < tissue.size(); ++i) {
      all.push_back(i);
      rest.col(i) = tissue.rest_position(i);
    }
    tissue.assemble(all, assembly);
  }
  Columns forces(Columns const& x, Columns const& v) {
    Columns local_x(x.rows(), x.cols()), local_v = local_x, f = Columns::Zero(3, x.cols());
    auto const particles = assembly.particles();
    for (std::size_t k = 0; k < particles.size(); ++k) {
      local_x.col(static_cast<Eigen::Index>(k)) = x.col(particles[k]);
      local_v.col(static_cast<Eigen::Index>(k)) = v.col(particles[k]);
    }
    assembly.add_forces(local_x, local_v, f);
    Columns result(3, x.cols());
    for (std::size_t k = 0; k < particles.size(); ++k) result.col(particles[k]) = f.col(static_cast<Eigen::Index>(k));
    return result;
  }

  std::vector<int> all;
  Columns rest;
  typename Tissue::Assembly assembly;
};

}  // namespace detail

/// Checks a tissue model: masses and neighbours make sense; forces are finite, at rest too, the same when asked twice, the same for a subset of the particles, for
/// each of them alone and by an assembly that is used again; the damping bound holds at rest; damping takes energy out; and, where the tissue has the ability,
/// force = −∇energy, the stiffness product is the slope of the force at the rest shape, symmetric and within the stated row bounds, and the damping product is
/// the damping force.
/// `isolated` adds: no net force, forces that do not change when the body is shifted, and with `turns` no net torque and forces that turn with it.
/// Tolerances 1e-6 (double) or 1e-2 (float) of the largest force.
template <TissueModel Tissue>
Violations check_tissue(Tissue const& tissue, TissueChecks const& checks = {}) {
  using palpate::detail::message;
  using Scalar = typename Tissue::Scalar;
  using Columns = Matrix3X<Scalar>;
  constexpr bool single = std::same_as<Scalar, float>;
  constexpr Scalar tolerance = single ? Scalar(1e-2) : Scalar(1e-6);
  Violations found;
  Random random(checks.seed);
  int const n = tissue.size();
  if (n == 0) return {"the tissue has no particles"};

  Scalar nearest = -1;
  for (int i = 0; i < n; ++i) {
    if (!(tissue.mass(i) > 0) || !std::isfinite(tissue.mass(i))) found.push_back(message("particle ", i, " weighs ", tissue.mass(i), " kg"));
    tissue.for_each_neighbour(i, [&](int j) {
      Scalar const distance = (tissue.rest_position(i) - tissue.rest_position(j)).norm();
      nearest = nearest < 0 ? distance : std::min(nearest, distance);
      bool mutual = false;
      tissue.for_each_neighbour(j, [&](int k) { mutual = mutual || k == i; });
      if (!mutual) found.push_back(message("particle ", j, " is a neighbour of ", i, " but not the other way round"));
    });
  }
  auto const triangles = tissue.surface().triangles();
  for (Eigen::Index t = 0; t < triangles.cols(); ++t)
    if (triangles.col(t).minCoeff() < 0 || triangles.col(t).maxCoeff() >= n)
      found.push_back(message("triangle ", t, " of the surface has a corner outside 0 … ", n - 1));
  if (!(nearest > 0)) found.push_back("two neighbours rest at the same place, or no particle has a neighbour");
  if (!found.empty()) return found;

  auto const noise = [&](Scalar size) {
    Columns columns(3, n);
    for (int i = 0; i < n; ++i)
      for (int k = 0; k < 3; ++k) columns(k, i) = random.uniform(-size, size);
    return columns;
  };
  detail::WholeTissue<Tissue> whole(tissue);
  Columns const still = Columns::Zero(3, n);
  Columns const x = whole.rest + noise(static_cast<Scalar>(checks.displacement) * nearest);
  Columns const v = noise(nearest);
  Columns const elastic = whole.forces(x, still);
  Columns const force = whole.forces(x, v);
  if (!is_finite(elastic) || !is_finite(force)) return {"a force is not finite"};
  Scalar const largest = elastic.colwise().norm().maxCoeff();
  auto const differ = [&](Columns const& a, Columns const& b, Scalar scale) { return !is_finite(a) || !((a - b).cwiseAbs().maxCoeff() <= tolerance * scale); };

  if (whole.forces(x, v) != force) found.push_back("the forces differ when they are asked for twice");
  if (!is_finite(whole.forces(whole.rest, still))) return {"a force at the rest shape is not finite"};
  if (checks.relaxed_at_rest && whole.forces(whole.rest, still).cwiseAbs().maxCoeff() > tolerance * largest)
    found.push_back("a body at its rest shape is not free of force; with pre-tension say relaxed_at_rest = false");
  if (Scalar const power = (force - elastic).cwiseProduct(v).sum(); power > 0)
    found.push_back(message("damping puts a power of ", power, " W into the body"));

  for (int i = 0; i < n; ++i)
    if (Vector3<Scalar> const alone = tissue.internal_force(i, x, v); !((alone - force.col(i)).norm() <= tolerance * (largest + force.col(i).norm()))) {
      found.push_back(message("internal_force(", i, ") is another than the force that an assembly of all adds; off by ", (alone - Vector3<Scalar>(force.col(i))).norm(), " N"));
      break;
    }
  for (int i = 0; i < n; ++i)
    if (Scalar const bound = tissue.damping_bound(i); !(bound >= 0) || !std::isfinite(bound) || !std::isfinite(tissue.stiffness_bound(i))) {
      found.push_back(message("damping_bound(", i, ") is ", bound, " N s/m and stiffness_bound(", i, ") ", tissue.stiffness_bound(i), " N/m; both must be finite"));
      break;
    }
  {
    Scalar const speed = v.colwise().norm().maxCoeff();   // m/s, of all
    Columns const unit = noise(1).colwise().normalized(), drag = (whole.forces(whole.rest, still) - whole.forces(whole.rest, speed * unit)) / speed;
    for (int i = 0; i < n; ++i)
      if (!(drag.col(i).norm() <= tissue.damping_bound(i) * (1 + tolerance) + tolerance * drag.colwise().norm().maxCoeff())) {
        found.push_back(message("damping_bound(", i, ") is ", tissue.damping_bound(i), " N s/m, but velocities of ", speed, " m/s give ", drag.col(i).norm(), " N for each m/s"));
        break;
      }
    detail::WholeTissue<Tissue> again(tissue);
    std::vector<int> const one{0};
    tissue.assemble(one, again.assembly), tissue.assemble(again.all, again.assembly);
    if (again.assembly.particles().size() != whole.assembly.particles().size() || whole.forces(x, v) != again.forces(x, v))
      found.push_back("an assembly that is used again answers otherwise than a new one");
  }

  std::vector<int> some;
  for (int i = n - 1; i >= 0; i -= 2) some.push_back(i);   // in no order that it may count on
  typename Tissue::Assembly part;
  tissue.assemble(some, part);
  auto const particles = part.particles();
  Columns part_x(3, static_cast<Eigen::Index>(particles.size()));
  Columns part_v = part_x, part_f = Columns::Zero(3, part_x.cols());
  for (std::size_t k = 0; k < particles.size(); ++k) {
    part_x.col(static_cast<Eigen::Index>(k)) = x.col(particles[k]);
    part_v.col(static_cast<Eigen::Index>(k)) = v.col(particles[k]);
  }
  part.add_forces(part_x, part_v, part_f);
  for (std::size_t k = 0; k < some.size(); ++k)
    if (!((part_f.col(static_cast<Eigen::Index>(k)) - force.col(some[k])).norm() <= tolerance * largest)) {
      found.push_back(message("the force on particle ", some[k], " is another when only a part of the body is assembled"));
      break;
    }

  Columns const direction = noise(1);
  Scalar const step = nearest * (single ? Scalar(1e-2) : Scalar(1e-6));
  if constexpr (HasPotentialEnergy<Tissue>) {
    Columns const ahead = x + step * direction, behind = x - step * direction;
    Scalar const slope = (tissue.potential_energy(ahead) - tissue.potential_energy(behind)) / (2 * step);
    Scalar const work = elastic.cwiseProduct(direction).sum();
    if (!(std::abs(slope + work) <= tolerance * (std::abs(work) + largest * Scalar(std::sqrt(n)))))
      found.push_back(message("the energy grows by ", slope, " J/m along a direction in which the force is ", work, " N; force must be -gradient"));
  }
  if constexpr (HasStiffnessProduct<Tissue>) {
    auto const slope = [&](Scalar width) {
      Columns const ahead = whole.rest + width * direction, behind = whole.rest - width * direction;
      return Columns((whole.forces(behind, still) - whole.forces(ahead, still)) / (2 * width));
    };
    Columns const measured = 2 * slope(step / 2) - slope(step);   // extrapolated: a law may bend sharply at rest
    Columns stated = still, other = still, damping = still;
    tissue.add_stiffness_product(whole.rest, direction, stated);
    Scalar const scale = stated.colwise().norm().maxCoeff();
    if (differ(stated, measured, scale)) found.push_back("the stiffness product is not the slope of the force at the rest shape");
    Columns const across = noise(1);
    tissue.add_stiffness_product(x, direction, other);
    Scalar const there = other.cwiseProduct(across).sum();
    Columns back = still;
    tissue.add_stiffness_product(x, across, back);
    if (!(std::abs(there - back.cwiseProduct(direction).sum()) <= tolerance * scale * Scalar(n)))
      found.push_back("the stiffness product is not symmetric");
    if (other.cwiseProduct(direction).sum() < 0) found.push_back("the stiffness product is not positive semidefinite");
    if constexpr (HasStiffnessBlocks<Tissue>) {
      Columns sum = still;
      bool beside = true;
      tissue.for_each_stiffness_block(x, [&](int i, int j, auto const& block) {
        sum.col(i) += block * direction.col(j);
        bool known = i == j;
        tissue.for_each_neighbour(i, [&](int neighbour) { known = known || neighbour == j; });
        beside = beside && known;
      });
      if (differ(sum, other, scale)) found.push_back("the blocks of the stiffness are not those of its product");
      if (!beside) found.push_back("a block of the stiffness is between particles that are no neighbours");
    }
    tissue.add_damping_product(x, v, damping);
    if (differ(damping, elastic - force, largest + damping.cwiseAbs().maxCoeff()))
      found.push_back("the damping product is not the damping force");
    Columns const unit = direction.colwise().normalized();
    Columns pull = still;
    tissue.add_stiffness_product(whole.rest, unit, pull);
    for (int i = 0; i < n; ++i)
      if (!(pull.col(i).norm() <= tissue.stiffness_bound(i) * (1 + tolerance))) {
        found.push_back(message("stiffness_bound(", i, ") is ", tissue.stiffness_bound(i), " N/m, but unit displacements give ", pull.col(i).norm(), " N"));
        break;
      }
  }
  if (checks.isolated) {
    Scalar const sum = largest * Scalar(n);
    if (!(force.rowwise().sum().norm() <= tolerance * sum)) found.push_back("the internal forces have a sum; it must be zero");
    Vector3<Scalar> torque = Vector3<Scalar>::Zero();
    Vector3<Scalar> const middle = x.rowwise().mean();
    for (int i = 0; i < n; ++i) {
      Vector3<Scalar> const arm = x.col(i) - middle, pull = force.col(i);
      torque += arm.cross(pull);
    }
    Scalar const size = (x.colwise() - middle).colwise().norm().maxCoeff();
    if (checks.turns && !(torque.norm() <= tolerance * sum * size)) found.push_back("the internal forces have a torque; it must be zero");
    Matrix<Scalar, 3, 3> const turn =
        Eigen::AngleAxis<Scalar>(Scalar(0.7), Vector3<Scalar>(Scalar(1), Scalar(-2), Scalar(0.5)).normalized()).toRotationMatrix();
    Vector3<Scalar> const shift = Vector3<Scalar>(Scalar(0.3), Scalar(-0.2), Scalar(0.1)) * size;
    if (differ(whole.forces(x.colwise() + shift, v), force, largest)) found.push_back("the forces change when the body is shifted");
    if (checks.turns && differ(whole.forces(turn * x, turn * v), turn * force, largest)) found.push_back("the forces do not turn with the body");
  }
  return found;
}

/// For what is no tissue: says why.
template <class Tissue>
Violations check_tissue(Tissue const&, TissueChecks const& = {}) {
  static_assert(sizeof(palpate::detail::TissueSentences<Tissue>) > 0);
  return {};
}

}  // namespace palpate::testing
