// SPDX-License-Identifier: MIT
#include <palpate/device/hand_tremor.hpp>
#include <palpate/device/scripted_device.hpp>

#include "allocation_trap.hpp"
#include "catch.hpp"

#include <cmath>
#include <array>
#include <complex>
#include <limits>
#include <numbers>

using namespace palpate;

static_assert(HapticDevice<TremblingDevice<ScriptedDevice<double>, double>> && !OpensAndCloses<TremblingDevice<ScriptedDevice<double>, double>>);

// Yardstick: the stated root mean square, over 100 s; and the power by frequency, |1 − 2 r cos θ z⁻¹ + r² z⁻²|⁻² on the unit circle, of which the
// share between 8 and 12 Hz is summed here and measured there by Goertzel's sums over one-second pieces.
TEMPLATE_TEST_CASE("a hand trembles as much as stated, between 8 and 12 Hz, alike on all axes", "[device]", PALPATE_TEST_SCALARS) {
  using S = TestType;
  HandTremor<S> tremor({.amplitude = 1e-4, .seed = 5});
  constexpr int count = 400000;
  Vector3<double> square = Vector3<double>::Zero();
  double in_band = 0, mixed = 0;
  for (int piece = 0; piece < count / 1000; ++piece) {
    std::array<std::complex<double>, 7> sums{};   // 7 … 13 Hz
    for (int k = 0; k < 1000; ++k) {
      Vector3<double> const x = tremor.step().template cast<double>();
      square += x.cwiseAbs2() / count;
      mixed += x.x() * x.y() / count;
      for (std::size_t f = 0; f < sums.size(); ++f) sums[f] += x.z() * std::polar(1.0, -2 * std::numbers::pi * double(7 + f) * k / 1000);
    }
    for (std::size_t f = 1; f <= 5; ++f) in_band += 2 * std::norm(sums[f]) / 1e6 / (count / 1000);   // 8 … 12 Hz
  }
  for (int axis = 0; axis < 3; ++axis) CHECK(std::sqrt(square[axis]) == Approx(1e-4).epsilon(0.08));   // some 400 s · π · 4 Hz independent values
  CHECK(std::abs(mixed) < 0.1e-8);
  double const r = std::exp(-std::numbers::pi * 4 / 1000), theta = 2 * std::numbers::pi * 10 / 1000;
  double share = 0, whole = 0;
  for (int k = 0; k < 500000; ++k) {
    double const f = (k + 0.5) * 0.001;
    auto const z = std::polar(1.0, -2 * std::numbers::pi * f / 1000);
    double const power = 1 / std::norm(1.0 - 2 * r * std::cos(theta) * z + r * r * z * z);
    whole += power;
    if (f > 7.5 && f < 12.5) share += power;
  }
  CHECK(in_band / square.z() == Approx(share / whole).epsilon(0.1));
  CHECK(share / whole > 0.5);
}

TEST_CASE("a tremor is the same from the same seed, and from the start as strong as later") {
  HandTremor<double> a({.seed = 3}), b({.seed = 3}), c({.seed = 4});
  Vector3<double> const first = a.step();
  CHECK(first == b.step());
  CHECK(first != c.step());
  CHECK(a.step() == b.step());
  a.reset();
  CHECK(a.step() == first);
  double square = 0;
  for (int seed = 0; seed < 10000; ++seed) square += HandTremor<double>({.amplitude = 2.0, .seed = static_cast<std::uint64_t>(seed)}).step().squaredNorm() / 30000;
  CHECK(std::sqrt(square) == Approx(2.0).epsilon(0.03));
}

TEST_CASE("a trembling device displaces what the hand does, speed included, and passes the force on") {
  auto const path = Trajectory<double>::start({0, 0, 0.1}).line({0.05, 0, 0.1}, 1.0);
  TremblingDevice device(ScriptedDevice<double>(path, {.max_force = 2.0}), HandTremor<double>({.amplitude = 1e-3, .seed = 9}));
  HandTremor<double> alone({.amplitude = 1e-3, .seed = 9});
  ScriptedDevice<double> steady(path, {.max_force = 2.0});
  CHECK(device.capabilities().max_force == 2.0);
  for (int tick = 0; tick < 500; ++tick) {
    DeviceState<double> shaken, still;
    REQUIRE(device.read(shaken) == DeviceStatus::ok);
    steady.read(still);
    Vector3<double> const shift = alone.step();
    REQUIRE(shaken.position == still.position + shift);
    REQUIRE(shaken.velocity == still.velocity + alone.velocity());
  }
  device.write({.force = {1, 2, 3}});
  CHECK(device.device().last_wrench().force == Vector3<double>(1, 2, 3));
}

TEST_CASE("a tick without a new sample moves nothing, whatever the device leaves in the state") {
  struct Sleepy {   // every other read is stale, and writes its bare position again
    int reads = 0;
    Capabilities capabilities() const { return {.max_force = 1.0, .rate = 1000.0}; }
    DeviceStatus read(DeviceState<double>& state) noexcept {
      state.position = {0.1, 0.2, 0.3};
      return reads++ % 2 == 0 ? DeviceStatus::ok : DeviceStatus::stale;
    }
    DeviceStatus write(Wrench<double> const&) noexcept { return DeviceStatus::ok; }
  };
  TremblingDevice device(Sleepy{}, HandTremor<double>({.amplitude = 1e-3, .seed = 2}));
  DeviceState<double> state;
  Vector3<double> last = Vector3<double>::Zero();
  for (int k = 0; k < 100; ++k) {
    DeviceStatus const status = device.read(state);
    if (k > 0) {
      CHECK((status == DeviceStatus::stale) == (k % 2 == 1));
      CHECK((state.position == last) == (status == DeviceStatus::stale));
    }
    CHECK((state.position - Vector3<double>(0.1, 0.2, 0.3)).norm() < 0.01);
    last = state.position;
  }
}

TEST_CASE("a tremor of another rate than the device's is refused: it would be of another band") {
  auto const hand = [](double rate) { return ScriptedDevice<double>(Trajectory<double>::start({0, 0, 0}).line({0, 0, 0}, 1.0), {.rate = rate}); };
  auto const put_on = [&](double of_tremor, double of_device) { TremblingDevice(hand(of_device), HandTremor<double>({.rate = of_tremor})); };
  CHECK_THROWS_WITH(put_on(1000, 4000), says("TremblingDevice: the tremor's rate is 1000 Hz", "the device's servo has 4000 Hz", "give the tremor .rate = 4000"));
  CHECK_THROWS_WITH(put_on(1000, 500), says("give the tremor .rate = 500"));
  CHECK_NOTHROW(put_on(4000, 4000));
  CHECK_NOTHROW(put_on(1000, 1020));   // a clock of its own
}

TEST_CASE("malformed tremors are refused with a reason, and a tick allocates nothing") {
  using Tremor = HandTremor<double>;
  double const nan = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_WITH(Tremor({.frequency = 600.0}), says(".frequency is 600 Hz", "below half the rate"));
  CHECK_THROWS_AS(Tremor({.frequency = nan}), InvalidArgument);
  CHECK_THROWS_AS(Tremor({.bandwidth = 0.0}), InvalidArgument);
  CHECK_THROWS_AS(Tremor({.amplitude = -1.0}), InvalidArgument);
  CHECK_THROWS_AS(Tremor({.rate = 0.0}), InvalidArgument);
  Tremor tremor;
  palpate_test::AllocationCount const allocations;
  for (int k = 0; k < 100; ++k) tremor.step();
  long const counted = allocations.count();
  CHECK(counted == 0);
}
