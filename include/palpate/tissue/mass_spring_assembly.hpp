// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/four.hpp>
#include <palpate/tissue/mass_spring_options.hpp>
#include <palpate/tissue/mass_spring_tangent.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <span>
#include <vector>

namespace palpate {

/// The springs that act on a chosen set of particles, laid out for the force loop.
///   f_i −= (w/|d|²) (T(|d| − L) |d| + c d·(v_i − v_j)) d,   d = x_i − x_j; the same with + on j
/// Particles 0 … moving−1 are the chosen ones; after them comes the border: particles that only hold an end of a spring.
/// Each link is stored once, with its lower end; a link between two border particles is left out.
/// Layout     Four particles form a group, and a row holds one link of each: the group's positions, velocities and forces stay in
///            registers while its rows are walked. Groups are made of particles with as many links of their own, taken from 32 that
///            follow each other, so that few places in a row are empty; an empty place is a link of weight 0 from its particle to
///            itself. Up to eight rows go through three short loops: differences, then factors, then pulls; one long loop would wait
///            for roots and divisions.
/// Shapes     positions, velocities, forces: 3 × particles().size(), one column per local particle; or 4 × with the fourth row 0, which
///            is faster.
/// Cost       O(links), no allocation, noexcept; the same result to the bit whatever the shape.
/// Limits     a link of length 0 has no direction: it gives no force.
template <RealScalar Scalar, SpringLaw<Scalar> Law>
class MassSpringAssembly {
 public:
  /// Local particle → particle of the body.
  std::span<int const> particles() const noexcept { return particles_; }
  int moving() const noexcept { return moving_; }

  /// f += internal forces at (x, v) in the first `moving()` columns; the border's columns are overwritten with partial sums.
  template <class X, class V, class F>
  void add_forces(X const& x, V const& v, F& f) const noexcept {
    add_link_forces(x, v, f);
    Four force, home;
    for (int i = 0; i < moving_; ++i) {
      home_force(home, x, v, i);
      take(force, f, i);
      put(f, i, force + home);
    }
  }

  /// out = inverse_mass · internal force + applied in the first `moving()` columns [m/s²]: add_forces and what a body does with them in
  /// one pass. `applied` is 4 × moving(). `force` is 4 × particles().size() and zero before; it may be `out`.
  template <class X, class V, class A, class F, class Out>
  void accelerate(X const& x, V const& v, Scalar const* inverse_mass, A const& applied, F&& force, Out& out) const noexcept {
    add_link_forces(x, v, force);
    Four sum, home, push;
    for (int i = 0; i < moving_; ++i) {
      home_force(home, x, v, i);
      take(sum, force, i);
      take(push, applied, i);
      put(out, i, inverse_mass[i] * (sum + home) + push);
    }
  }

  /// Takes the tangent of every spring at x, for the two below: once for many products. The first call allocates.
  template <class X>
  void linearise(X const& x, Scalar const* inverse_mass)
    requires StatesStiffness<Law, Scalar>
  {
    tangent_.particles.reserve(anchors_.capacity()), tangent_.groups.reserve(groups_.capacity()), tangent_.rows.reserve(rows_.capacity());
    tangent_.particles.clear(), tangent_.groups.clear(), tangent_.rows.clear();
    tangent_.all = static_cast<int>(particles_.size());
    for (int i = 0; i < moving_; ++i)
      tangent_.particles.push_back({1 / inverse_mass[i], anchors_[at(i)].damping, anchors_[at(i)].rest_and_stiffness[3]});
    auto const* row = rows_.data();
    for (Group const& group : groups_) {
      tangent_.groups.push_back({group.own, group.rows});
      for (auto const* const end = row + group.rows; row != end; ++row) set_tangent(tangent_.rows.emplace_back(), x, group, *row);
    }
  }
  /// out = (mass M + damping C + stiffness K) d, and the diagonal of that matrix; for shapes see MassSpringTangent.
  void multiply_tangent(Scalar mass, Scalar damping, Scalar stiffness, Scalar const* d, Scalar* out) const noexcept
    requires StatesStiffness<Law, Scalar>
  {
    tangent_.multiply(mass, damping, stiffness, d, out);
  }
  void tangent_diagonal(Scalar mass, Scalar damping, Scalar stiffness, Scalar* out) const noexcept
    requires StatesStiffness<Law, Scalar>
  {
    tangent_.diagonal(mass, damping, stiffness, out);
  }

