// SPDX-License-Identifier: MIT
// A mass of 75 g, a device without a hand, is thrown at a wall that a servo renders at 1 kHz.
#include "pictures.hpp"

#include <palpate/device/sampled_mass.hpp>
#include <palpate/haptics/passivity.hpp>
#include <palpate/haptics/sampled_wall.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

namespace haptics {

using namespace palpate;

namespace {

constexpr double thrown_mass = 0.075, thrown_damping = 0.1, thrown_speed = 0.2, servo_period = 0.001;   // kg, N s/m, m/s, s
constexpr double too_stiff = 5000.0, push = 0.5;   // N/m; N, towards the wall

/// The wall is where x < 0. With the controller, or observed alone.
class Throw {
 public:
  Throw(double stiffness, bool controlled, double with_damping = thrown_damping, double starts_at = 0.0)
      : stiffness_(stiffness), plant_({.mass = thrown_mass, .damping = with_damping, .rate = 1.0 / servo_period}),
        controller_({.period = servo_period, .max_damping = controlled ? thrown_mass / (4.0 * servo_period) : 0.0}), x_(starts_at, 0.0, 0.0) {}

  void tick(double pushed) {
    double const deep = std::min(x_.x(), 0.0);
    Vector3<double> const sent = controller_(x_, {-stiffness_ * deep, 0.0, 0.0}, stiffness_ * deep * deep / 2.0);
    controller_.sent(sent);
    plant_.step(x_, v_, sent - Vector3<double>(pushed, 0.0, 0.0));
  }
  double x() const { return x_.x(); }
  double v() const { return v_.x(); }
  PassivityController<double> const& controller() const { return controller_; }

