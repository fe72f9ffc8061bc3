// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/padded_columns.hpp>
#include <palpate/core/simd.hpp>
#include <palpate/tissue/assembled_particles.hpp>
#include <palpate/tissue/solid_assembly.hpp>
#include <palpate/tissue/tensor_mass/tensor_rows.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <span>
#include <vector>

namespace palpate {

/// The tensors that act on a chosen set of particles: forces, tangent, energy.
/// Order      a particle's force is the sum over its row, itself first and then its neighbours by number: the same bytes in any number of blocks and
///            whatever was cut when.
/// Shapes     positions, velocities, forces: 3 × particles().size(), one column per local particle, or 4 × with the fourth row 0.
/// Cost       O(tensors); follow() that of the rows that were edited, and of all where the border is not empty. Only these two allocate.
template <RealScalar Scalar>
class TensorAssembly : public AssembledParticles<Scalar> {
  using Base = AssembledParticles<Scalar>;
  using typename Base::ConstPadded, typename Base::Padded;
  using Base::at, Base::first_of, Base::inverse_mass;
  using Column = simd::Pack<Scalar, 4>;

 public:
  static constexpr bool fast_tangent = true;
  using Base::blocks, Base::moving, Base::particles;

  /// f += internal forces at (x, v) in the first `moving()` columns.
  template <class X, class V, class F>
  void add_forces(X const& x, V const& v, F& f) const noexcept {
    for (int i = 0; i < moving(); ++i) {
      std::array<Scalar, 4> sum{};
      add_force(i, [&](int j) { return Column{x.col(j)[0], x.col(j)[1], x.col(j)[2], Scalar(0)}; },
                [&](int j) { return Column{v.col(j)[0], v.col(j)[1], v.col(j)[2], Scalar(0)}; }, sum.data());
      for (int c = 0; c < 3; ++c) f.col(i)[c] += sum[at(c)];
    }
  }
  /// inverse mass · (internal force at (x, v) + pushes) + gravity of the `moving()` particles [m/s²]; see MassSpringAssembly for the arguments. `before` is
  /// called for all of them first, `after_of(block)` when all forces are known.
  template <class Run, std::size_t Count, class Before, class AfterOf>
  void accelerate(Scalar const* x, Scalar const* v, Vector3<Scalar> const& gravity, std::span<ColumnForce<Scalar> const> pushes, Scalar* force,
                  Run const& run, std::array<Scalar const*, Count> const& /*columns*/, Before const& before, AfterOf const& after_of) const {
    run(blocks(), [&](int b) { before(first_of(b), first_of(b + 1)); });
    run(blocks(), [&](int b) {
      for (int i = first_of(b); i < first_of(b + 1); ++i) add_force(i, columns_of(x), columns_of(v), force + 4 * i);
    });
    this->accelerate_by(Padded(force, 4, this->force_columns()), gravity, pushes, run, after_of);
  }

  /// That of some of them alone, and below their part of a product and of the diagonal.
  template <class Run>
  void accelerate_some(std::span<int const> some, Scalar const* x, Scalar const* v, Vector3<Scalar> const& gravity, std::span<ColumnForce<Scalar> const> pushes,
                       Scalar* out, Run const& run) const {
    each_of(some, run, [&](int i) {
      Scalar* const own = out + 4 * static_cast<std::ptrdiff_t>(i);
      std::fill_n(own, 4, Scalar(0));
      add_force(i, columns_of(x), columns_of(v), own);
      auto push = std::lower_bound(pushes.begin(), pushes.end(), i, [](ColumnForce<Scalar> const& p, int column) { return p.column < column; });
      for (; push != pushes.end() && push->column == i; ++push)
        for (int c = 0; c < 3; ++c) own[c] += push->force[c];
      for (int c = 0; c < 3; ++c) own[c] = inverse_mass(i) * own[c] + gravity[c];
    });
  }
  template <class Run>
  void multiply_some(std::span<int const> some, Scalar mass, Scalar damping, Scalar stiffness, Scalar const* d, Scalar* out, Run const& run) const {
    Scalar const inertia = mass + damping * damping_.alpha, factor = stiffness + damping * damping_.beta;
    each_of(some, run, [&](int i) {
      Column const own = (inertia / inverse_mass(i)) * columns_of(d)(i) + factor * rows_.product(i, moving(), columns_of(d));
      Scalar* const to = out + 4 * static_cast<std::ptrdiff_t>(i);
      simd::store(to, own), to[3] = 0;
    });
  }
  void diagonal_of_some(std::span<int const> some, Scalar mass, Scalar damping, Scalar stiffness, Scalar* out) const noexcept {
    Scalar const inertia = mass + damping * damping_.alpha, factor = stiffness + damping * damping_.beta;
    for (int const i : some)
      for (int c = 0; c < 3; ++c) out[4 * static_cast<std::ptrdiff_t>(i) + c] = inertia / inverse_mass(i) + factor * rows_.values(i)[4 * c];
  }