  /// Gathers the springs of `tissue` that pull on the particles in `moving`. Allocates only when the set outgrows earlier ones.
  template <class Tissue>
  void build(Tissue const& tissue, std::span<int const> moving) {
    for (int const p : particles_)
      if (static_cast<std::size_t>(p) < local_.size()) local_[static_cast<std::size_t>(p)] = -1;
    local_.resize(static_cast<std::size_t>(tissue.size()), -1);
    particles_.assign(moving.begin(), moving.end());
    moving_ = static_cast<int>(moving.size());
    for (int i = 0; i < moving_; ++i) local_[static_cast<std::size_t>(moving[at(i)])] = i;

    own_.clear(), anchors_.clear(), groups_.clear(), rows_.clear();
    for (int i = 0; i < moving_; ++i) {
      int const p = moving[at(i)];
      for (int const l : tissue.links().at(p)) {
        auto const& link = tissue.links()[l];
        int const q = link.a == p ? link.b : link.a;
        int& j = local_[static_cast<std::size_t>(q)];
        if (j < 0) {
          j = static_cast<int>(particles_.size());
          particles_.push_back(q);
        }
        if (j > i) own_.push_back({l, j});
      }
      Vector3<Scalar> const rest = tissue.rest_position(p);
      auto const& home = tissue.home(p);
      anchors_.push_back({{rest[0], rest[1], rest[2], home.stiffness}, home.damping, static_cast<int>(own_.size())});
    }
    for (int first = 0; first < moving_; first += window) group(tissue, first, std::min(first + window, moving_));
  }

  void reserve(int particles, int links) {
    auto const n = static_cast<std::size_t>(particles), m = static_cast<std::size_t>(links);
    particles_.reserve(n), local_.reserve(n), anchors_.reserve(n), groups_.reserve(n), own_.reserve(m), rows_.reserve(m / 2 + 64);
  }

 private:
  using Four = detail::Four<Scalar>;

  static constexpr int window = 32;       // particles among which groups are formed
  static constexpr int most_rows = 8;     // of a group, and of a pass
  /// Squared lengths below this count as this: such a link is far shorter than any rounding of its ends.
  static constexpr Scalar least = std::numeric_limits<Scalar>::min() * 4096 * 4096;

  /// A link of each of a group's particles.
  struct Row {
    Four rest_length;
    Four weight;
    std::array<Law, 4> law;
    std::array<int, 4> other;   // the upper ends
  };
  struct Group {
    std::array<int, 4> own;   // the lower ends
    int rows;
  };
  struct Anchor {
    std::array<Scalar, 4> rest_and_stiffness;
    Scalar damping;
    int end;   // of the particle's links in own_
  };
  struct OwnLink {
    int link, other;
  };

  static std::size_t at(int i) noexcept { return static_cast<std::size_t>(i); }

  template <class Columns>
  static constexpr bool is_wide = int{Columns::RowsAtCompileTime} == 4;

  template <class Columns>
  static void take(Four& to, Columns const& from, int i) noexcept {
    if constexpr (is_wide<Columns>)
      detail::load(to, from.data() + 4 * static_cast<std::ptrdiff_t>(i));
    else
      to = Four{from(0, i), from(1, i), from(2, i), Scalar(0)};
  }
  template <class Columns>
  static void put(Columns& to, int i, Four const& from) noexcept {
    if constexpr (is_wide<Columns>)
      detail::store(to.data() + 4 * static_cast<std::ptrdiff_t>(i), from);
    else
      for (int k = 0; k < 3; ++k) to(k, i) = from[k];
  }

  template <class X, class V>
  void home_force(Four& force, X const& x, V const& v, int i) const noexcept {
    Anchor const& anchor = anchors_[at(i)];
    Four rest, position, velocity;
    detail::load(rest, anchor.rest_and_stiffness.data());
    Scalar const stiffness = rest[3];
    take(position, x, i);
    take(velocity, v, i);
    rest[3] = 0;
    force = stiffness * (rest - position) - anchor.damping * velocity;
  }

  template <class X, class V, class F>
  void add_link_forces(X const& x, V const& v, F& f) const noexcept {
    Four difference[4 * most_rows], squared_length[most_rows], factor[most_rows];
    Row const* row = rows_.data();
    auto const* const end = groups_.data() + groups_.size();
    for (auto const* group = groups_.data(); group != end;) {
      int rows = 0;
      auto const* last = group;
      for (; last != end && rows + last->rows <= most_rows; ++last) {
        Four own_x[4], own_v[4];
        for (int k = 0; k < 4; ++k) take(own_x[k], x, last->own[at(k)]), take(own_v[k], v, last->own[at(k)]);
        for (int const after = rows + last->rows; rows < after; ++rows) {
          Four squares[4], products[4];
          for (int k = 0; k < 4; ++k) {
            Four other_x, other_v;
            take(other_x, x, row[rows].other[at(k)]), take(other_v, v, row[rows].other[at(k)]);
            Four const d = own_x[k] - other_x;
            difference[4 * rows + k] = d;
            squares[k] = d * d;
            products[k] = d * (own_v[k] - other_v);
          }
          detail::sum_each(squared_length[rows], squares);
          detail::sum_each(factor[rows], products);   // d·(v_i − v_j)
        }
      }
      for (int r = 0; r < rows; ++r) set_factor(factor[r], squared_length[r], row[r]);
      for (int r = 0; group != last; ++group) {
        Four sum[4] = {};
        for (int const after = r + group->rows; r < after; ++r)
          for (int k = 0; k < 4; ++k) {
            int const j = row[r].other[at(k)];
            Four const pull = factor[r][k] * difference[4 * r + k];
            Four there;
            take(there, f, j);
            put(f, j, there + pull);
            sum[k] -= pull;
          }
        for (int k = 0; k < 4; ++k) {
          Four here;
          take(here, f, group->own[at(k)]);
          put(f, group->own[at(k)], here + sum[k]);
        }
      }
      row += rows;
    }
  }

