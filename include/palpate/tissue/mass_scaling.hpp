// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/tissue/concept.hpp>
#include <palpate/tissue/lowest_frequencies.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace palpate {

/// What scale_masses() has done.
template <RealScalar Scalar>
struct MassScaling {
  Scalar moved = 0;         ///< kg, of `total`
  Scalar total = 0;         ///< kg, of the free particles, before and after
  int particles = 0;        ///< that were given some
  Scalar step_before = 0;   ///< s, the explicit step that row bounds guarantee, undamped
  Scalar step = 0;          ///< s, now: below the one asked for where there was too little mass around
  std::vector<Scalar> frequencies_before, frequencies;   ///< Hz, the lowest
};

/// Lets explicit integrators take steps of `step` seconds: a particle that is too light for the stiffness round it is lent mass by those nearest to it that
/// have more than they need, at most three edges away. The sum of all masses stays; small tetrahedra set the pace no more, and what was moved, and how far the
/// lowest frequencies went, is in the answer.
///
///   auto const scaling = scale_masses(tissue, 1e-4);
///   std::puts(to_text(scaling).c_str());
///
/// Need       m_i ≥ k_i (h/2)², k_i the row bound of the stiffness at rest: no mode is above 2/h then (Gerschgorin). Dampers shorten the step besides, see
///            stable_step(). Nailed particles neither lend nor borrow.
/// Limits     masses follow the material again after set_material(); call it last. Weight moves with the mass.
/// Errors     InvalidArgument for a step that is not above 0; those of lowest_frequencies().
/// Cost       that of lowest_frequencies(), twice; with 0 frequencies that of visiting the neighbours.
template <HasStiffnessBlocks Tissue>
  requires(!std::is_const_v<Tissue>)
MassScaling<typename Tissue::Scalar> scale_masses(Tissue& tissue, typename Tissue::Scalar step, int frequencies = 6) {
  using Scalar = typename Tissue::Scalar;
  constexpr int max_rings = 3;
  detail::require_positive("the step", step, "s");
  auto const at = [](int i) { return static_cast<std::size_t>(i); };
  auto const found = [&] { return frequencies > 0 ? lowest_frequencies(tissue, frequencies) : std::vector<Scalar>{}; };
  MassScaling<Scalar> scaling;
  scaling.frequencies_before = found();
  auto const longest_step = [&] {
    Scalar squared = std::numeric_limits<Scalar>::infinity();
    for (int i = 0; i < tissue.size(); ++i)
      if (!tissue.nailed(i)) squared = std::min(squared, tissue.mass(i) / tissue.stiffness_bound(i));
    return 2 * std::sqrt(squared);
  };
  scaling.step_before = longest_step();

  for (int i = 0; i < tissue.size(); ++i)
    if (!tissue.nailed(i)) scaling.total += tissue.mass(i);
  std::vector<Scalar> spare(at(tissue.size()));   // above what it needs; below 0 it lacks that
  auto const given = [&](int i, Scalar mass) {
    spare[at(i)] += mass;
    tissue.set_mass(i, tissue.mass(i) + mass);
  };
  std::vector<char> has_got(at(tissue.size()), 0);
  std::vector<int> seen, ring, next;
  auto const lend = [&] {   // what was lent [kg]
    Scalar all = 0;
    for (int i = 0; i < tissue.size(); ++i) {
      Scalar const mass = tissue.nailed(i) ? Scalar(0) : tissue.mass(i), own = mass - (mass > 0 ? tissue.stiffness_bound(i) * step * step / 4 : Scalar(0));
      spare[at(i)] = std::abs(own) > 8 * std::numeric_limits<Scalar>::epsilon() * mass ? own : Scalar(0);
    }
    seen.assign(at(tissue.size()), -1);
    for (int i = 0; i < tissue.size(); ++i) {
      if (!(spare[at(i)] < 0)) continue;
      seen[at(i)] = i;
      ring.assign(1, i);
      Scalar got = 0;
      for (int r = 0; r < max_rings && spare[at(i)] < 0; ++r) {
        next.clear();
        Scalar there = 0;
        for (int const j : ring)
          tissue.for_each_neighbour(j, [&](int k) {
            if (seen[at(k)] == i) return;
            seen[at(k)] = i;
            next.push_back(k), there += std::max(Scalar(0), spare[at(k)]);
          });
        ring = next;
        Scalar const lacks = -spare[at(i)], lent = std::min(lacks, there);
        if (!(lent > 0)) continue;
        for (int const k : ring)
          if (Scalar const own = spare[at(k)]; own > 0) given(k, -own * (lent / there));
        given(i, lent);
        got += lent;
        if (lent == lacks) spare[at(i)] = 0;   // to the last digit
      }
      all += got;
      if (got > 0 && !std::exchange(has_got[at(i)], 1)) ++scaling.particles;
    }
    return all;
  };
  for (int pass = 0; pass < 16; ++pass) {   // support springs are as stiff as their particle is heavy: what is lent makes it lack a little again
    Scalar const lent = lend();
    if (!(lent > 0)) break;
    scaling.moved += lent;
  }
  scaling.step = longest_step();
  scaling.frequencies = found();
  return scaling;
}
/// Of what is no such tissue: what is wrong.
template <class Other>
  requires(!HasStiffnessBlocks<Other> || std::is_const_v<Other>)
MassScaling<typename Other::Scalar> scale_masses(Other&, typename Other::Scalar, int = 6) {
  static_assert(HasStiffnessBlocks<Other> && !std::is_const_v<Other>,
                "scale_masses: this is no tissue that hands out its stiffness, see HasStiffnessBlocks, or it is const, as that of a body; scale before the body takes it.");
  return {};
}

/// "mass scaling: 0.31 g of 53 g moved to 12 particles; guaranteed step 0.021 ms -> 0.05 ms; lowest frequencies [Hz] 4.21 -> 4.2, 4.3 -> 4.29"
template <RealScalar Scalar>
std::string to_text(MassScaling<Scalar> const& scaling) {
  std::string text = detail::message("mass scaling: ", 1e3 * static_cast<double>(scaling.moved), " g of ", 1e3 * static_cast<double>(scaling.total), " g moved to ", scaling.particles,
                                     " particles; guaranteed step ", 1e3 * static_cast<double>(scaling.step_before), " ms -> ", 1e3 * static_cast<double>(scaling.step), " ms");
  for (std::size_t k = 0; k < scaling.frequencies.size(); ++k)
    text += detail::message(k == 0 ? "; lowest frequencies [Hz] " : ", ", scaling.frequencies_before[k], " -> ", scaling.frequencies[k]);
  return text;
}

}  // namespace palpate
