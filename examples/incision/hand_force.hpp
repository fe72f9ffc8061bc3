// SPDX-License-Identifier: MIT
#pragma once

#include "options.hpp"

#include <palpate/force/cutting_force.hpp>
#include <palpate/force/liver.hpp>
#include <palpate/force/noise.hpp>
#include <palpate/force/organ_force.hpp>
#include <palpate/force/tissue_reaction.hpp>

namespace incision {

/// What the hand feels, a force model of our own: the measured curves or the tissue's own reaction, chosen at the start.
class HandForce {
  using Contact = palpate::ToolContact<double>;
  using Vector = palpate::Vector3<double>;

 public:
  HandForce(Options const& options, Vector const& stroke)
      : measured_(palpate::scaled(palpate::liver_hysteresis<double>(), options.curve_factor),
                  palpate::OrganForce<double>{.coefficient = options.organ_coefficient, .wall_normal = stroke, .max_damping = 11.0},
                  palpate::CurveJoin<double>{.reversal_depth = 0.001},   // no click when the depth trembles
                  palpate::WhiteGaussianNoise<double>({.snr_db = options.snr_db, .seed = options.seed})),
        coupling_(options.coupling.value_or(options.tissue == TissueName::solid ? Coupling::tight : Coupling::loose)) {}

  Vector operator()(Contact const& contact) noexcept {
    return coupling_ == Coupling::loose ? measured_(contact) : reaction_(contact);
  }

 private:
  using Curve = decltype(palpate::scaled(palpate::liver_hysteresis<double>(), 1.0));
  palpate::CuttingForce<Curve, palpate::OrganForce<double>, palpate::CurveJoin<double>, palpate::WhiteGaussianNoise<double>> measured_;
  palpate::TissueReaction reaction_;
  Coupling coupling_;
};

}  // namespace incision
