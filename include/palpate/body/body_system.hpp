// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/columns.hpp>
#include <palpate/integrator/concept.hpp>
#include <palpate/tissue/concept.hpp>

#include <array>
#include <cstddef>
#include <span>
#include <vector>

namespace palpate {

/// The moving particles of a body as an integrator sees them (concept `System`): columns 0 … n−1, with the particles that hold the
/// border of the moving set behind them. The columns stay from step to step; they are gathered again only after a change from outside.
/// Cost       acceleration is O(elements of the moving set); nothing is allocated once the largest set has been seen. Without a border
///            x and v are used where they are.
template <TissueModel Tissue>
class BodySystem {
 public:
  using Scalar = typename Tissue::Scalar;
  using Matrix = Matrix3X<Scalar>;

  auto positions() noexcept { return x_.view().leftCols(moving_); }
  auto velocities() noexcept { return v_.view().leftCols(moving_); }
  auto remembered_acceleration() noexcept { return memory_.view(); }
  bool remembers() const noexcept { return remembers_; }

  auto scratch(int k) noexcept {   // sized on demand: most integrators use few
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
    auto force = force_.view();
    force.setZero();
    assembly_.add_forces(with_border(x.derived(), x_, border_x_), with_border(v.derived(), v_, border_v_), force);
    out = force.leftCols(moving_).cwiseProduct(inverse_mass_.view()) + applied_.view();
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
    for (auto* columns : {&memory_, &applied_, &inverse_mass_}) columns->resize(moving_);
    in_order_ = moving_ == tissue.size();
    for (int k = 0; k < moving_; ++k) {
      int const p = moving[static_cast<std::size_t>(k)];
      in_order_ = in_order_ && p == k;
      place_[static_cast<std::size_t>(p)] = k;
      inverse_mass_[k].setConstant(1 / tissue.mass(p));
    }
    pushed_.clear();
    is_gathered_ = false;
  }

  /// Room for sets up to this size, so that choosing them does not allocate.
  void reserve(int particles, int links) {
    for (auto* columns : {&x_, &v_, &border_x_, &border_v_, &force_, &memory_, &applied_, &inverse_mass_}) columns->reserve(particles);
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
      applied_[k] = state.applied[p].cwiseProduct(inverse_mass_[k]) + gravity;
      pushed_.push_back(k);
    }
  }

  /// Hands the state of the moving set back.
  template <class State>
  void scatter(State& state) const {
    if (in_order_) {
      state.position.view() = x_.view();
      state.velocity.view() = v_.view();
      state.remembered.view() = memory_.view();
      return;
    }
    for (int i = 0; i < moving_; ++i) {
      int const p = assembly_.particles()[static_cast<std::size_t>(i)];
      state.position[p] = x_[i];
      state.velocity[p] = v_[i];
      state.remembered[p] = memory_[i];
    }
  }

 private:
  using Map = Eigen::Map<Matrix const>;

  /// x and behind it the border: where both lie so in memory already, or copied into `buffer`, which holds the border.
  template <class X>
  Map with_border(X const& x, Columns<Scalar, 3> const& own, Columns<Scalar, 3>& buffer) const {
    if constexpr (requires { x.data(); x.outerStride(); }) {
      bool const is_whole = own.size() == moving_ && x.outerStride() == 3;
      if (is_whole || x.data() == own.view().data()) return Map(x.data(), 3, own.size());
    }
    buffer.view().leftCols(moving_) = x;
    return Map(buffer.view().data(), 3, buffer.size());
  }

  typename Tissue::Assembly assembly_;
  int moving_ = 0;
  bool remembers_ = false;
  bool is_gathered_ = false;
  bool in_order_ = false;                                    // the moving set is all particles in the body's order
  Columns<Scalar, 3> x_, v_, border_x_, border_v_, force_;   // moving set, then border
  Columns<Scalar, 3> memory_, applied_, inverse_mass_;       // moving set; applied and inverse mass as accelerations, three rows
  std::array<Columns<Scalar, 3>, 12> scratch_;
  std::vector<int> place_;    // particle of the body → column, −1 outside the moving set
  std::vector<int> pushed_;   // columns that a force was applied to in the last step
};

}  // namespace palpate
