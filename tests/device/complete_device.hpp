// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/device/concept.hpp>

#include <atomic>
#include <chrono>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace palpate_test {

/// A device with every refinement but a clock, which writes down what is done to it. The diary outlives it and its moves.
class CompleteDevice {
 public:
  using Diary = std::vector<std::string>;

  explicit CompleteDevice(std::shared_ptr<Diary> diary) : diary_(std::move(diary)) {}

  palpate::Capabilities capabilities() const noexcept {
    return {.max_force = palpate::datasheet(3.3), .rate = 1000.0, .reports_velocity = true, .buttons = 2, .moves_a_hand = false};
  }
  palpate::DeviceStatus read(palpate::DeviceState<double>& state) noexcept {
    state.position.setConstant(0.25);
    state.velocity.setZero();
    state.buttons = 2;
    return palpate::DeviceStatus::ok;
  }
  palpate::DeviceStatus write(palpate::Wrench<double> const& wrench) noexcept {
    last_ = wrench;
    return palpate::DeviceStatus::ok;
  }
  void open() { diary_->push_back("open"); }
  void close() noexcept { diary_->push_back("close"); }
  void arm() { diary_->push_back("arm"); }
  void disarm() noexcept { diary_->push_back("disarm"); }
  palpate::DeviceDescription description() const { return {.vendor = "nobody", .model = "complete"}; }
  palpate::Calibration calibration() noexcept { return calibrated_ ? palpate::Calibration::good : palpate::Calibration::needs_update; }
  void calibrate() noexcept { calibrated_ = true; }
  std::optional<palpate::DeviceFault> pop_fault() noexcept {
    return faults_-- > 0 ? std::optional<palpate::DeviceFault>({.native_code = 42, .what = "too warm"}) : std::nullopt;
  }
  palpate::Wrench<double> const& last_wrench() const noexcept { return last_; }

 protected:
  std::shared_ptr<Diary> diary_;

 private:
  palpate::Wrench<double> last_;
  bool calibrated_ = false;
  int faults_ = 1;
};

/// The same with a clock of its own: a thread that ticks as fast as it can.
class ClockedDevice : public CompleteDevice {
 public:
  using CompleteDevice::CompleteDevice;
  ClockedDevice(ClockedDevice&& other) noexcept : CompleteDevice(std::move(other)) {}
  ~ClockedDevice() { stop(); }

  void start(void (*tick)(void*) noexcept, void* context) {
    diary_->push_back("start");
    runs_ = true;
    thread_ = std::thread([this, tick, context] {
      while (runs_) {
        tick(context);
        std::this_thread::sleep_for(std::chrono::microseconds(20));
      }
    });
  }
  void stop() noexcept {
    runs_ = false;
    if (thread_.joinable()) thread_.join();
  }

 private:
  std::atomic<bool> runs_ = false;
  std::thread thread_;
};

}  // namespace palpate_test
