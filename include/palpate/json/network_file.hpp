// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/detail/whole_file.hpp>
#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/force/curve.hpp>
#include <palpate/force/network.hpp>
#include <palpate/json/detail/document.hpp>

#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>

namespace palpate {

/// An activation that files can name, so that weights are never read with another one than they were trained with.
template <class Activation>
concept NamedActivation = requires {
  { Activation::name } -> std::convertible_to<std::string_view>;
};

namespace detail {

constexpr int network_file_version = 1;
constexpr char const* network_file_format = "palpate network";

inline std::string json_number(double number) {
  if (!std::isfinite(number)) throw InvalidArgument(message("a number to be written is ", number, "; JSON has only finite ones"));
  return nlohmann::json(number).dump();
}

template <class Numbers>
std::string json_list(Numbers const& numbers) {
  std::string text;
  for (auto const number : numbers) text += (text.empty() ? "" : ", ") + json_number(double(number));
  return "[" + text + "]";
}

template <class Layer>
std::string json_layer(Layer const& layer) {
  std::string rows;
  for (auto const& row : layer.weights) rows += (rows.empty() ? "        " : ",\n        ") + json_list(row);
  return "    {\n      \"weights\": [\n" + rows + "\n      ],\n      \"bias\": " + json_list(layer.bias) + "\n    }";
}

/// The file's text; `more` is what a curve adds.
template <class Activation, RealScalar S, int... Sizes>
std::string network_text(BasicNetwork<Activation, S, Sizes...> const& network, std::string const& more) {
  static_assert(NamedActivation<Activation>, "palpate::write_network: the activation has no name for files; give it "
                                             "static constexpr char const* name = \"...\".");
  std::string sizes, layers;
  ((sizes += (sizes.empty() ? "" : ", ") + std::to_string(Sizes)), ...);
  std::apply([&](auto const&... layer) { ((layers += (layers.empty() ? "" : ",\n") + json_layer(layer)), ...); }, network.layers());
  auto const& s = network.scaling();
  std::string const scaling =
      !network.has_scaling() ? "null"
                             : message("{\n    \"input_offset\": ", json_list(s.input_offset), ",\n    \"input_gain\": ", json_list(s.input_gain),
                                       ",\n    \"output_offset\": ", json_list(s.output_offset), ",\n    \"output_gain\": ",
                                       json_list(s.output_gain), "\n  }");
  return message("{\n  \"format\": \"", network_file_format, "\",\n  \"version\": ", network_file_version, ",\n  \"activation\": ",
                 nlohmann::json(Activation::name).dump(), ",\n  \"sizes\": [", sizes, "],\n  \"scaling\": ", scaling, ",\n  \"layers\": [\n",
                 layers, "\n  ]", more, "\n}\n");
}

template <RealScalar S>
std::pair<DepthRange<S>, CurveGuard<S>> read_curve(JsonValue const& from) {
  from.require_keys({"depth_range_m", "largest_force_N"});
  std::array<S, 2> depths{};
  from.at("depth_range_m").read(depths);
  CurveGuard<S> guard;
  if (auto const cap = from.at("largest_force_N"); !cap.is_null()) guard.largest_force = cap.number<S>();
  return {{depths[0], depths[1]}, guard};
}

template <class T>
struct NetworkReader;

template <class Activation, RealScalar S, int... Sizes>
struct NetworkReader<BasicNetwork<Activation, S, Sizes...>> {
  using Net = BasicNetwork<Activation, S, Sizes...>;
  static_assert(NamedActivation<Activation>, "palpate::read_network: the activation has no name for files; give it "
                                             "static constexpr char const* name = \"...\".");

  static Net read(JsonValue const& document) {
    if (auto const format = document.at("format"); !format.is_text(network_file_format))
      format.fail_as(message("a file of the format \"", network_file_format, "\""));
    if (auto const version = document.at("version"); !version.is_integer(network_file_version))
      version.fail(message("is ", version.shown(), ", this palpate reads version ", network_file_version,
                           "; write the file again, or read it with the palpate that wrote it"));
    document.require_keys({"format", "version", "activation", "sizes", "scaling", "layers", "curve"});
    if (auto const activation = document.at("activation"); !activation.is_text(Activation::name))
      activation.fail(message("is ", activation.shown(), ", that of the network asked for is \"", Activation::name,
                              "\"; ask for a BasicNetwork with the file's activation"));
    if (auto const sizes = document.at("sizes"); !are(sizes))
      sizes.fail(message("is ", sizes.shown(), ", the network asked for is ", wanted_sizes(), "; ask for a network of the file's sizes"));

    auto const layers = document.at("layers");
    layers.require_list(sizeof...(Sizes) - 1);
    typename Net::Layers values;
    std::size_t l = 0;
    std::apply([&](auto&... layer) { (read_layer(layers.at(l++), layer), ...); }, values);
    if (document.has("curve")) read_curve<S>(document.at("curve"));   // so that nothing in the file goes unlooked at
    auto const scaling = document.at("scaling");
    if (!scaling.is_null()) return Net(values, read_scaling(scaling));
    Net network;
    network.set_parameters(Net(values).parameters());
    return network;
  }

