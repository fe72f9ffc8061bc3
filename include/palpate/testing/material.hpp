// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/random.hpp>
#include <palpate/material/concept.hpp>
#include <palpate/material/principal_tangent.hpp>
#include <palpate/testing/violations.hpp>

#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <string>
#include <utility>

namespace palpate::testing {

struct MaterialChecks {
  double strain = 0.3;      ///< how far each entry of F is moved from that of 1
  bool objective = true;    ///< turning the tissue changes no energy; a law of small strains is not objective
  int places = 50;          ///< deformations that all of this is looked at
  double young = 0;         ///< Pa; with poisson: the Hooke's law that small strains have to obey; 0: not asked
  double poisson = 0;
  Seed seed{1};
};

/// Checks a law of plain numbers at random deformations: no energy and no stress at F = 1; stress = ∂energy/∂F and stress_change = ∂stress/∂F : dF by central
/// differences, the latter symmetric; the energy of a turned body and of a body turned beforehand (of an isotropic law) the same; small strains obey
/// Hooke's law; the bulk modulus that it states is 1 : ∂P/∂F : 1/9 at F = 1 of an isotropic law, of others at most that. Deformations with det F < 0.1 are
/// left out where the law refuses some.
/// Tolerances 1e-6 (double) or 2e-3 (float) of the largest stiffness met; of differences ten times that.
template <RealScalar Scalar, MaterialLaw<Scalar> Law>
Violations check_material(Law const& law, MaterialChecks const& checks = {}) {
  using Tensor = Tensor3<Scalar>;
  using palpate::detail::message;
  constexpr bool single = std::same_as<Scalar, float>;
  constexpr Scalar tolerance = single ? Scalar(2e-3) : Scalar(1e-6), step = single ? Scalar(2e-3) : Scalar(1e-5);
  Violations found;
  auto const say = [&](std::string text) {
    if (std::find(found.begin(), found.end(), text) == found.end()) found.push_back(std::move(text));
  };
  auto const size = [](Tensor const& a) { return std::sqrt(double_contraction(a, a)); };
  Random random(checks.seed);
  auto const noise = [&](Scalar reach) {
    auto const one = [&] { return random.uniform(-reach, reach); };
    return Tensor{one(), one(), one(), one(), one(), one(), one(), one(), one()};
  };
  auto const rotation = [&] {   // of a random unit quaternion
    Scalar q[4], sum = 0;
    do {
      sum = 0;
      for (Scalar& each : q) each = random.uniform(Scalar(-1), Scalar(1)), sum += each * each;
    } while (!(sum > Scalar(0.01)));
    Scalar const s = 2 / sum, w = q[0], x = q[1], y = q[2], z = q[3];
    return Tensor{1 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y), s * (x * y + w * z), 1 - s * (x * x + z * z), s * (y * z - w * x),
                  s * (x * z - w * y), s * (y * z + w * x), 1 - s * (x * x + y * y)};
  };

  Tensor const one = Tensor::identity();
  Scalar stiffness = 0;
  for (int k = 0; k < 20; ++k) {
    Tensor const d = noise(1), change = law.stress_change(one, d);
    stiffness = std::max(stiffness, size(change) / size(d));
    if (!(checks.young > 0)) continue;
    auto const e = static_cast<Scalar>(checks.young), nu = static_cast<Scalar>(checks.poisson);
    Tensor const hooke = Tensor::diagonal(e * nu / ((1 + nu) * (1 - 2 * nu)) * trace(d)) + (e / (1 + nu)) * symmetric_part(d);
    if (!(size(change - hooke) <= tolerance * size(hooke))) say("small strains must obey Hooke's law: stress_change(1, d) is another");
  }
  if (!(stiffness > 0) || !std::isfinite(stiffness)) return {message("the stiffness at F = 1 is ", stiffness, " Pa; it must be finite and positive")};
  if constexpr (HasBulkModulus<Law, Scalar>) {
    Scalar const stated = static_cast<Scalar>(law.bulk_modulus()), of_tangent = trace(law.stress_change(one, one)) / 9, off = stated - of_tangent;
    if (!(off <= tolerance * stiffness && (!IsIsotropicLaw<Law> || off >= -tolerance * stiffness)))
      say(message("bulk_modulus() is ", stated, " Pa, but that of stress_change at F = 1 is ", of_tangent, " Pa"));
  }
  if (!(std::abs(law.energy(one)) <= tolerance * stiffness)) say("there is energy at F = 1");
  if (!(size(law.stress(one)) <= tolerance * stiffness)) say("there is stress at F = 1");

