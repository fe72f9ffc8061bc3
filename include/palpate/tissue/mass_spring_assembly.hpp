// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/padded_view.hpp>
#include <palpate/core/simd.hpp>
#include <palpate/tissue/column_force.hpp>
#include <palpate/tissue/mass_spring_layout.hpp>
#include <palpate/tissue/mass_spring_tangent.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <span>
#include <type_traits>

namespace palpate {

/// Spring forces on a chosen set of particles: SIMD over rows of springs, cache blocking over groups of particles.
///   f_i −= (w/|d|) (T(|d| − L) + c d·(v_i − v_j)/|d|) d,   d = x_i − x_j; the same with + on j
/// Order      that of MassSpringLayout. Up to eight rows pass three short loops: differences, factors, forces; one long loop would wait
///            for roots and divisions. A step finishes each group of particles while its data are in cache.
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
    add_link_forces(columns_of(x), columns_of(v), columns_of(f), 0, 0, static_cast<int>(layout_.groups().size()));
    Four force, home, position, velocity;
    for (int i = 0; i < moving(); ++i) {
      take_at(force, columns_of(f), 4 * i), take_at(position, columns_of(x), 4 * i), take_at(velocity, columns_of(v), 4 * i);
      home_force(home, position, velocity, layout_.rest()[at(i)].data(), Spread<Four>([&](int) { return layout_.coefficients(i); }));
      put_at(columns_of(f), 4 * i, force + home);
    }
  }

  /// inverse mass · (internal force at (x, v) + pushes) + gravity of the `moving()` particles [m/s²]: add_forces and what a body does with them,
  /// part by part. `before(first, end)` is called for particles before a link reads their x and v; `after_of(block)(i, accelerations)` when no
  /// link will read them again: it may change both. It gets a Four for particle i, or columns_in_register of them from i on. `run(n, walk)` calls
  /// walk(0) … walk(n − 1), in any order or at once, and returns when all are done. `columns` are those that `before` and `after_of` go through; of a
  /// large body they are called for before that.
  /// Shapes     x, v: 4 × particles().size(), force: 4 × force_columns(), contiguous, the fourth row 0; force is zero before and after.
  /// Memory     a particle's force is of use from the first link that acts on it to the last. In a large body it stands in a window that moves
  ///            along with the parts and stays near the processor; what links that leave a block act on goes to its own column.
  template <class Run, std::size_t Count, class Before, class AfterOf>
  void accelerate(Scalar const* x, Scalar const* v, Vector3<Scalar> const& gravity, std::span<ColumnForce<Scalar> const> pushes, Scalar* force,
                  Run const& run, std::array<Scalar const*, Count> const& columns, Before const& before, AfterOf const& after_of) const {
    run(static_cast<int>(layout_.blocks().size()), [&](int b) {
      auto const block = layout_.blocks()[at(b)];
      auto const after = after_of(b);
      auto next_push = pushes.begin();
      int prepared = layout_.parts()[at(block.first_part)].first;
      Window window(layout_.window() > 0 ? force + column(static_cast<int>(particles().size()) + b * layout_.window()) : nullptr, prepared);
      for (int k = block.first_part; k < block.end_part; ++k) {
        auto const part = layout_.parts()[at(k)];
        if (prepared < part.reach) before(prepared, part.reach);
        if (window.columns != nullptr && part.reach - window.first > layout_.window()) window.move(part.first, prepared);
        prepared = part.reach;
        Scalar* const f = window.columns != nullptr ? window.columns - column(window.first) : force;
        int const groups = part.end_group - part.first_group;
        if (layout_.blocks().size() > 1)
          add_link_forces(x, v, f, part.first_row, part.first_group, part.end_group,
                          Ahead<Count>(columns, prepared, std::min(prepared + part.end - part.first, moving()), groups));
        else   // all of it is near the processor
          add_link_forces(x, v, f, part.first_row, part.first_group, part.end_group);
        if (!part.is_open)
          finish(x, v, gravity, f, part, pushes, next_push, after);
        else if (f != force)
          hand_over(f + column(part.first), f + column(part.end), force + column(part.first));
      }
    });
    int const leaving = layout_.first_leaving_group(), groups = static_cast<int>(layout_.groups().size());
    if (leaving < groups) {
      add_link_forces(x, v, force, layout_.first_leaving_row(), leaving, groups);
      auto const after = after_of(0);
      auto next_push = pushes.begin();
      for (auto const& part : layout_.parts())
        if (part.is_open) finish(x, v, gravity, force, part, pushes, next_push, after);
    }
    std::fill(force + 4 * static_cast<std::ptrdiff_t>(moving()), force + 4 * static_cast<std::ptrdiff_t>(particles().size()), Scalar(0));
  }
  /// Of what accelerate() needs: one for each particle, then a window for each block.
  int force_columns() const noexcept { return static_cast<int>(particles().size()) + blocks() * layout_.window(); }
  static int max_force_columns(int particles) noexcept { return particles + Layout::max_window_columns(particles); }
  /// Blocks that accelerate() walks: those that can be walked at once.
  int blocks() const noexcept { return static_cast<int>(layout_.blocks().size()); }

  /// Takes the tangent of every spring at x, for the two below: once for many products. The first call allocates.
  template <class X>
  void linearise(X const& x, Scalar const* inverse_mass)
    requires StatesStiffness<Law, Scalar>
  {
    tangent_.particles.reserve(layout_.particle_capacity()), tangent_.groups.reserve(width / 4 * layout_.group_capacity());
    tangent_.rows.reserve(width / 4 * layout_.row_capacity());
    tangent_.particles.clear(), tangent_.groups.clear(), tangent_.rows.clear();
    tangent_.all = static_cast<int>(particles().size());
    for (int i = 0; i < moving(); ++i) {
      auto const& own = layout_.coefficients(i);
      tangent_.particles.push_back({1 / inverse_mass[i], own.damping, own.stiffness});
    }
    int row = 0;
    for (Group const& group : layout_.groups()) {
      for (int first = 0; first < width; first += 4) {
        tangent_.groups.push_back({{group.own[at(first)], group.own[at(first + 1)], group.own[at(first + 2)], group.own[at(first + 3)]}, group.rows});
        for (int r = row; r < row + group.rows; ++r) set_tangent(tangent_.rows.emplace_back(), x, group, r, first);
      }
      row += group.rows;
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
  /// Memory for the springs of a tissue that grows to so many particles and triangles.
  template <class Tissue>
  void reserve(Tissue const& tissue, int particles, int triangles) {
    layout_.reserve(particles, std::max(3 * triangles + particles, tissue.links().size() + 8 * std::max(0, particles - tissue.size())));   // a volume has more
  }

 private:
  using Four = simd::Pack<Scalar, 4>;
  using Layout = MassSpringLayout<Scalar, Law>;
  using Wide = simd::Pack<Scalar, Layout::width>;   // a number of each link of a row, or width / 4 columns
  using Row = typename Layout::Row;
  using Laws = typename Layout::Laws;
  using Group = typename Layout::Group;
  using Weights = typename Layout::Weights;
  using Coefficients = typename Layout::Coefficients;

  using Kept = std::conditional_t<std::is_trivially_copyable_v<Law>, Law, Law const&>;   // in registers where the law is trivially copyable

  static constexpr int width = Layout::width;
  static constexpr int max_rows = Layout::max_rows;   // of a pass
  /// Squared lengths below this count as this: such a link is far shorter than any rounding of its ends.
  static constexpr Scalar least = std::numeric_limits<Scalar>::min() * 4096 * 4096;

  static std::size_t at(int i) noexcept { return static_cast<std::size_t>(i); }
  static std::ptrdiff_t column(int i) noexcept { return 4 * static_cast<std::ptrdiff_t>(i); }

  /// The forces on the particles from `first` on, as many as a window has columns; zero where no link has acted yet.
  struct Window {
    Scalar* columns;   // none: there is no window
    int first;
    Window(Scalar* begin, int particle) noexcept : columns(begin), first(particle) {}
    /// Shifts the window so that `particle` is the first; forces have been added up to `end` − 1.
    void move(int particle, int end) noexcept {
      Scalar *const from = columns + column(particle - first), *const last = columns + column(end - first);
      first = particle;
      std::copy(from, last, columns);
      std::fill(std::max(columns + (last - from), from), last, Scalar(0));
    }
  };

  /// Software prefetch of the columns that the next part reads, spread evenly over the groups of this one, so that loads overlap with
  /// computing. The hardware prefetcher follows such streams only to the end of a page.
  template <std::size_t Count>
  struct Ahead {
    static constexpr std::ptrdiff_t line = 64 / sizeof(Scalar);   // numbers in a cache line

    std::array<Scalar const*, Count> columns{};
    std::ptrdiff_t next = 0, end = 0, share = 0;

    Ahead() = default;
    /// Columns `first` … `last` − 1, with so many groups.
    Ahead(std::array<Scalar const*, Count> const& of, int first, int last, int groups) noexcept
        : columns(of), next(column(first)), end(column(last)), share(((end - next) / std::max(groups, 1) / line + 1) * line) {}

    [[gnu::always_inline]] void call() noexcept {   // inlined: gcc drops a call of what does nothing but this
      if constexpr (Count > 0)
        for (std::ptrdiff_t const last = std::min(next + share, end); next < last; next += line)
          for (Scalar const* const each : columns) __builtin_prefetch(each + next);
    }
  };

  static void hand_over(Scalar* first, Scalar* last, Scalar* to) noexcept {
    std::copy(first, last, to);
    std::fill(first, last, Scalar(0));
  }

  /// Where columns begin that are four numbers each and contiguous; of others, where the matrix is. By value: stores cannot change it then.
  template <class Columns>
  static auto columns_of(Columns& columns) noexcept {
    if constexpr (int{Columns::RowsAtCompileTime} == 4)
      return columns.data();
    else
      return &columns;
  }
  /// The column at 4 i: what rows and groups hold, so that the processor need not multiply.
  static void take_at(Four& to, Scalar const* from, int offset) noexcept { simd::load(to, from + offset); }
  static void put_at(Scalar* to, int offset, Four const& from) noexcept { simd::store(to + offset, from); }
  template <class Columns>
  static void take_at(Four& to, Columns const* from, int offset) noexcept {
    Columns const& columns = *from;
    to = Four{columns(0, offset / 4), columns(1, offset / 4), columns(2, offset / 4), Scalar(0)};
  }
  template <class Columns>
  static void put_at(Columns* to, int offset, Four const& from) noexcept {
    for (int k = 0; k < 3; ++k) (*to)(k, offset / 4) = from[at(k)];
  }

  /// Columns k and, where Wide holds two, k + 4 of those at `offsets`.
  template <class Columns>
  static void take_at(Wide& to, Columns const* from, std::array<int, width> const& offsets, int k) noexcept {
    if constexpr (width == 8) {
      Four low, high;
      take_at(low, from, offsets[at(k)]), take_at(high, from, offsets[at(k + 4)]);
      simd::join(to, low, high);
    } else {
      take_at(to, from, offsets[at(k)]);
    }
  }
  /// One after the other: both may be the same.
  template <class Columns>
  static void add_at(Columns* to, std::array<int, width> const& offsets, int k, Wide const& what) noexcept {
    if constexpr (width == 8) {
      Four low, high;
      simd::split(low, high, what);
      add_at(to, offsets[at(k)], low), add_at(to, offsets[at(k + 4)], high);
    } else {
      add_at(to, offsets[at(k)], what);
    }
  }
  template <class Columns>
  static void add_at(Columns* to, int offset, Four const& what) noexcept {
    Four there;
    take_at(there, to, offset);
    put_at(to, offset, there + what);
  }

  /// The coefficients of as many particles as there are columns, each for all numbers of its column.
  template <class Columns>
  struct Spread {
    static constexpr int count = static_cast<int>(sizeof(Columns) / (4 * sizeof(Scalar)));
    Columns stiffness, damping, inverse_mass;
    /// `of(k)` are those of column k.
    template <class Of>
    explicit Spread(Of const& of) noexcept {
      spread(stiffness, [&](int k) { return of(k).stiffness; }), spread(damping, [&](int k) { return of(k).damping; });
      spread(inverse_mass, [&](int k) { return of(k).inverse_mass; });
    }

   private:
    template <class Number>
    static void spread(Columns& to, Number const& number) noexcept {
      Scalar const a = number(0);
      if constexpr (count == 1) {
        to = Columns{a, a, a, a};
      } else if constexpr (count == 2) {
        Scalar const b = number(1);
        to = Columns{a, a, a, a, b, b, b, b};
      } else {
        Scalar const b = number(1), c = number(2), d = number(3);
        to = Columns{a, a, a, a, b, b, b, b, c, c, c, c, d, d, d, d};
      }
    }
  };

  template <class Columns>
  static void home_force(Columns& force, Columns const& position, Columns const& velocity, Scalar const* at_rest,
                         Spread<Columns> const& own) noexcept {
    Columns rest;
    simd::load(rest, at_rest);
    force = own.stiffness * (rest - position) - own.damping * velocity;
  }

  /// From forces to what `after` makes of accelerations, for a part whose links have all been walked. The forces are zero then.
  template <class NextPush, class After>
  void finish(Scalar const* x, Scalar const* v, Vector3<Scalar> const& gravity, Scalar* f, typename Layout::Part const part,
              std::span<ColumnForce<Scalar> const> pushes, NextPush& next_push, After const& after_some) const noexcept {
    while (next_push != pushes.end() && next_push->column < part.first) ++next_push;
    for (; next_push != pushes.end() && next_push->column < part.end; ++next_push)
      for (int k = 0; k < 3; ++k) f[4 * next_push->column + k] += next_push->force[k];
    After const after = after_some;   // a copy that no store reaches stays in registers
    Scalar const* const rest = layout_.rest().front().data();
    constexpr int count = simd::columns_in_register<Scalar>;
    using Several = simd::Pack<Scalar, 4 * count>;
    std::array<Scalar, 4 * count> gravities{};
    for (int k = 0; k < 4 * count; ++k) gravities[at(k)] = k % 4 < 3 ? gravity[k % 4] : Scalar(0);
    auto const finish_at = [=]<class Columns>(int i, Spread<Columns> const& own) {
      std::ptrdiff_t const k = 4 * static_cast<std::ptrdiff_t>(i);
      Columns sum, home, position, velocity, weight;
      simd::load(sum, f + k), simd::load(position, x + k), simd::load(velocity, v + k), simd::load(weight, gravities.data());
      simd::store(f + k, Columns{});
      home_force(home, position, velocity, rest + k, own);
      after(i, Columns(own.inverse_mass * (sum + home) + weight));
    };
    int i = part.first;
    if constexpr (count > 1) {
      if (layout_.has_one_coefficients())
        for (Spread<Several> const own([&](int) { return layout_.coefficients(0); }); i + count <= part.end; i += count) finish_at(i, own);
      else
        for (; i + count <= part.end; i += count) finish_at(i, Spread<Several>([&](int k) { return layout_.coefficients(i + k); }));
    }
    for (; i < part.end; ++i) finish_at(i, Spread<Four>([&](int) { return layout_.coefficients(i); }));
  }

  /// The links of groups first_group … end_group − 1, whose rows begin at first_row.
  template <class X, class V, class F, std::size_t Count = 0>
  void add_link_forces(X const* x, V const* v, F* f, int first_row, int first_group, int end_group, Ahead<Count> ahead = {}) const noexcept {
    if (first_group == end_group) return;
    Row const* row = layout_.rows().data() + first_row;
    Wide difference[4 * max_rows], squared_length[max_rows], factor[max_rows];
    auto const* const end = layout_.groups().data() + end_group;
    bool const is_uniform = layout_.has_one_law() && layout_.weights_are_one();
    Kept const one_law = layout_.laws(0)[0];
    for (auto const* group = layout_.groups().data() + first_group; group != end;) {
      int rows = 0;
      auto const* last = group;
      for (; last != end && rows + last->rows <= max_rows; ++last) {
        ahead.call();
        Wide own_x[4], own_v[4];
#pragma GCC unroll 4
        for (int k = 0; k < 4; ++k) take_at(own_x[k], x, last->own, k), take_at(own_v[k], v, last->own, k);
        for (int const after = rows + last->rows; rows < after; ++rows) {
          decltype(simd::fold(own_x[0])) squares[4], products[4];
#pragma GCC unroll 4
          for (int k = 0; k < 4; ++k) {
            Wide other_x, other_v;
            take_at(other_x, x, row[rows].other, k), take_at(other_v, v, row[rows].other, k);
            Wide const d = own_x[k] - other_x;
            difference[4 * rows + k] = d;
            squares[k] = simd::fold(Wide(d * d));
            products[k] = simd::fold(Wide(d * (own_v[k] - other_v)));
          }
          simd::sum_each(squared_length[rows], squares);
          simd::sum_each(factor[rows], products);   // d·(v_i − v_j)
        }
      }
      if (is_uniform)
        for (int r = 0; r < rows; ++r) set_factor(factor[r], squared_length[r], row[r], [&](std::size_t) -> Law const& { return one_law; });
      else
        for (int r = 0; r < rows; ++r) {
          std::ptrdiff_t const number = row - layout_.rows().data() + r;
          Laws const& laws = layout_.laws(number);
          Wide weight;
          set_factor(factor[r], squared_length[r], row[r], [&](std::size_t k) -> Law const& { return laws[k]; });
          simd::load(weight, layout_.weights(number).data());
          factor[r] *= weight;
        }
      for (int r = 0; group != last; ++group) {
        Wide sum[4] = {};
        for (int const after = r + group->rows; r < after; ++r) {
          Wide pulls[4];
          simd::scale_each(pulls, difference + 4 * r, factor[r]);
#pragma GCC unroll 4
          for (int k = 0; k < 4; ++k) {
            add_at(f, row[r].other, k, pulls[k]);
            sum[k] -= pulls[k];
          }
        }
#pragma GCC unroll 4
        for (int k = 0; k < 4; ++k) add_at(f, group->own, k, sum[k]);
      }
      row += rows;
    }
  }

  /// From d·(v_i − v_j) to the factor of d in the pull of a link of weight 1.
  template <class LawOf>
  static void set_factor(Wide& factor, Wide const& squared_length, Row const& row, LawOf const& law_of) noexcept {
    Wide square = squared_length, length, per_length, rest_length;
    simd::load(rest_length, row.rest_length.data());
    simd::raise_to(square, least);
    simd::root_and_inverse(length, per_length, square);
    Wide const elongation = length - rest_length;
    auto const tension_of = [&](std::size_t k) { return static_cast<Scalar>(law_of(k).tension(elongation[k], rest_length[k])); };
    auto const damping_of = [&](std::size_t k) { return static_cast<Scalar>(law_of(k).damping); };
    auto const each = [](auto const& of) {
      if constexpr (width == 8)
        return Wide{of(0), of(1), of(2), of(3), of(4), of(5), of(6), of(7)};
      else
        return Wide{of(0), of(1), of(2), of(3)};
    };
    factor = (each(tension_of) + each(damping_of) * (factor * per_length)) * per_length;
  }

  /// Links first … first + 3 of a row.
  template <class TangentRow, class X>
  void set_tangent(TangentRow& to, X const& x, Group const& group, int row_number, int first) const noexcept {
    Row const& row = layout_.rows()[at(row_number)];
    Four squares[4], squared_length, length, rest_length, weight;
    simd::load(rest_length, row.rest_length.data() + first), simd::load(weight, layout_.weights(row_number).data() + first);
    for (int k = 0; k < 4; ++k) {
      Four own, other;
      to.other[at(k)] = row.other[at(first + k)];
      take_at(own, columns_of(x), group.own[at(first + k)]), take_at(other, columns_of(x), to.other[at(k)]);
      to.direction[k] = own - other;
      squares[k] = to.direction[k] * to.direction[k];
    }
    simd::sum_each(squared_length, squares);
    simd::raise_to(squared_length, least);
    simd::square_root(length, squared_length);
    Four const elongation = length - rest_length;
    Four const per_length = Scalar(1) / length;
    std::array<Scalar, 4> across, more_along, damping;
    for (std::size_t k = 0; k < 4; ++k) {
      Law const& law = layout_.laws(row_number)[at(first) + k];
      bool const is_link = row.other[at(first) + k] != group.own[at(first) + k];
      Scalar const tension = static_cast<Scalar>(law.tension(elongation[k], rest_length[k]));
      Scalar const along = static_cast<Scalar>(law.tangent_stiffness(elongation[k], rest_length[k]));
      across[k] = is_link ? std::max(Scalar(0), tension) * per_length[k] : Scalar(0);
      more_along[k] = std::max(Scalar(0), along) - across[k];
      damping[k] = static_cast<Scalar>(law.damping);
      to.direction[k] *= per_length[k];
    }
    simd::load(to.across, across.data()), simd::load(to.more_along, more_along.data()), simd::load(to.damping, damping.data());
    to.across *= weight, to.more_along *= weight, to.damping *= weight;
  }

  Layout layout_;
  MassSpringTangent<Scalar> tangent_;   // empty until linearise()
};

}  // namespace palpate