 private:
  static std::string wanted_sizes() {
    std::string text;
    ((text += text.empty() ? "" : "-", text += std::to_string(Sizes)), ...);
    return text;
  }
  static bool are(JsonValue const& sizes) {
    if (!sizes.is_list(sizeof...(Sizes))) return false;
    std::size_t k = 0;
    return (sizes.at(k++).is_integer(Sizes) && ...);
  }

  template <class Layer>
  static void read_layer(JsonValue const& from, Layer& layer) {
    from.require_keys({"weights", "bias"});
    auto const weights = from.at("weights");
    weights.require_list(layer.weights.size());
    for (std::size_t j = 0; j < layer.weights.size(); ++j) weights.at(j).read(layer.weights[j]);
    from.at("bias").read(layer.bias);
  }

  static typename Net::Scaling read_scaling(JsonValue const& from) {
    from.require_keys({"input_offset", "input_gain", "output_offset", "output_gain"});
    typename Net::Scaling scaling;
    from.at("input_offset").read(scaling.input_offset);
    from.at("output_offset").read(scaling.output_offset);
    read_gain(from.at("input_gain"), scaling.input_gain);
    read_gain(from.at("output_gain"), scaling.output_gain);
    return scaling;
  }
  template <class Numbers>
  static void read_gain(JsonValue const& from, Numbers& gain) {
    from.read(gain);
    for (std::size_t i = 0; i < gain.size(); ++i)
      if (gain[i] == 0) from.at(i).fail_as("a gain other than zero");
  }
};

template <class Net>
struct NetworkReader<NetworkCurve<Net>> {
  static NetworkCurve<Net> read(JsonValue const& document) {
    Net const network = NetworkReader<Net>::read(document);
    auto const curve = document.at("curve");
    auto const [range, guard] = read_curve<typename Net::Scalar>(curve);
    try {
      return {network, range, guard};
    } catch (InvalidArgument const& error) {
      curve.fail(message("makes no curve: ", error.what()));
    }
  }
};

}  // namespace detail

/// The text that `write_network` puts into the file.
template <class Activation, RealScalar S, int... Sizes>
std::string network_text(BasicNetwork<Activation, S, Sizes...> const& network) {
  return detail::network_text(network, "");
}

/// The same for a curve: its network, the depths it stands for and its cap.
template <class Net>
std::string network_text(NetworkCurve<Net> const& curve) {
  auto const range = curve.range();
  double const cap = double(curve.guard().largest_force);
  return detail::network_text(
      curve.network(), detail::message(",\n  \"curve\": {\n    \"depth_range_m\": ", detail::json_list(std::array{range.low, range.high}),
                                       ",\n    \"largest_force_N\": ", std::isfinite(cap) ? detail::json_number(cap) : "null", "\n  }"));
}

/// What `write_network` takes: a network, or a curve of one.
template <class Network>
concept HasNetworkText = requires(Network const& network) { network_text(network); };

/// Writes a trained network, or a `NetworkCurve`, to a JSON file, the whole file or none of it:
///   format, version    "palpate network", 1
///   activation, sizes  "tanh", [2, 5, 1]
///   scaling            input_offset, input_gain, output_offset, output_gain; null for a network that has none yet
///   layers             from the inputs on; `weights` row by row, a row a neuron, then `bias`
///   curve              of a `NetworkCurve` alone: depth_range_m, largest_force_N (null: no cap)
///
///   write_network("liver.json", curve);
///   auto const again = read_network<NetworkCurve<Network<double, 2, 5, 1>>>("liver.json");
///
/// Units      as the network's caller has them: the scaling is in the file. The curve's keys name theirs.
/// Invariant  Numbers read back to the same bits, in any locale; what is read and written again gives the same bytes.
/// Limits     Throws `FileError` for a folder that is missing or may not be written, or a full disk; an older file then stays as it was.
template <HasNetworkText Network>
void write_network(std::filesystem::path const& path, Network const& network) {
  detail::write_whole_file(path, network_text(network));
}

/// The network in a text; `name` is what messages call it.
template <class T>
T parse_network(std::string const& text, std::string const& name = "the text") {
  nlohmann::json const document = detail::parse_json(text, name);
  return detail::NetworkReader<T>::read(detail::JsonValue(document, name));
}

/// Reads what `write_network` wrote: `read_network<Network<double, 1, 5, 1>>(path)`. A network may be read out of a curve's file, and in
/// another scalar, to which its numbers are rounded.
/// Limits     Throws `FileError` that says where and what for anything else: no JSON (line and column), another format, version,
///            activation or size than asked for, a key that is missing, unknown or there twice, a number that is none or that the
///            scalar can not hold.
template <class T>
T read_network(std::filesystem::path const& path) {
  return parse_network<T>(detail::read_whole_file(path), path.string());
}

}  // namespace palpate
