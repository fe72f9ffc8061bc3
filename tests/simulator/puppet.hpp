// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/device/concept.hpp>
#include <palpate/force/concept.hpp>

namespace palpate_test {

/// What a puppet device does next and what was done to it; the test holds the strings.
template <class S>
struct Strings {
  palpate::Capabilities capabilities{.max_force = 3.0, .rate = 1000.0, .moves_a_hand = false};
  palpate::DeviceState<S> next;
  palpate::DeviceStatus reads = palpate::DeviceStatus::ok;
  palpate::DeviceStatus writes = palpate::DeviceStatus::ok;
  bool leaves_state = false;   ///< a read gives its status alone
  palpate::Wrench<S> felt;
  long reads_done = 0, writes_done = 0;
};

/// A device that a test moves tick by tick.
template <class S>
class Puppet {
 public:
  explicit Puppet(Strings<S>& strings) : strings_(&strings) {}

  palpate::Capabilities capabilities() const noexcept { return strings_->capabilities; }
  palpate::DeviceStatus read(palpate::DeviceState<S>& state) noexcept {
    ++strings_->reads_done;
    if (!strings_->leaves_state) state = strings_->next;
    return strings_->reads;
  }
  palpate::DeviceStatus write(palpate::Wrench<S> const& wrench) noexcept {
    ++strings_->writes_done;
    strings_->felt = wrench;
    return strings_->writes;
  }

 private:
  Strings<S>* strings_;
};

/// A force model that answers what the test says and keeps what it was asked.
template <class S>
struct Answer {
  palpate::Vector3<S>* answer;
  palpate::ToolContact<S>* asked;
  int* times;

  palpate::Vector3<S> operator()(palpate::ToolContact<S> const& contact) noexcept {
    *asked = contact;
    ++*times;
    return *answer;
  }
};

}  // namespace palpate_test
