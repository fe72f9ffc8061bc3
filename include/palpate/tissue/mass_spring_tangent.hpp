// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/simd.hpp>

#include <array>
#include <cstddef>
#include <vector>

namespace palpate {

/// The tangent of a MassSpringAssembly: what its links and home springs answer to small displacements and velocities, kept so that many
/// products at the same positions need no root and no division.
///   K_ij w = w_ij (s w + (T′ − s)(n·w) n),   C_ij w = w_ij c (n·w) n,   s = max(0, T)/|d|,  w = d_i − d_j
/// A compressed link's sideways softening is left out, and a falling tension counts as flat: K is symmetric and positive semidefinite. How
/// a damper's force turns with its link is left out of K as well.
/// Layout     the rows and groups of the assembly: four links at a time.
/// Shapes     d and out: 4 × particles of the assembly, contiguous, the fourth row 0; d is zero in the border's columns, out's border
///            columns are overwritten with partial sums.
/// Cost       O(links) a product, no allocation, noexcept; 0.3 to 0.4 of the time of a plain force loop over the same springs.
template <RealScalar Scalar>
class MassSpringTangent {
 public:
  using Four = simd::Pack<Scalar, 4>;

  /// A link of each of a group's particles.
  struct Row {
    Four across;             ///< w s [N/m]
    Four more_along;         ///< w (T′ − s) [N/m]
    Four damping;            ///< w c [N·s/m]
    Four direction[4];       ///< n, from the upper end to the lower
    std::array<int, 4> other;   ///< 4 × the upper ends
  };
  struct Group {
    std::array<int, 4> own;   ///< 4 × the lower ends
    int rows;
  };
  /// What acts on a particle alone.
  struct Particle {
    Scalar mass, damping, stiffness;   ///< kg, N·s/m, N/m
  };

  std::vector<Particle> particles;   // moving ones
  std::vector<Group> groups;
  std::vector<Row> rows;
  int all = 0;   // columns, the border's included

  /// out = (mass M + damping C + stiffness K) d
  void multiply(Scalar mass, Scalar damping, Scalar stiffness, Scalar const* d, Scalar* out) const noexcept {
    Four value;
    for (std::size_t i = 0; i < particles.size(); ++i) {
      simd::load(value, d + 4 * i);
      simd::store(out + 4 * i, Four(of_particle(mass, damping, stiffness, i) * value));
    }
    clear_border(out);
    if (damping == 0 && stiffness == 0) return;
    Row const* row = rows.data();
    for (Group const& group : groups) {
      Four own[4], sum[4] = {};
      for (std::size_t k = 0; k < 4; ++k) simd::load(own[k], column(d, group.own[k]));
      for (Row const* const end = row + group.rows; row != end; ++row) {
        Four difference[4], product[4], along;
        for (std::size_t k = 0; k < 4; ++k) {
          simd::load(difference[k], column(d, row->other[k]));
          difference[k] = own[k] - difference[k];
          product[k] = row->direction[k] * difference[k];
        }
        simd::sum_each(along, product);   // n·w
        along *= damping * row->damping + stiffness * row->more_along;
        Four const across = stiffness * row->across;
        for (std::size_t k = 0; k < 4; ++k) {
          Four const pull = across[k] * difference[k] + along[k] * row->direction[k];
          Four there;
          simd::load(there, column(out, row->other[k]));
          simd::store(column(out, row->other[k]), Four(there - pull));
          sum[k] += pull;
        }
      }
      for (std::size_t k = 0; k < 4; ++k) {
        Four here;
        simd::load(here, column(out, group.own[k]));
        simd::store(column(out, group.own[k]), Four(here + sum[k]));
      }
    }
  }

  /// out = the diagonal of mass M + damping C + stiffness K
  void diagonal(Scalar mass, Scalar damping, Scalar stiffness, Scalar* out) const noexcept {
    Four const ones = {1, 1, 1, 0};
    for (std::size_t i = 0; i < particles.size(); ++i)
      simd::store(out + 4 * i, Four(of_particle(mass, damping, stiffness, i) * ones));
    clear_border(out);
    Row const* row = rows.data();
    for (Group const& group : groups)
      for (Row const* const end = row + group.rows; row != end; ++row) {
        Four const along = damping * row->damping + stiffness * row->more_along;
        Four const across = stiffness * row->across;
        for (std::size_t k = 0; k < 4; ++k) {
          Four const add = across[k] * ones + along[k] * row->direction[k] * row->direction[k];
          for (Scalar* const end_of_link : {column(out, row->other[k]), column(out, group.own[k])}) {
            Four there;
            simd::load(there, end_of_link);
            simd::store(end_of_link, Four(there + add));
          }
        }
      }
  }

 private:
  static Scalar const* column(Scalar const* columns, int offset) noexcept { return columns + offset; }
  static Scalar* column(Scalar* columns, int offset) noexcept { return columns + offset; }

  Scalar of_particle(Scalar mass, Scalar damping, Scalar stiffness, std::size_t i) const noexcept {
    return mass * particles[i].mass + damping * particles[i].damping + stiffness * particles[i].stiffness;
  }

  void clear_border(Scalar* out) const noexcept {
    for (std::size_t i = particles.size(); i < static_cast<std::size_t>(all); ++i) simd::store(out + 4 * i, Four{});
  }
};

}  // namespace palpate
