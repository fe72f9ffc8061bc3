// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/core/random.hpp>

#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <span>
#include <tuple>
#include <type_traits>
#include <utility>

namespace palpate {

/// One measured pair, in the caller's units.
template <RealScalar S, int In, int Out>
struct Sample {
  std::array<S, In> input{};
  std::array<S, Out> output{};
};

/// Tan-sigmoid tanh(x), the activation that the published liver weights belong to.
/// Source     \cite zheng2006 eq. 6-1; erratum: the thesis prints (1 − e^−x)/(1 + e^−x) = tanh(x/2). With that
///            form its two liver networks contradict each other, with tanh(x) they agree within 0.0125 N. The
///            printed form is `HalfSigmoid`.
struct Tanh {
  static constexpr char const* name = "tanh";   ///< in files

  template <RealScalar Scalar>
  static Scalar value(Scalar x) noexcept {
    return std::tanh(x);
  }
  /// The slope at the place where the activation has the value y.
  template <RealScalar Scalar>
  static constexpr Scalar slope(Scalar y) noexcept {
    return Scalar(1) - y * y;
  }
};

/// Half-argument sigmoid (1 − e^−x)/(1 + e^−x) = tanh(x/2), as the thesis prints it; see `Tanh`.
struct HalfSigmoid {
  static constexpr char const* name = "half_sigmoid";

  template <RealScalar Scalar>
  static Scalar value(Scalar x) noexcept {
    return std::tanh(x / Scalar(2));
  }
  template <RealScalar Scalar>
  static constexpr Scalar slope(Scalar y) noexcept {
    return (Scalar(1) - y * y) / Scalar(2);
  }
};

/// The weights of one layer of neurons: row j holds the input weights of neuron j.
template <RealScalar Scalar, int In, int Out>
struct NetworkLayer {
  std::array<std::array<Scalar, In>, Out> weights{};
  std::array<Scalar, Out> bias{};
};

/// How a network's inputs and outputs relate to the units of its caller:
///   inside = (x − input_offset) · input_gain,   y = output_offset + output_gain · inside
template <RealScalar Scalar, int In, int Out>
struct NetworkScaling {
  std::array<Scalar, In> input_offset{};
  std::array<Scalar, In> input_gain = ones<In>();
  std::array<Scalar, Out> output_offset{};
  std::array<Scalar, Out> output_gain = ones<Out>();

  template <int N>
  static constexpr std::array<Scalar, N> ones() noexcept {
    std::array<Scalar, N> result{};
    for (auto& value : result) value = Scalar(1);
    return result;
  }
};

namespace detail {

/// Place of a layer's first parameter in the list of all parameters.
template <std::size_t N>
constexpr int first_parameter(std::array<int, N> const& sizes, std::size_t layer) noexcept {
  int sum = 0;
  for (std::size_t l = 0; l < layer; ++l) sum += (sizes[l] + 1) * sizes[l + 1];
  return sum;
}

}  // namespace detail

/// Feed-forward network with compile-time sizes: every hidden layer is y = f(W x + b), the last layer is
/// linear.
///   `Network<double, 2, 5, 1>`                      two inputs, one hidden layer of five tanh neurons, one output
///   `BasicNetwork<HalfSigmoid, double, 2, 5, 1>`    the same with another activation
/// An activation is a type with two static functions: `value(x)`, and `slope(y)`, its derivative where it has
/// the value y; and for files a static `name`. The scaling of inputs and outputs is kept with the weights, so a network is evaluated in its
/// caller's units.
/// Shapes     `parameters()` are layer by layer; in a layer the weights row by row, then the biases.
/// Source     \cite zheng2006 ch. 6
/// Invariant  All weights and scalings are finite; checked at set-up.
/// Cost       One tanh a hidden neuron, one multiplication a weight; no allocation, noexcept: allowed in the
///            servo tick.
template <class Activation, RealScalar S, int... Sizes>
class BasicNetwork {
  static_assert(sizeof...(Sizes) >= 2, "palpate::Network: give the sizes of at least two layers, inputs and outputs: "
                                       "Network<double, 1, 5, 1>.");
  static_assert(((Sizes > 0) && ...), "palpate::Network: every layer needs at least one neuron; the sizes after the scalar "
                                      "are positive: Network<double, 1, 5, 1>.");

  static constexpr std::array<int, sizeof...(Sizes)> sizes_{Sizes...};
  static constexpr std::size_t layer_count_ = sizeof...(Sizes) - 1;

  template <std::size_t... L>
  static auto layers_of(std::index_sequence<L...>) -> std::tuple<NetworkLayer<S, sizes_[L], sizes_[L + 1]>...>;

 public:
  using Scalar = S;
  static constexpr int inputs = sizes_.front();
  static constexpr int outputs = sizes_.back();
  static constexpr int parameter_count = detail::first_parameter(sizes_, layer_count_);