 private:
  double stiffness_;
  SampledMass<double> plant_;
  PassivityController<double> controller_;
  Vector3<double> x_, v_{-thrown_speed, 0.0, 0.0};
};

/// Speed away from the wall over that towards it; what the air takes is not counted. The controller is given 20 ticks in the air to take back what
/// the wall has given in its last ones.
double rebound(double stiffness, bool controlled, double with_damping, double starts_at) {
  Throw thrown(stiffness, controlled, with_damping, starts_at);
  double const towards = thrown_speed * std::exp(-with_damping / thrown_mass * starts_at / thrown_speed);
  do thrown.tick(0.0);
  while (thrown.x() > 0.0 && thrown.v() < 0.0);
  do thrown.tick(0.0);
  while (thrown.x() < 0.0);
  constexpr int in_air = 20;
  for (int k = 0; k < in_air; ++k) thrown.tick(0.0);
  return thrown.v() * std::exp(with_damping / thrown_mass * in_air * servo_period) / towards;
}

/// The largest of contacts that begin somewhere between two samples.
double largest_rebound(double stiffness, bool controlled, double with_damping = thrown_damping) {
  double largest = 0.0;
  double const way = thrown_speed * servo_period;
  for (int k = 0; k < 40; ++k) largest = std::max(largest, rebound(stiffness, controlled, with_damping, way * k / 40.0));
  return largest;
}

/// Of a wall that is not sampled, from the damped oscillation.
double ideal_rebound(double stiffness) {
  double const decay = thrown_damping / (2.0 * thrown_mass), turn = std::sqrt(stiffness / thrown_mass - decay * decay);
  return std::exp(-decay * std::numbers::pi / turn);
}

template <class Value>
void follow(PlotSeries& series, Throw thrown, int ticks, Value value) {
  for (int k = 0; k <= ticks; ++k, thrown.tick(push)) add(series, k, value(thrown));
}

double millimetres(Throw const& thrown) { return 1000.0 * thrown.x(); }

}  // namespace

Picture bounces() {
  Picture picture("haptics_bounces", "A mass that 0.5 N pushes at a wall", "time [ms]", "height over the wall [mm]");
  auto const show = [&](Colour colour, double stiffness) {
    follow(picture.line(colour, std::to_string(std::lround(stiffness)) + " N/m"), Throw(stiffness, false), 800, millimetres);
    Throw thrown(stiffness, false);
    double highest = 0.0, late = 0.0;
    for (int k = 0; k <= 800; ++k, thrown.tick(push)) {
      double& most = k < 200 ? highest : late;
      most = std::max(most, thrown.x());
    }
    picture.quote("%5.0f N/m: up to %.2f mm in the first 200 ms, %.2f mm afterwards", stiffness, 1000 * highest, 1000 * late);
  };
  show(blue, 190.0);
  show(orange, 1000.0);
  show(pink, too_stiff);
  picture.quote("stable up to %.1f N/m", stable_wall(thrown_mass, thrown_damping, servo_period));
  return picture;
}

Picture restitution() {
  Picture picture("haptics_restitution", "Speed after the wall over speed before it", "stiffness of the wall [N/m]", "restitution [-]");
  picture.x().logarithmic = true, picture.x().from = 100.0, picture.x().to = 10000.0;
  auto const draw = [&](PlotSeries& series, auto value) {
    for (int k = 0; k <= 120; ++k) {
      double const stiffness = 100.0 * std::pow(100.0, k / 120.0);
      add(series, stiffness, value(stiffness));
    }
  };
  draw(picture.line(pink, "0.1 N s/m"), [](double k) { return largest_rebound(k, false); });
  draw(picture.line(orange, "0.5 N s/m"), [](double k) { return largest_rebound(k, false, 0.5); });
  draw(picture.line(blue, "0.1, controlled"), [](double k) { return largest_rebound(k, true); });
  draw(picture.dashes(black, "0.1, not sampled"), ideal_rebound);
  auto const limit = [&](Colour colour, char const* label, double b) {
    PlotSeries& series = picture.dashes(colour, label);
    double const most = stable_wall(thrown_mass, b, servo_period);
    add(series, most, 0.7), add(series, most, 1.3);
    picture.quote("%.1f N s/m: stable up to %.1f N/m, there %.4f", b, most, largest_rebound(most, false, b));
  };
  limit(pink, "stable with 0.1", 0.1);
  limit(orange, "stable with 0.5", 0.5);
  for (double const k : {200.0, 500.0, 1000.0, 2000.0, too_stiff})
    picture.quote("%5.0f N/m: from a sample %.3f, at most %.3f; with the controller %.3f, at most %.3f; not sampled %.3f", k,
                  rebound(k, false, thrown_damping, 0.0), largest_rebound(k, false), rebound(k, true, thrown_damping, 0.0),
                  largest_rebound(k, true), ideal_rebound(k));
  return picture;
}

Picture controller_position() {
  Picture picture("haptics_controller_position", "The wall of 5000 N/m, without and with the controller", "time [ms]", "height over the wall [mm]");
  follow(picture.line(pink, "as it is"), Throw(too_stiff, false), 400, millimetres);
  follow(picture.line(blue, "controlled"), Throw(too_stiff, true), 400, millimetres);
  Throw controlled(too_stiff, true);
  double late = 0.0;
  for (int k = 0; k <= 400; ++k, controlled.tick(push))
    if (k >= 300) late = std::max(late, controlled.x());
  picture.quote("controlled: up to %.2f mm in the last 100 ms", 1000 * late);
  return picture;
}

Picture controller_energy() {
  Picture picture("haptics_controller_energy", "What the wall of 5000 N/m has taken from the mass", "time [ms]", "energy [mJ]");
  auto const energy = [](Throw const& thrown) { return 1000.0 * thrown.controller().energy(); };
  follow(picture.line(pink, "as it is"), Throw(too_stiff, false), 400, energy);
  follow(picture.line(blue, "controlled"), Throw(too_stiff, true), 400, energy);
  double const came = thrown_mass * thrown_speed * thrown_speed / 2.0;
  for (bool const controlled : {false, true}) {
    Throw thrown(too_stiff, controlled);
    for (int k = 0; k <= 400; ++k) thrown.tick(push);
    picture.quote("%-10s taken %.3f mJ after 400 ms, least %.3f mJ, damped in %d ticks; it came with %.3f mJ", controlled ? "controlled" : "as it is",
                  energy(thrown), 1000 * thrown.controller().min_energy(), static_cast<int>(thrown.controller().damped()), 1000 * came);
  }
  return picture;
}

}  // namespace haptics