  /// The tangent is the same everywhere.
  template <class X>
  void linearise(X const& /*x*/, Scalar const* /*inverse_mass*/) {
    rows_.round(false);
  }
  /// out = (mass M + damping C + stiffness K) d, and the diagonal of that matrix: 4 × particles().size(), contiguous, the fourth row 0; d is zero in the
  /// border's columns, out's are zero.
  void multiply_tangent(Scalar mass, Scalar damping, Scalar stiffness, Scalar const* d, Scalar* out) const noexcept {
    this->multiply_mass(mass + damping * damping_.alpha, d, out);
    Scalar const factor = stiffness + damping * damping_.beta;
    for (int i = 0; i < moving(); ++i) add(factor * rows_.product(i, moving(), columns_of(d)), out + 4 * i);
  }
  void multiply_tangent(Scalar mass, Scalar damping, Scalar stiffness, float const* d, float* out) const noexcept
    requires detail::has_float_rows<Scalar>
  {
    this->multiply_mass(mass + damping * damping_.alpha, d, out);
    rows_.add_product(static_cast<float>(stiffness + damping * damping_.beta), d, out);
  }
  void tangent_diagonal(Scalar mass, Scalar damping, Scalar stiffness, Scalar* out) const noexcept {
    this->mass_diagonal(mass + damping * damping_.alpha, out);
    for (int i = 0; i < moving(); ++i)
      for (int c = 0; c < 3; ++c) out[4 * i + c] += (stiffness + damping * damping_.beta) * rows_.values(i)[4 * c];
  }

  /// ½ u · K u of the chosen particles and what the border does to them, at x: 4 × particles().size() [J].
  Scalar energy(Scalar const* x) const noexcept {
    Scalar sum = 0;
    auto const moved = [this, at_x = columns_of(x)](int j) { return Column(at_x(j) - rest_of(j)); };
    for (int i = 0; i < moving(); ++i) {
      Column const u = moved(i), twice = rows_.product(i, any, moved) * Scalar(2) - rows_.product(i, moving(), moved);
      sum += (u[0] * twice[0] + u[1] * twice[1] + u[2] * twice[2]) / 2;
    }
    return sum;
  }
  /// What rounding makes of that: some digits of what it would be if each particle were as far from its place as its edges are long.
  Scalar energy_rounding() const noexcept { return energy_rounding_; }

  /// Gathers the rows of `tissue` of the particles in `chosen`.
  template <class Tissue>
  void build(Tissue const& tissue, std::span<int const> chosen) {
    this->choose(tissue, chosen);
    damping_ = tissue.damping();
    rows_.clear();
    for (int i = 0; i < moving(); ++i) take_row(tissue, i);
    take_rest(tissue, 0);
    round_energy(tissue.edge_length());
    seen_ = tissue.row_edits().end();
  }
  /// The same for tissue that it was built of, or a copy of it, after edits.
  template <class Tissue>
  void follow(Tissue const& tissue, std::span<int const> chosen) {
    bool const has_border = static_cast<int>(particles().size()) > moving();
    if (has_border || !tissue.row_edits().knows(seen_) || !this->can_grow_to(chosen)) return build(tissue, chosen);
    int const before = moving();
    this->grow_to(tissue, chosen);
    damping_ = tissue.damping();
    for (int i = before; i < moving(); ++i) take_row(tissue, i);
    for (int const p : tissue.row_edits().since(seen_))
      if (int const i = this->known(p); i >= 0 && i < before) take_row(tissue, i), this->weigh(tissue, i);
    take_rest(tissue, before);
    round_energy(tissue.edge_length());
    seen_ = tissue.row_edits().end();
  }
  /// Its sums have one order.
  struct Layout {};
  Layout layout() const noexcept { return {}; }
  void take(Layout const&) noexcept { seen_ = std::numeric_limits<std::size_t>::max(); }

