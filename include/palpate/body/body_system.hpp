// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/padded_columns.hpp>
#include <palpate/integrator/concept.hpp>
#include <palpate/tissue/concept.hpp>

#include <array>
#include <concepts>
#include <cstddef>
#include <limits>
#include <span>
#include <type_traits>
#include <vector>

namespace palpate {

/// The moving particles of a body as an integrator sees them (concept `System`): columns 0 … n−1, with the particles that hold the
/// border of the moving set behind them. The columns stay from step to step; they are gathered again only after a change from outside.
/// Layout     a fourth row of zeros stands under each column, so that it is one or two registers; wide() shows it.
/// Cost       acceleration is O(elements of the moving set); nothing is allocated once the largest set has been seen. What this class
///            handed out is used where it is; another x or v is copied first.
template <TissueModel Tissue>
class BodySystem {
 public:
  using Scalar = typename Tissue::Scalar;
  using Matrix = Matrix3X<Scalar>;

  NarrowView<Scalar> positions() noexcept { return x_.view(moving_); }
  NarrowView<Scalar> velocities() noexcept { return v_.view(moving_); }
  NarrowView<Scalar> remembered_acceleration() noexcept { return memory_.view(); }
  bool remembers() const noexcept { return remembers_; }

  NarrowView<Scalar> scratch(int k) noexcept {   // sized on demand: most integrators use few
    auto& columns = scratch_[static_cast<std::size_t>(k)];
    if (columns.size() != moving_) columns.resize(moving_);
    return columns.view();
  }

  template <class X, class V>
  Matrix acceleration(Eigen::MatrixBase<X> const& x, Eigen::MatrixBase<V> const& v) {
    Matrix out(3, moving_);
    acceleration(x, v, out);
    return out;
  }

  template <class X, class V, class Out>
  void acceleration(Eigen::MatrixBase<X> const& x, Eigen::MatrixBase<V> const& v, Out&& out) {
    auto const at = with_border(x.derived(), x_, border_x_);
    auto const speed = with_border(v.derived(), v_, border_v_);
    auto&& result = wide(out);
    if constexpr (requires { assembly_.accelerate(at, speed, inverse_mass_.data(), applied_.wide(), force_.wide(), result); }) {
      if constexpr (std::same_as<std::remove_cvref_t<decltype(result)>, WideView<Scalar>>)
        if (x_.size() == moving_ && result.data() != at.data() && result.data() != speed.data()) {
          // No border: forces gather where their accelerations go.
          result.setZero();
          assembly_.accelerate(at, speed, inverse_mass_.data(), applied_.wide(), result, result);
          return;
        }
      assembly_.accelerate(at, speed, inverse_mass_.data(), applied_.wide(), force_.wide(), result);
      force_.set_zero();
    } else {
      auto force = force_.view();
      assembly_.add_forces(narrow(at), narrow(speed), force);
      for (int i = 0; i < moving_; ++i)
        result.col(i).template head<3>() = inverse_mass_[static_cast<std::size_t>(i)] * force.col(i) + applied_[i];
      force_.set_zero();
    }
  }

  /// Takes the tangent of what acts on the moving set, at positions(); the two below are of that one.
  void linearise()
    requires Linearises<Tissue>
  {
    assembly_.linearise(x_.wide(), inverse_mass_.data());
    if (x_.size() == moving_) return;
    direction_.resize(x_.size()), product_.resize(x_.size());
    direction_.set_zero();   // the border does not move
  }
  template <class D, class Out>
  void multiply_tangent(Scalar mass, Scalar damping, Scalar stiffness, D const& d, Out&& out)
    requires Linearises<Tissue>
  {
    if constexpr (is_padded<D> && is_padded<Out>)
      if (x_.size() == moving_) return assembly_.multiply_tangent(mass, damping, stiffness, d.data(), out.data());
    if (x_.size() == moving_) direction_.resize(moving_), product_.resize(moving_);
    if constexpr (int{D::RowsAtCompileTime} == 4)
      direction_.wide().leftCols(moving_) = d;
    else
      direction_.view(moving_) = d;
    assembly_.multiply_tangent(mass, damping, stiffness, direction_.wide().data(), product_.wide().data());
    hand_out(out);
  }
  template <class Out>
  void tangent_diagonal(Scalar mass, Scalar damping, Scalar stiffness, Out&& out)
    requires Linearises<Tissue>
  {
    product_.resize(x_.size());
    assembly_.tangent_diagonal(mass, damping, stiffness, product_.wide().data());
    hand_out(out);
  }

  int moving() const noexcept { return moving_; }

  /// Chooses the moving particles and gathers what acts on them.
  void choose(Tissue const& tissue, std::span<int const> moving) {
    for (int const p : assembly_.particles())
      if (static_cast<std::size_t>(p) < place_.size()) place_[static_cast<std::size_t>(p)] = -1;
    place_.resize(static_cast<std::size_t>(tissue.size()), -1);
    tissue.assemble(moving, assembly_);
    moving_ = static_cast<int>(moving.size());
    int const all = static_cast<int>(assembly_.particles().size());
    for (auto* columns : {&x_, &v_, &border_x_, &border_v_, &force_}) columns->resize(all);
    for (auto* columns : {&memory_, &applied_}) columns->resize(moving_);
    inverse_mass_.resize(static_cast<std::size_t>(moving_));
    in_order_ = moving_ == tissue.size();
    for (int k = 0; k < moving_; ++k) {
      int const p = moving[static_cast<std::size_t>(k)];
      in_order_ = in_order_ && p == k;
      place_[static_cast<std::size_t>(p)] = k;
      inverse_mass_[static_cast<std::size_t>(k)] = 1 / tissue.mass(p);
    }
    pushed_.clear();
    is_gathered_ = false;
  }

