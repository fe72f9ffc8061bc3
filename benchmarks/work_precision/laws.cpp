// SPDX-License-Identifier: MIT
#include "laws.hpp"

#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

namespace work_precision {

namespace {

constexpr double impulse_frequency = 4;   // 1/s, of the particle of the impulse scenes

struct Known {
  char const* integrator;
  int order;
  double (*growth)(double z);   ///< of the energy of an undamped oscillator in a step, z = hω; none where it swings for ever
};

/// From the textbooks; |λ|² of x″ = −ω²x.
constexpr Known known[] = {{"ExplicitEuler", 1, [](double z) { return 1 + z * z; }},
                           {"SymplecticEuler", 1, nullptr},
                           {"StoermerVerlet", 2, nullptr},
                           {"LeapfrogVerlet", 2, nullptr},
                           {"VelocityVerlet", 2, nullptr},
                           {"ExplicitMidpoint", 2, [](double z) { return 1 + std::pow(z, 4) / 4; }},
                           {"RungeKutta4", 4, [](double z) { return 1 - std::pow(z, 6) / 72 + std::pow(z, 8) / 576; }},
                           {"BackwardEuler", 1, [](double z) { return 1 / (1 + z * z); }},
                           {"ThetaScheme 0.6", 1, [](double z) { return (1 + 0.16 * z * z) / (1 + 0.36 * z * z); }},
                           {"CrankNicolson", 2, [](double) { return 1.0; }}};

class Laws {
 public:
  explicit Laws(Rows const& rows) : rows_(rows) {}

  Row const* find(char const* kind, char const* scene, std::string const& integrator) const {
    for (Row const& row : rows_)
      if (row.kind == kind && row.scene == scene && row.integrator == integrator) return &row;
    return nullptr;
  }

  void expect(char const* what, std::string const& integrator, double found, double expected, double within) {
    bool const holds = std::abs(found - expected) <= within;
    std::printf("%-7s %-42s %-18s %12.6g, expected %.6g within %.2g\n", holds ? "holds" : "BROKEN", what, integrator.c_str(), found, expected, within);
    broken_ += !holds;
  }

  /// log₂ of the ratio of the errors of two runs where the second takes half the step, for the finest pair where digits and an implicit method's
  /// tolerance do not show.
  double order(char const* scene, std::string const& integrator) const {
    std::vector<Row const*> runs;
    for (Row const& row : rows_)
      if (row.kind == "precision" && row.scene == scene && row.integrator == integrator && row.error > 1e-8 && row.error < 0.05 && row.step > 5e-4) runs.push_back(&row);
    if (runs.size() < 2) return unknown;
    Row const& coarse = *runs[runs.size() - 2];
    Row const& fine = *runs.back();
    return std::log(coarse.error / fine.error) / std::log(coarse.step / fine.step);
  }

  int broken() const { return broken_; }

 private:
  Rows const& rows_;
  int broken_ = 0;
};

}  // namespace

int check_laws(Rows const& rows) {
  Laws laws(rows);
  std::printf("\n");
  for (Known const& one : known) {
    laws.expect("order, against the closed form", one.integrator, laws.order("impulse_underdamped", one.integrator), one.order, 0.15);
    Row const* const energy = laws.find("energy", "impulse_undamped", one.integrator);
    if (energy == nullptr) {
      laws.expect("its energy is measured", one.integrator, unknown, 0, 0);
      continue;
    }
    double const z = impulse_frequency * energy->step;
    Row const* const path = laws.find("energy_path", "impulse_undamped", one.integrator);   // its first point: the mean of some steps
    if (one.growth == nullptr) {
      laws.expect("energy does not drift", one.integrator, energy->energy_drift, 0, 0.02);
    } else if (path == nullptr) {
      laws.expect("the energy's path is known", one.integrator, unknown, 0, 0);
    } else {
      int const steps = static_cast<int>(std::lround(path->time / energy->step));
      double expected = 0;
      for (int k = 1; k <= steps; ++k) expected += std::pow(one.growth(z), k) / steps;
      laws.expect("mean energy of the first steps", one.integrator, path->energy, expected, 2e-3 * expected);
    }
  }
  // Leapfrog keeps v² (1 − z²/4) + ω² x², so that the energy lies between 1 − z²/4 and 1 of what it was at x = 0.
  if (Row const* const energy = laws.find("energy", "impulse_undamped", "LeapfrogVerlet"))
    laws.expect("energy swings by (hω)²/4", "LeapfrogVerlet", energy->energy_swing, std::pow(impulse_frequency * energy->step, 2) / 4, 0.01);
  for (char const* name : {"SymplecticEuler", "StoermerVerlet", "LeapfrogVerlet", "VelocityVerlet"})
    if (Row const* const limit = laws.find("stability", "impulse_undamped", name))
      laws.expect("measured limit is hω = 2", name, impulse_frequency * limit->measured_limit, 2, 0.04);
  if (Row const* const limit = laws.find("stability", "impulse_undamped", "RungeKutta4"))
    laws.expect("measured limit is hω = √8", "RungeKutta4", impulse_frequency * limit->measured_limit, std::sqrt(8.0), 0.06);
  std::printf(laws.broken() == 0 ? "all laws hold\n" : "%d laws are broken\n", laws.broken());
  return laws.broken() == 0 ? 0 : 1;
}

}  // namespace work_precision
