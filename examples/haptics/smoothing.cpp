// SPDX-License-Identifier: MIT
// What smoothing the force of a wall costs: a mean of the last forces is late. A device of 75 g and 0.5 N s/m at 1 kHz.
#include "pictures.hpp"

#include <palpate/device/sampled_mass.hpp>
#include <palpate/haptics/filtered_wall.hpp>
#include <palpate/haptics/sampled_wall.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

namespace haptics {

using namespace palpate;

namespace {

constexpr double swung_mass = 0.075, swung_damping = 0.5, swung_period = 0.001;   // kg, N s/m, s

/// A mass on a wall to both sides, whose force is the mean of the last `samples` ones.
class Smoothed {
 public:
  Smoothed(double stiffness, int samples)
      : stiffness_(stiffness), last_(static_cast<std::size_t>(samples), 0.0),
        plant_({.mass = swung_mass, .damping = swung_damping, .rate = 1.0 / swung_period}) {}

  void tick() {
    last_[tick_++ % last_.size()] = -stiffness_ * x_.x();
    double sum = 0.0;
    for (double const force : last_) sum += force;
    plant_.step(x_, v_, {sum / static_cast<double>(last_.size()), 0.0, 0.0});
  }
  double x() const { return x_.x(); }

 private:
  double stiffness_;
  std::vector<double> last_;
  SampledMass<double> plant_;
  std::size_t tick_ = 0;
  Vector3<double> x_ = Vector3<double>::Zero(), v_{0.002, 0.0, 0.0};
};

bool grows(double stiffness, int samples) {
  Smoothed swing(stiffness, samples);
  auto const largest = [&](int ticks) {
    double most = 0.0;
    for (int k = 0; k < ticks; ++k, swing.tick()) most = std::max(most, std::abs(swing.x()));
    return most;
  };
  largest(1000);
  double const early = largest(1000);
  largest(8000);
  return !(largest(1000) <= early);
}

double tried(int samples) {
  double low = 1.0, high = 2000.0;
  for (int k = 0; k < 16; ++k) {
    double const middle = std::sqrt(low * high);
    (grows(middle, samples) ? high : low) = middle;
  }
  return low;
}

}  // namespace

Picture moving_average() {
  Picture picture("haptics_moving_average", "The stiffest stable wall behind a moving average", "forces in the mean", "stiffness [N/m]");
  picture.x().to = 32.0;
  picture.y().logarithmic = true, picture.y().from = 20.0, picture.y().to = 2000.0;
  PlotSeries &wall = picture.line(blue, "stable_wall"), &found = picture.dots(orange, "tried"), &rule = picture.dashes(black, "b/(n T/2)");
  for (int n = 1; n <= 30; ++n) {
    MovingAverage const mean{n};
    double const most = stable_wall(swung_mass, swung_damping, swung_period, mean);
    add(wall, n, most);
    add(rule, n, stable_wall_estimate(swung_damping, swung_period, mean.delay(swung_period)));
    if (n > 2 && n % 5 != 0) continue;
    double const simulated = tried(n);
    add(found, n, simulated);
    picture.quote("mean of %2d: %.1f N/m, tried %.1f N/m", n, most, simulated);
  }
  return picture;
}

Picture late_force() {
  Picture picture("haptics_late_force", "A wall of 150 N/m, its force averaged", "time [ms]", "position [mm]");
  auto const show = [&](Colour colour, int samples) {
    PlotSeries& series = picture.line(colour, samples == 1 ? std::string("the force itself") : "mean of " + std::to_string(samples));
    Smoothed swing(150.0, samples);
    double early = 0.0, late = 0.0;
    for (int k = 0; k <= 1000; ++k, swing.tick()) {
      add(series, k, 1000 * swing.x());
      if (k < 200) early = std::max(early, std::abs(swing.x()));
      if (k >= 800) late = std::max(late, std::abs(swing.x()));
    }
    picture.quote("mean of %2d: %.3f mm in the first 200 ms, %.3f mm in the last", samples, 1000 * early, 1000 * late);
  };
  show(pink, 15);
  show(orange, 6);
  show(blue, 1);
  return picture;
}

}  // namespace haptics
