// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/force/curve.hpp>
#include <palpate/force/indentation_spring.hpp>
#include <palpate/force/network.hpp>
#include <palpate/force/organ_force.hpp>
#include <palpate/force/tissue_presets.hpp>

#include <array>
#include <cstddef>

namespace palpate {

/// The depths the published liver networks stand for. At its end the hysteresis loop closes.
template <RealScalar S>
constexpr DepthRange<S> liver_range() noexcept {
  return {S(0), S(0.02283)};
}

/// Beyond those depths the liver curves go on along their slope, up to 3 N: no larger force is published for liver, see `liver_spring`.
template <RealScalar S>
constexpr CurveGuard<S> liver_guard() noexcept {
  return {.largest_force = S(3)};
}

namespace detail {

/// A network with one hidden layer from rows as they are printed: input weights, output weight, hidden bias.
template <RealScalar S, int In, int Hidden>
Network<S, In, Hidden, 1> network_from_rows(std::array<std::array<double, In + 2>, Hidden> const& rows, double output_bias) {
  typename Network<S, In, Hidden, 1>::Layers layers;
  auto& [hidden, output] = layers;
  for (std::size_t j = 0; j < std::size_t(Hidden); ++j) {
    for (std::size_t i = 0; i < std::size_t(In); ++i) hidden.weights[j][i] = S(rows[j][i]);
    output.weights[0][j] = S(rows[j][In]);
    hidden.bias[j] = S(rows[j][In + 1]);
  }
  output.bias[0] = S(output_bias);
  NetworkScaling<S, In, 1> scaling;
  scaling.input_gain[0] = S(1000);   // the printed weights take millimetres
  return Network<S, In, Hidden, 1>(layers, scaling);
}

}  // namespace detail

/// Indentation force of liver, loading: the thesis's trained 1-5-1 network. `liver_loading<double>()(0.015)`
/// is 0.1830 N.
/// Units      depth [m], force [N].
/// Source     \cite zheng2006 table 6-1; erratum: the weights belong to tanh(x), see `Tanh`. Reported mean
///            squared error 5.018e-5 N².
/// Limits     A 4 mm indentation probe at 0.69 and 6.1 mm/min; the species is not stated. Not a cutting force: at 18
///            mm it gives 0.36 N, where a scalpel in another experiment punctured at 3 N. Mix them only with
///            a stated factor (`scaled`). Unchanged from 0 to 22.83 mm, continued along the tangents outside, never below 0
///            nor above `guard.largest_force`. Not zero at 0: 0.0041 N.
template <RealScalar S>
NetworkCurve<Network<S, 1, 5, 1>> liver_loading(CurveGuard<S> guard = liver_guard<S>()) {
  return {detail::network_from_rows<S, 1, 5>({{{0.1959, 0.0656, -13.8628},
                                               {-0.8624, -0.3429, 18.5440},
                                               {-0.5384, -0.1393, 10.0367},
                                               {-0.2533, -0.1248, 3.7805},
                                               {-0.1185, -0.0331, 1.0538}}},
                                             0.7025),
          liver_range<S>(), guard};
}

/// Indentation force of liver with hysteresis: the thesis's trained 2-5-1 network, depth and phase.
/// `liver_hysteresis<double>()(0.015, Phase::loading)` is 0.1846 N; the two published networks agree within
/// 0.0125 N up to 21 mm.
/// Units      depth [m], force [N].
/// Source     \cite zheng2006 table 6-2, flag 0 = loading, 1 = unloading; erratum as for `liver_loading`.
///            Reported mean squared error 1.232e-4 N².
/// Limits     As for `liver_loading`. The loop closes at 22.83 mm and is widest (0.30 N) near 20.2 mm. Below
///            1.8 mm unloading exceeds loading by up to 2 mN, and beyond 22.83 mm the continued unloading
///            exceeds the continued loading: `CuttingForce` takes the smaller of the two when the tool comes
///            back.
template <RealScalar S>
NetworkCurve<Network<S, 2, 5, 1>> liver_hysteresis(CurveGuard<S> guard = liver_guard<S>()) {
  return {detail::network_from_rows<S, 2, 5>({{{0.1211, -8.8553, 1.4730, -3.3122},
                                               {0.3226, 0.4131, 17.1267, -9.3809},
                                               {-1.2783, -6.0967, -0.0032, 3.7464},
                                               {-0.6281, -0.4962, -0.0200, 8.6331},
                                               {-2.4796, -4.0361, 0.0002, 1.6728}}},
                                             18.6234),
          liver_range<S>(), guard};
}

/// Resistance of liver to a scalpel before the puncture: a line to the one datum of 3 N at 18 mm, `IndentationSpring`'s default.
/// Source     \cite zheng2006 ch. 6.4, after a published cutting test at 1 mm/s; see `tissue_presets`.
template <RealScalar S>
constexpr IndentationSpring<S> liver_spring() noexcept {
  return {.stiffness = S(3.0 / 0.018)};
}

/// Drag of the liver's inner walls on a scalpel, as friction: 180 N/m of depth, across `wall_normal`.
/// Source     \cite zheng2006 ch. 6.5, its coefficient in a rate-independent form; see `OrganFriction` and `tissue_presets`.
template <RealScalar S>
OrganFriction<S> liver_friction(Vector3<S> const& wall_normal = Vector3<S>::UnitX()) noexcept {
  return {.stiffness = S(180), .wall_normal = wall_normal};
}

}  // namespace palpate