  using Input = std::array<S, inputs>;
  using Output = std::array<S, outputs>;
  using Layers = decltype(layers_of(std::make_index_sequence<layer_count_>{}));
  using Scaling = NetworkScaling<S, inputs, outputs>;
  using Parameters = std::array<S, parameter_count>;

  /// Random weights, ready for `train`, which also chooses the scaling from its samples. The same seed gives
  /// the same weights. The bends of a hidden layer's neurons are spread over the inputs' range −1 … 1 (\cite
  /// nguyen1990).
  explicit BasicNetwork(Seed seed = {}) noexcept {
    Random random(seed);
    for_each_layer([&](auto& layer) { spread(layer, random); });
  }

  /// Given weights in the given scaling; `train` then keeps the scaling.
  explicit BasicNetwork(Layers const& layers, Scaling const& scaling = {}) : layers_(layers) {
    for (S const parameter : parameters()) require_finite("weight or bias", parameter);
    set_scaling(scaling);
  }

  /// Output at an input, both in the caller's units.
  Output operator()(Input const& input) const noexcept { return unscale(forward<0>(scale(input))); }

  /// The same for a network with one output, the inputs listed: `network(0.01)`, `network(0.01, 1.0)`.
  template <class... X>
    requires(sizeof...(X) == inputs && outputs == 1 && (std::convertible_to<X, S> && ...))
  S operator()(X... input) const noexcept {
    return (*this)(Input{static_cast<S>(input)...})[0];
  }

  /// Derivative of the weighted sum of outputs Σ_o weight_o y_o with respect to each input.
  Input input_gradient(Input const& input, Output const& weight) const noexcept {
    return backward(input, weight, nullptr);
  }

  /// Adds the derivative of Σ_o weight_o y_o with respect to every parameter to `gradient` (analytic
  /// back-propagation).
  void add_parameter_gradient(Input const& input, Output const& weight,
                              std::span<S, parameter_count> gradient) const noexcept {
    backward(input, weight, gradient.data());
  }

  Layers const& layers() const noexcept { return layers_; }
  Scaling const& scaling() const noexcept { return scaling_; }

  /// False until a scaling was given or training has chosen one.
  bool has_scaling() const noexcept { return has_scaling_; }

  void set_scaling(Scaling const& scaling) {
    for (S const value : scaling.input_offset) require_finite("input offset", value);
    for (S const value : scaling.output_offset) require_finite("output offset", value);
    for (S const value : scaling.input_gain) require_gain("input gain", value);
    for (S const value : scaling.output_gain) require_gain("output gain", value);
    scaling_ = scaling;
    has_scaling_ = true;
  }

  Parameters parameters() const noexcept {
    Parameters result{};
    std::size_t k = 0;
    for_each_layer([&](auto const& layer) {
      for (auto const& row : layer.weights)
        for (S const weight : row) result[k++] = weight;
      for (S const bias : layer.bias) result[k++] = bias;
    });
    return result;
  }

  void set_parameters(std::span<S const, parameter_count> values) {
    for (S const value : values) require_finite("weight or bias", value);
    assign(values.data());
  }

  /// The same network in another scalar.
  template <RealScalar T>
  BasicNetwork<Activation, T, Sizes...> cast() const {
    BasicNetwork<Activation, T, Sizes...> result;
    std::array<T, parameter_count> values{};
    copy(parameters(), values);
    result.set_parameters(values);
    if (has_scaling_) {
      NetworkScaling<T, inputs, outputs> scaling;
      copy(scaling_.input_offset, scaling.input_offset);
      copy(scaling_.input_gain, scaling.input_gain);
      copy(scaling_.output_offset, scaling.output_offset);
      copy(scaling_.output_gain, scaling.output_gain);
      result.set_scaling(scaling);
    }
    return result;
  }

 private:
  template <class From, class To>
  static constexpr void copy(From const& from, To& to) noexcept {
    for (std::size_t i = 0; i < from.size(); ++i) to[i] = static_cast<typename To::value_type>(from[i]);
  }

  static void require_finite(char const* what, S value) {
    if (!std::isfinite(value))
      throw InvalidArgument(detail::message("Network: a ", what, " is ", value, "; give finite numbers"));
  }
  static void require_gain(char const* what, S value) {
    require_finite(what, value);
    if (value == S(0))
      throw InvalidArgument(detail::message("Network: an ", what, " is 0; give a scale other than zero"));
  }

  template <class Function>
  void for_each_layer(Function function) noexcept {
    std::apply([&](auto&... layer) { (function(layer), ...); }, layers_);
  }
  template <class Function>
  void for_each_layer(Function function) const noexcept {
    std::apply([&](auto const&... layer) { (function(layer), ...); }, layers_);
  }