  /// Memory for sets of up to so many particles.
  template <class Tissue>
  void reserve(Tissue const& tissue, int count, int /*triangles*/) {
    Base::reserve(count);
    rows_.reserve(at(count), tissue.tensors() + 30 * at(std::max(0, count - tissue.size())));
    rest_.reserve(count), local_columns_.reserve(256);
  }

 private:
  static constexpr int any = std::numeric_limits<int>::max();
  static constexpr int min_share = 256;   // of rows that are walked at once
  template <class Run, class Walk>
  static void each_of(std::span<int const> some, Run const& run, Walk const& walk) {
    int const count = static_cast<int>(some.size()), shares = std::clamp(count / min_share, 1, Base::max_blocks);
    run(shares, [&](int s) {
      for (int k = count * s / shares, end = count * (s + 1) / shares; k < end; ++k) walk(some[at(k)]);
    });
  }
  static auto columns_of(Scalar const* all) noexcept {
    return [all](int j) {
      Column one;
      simd::load(one, all + 4 * static_cast<std::ptrdiff_t>(j));
      return one;
    };
  }
  Column rest_of(int j) const noexcept {
    Column one;
    simd::load(one, rest_.padded_view().data() + 4 * static_cast<std::ptrdiff_t>(j));
    return one;
  }
  /// Three numbers; the fourth stays.
  static void add(Column const& one, Scalar* to) noexcept {
    Column sum;
    simd::load(sum, to);
    Scalar const fourth = to[3];
    simd::store(to, Column(sum + one));
    to[3] = fourth;
  }
  /// −Σ_j K_ij (x_j − X_j + β v_j) − α m v_i.
  template <class X, class V>
  void add_force(int i, X const& x, V const& v, Scalar* to) const noexcept {
    if (damping_.beta != 0)
      add(-rows_.product(i, any, [&](int j) { return Column(x(j) - rest_of(j) + damping_.beta * v(j)); }), to);
    else
      add(-rows_.product(i, any, [&](int j) { return Column(x(j) - rest_of(j)); }), to);
    if (damping_.alpha != 0) add((-damping_.alpha / inverse_mass(i)) * v(i), to);
  }

  template <class Tissue>
  void take_row(Tissue const& tissue, int i) {
    auto const& rows = tissue.rows();
    int const p = particles()[at(i)];
    local_columns_.clear();
    for (int const j : rows.columns(p)) local_columns_.push_back(this->local(j));
    rows_.set(i, local_columns_, rows.values(p));
  }
  void round_energy(Scalar edge) noexcept {
    Scalar size = 0;
    for (int i = 0; i < moving(); ++i)
      for (int c = 0; c < 3; ++c) size += rows_.values(i)[4 * c];
    energy_rounding_ = 4 * std::numeric_limits<Scalar>::epsilon() * size * edge * edge;
  }
  template <class Tissue>
  void take_rest(Tissue const& tissue, int from) {
    rest_.resize(this->force_columns());
    for (int j = from; j < this->force_columns(); ++j) rest_[j] = tissue.unstrained_position(particles()[at(j)]);
  }

  detail::TensorRows<Scalar> rows_;
  PaddedColumns<Scalar> rest_;   // where the tensors pull to
  RayleighDamping<Scalar> damping_;
  Scalar energy_rounding_ = 0;
  std::size_t seen_ = 0;   // of the tissue's rows that were edited
  std::vector<int> local_columns_;   // of a row, while it is taken
};

}  // namespace palpate
