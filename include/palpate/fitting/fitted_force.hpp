// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/fitting/contact_models.hpp>
#include <palpate/fitting/fit.hpp>
#include <palpate/fitting/measurements.hpp>
#include <palpate/fitting/needle_model.hpp>
#include <palpate/force/concept.hpp>
#include <palpate/force/curve.hpp>
#include <palpate/force/cutting_force.hpp>
#include <palpate/force/network.hpp>

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace palpate {

/// A fitted force as it is kept: which model, its coefficients, and where it was measured.
struct ForcePreset {
  std::string model;                                          ///< "linear", "polynomial", "exponential", "hunt-crossley" or "needle"
  std::vector<std::pair<std::string, double>> coefficients;   ///< by the names and in the units of the model's parameters()
  MeasuredRange depths, speeds;                               ///< m, m/s
  std::string source;                                         ///< where the measurements are from: tissue, species, tool
};

/// The preset that a fit becomes. Say in `source` what was measured, on what, with what.
template <FittedModel Model>
ForcePreset force_preset(Fit<Model> const& fit, std::string source) {
  ForcePreset preset{std::string(fit.model.name()), {}, fit.depths, fit.speeds, std::move(source)};
  std::string unknown;
  for (FittedCoefficient const& c : fit.coefficients) {
    preset.coefficients.emplace_back(c.name, c.value);
    if (!c.determined) unknown += (unknown.empty() ? "" : ", ") + c.name;
  }
  if constexpr (HasTipDepth<Model>) preset.coefficients.emplace_back("tip_depth", fit.model.tip_depth);
  if (!unknown.empty()) preset.source += " (not determined by the measurements: " + unknown + ")";
  if (!fit.converged) preset.source += " (the fit did not converge)";
  return preset;
}

/// A force model that was fitted, chosen at run time: the whole force of `CuttingForce` around it, so that a `Simulator` takes it as it is.
///   Simulator simulator(device, body, cutter, FittedForce<double>(force_preset(fit(measurements, NeedleModel{}), "phantom, steel needle")));
/// Faster along the normal than was measured, it takes the fastest speed measured and counts the tick; deeper, it takes the deepest place measured, a
/// network its own way on, and counts the tick too: of more it knows nothing.
/// A network is felt before the puncture too: what it was trained on had none. A contact law ends at the puncture.
/// Units      force [N] on the hand, world frame.
/// Errors     InvalidArgument for a model of no known name, coefficients that are not its own, and ranges that are not.
/// Cost       As the model's, in double whatever the scalar; noexcept, no allocation: allowed in the servo tick.
/// Limits     One object serves one tool. To add noise or an organ's drag, give the fit's law to a `CuttingForce` of one's own.
template <RealScalar S>
class FittedForce {
 public:
  using Scalar = S;
  using LoadingCurve = NetworkCurve<Network<double, 1, 5, 1>>;
  using HysteresisNetworkCurve = NetworkCurve<Network<double, 2, 5, 1>>;

  explicit FittedForce(ForcePreset const& preset) : depths_(preset.depths), speeds_(preset.speeds), source_(preset.source), force_(make(preset)) {
    check_ranges();
  }
  FittedForce(LoadingCurve curve, MeasuredRange speeds, std::string source)
      : depths_{curve.range().low, curve.range().high}, speeds_(speeds), source_(std::move(source)), force_(whole(std::move(curve))) {
    check_ranges();
  }
  FittedForce(HysteresisNetworkCurve curve, MeasuredRange speeds, std::string source)
      : depths_{curve.range().low, curve.range().high}, speeds_(speeds), source_(std::move(source)), force_(whole(std::move(curve))) {
    check_ranges();
  }

  Vector3<S> operator()(ToolContact<S> const& contact) noexcept {
    ToolContact<double> wide{.phase = contact.phase,
                             .depth = double(contact.depth),
                             .previous_depth = double(contact.previous_depth),
                             .normal = contact.normal.template cast<double>(),
                             .velocity = contact.velocity.template cast<double>(),
                             .tissue_force = contact.tissue_force.template cast<double>(),
                             .seconds = double(contact.seconds)};
    if (is_curve() && contact.phase == CuttingPhase::indenting) wide.phase = CuttingPhase::moving;
    if (contact.phase != CuttingPhase::no_contact && wide.depth > depths_.high) ++too_deep_;
    if (!is_curve()) {
      wide.depth = std::min(wide.depth, depths_.high);   // false for a NaN, which the force itself refuses
      wide.previous_depth = std::min(wide.previous_depth, depths_.high);
    }
    double const outward = wide.velocity.dot(wide.normal);
    if (contact.phase != CuttingPhase::no_contact && std::abs(outward) > speeds_.high) {
      wide.velocity += (std::copysign(speeds_.high, outward) - outward) * wide.normal;
      ++too_fast_;
    }
    return std::visit([&](auto& force) { return force(wide); }, force_).template cast<S>();
  }

  /// In how many ticks the tool moved along the normal faster than was measured.
  std::uint64_t too_fast() const noexcept { return too_fast_; }
  /// In how many ticks the tool was deeper than was measured.
  std::uint64_t too_deep() const noexcept { return too_deep_; }
  MeasuredRange const& depths() const noexcept { return depths_; }
  MeasuredRange const& speeds() const noexcept { return speeds_; }
  std::string const& source() const noexcept { return source_; }

  void reset() noexcept {
    too_fast_ = too_deep_ = 0;
    std::visit([](auto& force) { force.reset(); }, force_);
  }

 private:
  using Force = std::variant<CuttingForce<IndentationSpring<double>>, CuttingForce<PolynomialContact<double>>, CuttingForce<ExponentialContact<double>>,
                             CuttingForce<HuntCrossleyContact<double>>, CuttingForce<NeedleForce<double>>,
                             CuttingForce<LoadingCurve, IndentationSpring<double>>, CuttingForce<HysteresisNetworkCurve, IndentationSpring<double>>>;

  template <class Curve>
  static auto whole(Curve curve) {
    return CuttingForce(std::move(curve), IndentationSpring<double>{.stiffness = 0.0});
  }
  bool is_curve() const noexcept { return force_.index() >= std::variant_size_v<Force> - 2; }

  void check_ranges() const {
    if (!(speeds_.low >= 0.0 && speeds_.low <= speeds_.high) || !std::isfinite(speeds_.high))
      throw InvalidArgument(detail::message("FittedForce: the measured speeds are ", speeds_.low, " to ", speeds_.high, " m/s; give finite ones, the lower first"));
    if (!(depths_.low <= depths_.high) || !std::isfinite(depths_.high) || !std::isfinite(depths_.low))
      throw InvalidArgument(detail::message("FittedForce: the measured depths are ", depths_.low, " to ", depths_.high, " m; give finite ones, the lower first"));
  }

  /// The coefficients in the model's order, when the preset is of this model.
  template <class Model>
  static std::optional<Force> made_by(Model const& model, ForcePreset const& preset) {
    if (preset.model != model.name()) return std::nullopt;
    auto const parameters = model.parameters();
    auto const refuse = [&](auto const&... what) { throw InvalidArgument(detail::message("FittedForce: the model \"", preset.model, "\" ", what...)); };
    Eigen::VectorXd p(static_cast<Eigen::Index>(parameters.size()));
    for (std::size_t k = 0; k < parameters.size(); ++k) {
      bool found = false;
      for (auto const& [name, value] : preset.coefficients)
        if (name == parameters[k].name) {
          if (!std::isfinite(value) || value < parameters[k].lower)
            refuse("has the coefficient ", name, " = ", value, "; give a finite number, not below ", parameters[k].lower);
          p[static_cast<Eigen::Index>(k)] = value;
          found = true;
        }
      if (!found) refuse("has no coefficient \"", parameters[k].name, "\"; give it in ", parameters[k].unit.empty() ? "a pure number" : parameters[k].unit);
    }
    Model adjusted = model;
    std::size_t known = parameters.size();
    if constexpr (HasTipDepth<Model>)
      for (auto const& [name, value] : preset.coefficients)
        if (name == "tip_depth") adjusted.tip_depth = value, ++known;
    if (preset.coefficients.size() != known) refuse("has ", parameters.size(), " coefficients, given are ", preset.coefficients.size());
    return Force(CuttingForce(adjusted.law(p, preset.depths)));
  }

  static Force make(ForcePreset const& preset) {
    std::optional<Force> force;
    auto const try_model = [&](auto const& model) {
      if (!force) force = made_by(model, preset);
    };
    try_model(LinearModel{}), try_model(PolynomialModel{}), try_model(ExponentialModel{}), try_model(HuntCrossleyModel{}), try_model(NeedleModel{});
    if (!force)
      throw InvalidArgument(detail::message("FittedForce: there is no model \"", preset.model, "\"; it is linear, polynomial, exponential, hunt-crossley or needle"));
    return *std::move(force);
  }

  MeasuredRange depths_, speeds_;
  std::string source_;
  Force force_;
  std::uint64_t too_fast_ = 0, too_deep_ = 0;
};

}  // namespace palpate
