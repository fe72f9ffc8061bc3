// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/haptics/contact_coupling.hpp>
#include <palpate/simulator/servo_loop.hpp>

#include <optional>
#include <utility>

namespace palpate {

struct ToolOptions {
  std::optional<int> key = {};                      ///< tools touch, cut and push in the order of their keys; by default its place among the tools
  std::optional<ContactCoupling> coupling = {};     ///< by default the simulator's; not of a tool that presses the tissue itself
  std::optional<ServoOptions> servo = {};           ///< safety, frames, clutch and trocar of its device; by default the simulator's
  std::optional<TrocarOptions<double>> trocar = {};  ///< its own, instead of that of its servo
};

/// One of the tools of a Simulator: a device that a hand holds, what the tool does to the tissue, and what the hand feels.
///   Tool(ScriptedDevice<double>(path), ProgressiveCutter<double>({.puncture_depth = 0.003}), TissueReaction{})
template <class DeviceType, class CutterType, class ForceType>
struct Tool {
  using Device = DeviceType;
  using Cutter = CutterType;
  using Force = ForceType;

  Tool(Device its_device, Cutter its_cutter, Force its_force, ToolOptions const& its_options = {})
      : device(std::move(its_device)), cutter(std::move(its_cutter)), force(std::move(its_force)), options(its_options) {}

  Device device;
  Cutter cutter;
  Force force;
  ToolOptions options;
};

namespace detail {

template <class T>
inline constexpr bool is_tool = false;
template <class Device, class CutterType, class Force>
inline constexpr bool is_tool<Tool<Device, CutterType, Force>> = true;

}  // namespace detail

}  // namespace palpate
