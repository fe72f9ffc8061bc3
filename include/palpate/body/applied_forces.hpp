// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/particle_state.hpp>

#include <cstddef>
#include <span>
#include <utility>
#include <vector>

namespace palpate {

/// Which particles carry a force for the next step and which carried one in the last; the forces themselves are the state's `applied`
/// and `load`. A particle may be listed twice.
/// Cost       O(particles with a force).
class AppliedForces {
 public:
  std::span<int const> forced() const noexcept { return forced_; }

  template <RealScalar Scalar>
  void add(ParticleState<Scalar>& state, int i, Vector3<Scalar> const& force) {
    if (is_zero(force)) return;
    if (is_zero(state.applied[i])) forced_.push_back(i);
    state.applied[i] += force;
  }

  /// The step is done: what was applied is what was carried.
  template <RealScalar Scalar>
  void consume(ParticleState<Scalar>& state) noexcept {
    for (int const i : loaded_)
      if (i < state.size()) state.load[i].setZero();
    loaded_.swap(forced_);
    forced_.clear();
    for (int const i : loaded_) {
      if (i >= state.size()) continue;
      state.load[i] += state.applied[i];   // a particle may be listed twice
      state.applied[i].setZero();
    }
  }

  /// Particles that an edit removed are forgotten; one that was merged has handed its forces over to one in `disturbed`.
  template <RealScalar Scalar>
  void follow_edits(ParticleState<Scalar> const& state, std::span<int const> disturbed) {
    std::erase_if(forced_, [&](int i) { return i >= state.size(); });
    for (int const i : disturbed) {
      if (i >= state.size()) continue;
      if (!is_zero(state.applied[i])) forced_.push_back(i);
      if (!is_zero(state.load[i])) loaded_.push_back(i);
    }
  }

  void clear() noexcept { forced_.clear(); }   // what is in `load` was set to zero, or stays listed

  template <RealScalar Scalar>
  void restore(ParticleState<Scalar> const& state, std::vector<int> const& forced) {
    forced_ = forced;
    loaded_.clear();
    for (int i = 0; i < state.size(); ++i)
      if (!is_zero(state.load[i])) loaded_.push_back(i);
  }

  void reserve(int particle_count) {
    for (auto* list : {&forced_, &loaded_}) list->reserve(2 * static_cast<std::size_t>(particle_count));
  }

 private:
  std::vector<int> forced_, loaded_;
};

}  // namespace palpate