  /// Weight vectors of length 0.7 · neurons^(1/inputs) in random directions, biases spread over plus and
  /// minus that length.
  template <int In, int Out>
  static void spread(NetworkLayer<S, In, Out>& layer, Random& random) noexcept {
    S const length = S(0.7) * std::pow(S(Out), S(1) / S(In));
    for (std::size_t j = 0; j < std::size_t(Out); ++j) {
      S square = 0;
      for (S& weight : layer.weights[j]) {
        weight = random.uniform(S(-1), S(1));
        square += weight * weight;
      }
      S const norm = std::sqrt(square);
      for (S& weight : layer.weights[j]) weight = norm > S(0) ? weight * length / norm : length / std::sqrt(S(In));
      S const place = Out == 1 ? S(0) : S(2) * S(j) / S(Out > 1 ? Out - 1 : 1) - S(1);
      layer.bias[j] = length * (place + random.uniform(S(-1), S(1)) / S(Out));
    }
  }

  void assign(S const* value) noexcept {
    for_each_layer([&](auto& layer) {
      for (auto& row : layer.weights)
        for (S& weight : row) weight = *value++;
      for (S& bias : layer.bias) bias = *value++;
    });
  }

  Input scale(Input const& input) const noexcept {
    Input result{};
    for (std::size_t i = 0; i < std::size_t(inputs); ++i)
      result[i] = (input[i] - scaling_.input_offset[i]) * scaling_.input_gain[i];
    return result;
  }
  Output unscale(Output const& inside) const noexcept {
    Output result{};
    for (std::size_t o = 0; o < std::size_t(outputs); ++o)
      result[o] = scaling_.output_offset[o] + scaling_.output_gain[o] * inside[o];
    return result;
  }

  template <int In, int Out>
  static std::array<S, Out> neurons(NetworkLayer<S, In, Out> const& layer,
                                    std::type_identity_t<std::array<S, In>> const& input, bool hidden) noexcept {
    std::array<S, Out> result{};
    for (std::size_t j = 0; j < std::size_t(Out); ++j) {
      S sum = layer.bias[j];
      for (std::size_t i = 0; i < std::size_t(In); ++i) sum += layer.weights[j][i] * input[i];
      result[j] = hidden ? Activation::value(sum) : sum;
    }
    return result;
  }

  template <std::size_t L, class Values>
  Output forward(Values const& input) const noexcept {
    auto const& layer = std::get<L>(layers_);
    if constexpr (L + 1 == layer_count_)
      return neurons(layer, input, false);
    else
      return forward<L + 1>(neurons(layer, input, true));
  }

  Input backward(Input const& input, Output weight, S* gradient) const noexcept {
    for (std::size_t o = 0; o < std::size_t(outputs); ++o) weight[o] *= scaling_.output_gain[o];
    Input result = backward_layer<0>(scale(input), weight, gradient);
    for (std::size_t i = 0; i < std::size_t(inputs); ++i) result[i] *= scaling_.input_gain[i];
    return result;
  }

  /// From layer L on: adds to the parameters' gradient (unless null) and returns the derivative with respect
  /// to the layer's input.
  template <std::size_t L>
  auto backward_layer(std::array<S, sizes_[L]> const& input, Output const& weight, S* gradient) const noexcept
      -> std::array<S, sizes_[L]> {
    constexpr std::size_t In = std::size_t(sizes_[L]);
    constexpr std::size_t Out = std::size_t(sizes_[L + 1]);
    auto const& layer = std::get<L>(layers_);
    std::array<S, Out> delta{};
    if constexpr (L + 1 == layer_count_) {
      delta = weight;
    } else {
      auto const value = neurons(layer, input, true);
      delta = backward_layer<L + 1>(value, weight, gradient);
      for (std::size_t j = 0; j < Out; ++j) delta[j] *= Activation::slope(value[j]);
    }
    std::array<S, In> result{};
    for (std::size_t j = 0; j < Out; ++j)
      for (std::size_t i = 0; i < In; ++i) result[i] += layer.weights[j][i] * delta[j];
    if (gradient != nullptr) {
      S* place = gradient + detail::first_parameter(sizes_, L);
      for (std::size_t j = 0; j < Out; ++j)
        for (std::size_t i = 0; i < In; ++i) *place++ += delta[j] * input[i];
      for (std::size_t j = 0; j < Out; ++j) *place++ += delta[j];
    }
    return result;
  }

  Layers layers_{};
  Scaling scaling_{};
  bool has_scaling_ = false;
};

/// The usual network: tanh neurons, linear outputs.
template <RealScalar Scalar, int... Sizes>
using Network = BasicNetwork<Tanh, Scalar, Sizes...>;

}  // namespace palpate
