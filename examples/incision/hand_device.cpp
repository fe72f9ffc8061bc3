// SPDX-License-Identifier: MIT
#include "hand_device.hpp"

#include <palpate/device/built_in_devices.hpp>
#include <palpate/device/force_dimension/address.hpp>
#include <palpate/device/phantom/address.hpp>
#include <palpate/device/scripted_device.hpp>
#include <palpate/training/replay_address.hpp>

namespace incision {

using palpate::ForceDimensionDevice;
using palpate::PhantomDevice;

Device make_device(Options const& options, Hand const& hand) {
  if (options.device == "script") return palpate::ScriptedDevice<double>(hand.path);
  palpate::DeviceRegistry<double> devices = palpate::built_in_devices();
  palpate::add_replay(devices);
  palpate::add_phantom(devices);
  palpate::add_force_dimension(devices);
  return devices.make(options.device);
}

palpate::WorkspaceMapping<double> mapping_of(Options const& options, Hand const& hand) {
  if (options.device == "script") return {};
  palpate::Matrix<double, 3, 3> turn;
  turn << hand.along, hand.normal, hand.along.cross(hand.normal);
  return palpate::WorkspaceMapping<double>(palpate::Similarity<double>::make(1.0, Eigen::Quaternion<double>(turn).normalized(), hand.middle));
}

bool keeps_time(Device& device) {
  if (device.get_if<ForceDimensionDevice>() != nullptr) return true;
  PhantomDevice* const phantom = device.get_if<PhantomDevice>();
  if (phantom == nullptr) return false;
  phantom->open();
  bool const by_the_wall = !phantom->has_virtual_clock();
  phantom->close();
  return by_the_wall;
}

std::string description_of(Device& device) {
  auto const who = device.description();
  auto const with_driver = [&](auto const& maker) { return palpate::detail::message(who.model, ", ", who.driver, " (", maker.library(), ")"); };
  if (PhantomDevice const* const phantom = device.get_if<PhantomDevice>()) return with_driver(*phantom);
  if (ForceDimensionDevice const* const delta = device.get_if<ForceDimensionDevice>()) return with_driver(*delta);
  return who.model;
}

std::string faults_of(Device& device) {
  std::string all;
  while (auto const fault = device.pop_fault())
    all += (all.empty() ? "" : ", ") + palpate::detail::message(fault->what, " (", fault->native_code, ", ", to_string(fault->status), ")");
  return all;
}

}  // namespace incision
