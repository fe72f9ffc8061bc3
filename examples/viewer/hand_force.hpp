// SPDX-License-Identifier: MIT
#pragma once

#include "setup.hpp"

#include <palpate/force/cutting_force.hpp>
#include <palpate/force/liver.hpp>
#include <palpate/force/organ_force.hpp>
#include <palpate/force/tissue_reaction.hpp>
#include <palpate/haptics/proxy_force.hpp>
#include <palpate/simulator/seqlock.hpp>

#include <array>
#include <memory>
#include <utility>

namespace viewer {

/// From the tip to the proxy [m], for the thread that draws.
using WayOut = palpate::Seqlock<std::array<double, 3>>;

/// What the hand feels: force curves beside the deformation (loose), the tissue's own reaction (tight), or a spring to a proxy on the surface as it
/// is now (proxy), chosen while the program runs: a SurfaceForce of our own.
class HandForce {
 public:
  HandForce(Coupling coupling, TissueValues const& values, std::shared_ptr<WayOut> way_out)
      : measured_(palpate::scaled(palpate::liver_hysteresis<double>(), values.curve_factor),
                  palpate::IndentationSpring<double>{.stiffness = values.resistance},
                  palpate::OrganForce<double>{.coefficient = 500.0, .wall_normal = Vector::UnitX(), .max_damping = 11.0},
                  palpate::CurveJoin<double>{.reversal_depth = 0.001}),
        coupling_(coupling),
        way_out_(std::move(way_out)) {}

  palpate::SurfaceKind surface_kind() const noexcept { return proxy_.surface_kind(); }
  /// The proxy starts anew where the rates are others: slices in lock-step go on as if they were one run.
  void begin_session(double servo_rate, double model_rate) {
    if (servo_rate != servo_rate_ || model_rate != model_rate_) proxy_.begin_session(servo_rate, model_rate);
    servo_rate_ = servo_rate;
    model_rate_ = model_rate;
  }

  Vector on_surface(palpate::LocalModel<double> const& local, palpate::ToolMotion<double> const& motion) noexcept {
    palpate::ToolContact<double> const contact{.phase = local.phase,
                                               .depth = local.depth(motion.tip),
                                               .previous_depth = last_depth_,
                                               .normal = local.normal,
                                               .velocity = motion.velocity,
                                               .tissue_force = local.tissue_force,
                                               .seconds = motion.seconds};
    last_depth_ = contact.depth;
    if (coupling_ == Coupling::proxy) {
      Vector const force = proxy_.on_surface(local, motion);
      show(proxy_.proxy().touches() ? Vector(proxy_.proxy().position() - motion.tip) : Vector(Vector::Zero()));
      return force;
    }
    show(contact.depth * contact.normal);
    return coupling_ == Coupling::loose ? measured_(contact) : reaction_(contact);
  }

  void choose(Coupling coupling) noexcept {
    measured_.reset();
    proxy_.reset();
    coupling_ = coupling;
  }

 private:
  void show(Vector const& way) noexcept { way_out_->write({way.x(), way.y(), way.z()}); }

  using Curve = decltype(palpate::scaled(palpate::liver_hysteresis<double>(), 1.0));
  palpate::CuttingForce<Curve, palpate::IndentationSpring<double>, palpate::OrganForce<double>, palpate::CurveJoin<double>> measured_;
  palpate::TissueReaction reaction_;
  palpate::ProxyForce<double> proxy_{
      {.surface = palpate::SurfaceKind::ball, .max_stiffness = 2000.0, .static_friction = 0.3, .dynamic_friction = 0.2}};
  double servo_rate_ = 0.0, model_rate_ = 0.0;   // Hz
  double last_depth_ = 0.0;                      // m
  Coupling coupling_;
  std::shared_ptr<WayOut> way_out_;
};

static_assert(palpate::SurfaceForce<HandForce, double>);

}  // namespace viewer
