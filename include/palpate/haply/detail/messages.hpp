// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/detail/text.hpp>
#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/device/concept.hpp>
#include <palpate/haply/frame.hpp>
#include <palpate/haply/options.hpp>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace palpate {

/// What the service said when the device was opened.
struct Inverse3Report {
  std::string service_version{};     ///< "3.5.0"; empty: it did not say
  HaplyDialect dialect = HaplyDialect::vector;   ///< that forces are written in
  std::string device_id{}, type{}, handedness{}, preset{};   ///< empty: not said
  std::string basis{};               ///< permutation of the axes that the service applies; empty: not said, taken as XYZ
  HaplyTransform mount{}, workspace{};   ///< that the service applies
  HaplyFrame frame{};                ///< from what it says to the frame here
  std::string grip_id{};             ///< empty: no verse grip
  bool wireless_grip = false;
  std::optional<bool> calibrated{}, power_supply{}, ready{};   ///< of the device's status; nothing: not said
};

}  // namespace palpate

namespace palpate::detail::haply {

using Json = nlohmann::json;

/// The document of a message. Throws `HaplyError` for what is none.
inline Json parsed(std::string_view text) {
  try {
    return Json::parse(text.begin(), text.end());
  } catch (Json::out_of_range const&) {
    throw HaplyError(HaplyProblem::protocol, message("the service sent a number that is too large: ", legible(text)));
  } catch (Json::exception const&) {
    throw HaplyError(HaplyProblem::protocol, message("the service sent what is no JSON: ", legible(text),
                                                     "; is the address that of Haply's Inverse Service, and the port that of format 3.x (10001)?"));
  }
}

/// A value of a message with the way to it. What is not as it must be throws `HaplyError` that says where and what is there.
class Field {
 public:
  Field(Json const& value, std::string path) : value_(&value), path_(std::move(path)) {}

  [[noreturn]] void refuse(std::string_view wanted) const {
    bool const nested = std::any_of(value_->begin(), value_->end(), [](Json const& entry) { return entry.is_structured(); });
    std::string const there = nested ? message("a nested ", value_->type_name())   // writing it needs stack for each level, as many as the service likes
                                     : legible(value_->dump(-1, ' ', true, Json::error_handler_t::replace));
    throw HaplyError(HaplyProblem::protocol,
                     message("the service sent ", path_, " as ", there,
                             ", which is not ", wanted, "; a service of another format needs an update of it or of palpate"));
  }
  std::optional<Field> find(char const* key) const {
    if (!value_->is_object()) refuse("an object");
    auto const found = value_->find(key);
    if (found == value_->end()) return std::nullopt;
    return Field(*found, path_ + "." + key);
  }
  Field at(char const* key) const {
    if (auto field = find(key)) return *field;
    throw HaplyError(HaplyProblem::protocol, message("the service sent ", path_, " without ", key,
                                                     "; a service of another format needs an update of it or of palpate"));
  }
  /// The entries of a list.
  std::vector<Field> entries() const {
    if (!value_->is_array()) refuse("a list");
    std::vector<Field> result;
    for (Json const& entry : *value_) result.emplace_back(entry, message(path_, "[", result.size(), "]"));
    return result;
  }
  double number() const {
    if (!value_->is_number()) refuse("a number");
    double const number = value_->get<double>();
    if (!std::isfinite(number)) refuse("a finite number");
    return number;
  }
  bool flag() const {
    if (!value_->is_boolean()) refuse("true or false");
    return value_->get<bool>();
  }
  std::string text() const {
    if (!value_->is_string()) refuse("a text");
    return value_->get<std::string>();
  }
  Vector3<double> vector() const { return {at("x").number(), at("y").number(), at("z").number()}; }
  Eigen::Quaternion<double> quaternion() const { return {at("w").number(), at("x").number(), at("y").number(), at("z").number()}; }