  /// From d·(v_i − v_j) to the factor of d in the pull of a link.
  static void set_factor(Four& factor, Four const& squared_length, Row const& row) noexcept {
    Four const square = squared_length > least ? squared_length : least + Four{};
    Four length, tension, damping;
    detail::square_root(length, square);
    Four const elongation = length - row.rest_length;
    for (int k = 0; k < 4; ++k) {
      tension[k] = static_cast<Scalar>(row.law[at(k)].tension(elongation[k], row.rest_length[k]));
      damping[k] = static_cast<Scalar>(row.law[at(k)].damping);
    }
    factor = row.weight * (tension * length + damping * factor) / square;
  }

  template <class TangentRow, class X>
  static void set_tangent(TangentRow& to, X const& x, Group const& group, Row const& row) noexcept {
    Four squares[4], squared_length, length;
    for (int k = 0; k < 4; ++k) {
      Four own, other;
      take(own, x, group.own[at(k)]), take(other, x, row.other[at(k)]);
      to.direction[k] = own - other;
      squares[k] = to.direction[k] * to.direction[k];
    }
    detail::sum_each(squared_length, squares);
    Four const square = squared_length > least ? squared_length : least + Four{};
    detail::square_root(length, square);
    Four const elongation = length - row.rest_length;
    Four const per_length = 1 / length;
    for (int k = 0; k < 4; ++k) {
      Law const& law = row.law[at(k)];
      Scalar const tension = static_cast<Scalar>(law.tension(elongation[k], row.rest_length[k]));
      Scalar const along = static_cast<Scalar>(law.tangent_stiffness(elongation[k], row.rest_length[k]));
      to.across[k] = std::max(Scalar(0), tension) * per_length[k];
      to.more_along[k] = std::max(Scalar(0), along) - to.across[k];
      to.damping[k] = static_cast<Scalar>(law.damping);
      to.direction[k] *= per_length[k];
    }
    to.across *= row.weight, to.more_along *= row.weight, to.damping *= row.weight;
    to.other = row.other;
  }

  int own_count(int i) const noexcept { return anchors_[at(i)].end - own_begin(i); }
  int own_begin(int i) const noexcept { return i > 0 ? anchors_[at(i - 1)].end : 0; }

  /// Puts the particles first … last − 1 into groups of four, those with most links of their own first.
  template <class Tissue>
  void group(Tissue const& tissue, int first, int last) {
    int most = 0, members = 0;
    for (int i = first; i < last; ++i) most = std::max(most, own_count(i));
    std::array<int, 4> own{};
    for (int count = most; count > 0; --count)
      for (int i = first; i < last; ++i) {
        if (own_count(i) != count) continue;
        own[at(members++)] = i;
        if (members < 4) continue;
        add_group(tissue, own, 4);
        members = 0;
      }
    if (members > 0) {
      for (int k = members; k < 4; ++k) own[at(k)] = own[0];
      add_group(tissue, own, members);
    }
  }

  template <class Tissue>
  void add_group(Tissue const& tissue, std::array<int, 4> const& own, int members) {
    int const count = own_count(own[0]);   // none has more
    for (int k = 0; k < count; ++k) {
      if (k % most_rows == 0) groups_.push_back({own, std::min(most_rows, count - k)});
      Row& row = rows_.emplace_back();
      for (int m = 0; m < 4; ++m) {
        bool const is_link = m < members && k < own_count(own[at(m)]);
        OwnLink const& chosen = own_[at(own_begin(own[is_link ? at(m) : 0]) + k)];
        auto const& link = tissue.links()[chosen.link];
        row.rest_length[m] = link.rest_length;
        row.weight[m] = is_link ? link.weight : Scalar(0);
        row.law[at(m)] = link.law;
        row.other[at(m)] = is_link ? chosen.other : own[at(m)];
      }
    }
  }

  int moving_ = 0;
  std::vector<int> particles_;
  std::vector<int> local_;   // particle of the body → local particle, −1 outside
  std::vector<OwnLink> own_;
  std::vector<Anchor> anchors_;
  std::vector<Group> groups_;
  std::vector<Row> rows_;
  MassSpringTangent<Scalar> tangent_;   // empty until linearise()
};

}  // namespace palpate
