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

/// The moving particles of a body as an integrator sees them (concept `System`): gathered into columns 0 … n−1, with the particles
/// that hold the border of the moving set behind them.
/// Cost       acceleration is O(elements of the moving set); nothing is allocated once the largest set has been seen.
template <TissueModel Tissue>
class BodySystem {
 public:
  using Scalar = typename Tissue::Scalar;
  using Matrix = Matrix3X<Scalar>;

  auto positions() noexcept { return x_.view().leftCols(moving_); }
  auto velocities() noexcept { return v_.view().leftCols(moving_); }
  auto remembered_acceleration() noexcept { return memory_.view(); }
  bool remembers() const noexcept { return remembers_; }

  auto scratch(int k) noexcept { return scratch_[static_cast<std::size_t>(k)].view(); }

  template <class X, class V>
  Matrix acceleration(Eigen::MatrixBase<X> const& x, Eigen::MatrixBase<V> const& v) {
    Matrix out(3, moving_);
    acceleration(x, v, out);
    return out;
  }

  template <class X, class V, class Out>
  void acceleration(Eigen::MatrixBase<X> const& x, Eigen::MatrixBase<V> const& v, Out&& out) {
    auto force_x = force_x_.view();
    auto force_v = force_v_.view();
    auto force = force_.view();
    force_x.leftCols(moving_) = x;
    force_v.leftCols(moving_) = v;
    force.setZero();
    assembly_.add_forces(force_x, force_v, force);
    Eigen::Map<Eigen::Matrix<Scalar, Dynamic, 1> const> const inverse_mass(inverse_mass_.data(), moving_);
    out = force.leftCols(moving_) * inverse_mass.asDiagonal();
    out += applied_.view();
  }

  typename Tissue::Assembly& assembly() noexcept { return assembly_; }
  typename Tissue::Assembly const& assembly() const noexcept { return assembly_; }
  int moving() const noexcept { return moving_; }

  /// Chooses the moving particles and gathers what acts on them.
  void choose(Tissue const& tissue, std::span<int const> moving) {
    tissue.assemble(moving, assembly_);
    moving_ = static_cast<int>(moving.size());
    int const all = static_cast<int>(assembly_.particles().size());
    for (auto* columns : {&x_, &v_, &force_x_, &force_v_, &force_}) columns->resize(all);
    for (auto* columns : {&memory_, &applied_}) columns->resize(moving_);
    for (auto& columns : scratch_) columns.resize(moving_);
    inverse_mass_.clear();
    for (int const p : moving) inverse_mass_.push_back(1 / tissue.mass(p));
  }

  /// Room for sets up to this size, so that choosing them does not allocate.
  void reserve(int particles, int links) {
    for (auto* columns : {&x_, &v_, &force_x_, &force_v_, &force_, &memory_, &applied_}) columns->reserve(particles);
    for (auto& columns : scratch_) columns.reserve(particles);
    inverse_mass_.reserve(static_cast<std::size_t>(particles));
    if constexpr (requires { assembly_.reserve(particles, links); }) assembly_.reserve(particles, links);
  }

  /// Takes the state of the moving set and its border; `applied` is the force on each particle of the body [N].
  template <class State>
  void gather(State const& state, Vector3<Scalar> const& gravity, bool remembers) {
    auto const particles = assembly_.particles();
    for (int k = 0; k < x_.size(); ++k) {
      int const p = particles[static_cast<std::size_t>(k)];
      x_[k] = state.position[p];
      v_[k] = state.velocity[p];
      if (k < moving_) {
        memory_[k] = state.remembered[p];
        applied_[k] = gravity + inverse_mass_[static_cast<std::size_t>(k)] * state.applied[p];
      } else {
        force_x_[k] = x_[k];
        force_v_[k] = v_[k];
      }
    }
    remembers_ = remembers;
  }

  /// Hands the state of the moving set back.
  template <class State>
  void scatter(State& state) const {
    for (int i = 0; i < moving_; ++i) {
      int const p = assembly_.particles()[static_cast<std::size_t>(i)];
      state.position[p] = x_[i];
      state.velocity[p] = v_[i];
      state.remembered[p] = memory_[i];
    }
  }

 private:
  typename Tissue::Assembly assembly_;
  int moving_ = 0;
  bool remembers_ = false;
  Columns<Scalar, 3> x_, v_, force_x_, force_v_, force_;   // moving set, then border
  Columns<Scalar, 3> memory_, applied_;                    // moving set
  std::vector<Scalar> inverse_mass_;
  std::array<Columns<Scalar, 3>, 8> scratch_;
};

}  // namespace palpate
