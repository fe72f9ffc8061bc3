// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/four.hpp>
#include <palpate/core/wide.hpp>
#include <palpate/tissue/mass_spring_layout.hpp>
#include <palpate/tissue/mass_spring_tangent.hpp>
#include <palpate/tissue/column_force.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <span>

namespace palpate {

/// The springs that act on a chosen set of particles, and their forces.
///   f_i −= (w/|d|²) (T(|d| − L) |d| + c d·(v_i − v_j)) d,   d = x_i − x_j; the same with + on j
/// Order      that of MassSpringLayout. Up to eight rows go through three short loops: differences, then factors, then pulls; one long loop
///            would wait for roots and divisions. A step goes through the particles part by part and finishes each part while its numbers
///            are near the processor.
/// Shapes     positions, velocities, forces: 3 × particles().size(), one column per local particle; or 4 × with the fourth row 0, which
///            is faster.
/// Cost       O(links), no allocation, noexcept; the same result to the bit whatever the shape.
/// Limits     a link of length 0 has no direction: it gives no force.
template <RealScalar Scalar, SpringLaw<Scalar> Law>
class MassSpringAssembly {
 public:
  /// Local particle → particle of the body.
  std::span<int const> particles() const noexcept { return layout_.particles(); }
  int moving() const noexcept { return layout_.moving(); }

  /// f += internal forces at (x, v) in the first `moving()` columns; the border's columns are overwritten with partial sums.
  template <class X, class V, class F>
  void add_forces(X const& x, V const& v, F& f) const noexcept {
    add_link_forces(x, v, f, 0, 0, static_cast<int>(layout_.groups().size()));
    Four force, home, position, velocity;
    for (int i = 0; i < moving(); ++i) {
      take(force, f, i), take(position, x, i), take(velocity, v, i);
      home_force(home, position, velocity, layout_.anchors()[at(i)]);
      put(f, i, force + home);
    }
  }

  /// inverse mass · (internal force at (x, v) + pushes) + gravity of the `moving()` particles [m/s²]: add_forces and what a body does with them,
  /// part by part. `before(first, end)` is called for particles before a link reads their x and v; `after_of(block)(i, acceleration)` when no link will
  /// read it again: it may change both. `run(n, walk)` calls walk(0) … walk(n − 1), in any order or at once, and returns when all are done.
  /// Shapes     x, v, force: 4 × particles().size(), contiguous, the fourth row 0; force is zero before and after.
  template <class Run, class Before, class AfterOf>
  void accelerate(Scalar const* x, Scalar const* v, Vector3<Scalar> const& gravity, std::span<ColumnForce<Scalar> const> pushes, Scalar* force,
                  Run const& run, Before const& before, AfterOf const& after_of) const {
    auto const all = static_cast<Eigen::Index>(particles().size());
    WideView<Scalar> const at_x(const_cast<Scalar*>(x), 4, all), at_v(const_cast<Scalar*>(v), 4, all);
    WideView<Scalar> f(force, 4, all);
    run(static_cast<int>(layout_.blocks().size()), [&](int b) {
      auto const block = layout_.blocks()[at(b)];
      auto after = after_of(b);
      auto next_push = pushes.begin();
      int prepared = layout_.parts()[at(block.first_part)].first;
      for (int k = block.first_part; k < block.end_part; ++k) {
        auto const part = layout_.parts()[at(k)];
        if (prepared < part.reach) before(prepared, part.reach);
        prepared = part.reach;
        add_link_forces(at_x, at_v, f, part.first_row, part.first_group, part.end_group);
        if (!part.is_open) finish(at_x, at_v, gravity, f, part, pushes, next_push, after);
      }
    });
    int const leaving = layout_.first_leaving_group(), groups = static_cast<int>(layout_.groups().size());
    if (leaving < groups) {
      add_link_forces(at_x, at_v, f, layout_.first_leaving_row(), leaving, groups);
      auto after = after_of(0);
      auto next_push = pushes.begin();
      for (auto const& part : layout_.parts())
        if (part.is_open) finish(at_x, at_v, gravity, f, part, pushes, next_push, after);
    }
    f.rightCols(all - moving()).setZero();
  }
  /// Blocks that accelerate() walks: those that can be walked at once.
  int blocks() const noexcept { return static_cast<int>(layout_.blocks().size()); }

