// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/padded_columns.hpp>

#include <array>
#include <cstddef>
#include <span>
#include <vector>

namespace palpate {

/// What a body keeps per particle besides its tissue, and how it follows a cut.
/// Shapes     3 × n each, one column per particle, in the order of the mesh.
template <RealScalar Scalar>
struct ParticleState {
  PaddedColumns<Scalar> position;     // m
  PaddedColumns<Scalar> velocity;     // m/s
  PaddedColumns<Scalar> remembered;   // m/s², the integrator's memory
  PaddedColumns<Scalar> home;         // m, the undisturbed shape: depth is counted from there
  PaddedColumns<Scalar> normal;       // smooth outward unit normal of the undisturbed shape
  PaddedColumns<Scalar> applied;      // N, for the next step
  PaddedColumns<Scalar> load;         // N, applied during the last step
  std::vector<char> held;          // 1 while something outside decides the position

  int size() const noexcept { return position.size(); }

  void resize(int particles) {
    for (auto* columns : all()) {
      columns->resize(particles);
      columns->set_zero();
    }
    held.assign(static_cast<std::size_t>(particles), 0);
  }

  void reserve(int particles) {
    for (auto* columns : all()) columns->reserve_and_prefault(particles);
    reserve_and_prefault(held, static_cast<std::size_t>(particles));
  }

  /// Adds a particle between its parents: every field is their weighted mean; it carries no force.
  void add_between(std::span<int const> parents, std::span<Scalar const> weights) {
    for (auto* columns : all()) {
      Vector3<Scalar> mean = Vector3<Scalar>::Zero();
      for (std::size_t k = 0; k < parents.size(); ++k) mean += weights[k] * (*columns)[parents[k]];
      columns->push_back(mean);
    }
    int const n = size() - 1;
    Scalar const length = normal[n].norm();
    if (length > 0) normal[n] /= length;
    applied[n].setZero();
    load[n].setZero();
    held.push_back(0);
  }

  /// Adds a copy of particle p. Forces on p, and a hand that holds it, stay with p.
  void add_copy(int p) {
    for (auto* columns : {&position, &velocity, &remembered, &home, &normal}) columns->push_back((*columns)[p]);
    for (auto* columns : {&applied, &load}) columns->push_back(Vector3<Scalar>::Zero());
    held.push_back(0);
  }

  /// Gives p what the last particle is and carries, before that one goes: place and velocity are the mean, in which that one has this share. With its share of the mass
  /// momentum is kept.
  void merge_last(int p, Scalar share) {
    int const last = size() - 1;
    for (auto* columns : {&position, &velocity, &remembered})
      (*columns)[p] = (1 - share) * (*columns)[p] + share * (*columns)[last];
    for (auto* columns : {&applied, &load}) (*columns)[p] += (*columns)[last];
  }

  void pop() noexcept {
    for (auto* columns : all()) columns->pop_back();
    held.pop_back();
  }

  /// Of these particles, in this order.
  ParticleState part(std::span<int const> particles) const {
    ParticleState made;
    made.reserve(static_cast<int>(particles.size()));
    auto const to = made.all();
    auto const from = const_cast<ParticleState*>(this)->all();
    for (int const i : particles) {
      for (std::size_t k = 0; k < to.size(); ++k) to[k]->push_back((*from[k])[i]);
      made.held.push_back(held[static_cast<std::size_t>(i)]);
    }
    return made;
  }

 private:
  std::array<PaddedColumns<Scalar>*, 7> all() noexcept {
    return {&position, &velocity, &remembered, &home, &normal, &applied, &load};
  }
};

}  // namespace palpate
