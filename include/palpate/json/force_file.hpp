// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/detail/whole_file.hpp>
#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/fitting/fit_network.hpp>
#include <palpate/fitting/fitted_force.hpp>
#include <palpate/force/tissue_presets.hpp>
#include <palpate/json/detail/document.hpp>
#include <palpate/json/network_file.hpp>

#include <array>
#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>
#include <type_traits>

namespace palpate {

namespace detail {

constexpr int force_file_version = 1;
constexpr char const* force_file_format = "palpate force";

inline std::string json_text(std::string_view text) { return nlohmann::json(text).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace); }

/// What every force file begins with, up to the model.
inline std::string force_file_head(std::string_view model, std::string_view source, MeasuredRange const& depths, MeasuredRange const& speeds) {
  return message("{\n  \"format\": ", json_text(force_file_format), ",\n  \"version\": ", force_file_version, ",\n  \"note\": ", json_text(force_disclaimer),
                 ",\n  \"source\": ", json_text(source), ",\n  \"depth_range_m\": ", json_list(std::array{depths.low, depths.high}),
                 ",\n  \"speed_range_m_s\": ", json_list(std::array{speeds.low, speeds.high}), ",\n  \"model\": ", json_text(model));
}

/// A document within another, its lines moved to the right.
inline std::string indented(std::string const& text) {
  std::string result;
  for (char const c : text) (result += c) += c == '\n' ? "  " : "";
  while (!result.empty() && (result.back() == ' ' || result.back() == '\n')) result.pop_back();
  return result;
}

inline MeasuredRange read_range(JsonValue const& from) {
  std::array<double, 2> ends{};
  from.read(ends);
  if (!(ends[0] >= 0.0 && ends[0] <= ends[1])) from.fail_as("two numbers, zero or more, the lower one first");
  return {ends[0], ends[1]};
}

template <RealScalar S>
FittedForce<S> read_force(JsonValue const& document) {
  if (auto const format = document.at("format"); !format.is_text(force_file_format)) format.fail_as(message("a file of the format \"", force_file_format, "\""));
  if (auto const version = document.at("version"); !version.is_integer(force_file_version))
    version.fail(message("is ", version.shown(), ", this palpate reads version ", force_file_version, "; write the file again, or read it with the palpate that wrote it"));
  document.require_keys({"format", "version", "note", "source", "depth_range_m", "speed_range_m_s", "model", "coefficients", "network"});
  document.at("note").text();
  std::string const source = document.at("source").text();
  MeasuredRange const depths = read_range(document.at("depth_range_m")), speeds = read_range(document.at("speed_range_m_s"));
  auto const model = document.at("model");
  try {
    if (model.is_text("network")) {
      auto const network = document.at("network");
      if (document.has("coefficients")) document.at("coefficients").fail("belongs to no network; remove it");
      auto const force_of = [&]<class Curve>(std::type_identity<Curve>) {
        using Of = typename Curve::Scalar;
        Curve curve = NetworkReader<Curve>::read(network);
        if (auto const range = curve.range(); range.low != static_cast<Of>(depths.low) || range.high != static_cast<Of>(depths.high))
          document.at("depth_range_m").fail_as(message("that of the network's curve, [", range.low, ", ", range.high, "]"));
        return FittedForce<S>(std::move(curve), speeds, source);
      };
      auto const sizes = network.at("sizes");
      if (sizes.is_list(3) && sizes.at(std::size_t{0}).is_integer(1)) return force_of(std::type_identity<typename FittedForce<S>::LoadingCurve>());
      return force_of(std::type_identity<typename FittedForce<S>::HysteresisNetworkCurve>());
    }
    if (document.has("network")) document.at("network").fail("belongs to the model \"network\"; remove it, or name that model");
    ForcePreset preset{model.text(), {}, depths, speeds, source};
    auto const coefficients = document.at("coefficients");
    for (std::string const& key : coefficients.keys()) {
      auto const coefficient = coefficients.at(key.c_str());
      static_cast<void>(coefficient.template number<S>());   // throws for what the force can not hold
      preset.coefficients.emplace_back(key, coefficient.template number<double>());
    }
    return FittedForce<S>(preset);
  } catch (InvalidArgument const& error) {
    document.fail(message("makes no force: ", error.what()));
  }
}

}  // namespace detail

/// The text that `write_force` puts into the file.
inline std::string force_text(ForcePreset const& preset) {
  std::string text = detail::force_file_head(preset.model, preset.source, preset.depths, preset.speeds) + ",\n  \"coefficients\": {";
  bool first = true;
  for (auto const& [name, value] : preset.coefficients) {
    text += detail::message(first ? "\n" : ",\n", "    ", detail::json_text(name), ": ", detail::json_number(value));
    first = false;
  }
  return text + "\n  }\n}\n";
}
/// The same for a fitted network, 1-5-1 or 2-5-1.
template <class Net>
std::string force_text(NetworkFit<NetworkCurve<Net>> const& fit, std::string_view source) {
  static_assert(std::is_same_v<Net, Network<double, 1, 5, 1>> || std::is_same_v<Net, Network<double, 2, 5, 1>>,
                "palpate::write_force: a force file holds a network 1-5-1 or 2-5-1; write another with write_network and read it into a NetworkCurve of its sizes.");
  return detail::force_file_head("network", source, fit.depths, fit.speeds) + ",\n  \"network\": " + detail::indented(network_text(fit.law)) + "\n}\n";
}

/// Writes a fitted force to a JSON file, the whole file or none of it:
///   format, version, note            "palpate force", 1, that no force here is validated for a patient
///   source                           where the measurements are from
///   depth_range_m, speed_range_m_s   what was measured
///   model                            "linear", "polynomial", "exponential", "hunt-crossley", "needle" or "network"
///   coefficients                     by name, in the units of the model; or `network`, as `write_network` writes a curve
///
///   write_force("needle.json", force_preset(fit(measurements, NeedleModel{}), "phantom, steel needle of 1.3 mm"));
///   auto force = read_force<double>("needle.json");     // a force model for `Simulator`
///
/// Invariant  Numbers read back to the same bits, in any locale.
/// Limits     Throws `FileError` for a folder that is missing or may not be written, or a full disk; an older file then stays as it was.
inline void write_force(std::filesystem::path const& path, ForcePreset const& preset) { detail::write_whole_file(path, force_text(preset)); }
template <class Net>
void write_force(std::filesystem::path const& path, NetworkFit<NetworkCurve<Net>> const& fit, std::string_view source) {
  detail::write_whole_file(path, force_text(fit, source));
}

/// The force in a text; `name` is what messages call it.
template <RealScalar S>
FittedForce<S> parse_force(std::string const& text, std::string const& name = "the text") {
  nlohmann::json const document = detail::parse_json(text, name);
  return detail::read_force<S>(detail::JsonValue(document, name));
}

/// Reads what `write_force` wrote. Throws `FileError` that says where and what for anything else: no JSON, another format or version, a model that
/// is unknown, coefficients that are missing, unknown, there twice or out of their meaning, ranges that are none.
template <RealScalar S>
FittedForce<S> read_force(std::filesystem::path const& path) {
  return parse_force<S>(detail::read_whole_file(path), path.string());
}

}  // namespace palpate
