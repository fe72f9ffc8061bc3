// SPDX-License-Identifier: MIT
// The same without the mistake.
#include <palpate/palpate.hpp>

/// A driver of its own.
struct Handle {
  palpate::Capabilities capabilities() const { return {.max_force = 3.3, .rate = 1000.0}; }
  palpate::DeviceStatus read(palpate::DeviceState<double>&) noexcept { return palpate::DeviceStatus::ok; }
  palpate::DeviceStatus write(palpate::Wrench<double> const&) noexcept { return palpate::DeviceStatus::ok; }
  void open() {}
  void close() noexcept {}
};

void run() {
  using namespace palpate;
  MassSpring<double> tissue(make_grid<double>(3, 3, 0.01), {});
  SoftBody body(std::move(tissue));
  Simulator simulator(Handle{}, std::move(body), NoCutter<double>(), TissueReaction{});
  simulator.run(0.1);
}
