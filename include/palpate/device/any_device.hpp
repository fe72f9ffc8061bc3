// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/device/concept.hpp>

#include <concepts>
#include <memory>
#include <optional>
#include <type_traits>
#include <utility>

namespace palpate {

namespace detail {
template <class Device>
inline constexpr char device_tag = 0;   // its address tells the types of devices apart
}  // namespace detail

/// Type-erased device of a scalar, chosen at run time: a simulator of an `AnyDevice` takes whatever the user names.
/// Every refinement is forwarded. What the device lacks does nothing: opening, closing, arming, disarming and calibrating return at once,
/// the calibration is good, there are no faults, and the description is empty. `clock()` is the device's own clock, null where the host
/// keeps the time.
/// Invariant  one that was moved from is false; its reads and writes say `disconnected`, its capabilities are empty, and it can not be
///            opened or armed.
/// Cost       one allocation when it is made; then a virtual call each; `read` and `write` are noexcept and allocate nothing themselves.
template <RealScalar S = double>
class AnyDevice {
 public:
  using Scalar = S;

  template <class Device>
    requires (!std::same_as<std::remove_cvref_t<Device>, AnyDevice>) && HapticDevice<std::remove_cvref_t<Device>, S> &&
             std::constructible_from<std::remove_cvref_t<Device>, Device>
  AnyDevice(Device&& device) : held_(std::make_unique<Holder<std::remove_cvref_t<Device>>>(std::forward<Device>(device))) {}
  /// A device that can not be moved, made in place.
  template <class Device, class... Arguments>
    requires HapticDevice<Device, S> && std::constructible_from<Device, Arguments...>
  explicit AnyDevice(std::in_place_type_t<Device>, Arguments&&... arguments)
      : held_(std::make_unique<Holder<Device>>(std::forward<Arguments>(arguments)...)) {}

  /// False: it was moved away.
  explicit operator bool() const noexcept { return held_ != nullptr; }

  Capabilities capabilities() const { return held_ ? held_->capabilities() : Capabilities{}; }
  DeviceStatus read(DeviceState<S>& state) noexcept { return held_ ? held_->read(state) : DeviceStatus::disconnected; }
  DeviceStatus write(Wrench<S> const& wrench) noexcept { return held_ ? held_->write(wrench) : DeviceStatus::disconnected; }
  void open() { there().open(); }
  void close() noexcept {
    if (held_) held_->close();
  }
  void arm() { there().arm(); }
  void disarm() noexcept {
    if (held_) held_->disarm();
  }
  DeviceDescription description() const { return held_ ? held_->description() : DeviceDescription{}; }
  Calibration calibration() noexcept { return held_ ? held_->calibration() : Calibration::good; }
  void calibrate() noexcept {
    if (held_) held_->calibrate();
  }
  /// Empty where the device has none.
  char const* calibration_advice() const noexcept { return held_ ? held_->calibration_advice() : ""; }
  std::optional<DeviceFault> pop_fault() noexcept { return held_ ? held_->pop_fault() : std::nullopt; }
  DeviceClock* clock() noexcept { return held_ ? held_->clock() : nullptr; }

  /// The device itself if it is of this type, null otherwise.
  template <class Device>
  Device* get_if() noexcept {
    return held_ && held_->tag() == &detail::device_tag<Device> ? static_cast<Device*>(held_->device()) : nullptr;
  }

 private:
  struct Interface {
    virtual ~Interface() = default;
    virtual Capabilities capabilities() const = 0;
    virtual DeviceStatus read(DeviceState<S>& state) noexcept = 0;
    virtual DeviceStatus write(Wrench<S> const& wrench) noexcept = 0;
    virtual void open() = 0;
    virtual void close() noexcept = 0;
    virtual void arm() = 0;
    virtual void disarm() noexcept = 0;
    virtual DeviceDescription description() const = 0;
    virtual Calibration calibration() noexcept = 0;
    virtual void calibrate() noexcept = 0;
    virtual char const* calibration_advice() const noexcept = 0;
    virtual std::optional<DeviceFault> pop_fault() noexcept = 0;
    virtual DeviceClock* clock() noexcept = 0;
    virtual char const* tag() const noexcept = 0;
    virtual void* device() noexcept = 0;
  };

  template <class Device>
  struct Holder final : Interface, DeviceClock {
    template <class... Arguments>
    explicit Holder(Arguments&&... arguments) : device_(std::forward<Arguments>(arguments)...) {
      static_assert(sizeof(detail::DeviceRefinements<Device>) > 0);
    }

    Capabilities capabilities() const override { return device_.capabilities(); }
    DeviceStatus read(DeviceState<S>& state) noexcept override { return device_.read(state); }
    DeviceStatus write(Wrench<S> const& wrench) noexcept override { return device_.write(wrench); }
    void open() override {
      if constexpr (OpensAndCloses<Device>) device_.open();
    }
    void close() noexcept override {
      if constexpr (OpensAndCloses<Device>) device_.close();
    }
    void arm() override {
      if constexpr (Armable<Device>) device_.arm();
    }
    void disarm() noexcept override {
      if constexpr (Armable<Device>) device_.disarm();
    }
    DeviceDescription description() const override {
      if constexpr (DescribesItself<Device>)
        return device_.description();
      else
        return {};
    }
    Calibration calibration() noexcept override {
      if constexpr (Calibratable<Device>)
        return device_.calibration();
      else
        return Calibration::good;
    }
    void calibrate() noexcept override {
      if constexpr (Calibratable<Device>) device_.calibrate();
    }
    char const* calibration_advice() const noexcept override {
      if constexpr (AdvisesCalibration<Device>)
        return device_.calibration_advice();
      else
        return "";
    }
    std::optional<DeviceFault> pop_fault() noexcept override {
      if constexpr (ReportsFaults<Device>)
        return device_.pop_fault();
      else
        return std::nullopt;
    }
    DeviceClock* clock() noexcept override {
      if constexpr (SelfClocked<Device>)
        return this;
      else if constexpr (HasOptionalClock<Device>)
        return device_.clock();   // another AnyDevice, deeper inside
      else
        return nullptr;
    }
    void start([[maybe_unused]] void (*tick)(void*) noexcept, [[maybe_unused]] void* context) override {
      if constexpr (SelfClocked<Device>) device_.start(tick, context);
    }
    void stop() noexcept override {
      if constexpr (SelfClocked<Device>) device_.stop();
    }
    char const* tag() const noexcept override { return &detail::device_tag<Device>; }
    void* device() noexcept override { return &device_; }

    Device device_;
  };

  Interface& there() {
    if (!held_) throw InvalidArgument("AnyDevice: this one was moved away; use the one that it was moved to, or make another");
    return *held_;
  }

  std::unique_ptr<Interface> held_;
};

}  // namespace palpate