 private:
  Json const* value_;
  std::string path_;
};

inline std::string text_or_empty(Field const& owner, char const* key) {
  auto const field = owner.find(key);
  return field ? field->text() : std::string();
}

/// Parts that are not sent are as in the identity.
inline HaplyTransform transform_of(Field const& owner, char const* key) {
  HaplyTransform result;
  auto const field = owner.find(key);
  if (!field) return result;
  if (auto const position = field->find("position")) result.position = position->vector();
  if (auto const rotation = field->find("rotation")) result.rotation = rotation->quaternion();
  if (auto const scale = field->find("scale")) result.scale = scale->vector();
  return result;
}

/// The one of a list that has this id.
inline std::optional<Field> find_device(Field const& document, char const* list, std::string const& id) {
  auto const devices = document.find(list);
  if (!devices) return std::nullopt;
  for (Field const& one : devices->entries())
    if (one.at("device_id").text() == id) return one;
  return std::nullopt;
}

inline void add_ids(std::vector<std::string>& ids, Field const& document, char const* list) {
  if (auto const devices = document.find(list))
    for (Field const& one : devices->entries()) ids.push_back(one.at("device_id").text());
}

/// The id that was asked for or the only one. Empty only for an optional kind that is not there.
inline std::string chosen(std::vector<std::string> const& ids, std::string const& wanted, char const* kind, char const* option, bool optional) {
  std::string all;
  for (std::string const& id : ids) {
    bool const is_wanted = wanted.empty() || id == wanted;
    if (is_wanted && std::count(ids.begin(), ids.end(), id) > 1)
      throw HaplyError(HaplyProblem::no_device, message("the service has several ", kind, "s with the id ", legible(id), ", which nothing tells apart; unplug all but one"));
    if (!wanted.empty() && is_wanted) return id;
    (all += all.empty() ? "" : ", ") += legible(id);
  }
  if (!wanted.empty())
    throw HaplyError(HaplyProblem::no_device,
                     message("the service knows no ", kind, " \"", legible(wanted), "\"; it has ", all.empty() ? "none" : all));
  if (ids.size() > 1)
    throw HaplyError(HaplyProblem::no_device, message("the service has several ", kind, "s: ", all, "; say which, as ", option, "=", legible(ids[0])));
  if (ids.empty() && !optional)
    throw HaplyError(HaplyProblem::no_device,
                     message("the service has no ", kind, "; check its cable and power, and that the vendor's own program shows it"));
  return ids.empty() ? std::string() : ids[0];
}

/// The major and minor number at the begin of "3.5.0-2-gce34c39e".
inline std::optional<std::pair<int, int>> version_of(std::string_view text) noexcept {
  std::pair<int, int> version{};
  char const* const end = text.data() + text.size();
  auto const [dot, bad] = std::from_chars(text.data(), end, version.first);
  if (bad != std::errc{} || dot == end || *dot != '.') return std::nullopt;
  if (std::from_chars(dot + 1, end, version.second).ec != std::errc{}) return std::nullopt;
  return version;
}

/// What GET /version says; empty for any other text.
inline std::string service_version(std::string_view text) {
  Json const document = Json::parse(text.begin(), text.end(), nullptr, false);
  if (!document.is_object()) return {};
  for (char const* key : {"git_tag", "project_version"}) {
    auto const found = document.find(key);
    if (found == document.end() || !found->is_string()) continue;
    std::string version = found->get<std::string>();
    if (version.starts_with('v')) version.erase(0, 1);
    if (version_of(version)) return legible(version);
  }
  return {};
}

inline HaplyDialect dialect_of(HaplyDialect wanted, std::string_view version) noexcept {
  if (wanted != HaplyDialect::by_version) return wanted;
  auto const told = version_of(version);
  return told && *told < std::pair(3, 5) ? HaplyDialect::values : HaplyDialect::vector;
}

/// Chooses device and grip, and reads how the service turns and scales.
inline Inverse3Report read_inventory(std::string_view text, Inverse3Options const& options, std::string const& version) {
  Json const document = parsed(text);
  Field const all(document, "the inventory");
  Inverse3Report report{.service_version = version, .dialect = dialect_of(options.dialect, version)};

  std::vector<std::string> ids, wireless, wired;
  add_ids(ids, all, "inverse3");
  report.device_id = chosen(ids, options.device, "Inverse3", "device", false);
  if (options.grip != "none") {
    add_ids(wireless, all, "wireless_verse_grip");
    add_ids(wired, all, "verse_grip");
    std::vector<std::string> grips = wireless;
    grips.insert(grips.end(), wired.begin(), wired.end());
    report.grip_id = chosen(grips, options.grip, "verse grip", "grip", true);
    for (std::string const& id : wireless) report.wireless_grip = report.wireless_grip || (!report.grip_id.empty() && id == report.grip_id);
  }

  Field const device = *find_device(all, "inverse3", report.device_id);
  if (auto const config = device.find("config")) {
    report.type = text_or_empty(*config, "type");
    report.handedness = text_or_empty(*config, "handedness");
    report.preset = text_or_empty(*config, "preset");
    if (auto const basis = config->find("basis")) report.basis = text_or_empty(*basis, "permutation");
    report.mount = transform_of(*config, "mount");
  }
  report.workspace = transform_of(device.at("state"), "transform");
  if (auto const status = device.find("status")) {
    auto const flag = [&](char const* key) {
      auto const field = status->find(key);
      return field ? std::optional(field->flag()) : std::nullopt;
    };
    report.calibrated = flag("calibrated"), report.power_supply = flag("power_supply"), report.ready = flag("ready");
  }

  auto const basis = signed_axes(report.basis.empty() ? "XYZ" : report.basis);
  if (!basis)
    throw HaplyError(HaplyProblem::frame, message("the service permutes the axes of ", legible(report.device_id), " by \"", legible(report.basis),
                                                  "\", which is not X, Y and Z with signs; set the basis in the vendor's program"));
  report.frame = HaplyFrame(*signed_axes(options.axes), *basis);
  if (!options.accepts_scale && !(report.mount.keeps_lengths() && report.workspace.keeps_lengths())) {
    Vector3<double> const scale = report.mount.scale.cwiseProduct(report.workspace.scale);
    throw HaplyError(HaplyProblem::frame,
                     message("the service scales the motion of ", legible(report.device_id), " by ", scale.x(), ", ", scale.y(), ", ", scale.z(),
                             ": metres and newtons of the hand would be lost; set mount and workspace to scale 1 there, or allow it "
                             "with .accepts_scale"));
  }
  return report;
}

/// Reads one state of the device in the report into SI and the frame here; orientation and buttons are the grip's. A grip that is not there has no
/// buttons pressed and keeps its last orientation, as does one whose quaternion is none.
/// Errors     `HaplyError`: no JSON, a field that is missing, of another type or not finite, the device gone, its workspace moved. `state` is then
///            as it was.
inline void read_state(std::string_view text, Inverse3Report const& report, DeviceState<double>& state) {
  Json const document = parsed(text);
  Field const all(document, "the state");
  auto const device = find_device(all, "inverse3", report.device_id);
  if (!device)
    throw HaplyError(HaplyProblem::vanished,
                     message("the service no longer has ", legible(report.device_id), "; check its cable and power, then open it again"));
  Field const cursor = device->at("state");
  DeviceState<double> next = state;
  next.position = report.frame.from_service(cursor.at("cursor_position").vector());
  next.velocity = report.frame.from_service(cursor.at("cursor_velocity").vector());
  if (!(transform_of(cursor, "transform") == report.workspace))
    throw HaplyError(HaplyProblem::frame_changed, message("the service moved or scaled the workspace of ", legible(report.device_id),
                                                          " while it was in use; leave that to the scene, and open the device again"));
  next.buttons = 0;
  auto const grip =
      report.grip_id.empty() ? std::nullopt : find_device(all, report.wireless_grip ? "wireless_verse_grip" : "verse_grip", report.grip_id);
  if (grip) {
    Field const held = grip->at("state");
    Eigen::Quaternion<double> const told = held.at("orientation").quaternion();
    if (std::abs(told.norm() - 1.0) < 0.1) next.orientation = report.frame.from_service(told.normalized());
    if (report.wireless_grip) {
      Field const buttons = held.at("buttons");
      std::uint32_t bit = 1;
      for (char const* name : {"a", "b", "c"}) {
        if (buttons.at(name).flag()) next.buttons |= bit;
        bit <<= 1;
      }
    } else if (held.at("button").flag()) {
      next.buttons = 1;
    }
  }
  state = next;
}

/// The message that asks for a force at the cursor.
class ForceCommand {
 public:
  ForceCommand() = default;
  explicit ForceCommand(Inverse3Report const& report) : frame_(report.frame), key_(report.dialect == HaplyDialect::values ? "values" : "vector") {
    Json& device = document_["inverse3"][0];
    device["device_id"] = report.device_id;
    device["commands"]["set_cursor_force"][key_] = Json::object();
  }

  /// `force` [N] in the frame here.
  std::string text(Vector3<double> const& force) {
    Vector3<double> const there = frame_.to_service(force);
    Json& vector = document_["inverse3"][0]["commands"]["set_cursor_force"][key_];
    vector["x"] = there.x() + 0.0, vector["y"] = there.y() + 0.0, vector["z"] = there.z() + 0.0;   // no −0
    return document_.dump();
  }

 private:
  HaplyFrame frame_;
  std::string key_;
  Json document_;
};

}  // namespace palpate::detail::haply