  /// Takes the tangent of every spring at x, for the two below: once for many products. The first call allocates.
  template <class X>
  void linearise(X const& x, Scalar const* inverse_mass)
    requires StatesStiffness<Law, Scalar>
  {
    tangent_.particles.reserve(layout_.anchor_capacity()), tangent_.groups.reserve(layout_.group_capacity());
    tangent_.rows.reserve(layout_.row_capacity());
    tangent_.particles.clear(), tangent_.groups.clear(), tangent_.rows.clear();
    tangent_.all = static_cast<int>(particles().size());
    for (int i = 0; i < moving(); ++i) {
      auto const& anchor = layout_.anchors()[at(i)];
      tangent_.particles.push_back({1 / inverse_mass[i], anchor.damping, anchor.rest_and_stiffness[3]});
    }
    int row = 0;
    for (Group const& group : layout_.groups()) {
      tangent_.groups.push_back({group.own, group.rows});
      for (int const end = row + group.rows; row < end; ++row)
        set_tangent(tangent_.rows.emplace_back(), x, group, layout_.rows()[at(row)], layout_.laws(row));
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
    layout_.build(tissue, moving);
  }
  void reserve(int particles, int links) { layout_.reserve(particles, links); }

 private:
  using Four = detail::Four<Scalar>;
  using Layout = MassSpringLayout<Scalar, Law>;
  using Row = typename Layout::Row;
  using Laws = typename Layout::Laws;
  using Group = typename Layout::Group;
  using Anchor = typename Layout::Anchor;

  static constexpr int most_rows = Layout::most_rows;   // of a pass
  /// Squared lengths below this count as this: such a link is far shorter than any rounding of its ends.
  static constexpr Scalar least = std::numeric_limits<Scalar>::min() * 4096 * 4096;

  static std::size_t at(int i) noexcept { return static_cast<std::size_t>(i); }

  template <class Columns>
  static constexpr bool is_wide = int{Columns::RowsAtCompileTime} == 4;

  template <class Columns>
  static void take(Four& to, Columns const& from, int i) noexcept {
    take_at(to, from, 4 * i);
  }
  template <class Columns>
  static void put(Columns& to, int i, Four const& from) noexcept {
    put_at(to, 4 * i, from);
  }
  /// The column at 4 i: what rows and groups hold, so that the processor need not multiply.
  template <class Columns>
  static void take_at(Four& to, Columns const& from, int offset) noexcept {
    if constexpr (is_wide<Columns>)
      detail::load(to, from.data() + offset);
    else
      to = Four{from(0, offset / 4), from(1, offset / 4), from(2, offset / 4), Scalar(0)};
  }
  template <class Columns>
  static void put_at(Columns& to, int offset, Four const& from) noexcept {
    if constexpr (is_wide<Columns>)
      detail::store(to.data() + offset, from);
    else
      for (int k = 0; k < 3; ++k) to(k, offset / 4) = from[at(k)];
  }

  static void home_force(Four& force, Four const& position, Four const& velocity, Anchor const& anchor) noexcept {
    Four rest;
    detail::load(rest, anchor.rest_and_stiffness.data());
    Scalar const stiffness = rest[3];
    detail::clear_last(rest);
    force = stiffness * (rest - position) - anchor.damping * velocity;
  }

  /// From forces to what `after` makes of accelerations, for a part whose links have all been walked. The forces are zero then.
  template <class NextPush, class After>
  void finish(WideView<Scalar> const& x, WideView<Scalar> const& v, Vector3<Scalar> const& gravity, WideView<Scalar>& f,
              typename Layout::Part const part, std::span<ColumnForce<Scalar> const> pushes, NextPush& next_push, After& after) const noexcept {
    while (next_push != pushes.end() && next_push->column < part.first) ++next_push;
    for (; next_push != pushes.end() && next_push->column < part.end; ++next_push)
      f.col(next_push->column).template head<3>() += next_push->force;
    Four const weight = {gravity[0], gravity[1], gravity[2], Scalar(0)};
    Anchor const* const anchors = layout_.anchors().data();
    Four sum, home, position, velocity;
    for (int i = part.first; i < part.end; ++i) {
      take(sum, f, i), take(position, x, i), take(velocity, v, i);
      put(f, i, Four{});
      home_force(home, position, velocity, anchors[i]);
      after(i, anchors[i].inverse_mass * (sum + home) + weight);
    }
  }

  /// The links of groups first_group … end_group − 1, whose rows begin at first_row.
  template <class X, class V, class F>
  void add_link_forces(X const& x, V const& v, F& f, int first_row, int first_group, int end_group) const noexcept {
    Row const* row = layout_.rows().data() + first_row;
    Four difference[4 * most_rows], squared_length[most_rows], factor[most_rows];
    auto const* const end = layout_.groups().data() + end_group;
    for (auto const* group = layout_.groups().data() + first_group; group != end;) {
      int rows = 0;
      auto const* last = group;
      for (; last != end && rows + last->rows <= most_rows; ++last) {
        Four own_x[4], own_v[4];
        for (int k = 0; k < 4; ++k) take_at(own_x[k], x, last->own[at(k)]), take_at(own_v[k], v, last->own[at(k)]);
        for (int const after = rows + last->rows; rows < after; ++rows) {
          Four squares[4], products[4];
          for (int k = 0; k < 4; ++k) {
            Four other_x, other_v;
            take_at(other_x, x, row[rows].other[at(k)]), take_at(other_v, v, row[rows].other[at(k)]);
            Four const d = own_x[k] - other_x;
            difference[4 * rows + k] = d;
            squares[k] = d * d;
            products[k] = d * (own_v[k] - other_v);
          }
          detail::sum_each(squared_length[rows], squares);
          detail::sum_each(factor[rows], products);   // d·(v_i − v_j)
        }
      }
      if (layout_.has_one_law())
        for (int r = 0; r < rows; ++r) set_factor(factor[r], squared_length[r], row[r], layout_.laws(0));
      else
        for (int r = 0; r < rows; ++r) set_factor(factor[r], squared_length[r], row[r], layout_.laws(row - layout_.rows().data() + r));
      for (int r = 0; group != last; ++group) {
        Four sum[4] = {};
        for (int const after = r + group->rows; r < after; ++r)
          for (int k = 0; k < 4; ++k) {
            int const j = row[r].other[at(k)];
            Four const pull = factor[r][at(k)] * difference[4 * r + k];
            Four there;
            take_at(there, f, j);
            put_at(f, j, there + pull);
            sum[k] -= pull;
          }
        for (int k = 0; k < 4; ++k) {
          Four here;
          take_at(here, f, group->own[at(k)]);
          put_at(f, group->own[at(k)], here + sum[k]);
        }
      }
      row += rows;
    }
  }

  /// From d·(v_i − v_j) to the factor of d in the pull of a link.
  static void set_factor(Four& factor, Four const& squared_length, Row const& row, Laws const& law) noexcept {
    Four square = squared_length, length, rest_length, weight;
    detail::load(rest_length, row.rest_length.data()), detail::load(weight, row.weight.data());
    detail::raise_to(square, least);
    detail::square_root(length, square);
    Four const elongation = length - rest_length;
    auto const tension_of = [&](std::size_t k) { return static_cast<Scalar>(law[k].tension(elongation[k], rest_length[k])); };
    auto const damping_of = [&](std::size_t k) { return static_cast<Scalar>(law[k].damping); };
    Four const tension = {tension_of(0), tension_of(1), tension_of(2), tension_of(3)};
    Four const damping = {damping_of(0), damping_of(1), damping_of(2), damping_of(3)};
    factor = weight * (tension * length + damping * factor) / square;
  }

  template <class TangentRow, class X>
  static void set_tangent(TangentRow& to, X const& x, Group const& group, Row const& row, Laws const& laws) noexcept {
    Four squares[4], squared_length, length, rest_length, weight;
    detail::load(rest_length, row.rest_length.data()), detail::load(weight, row.weight.data());
    for (int k = 0; k < 4; ++k) {
      Four own, other;
      take_at(own, x, group.own[at(k)]), take_at(other, x, row.other[at(k)]);
      to.direction[k] = own - other;
      squares[k] = to.direction[k] * to.direction[k];
    }
    detail::sum_each(squared_length, squares);
    detail::raise_to(squared_length, least);
    detail::square_root(length, squared_length);
    Four const elongation = length - rest_length;
    Four const per_length = Scalar(1) / length;
    std::array<Scalar, 4> across, more_along, damping;
    for (std::size_t k = 0; k < 4; ++k) {
      Law const& law = laws[k];
      Scalar const tension = static_cast<Scalar>(law.tension(elongation[k], rest_length[k]));
      Scalar const along = static_cast<Scalar>(law.tangent_stiffness(elongation[k], rest_length[k]));
      across[k] = std::max(Scalar(0), tension) * per_length[k];
      more_along[k] = std::max(Scalar(0), along) - across[k];
      damping[k] = static_cast<Scalar>(law.damping);
      to.direction[k] *= per_length[k];
    }
    detail::load(to.across, across.data()), detail::load(to.more_along, more_along.data()), detail::load(to.damping, damping.data());
    to.across *= weight, to.more_along *= weight, to.damping *= weight;
    to.other = row.other;
  }

  Layout layout_;
  MassSpringTangent<Scalar> tangent_;   // empty until linearise()
};

}  // namespace palpate
