// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/fitting/contact_models.hpp>
#include <palpate/fitting/measurements.hpp>
#include <palpate/force/needle_force.hpp>

#include <Eigen/Core>

#include <span>
#include <string_view>
#include <vector>

namespace palpate {

/// The three parts of a needle's force, after Okamura: becomes a `NeedleForce`.
///   indenting   F = a₁ d + a₂ d²
///   loading     F = f_c + (C + b |ḋ|) d
///   unloading   F = −(C + b |ḋ|) d
/// Limits     A needle that slides says nothing of the friction that holds it at rest: the law takes D = C. Measurements within tip_depth after a
///            reversal belong to neither branch; leave them out of the file.
struct NeedleModel {
  double tip_depth = 0.001;   ///< m, as in `NeedleForceOptions`; not fitted

  std::string_view name() const noexcept { return "needle"; }
  std::vector<ModelParameter> parameters() const { return {{"a1", "N/m"}, {"a2", "N/m^2"}, {"cutting", "N"}, {"dynamic", "N/m"}, {"viscous", "N s/m^2"}}; }
  std::vector<Measurement> takes(std::span<Measurement const> measurements) const { return {measurements.begin(), measurements.end()}; }
  Eigen::VectorXd start(std::span<Measurement const>) const { return Eigen::VectorXd::Zero(5); }
  double force(Eigen::VectorXd const& p, Measurement const& m) const noexcept {
    double const friction = (p[3] + p[4] * m.speed) * m.depth;
    switch (m.phase) {
      case MeasuredPhase::indenting: return (p[0] + p[1] * m.depth) * m.depth;
      case MeasuredPhase::loading: return p[2] + friction;
      case MeasuredPhase::unloading: return -friction;
    }
    return 0.0;
  }
  void gradient(Eigen::VectorXd const&, Measurement const& m, Eigen::Ref<Eigen::RowVectorXd> g) const noexcept {
    g.setZero();
    if (m.phase == MeasuredPhase::indenting) {
      g[0] = m.depth, g[1] = m.depth * m.depth;
      return;
    }
    double const way = m.phase == MeasuredPhase::loading ? 1.0 : -1.0;
    g[2] = m.phase == MeasuredPhase::loading ? 1.0 : 0.0;
    g[3] = way * m.depth;
    g[4] = way * m.depth * m.speed;
  }
  NeedleForceOptions options(Eigen::VectorXd const& p) const noexcept {
    return {.linear = p[0], .quadratic = p[1], .cutting = p[2], .tip_depth = tip_depth, .friction = {.dynamic = p[3], .viscous = p[4], .holding = p[3]}};
  }
  NeedleForce<double> law(Eigen::VectorXd const& p, MeasuredRange const&) const { return NeedleForce<double>(options(p)); }
};

}  // namespace palpate