  std::size_t const at_rest = found.size();
  for (int place = 0; place < checks.places; ++place) {
    Tensor const F = one + noise(static_cast<Scalar>(checks.strain)), d = noise(1), other = noise(1);
    if constexpr (RefusesInversion<Law, Scalar>)
      if (!(determinant(F, cofactor(F)) > Scalar(0.1))) continue;
    Tensor const stress = law.stress(F), change = law.stress_change(F, d), ahead = F + step * d, behind = F - step * d;
    Scalar const energy = law.energy(F), slope = (law.energy(ahead) - law.energy(behind)) / (2 * step);
    Tensor const stress_slope = (1 / (2 * step)) * (law.stress(ahead) - law.stress(behind));
    if (!std::isfinite(energy + slope + size(stress) + size(change) + size(stress_slope))) {
      found.resize(at_rest);   // close to where numbers end, differences say nothing
      say(message("energy, stress or stress_change is not finite at F = {", F.xx, ", ", F.xy, ", ", F.xz, ", ", F.yx, ", ", F.yy, ", ", F.yz, ", ", F.zx, ", ", F.zy, ", ", F.zz,
                  "}, det F = ", determinant(F, cofactor(F)), "; where the law stands no such shape ask for less: MaterialChecks{.strain = ...}"));
      return found;
    }
    Scalar const scale = std::max({stiffness, size(change) / size(d), size(stress)});
    if (!(std::abs(slope - double_contraction(stress, d)) <= 10 * tolerance * scale * size(d))) say("stress must be d energy/dF");
    if (!(size(stress_slope - change) <= 10 * tolerance * scale * size(d))) say("stress_change must be d stress/dF : dF");
    if (!(std::abs(double_contraction(change, other) - double_contraction(law.stress_change(F, other), d)) <= tolerance * scale * size(d) * size(other)))
      say("stress_change must be symmetric: a : change(b) = b : change(a)");
    if constexpr (HasSemidefiniteStressChange<Law, Scalar>) {
      if (!(size(law.semidefinite_stress_change(one, d) - law.stress_change(one, d)) <= tolerance * stiffness * size(d)))
        say("at F = 1 semidefinite_stress_change must be stress_change");
      if (!(std::abs(double_contraction(law.semidefinite_stress_change(F, d), other) - double_contraction(law.semidefinite_stress_change(F, other), d)) <=
            tolerance * scale * size(d) * size(other)))
        say("semidefinite_stress_change must be symmetric");
      if (!(double_contraction(law.semidefinite_stress_change(F, d), d) >= -tolerance * scale * size(d) * size(d))) say("semidefinite_stress_change is not positive semidefinite");
    }
    if (!checks.objective) continue;
    Tensor const R = rotation();
    if (!(std::abs(law.energy(R * F) - energy) <= tolerance * scale)) say("the energy changes when the tissue is turned");
    if constexpr (IsIsotropicLaw<Law>)
      if (!(std::abs(law.energy(F * R) - energy) <= tolerance * scale)) say("the law says that it is isotropic, and its energy changes with the direction");
  }
  return found;
}

/// Of a material that has a law, that; for what is none: says why.
template <RealScalar Scalar, class M>
Violations check_material(M const& material, MaterialChecks const& checks = {}) {
  static_assert(sizeof(palpate::detail::MaterialSentences<M, Scalar>) > 0);
  if constexpr (Material<M, Scalar>)
    return check_material<Scalar>(material.law(), checks);
  else
    return {};
}

}  // namespace palpate::testing
