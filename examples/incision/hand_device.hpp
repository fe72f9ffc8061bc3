// SPDX-License-Identifier: MIT
#pragma once

#include "options.hpp"
#include "scene.hpp"

#include <palpate/device/any_device.hpp>
#include <palpate/haptics/workspace_mapping.hpp>

#include <string>

namespace incision {

using Device = palpate::AnyDevice<double>;

/// The scripted hand, or what `--device` names: what the library has built in, a replay, a PHANToM, a device of Force Dimension. Throws palpate::Error for a name that is none.
Device make_device(Options const& options, Hand const& hand);

/// Where the device is in the scene. What `--device` names has the middle of its workspace on the organ's upper side, in the middle of the stroke,
/// its y axis along the surface's normal, its x axis along the stroke.
palpate::WorkspaceMapping<double> mapping_of(Options const& options, Hand const& hand);

/// Is there a hand that moves by the wall clock? Lock-step, at any other speed, would not do it justice. Opens the device for a moment to know.
bool keeps_time(Device& device);

/// Who it is, and what went wrong in it, in a line each; empty for a hand without a name.
std::string description_of(Device& device);
std::string faults_of(Device& device);

}  // namespace incision