  /// Room for sets up to this size, so that choosing them does not allocate.
  void reserve(int particles, int links) {
    for (auto* columns : {&x_, &v_, &border_x_, &border_v_, &force_, &memory_, &applied_, &direction_, &product_})
      columns->reserve(particles);
    inverse_mass_.reserve(static_cast<std::size_t>(particles));
    for (auto& columns : scratch_) columns.reserve(particles);
    place_.reserve(static_cast<std::size_t>(particles)), pushed_.reserve(2 * static_cast<std::size_t>(particles));
    if constexpr (requires { assembly_.reserve(particles, links); }) assembly_.reserve(particles, links);
  }

  /// What is gathered is void: the state was changed from outside, or a step is not kept.
  void forget() noexcept { is_gathered_ = false; }

  /// Takes the state of the moving set and its border, where that has changed, and the forces [N] on the particles in `forced`.
  template <class State>
  void gather(State const& state, std::span<int const> forced, Vector3<Scalar> const& gravity, bool remembers) {
    remembers_ = remembers;
    if (!is_gathered_) {
      for (auto* columns : {&x_, &v_, &border_x_, &border_v_, &memory_, &applied_}) columns->set_zero();   // a step that diverged leaves none
      auto const particles = assembly_.particles();
      for (int k = 0; k < x_.size(); ++k) {
        int const p = particles[static_cast<std::size_t>(k)];
        border_x_[k] = x_[k] = state.position[p];
        border_v_[k] = v_[k] = state.velocity[p];
        if (k < moving_) memory_[k] = state.remembered[p];
      }
      applied_.view().colwise() = gravity;
      pushed_.clear();
      is_gathered_ = true;
    }
    for (int const k : pushed_) applied_[k] = gravity;
    pushed_.clear();
    for (int const p : forced) {
      int const k = place_[static_cast<std::size_t>(p)];
      if (k < 0) continue;
      applied_[k] = inverse_mass_[static_cast<std::size_t>(k)] * state.applied[p] + gravity;
      pushed_.push_back(k);
    }
  }

  /// Hands the state of the moving set back.
  template <class State>
  void scatter(State& state) const {
    if (in_order_) {
      state.position.wide() = x_.wide();
      state.velocity.wide() = v_.wide();
      state.remembered.wide() = memory_.wide();
      return;
    }
    for (int i = 0; i < moving_; ++i) {
      int const p = assembly_.particles()[static_cast<std::size_t>(i)];
      state.position[p] = x_[i];
      state.velocity[p] = v_[i];
      state.remembered[p] = memory_[i];
    }
  }

  /// Whether every moving particle is within `bound` [m] of the origin and has a finite velocity; may say no where it is close.
  bool is_within(Scalar bound) const noexcept {
    auto const x = x_.wide().leftCols(moving_);
    auto const v = v_.wide().leftCols(moving_);
    return x.squaredNorm() < bound * bound && v.squaredNorm() <= std::numeric_limits<Scalar>::max();   // no NaN passes either
  }

 private:
  using Narrow = typename PaddedColumns<Scalar>::ConstView;
  static Narrow narrow(WideView<Scalar> const& columns) noexcept { return Narrow(columns.data(), 3, columns.cols()); }

  template <class D>
  static constexpr bool is_padded = std::same_as<std::remove_cvref_t<D>, NarrowView<Scalar>> || std::same_as<std::remove_cvref_t<D>, WideView<Scalar>>;

  template <class Out>
  void hand_out(Out&& out) {
    if constexpr (int{std::remove_cvref_t<Out>::RowsAtCompileTime} == 4)
      out = product_.wide().leftCols(moving_);
    else
      out = product_.view(moving_);
  }

  /// x and behind it the border: where both lie so in memory already, or copied into `buffer`, which holds the border.
  template <class X>
  WideView<Scalar> with_border(X const& x, PaddedColumns<Scalar>& own, PaddedColumns<Scalar>& buffer) const {
    if constexpr (std::same_as<X, NarrowView<Scalar>> || std::same_as<X, WideView<Scalar>>)
      if (own.size() == moving_ || x.data() == own.wide().data()) return WideView<Scalar>(const_cast<Scalar*>(x.data()), 4, own.size());
    if constexpr (int{X::RowsAtCompileTime} == 4)
      buffer.wide().leftCols(moving_) = x;
    else
      buffer.view(moving_) = x;
    return buffer.wide();
  }

  typename Tissue::Assembly assembly_;
  int moving_ = 0;
  bool remembers_ = false;
  bool is_gathered_ = false;
  bool in_order_ = false;                                    // the moving set is all particles in the body's order
  PaddedColumns<Scalar> x_, v_, border_x_, border_v_, force_;   // moving set, then border; force_ is zero between calls
  PaddedColumns<Scalar> memory_, applied_;                      // moving set; applied forces and gravity as accelerations
  PaddedColumns<Scalar> direction_, product_;                   // as x_: of multiply_tangent
  std::array<PaddedColumns<Scalar>, 12> scratch_;
  std::vector<Scalar> inverse_mass_;   // 1/kg, moving set
  std::vector<int> place_;    // particle of the body → column, −1 outside the moving set
  std::vector<int> pushed_;   // columns that a force was applied to in the last step
};

}  // namespace palpate
