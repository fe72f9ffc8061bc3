// SPDX-License-Identifier: MIT
// Noise, of 30 dB below a force of 1 N at 1 kHz.
#include "pictures.hpp"

#include <palpate/force/band_limited_noise.hpp>
#include <palpate/force/noise.hpp>

#include <cmath>
#include <complex>
#include <numbers>
#include <vector>

namespace forces {

using namespace palpate;

namespace {

constexpr double rate = 1000.0;   // Hz
Vector3<double> const one_newton(0.0, 0.0, 1.0);

template <class Noise>
std::vector<double> draw(Noise noise, int ticks) {
  std::vector<double> values;
  for (int k = 0; k < ticks; ++k) values.push_back(noise.draw(one_newton).z());
  return values;
}

/// One-sided power density [mN²/Hz] over frequency: the mean of periodograms of 200 ms, with Hann's window.
void density(PlotSeries& series, std::vector<double> const& values) {
  constexpr int length = 200;
  auto const windows = static_cast<int>(values.size()) / length;
  for (int f = 2; f < length / 2; ++f) {
    double sum = 0.0;
    for (int w = 0; w < windows; ++w) {
      std::complex<double> part = 0.0;
      for (int k = 0; k < length; ++k)
        part += values[static_cast<std::size_t>(w * length + k)] * std::pow(std::sin(std::numbers::pi * k / length), 2) *
                std::polar(1.0, -2 * std::numbers::pi * f * k / length);
      sum += std::norm(part);
    }
    add(series, rate * f / length, 1e6 * sum / windows * 2.0 / (rate * length * 3.0 / 8.0));   // the window's mean square is 3/8
  }
}

double rms(std::vector<double> const& values) {
  double sum = 0.0;
  for (double const v : values) sum += v * v;
  return std::sqrt(sum / static_cast<double>(values.size()));
}

}  // namespace

Picture noise_spectra() {
  Picture picture("forces_noise_spectrum", "Noise at 30 dB below 1 N: power density", "frequency [Hz]", "power density [mN^2/Hz]");
  picture.y().logarithmic = true;
  constexpr int ticks = 200000;
  auto const white = draw(WhiteGaussianNoise<double>({.seed = 7}), ticks), narrow = draw(BandLimitedNoise<double>({.seed = 7}), ticks);
  density(picture.line(blue, "white"), white);
  density(picture.line(orange, "below 100 Hz"), narrow);
  // The formula in band_limited_noise.hpp, scaled to the same variance.
  auto const bent = [](double f) { return std::tan(std::numbers::pi * f / rate); };
  auto const shape = [&](double f) { return 1.0 / (1.0 + std::pow(bent(f) / bent(100.0), 4)); };
  double area = 0.0;
  for (double f = 0.5; f < rate / 2; f += 1.0) area += shape(f);
  sample(picture.dashes(black, "formula"), 1.0, 490.0, 1.0, [&](double f) { return 1e3 * shape(f) / area; });   // variance 1e3 mN²
  picture.quote("rms: white %.2f mN, below 100 Hz %.2f mN, asked for %.2f mN", 1e3 * rms(white), 1e3 * rms(narrow), 1e3 * std::pow(10.0, -1.5));
  return picture;
}

Picture noise_in_time() {
  Picture picture("forces_noise_time", "A force of 1 N with noise at 30 dB", "time [ms]", "force [N]");
  auto const show = [&](PlotSeries& series, std::vector<double> const& values) {
    for (std::size_t k = 0; k < values.size(); ++k) add(series, static_cast<double>(k), 1.0 + values[k]);
  };
  show(picture.line(sky, "white"), draw(WhiteGaussianNoise<double>({.seed = 7}), 201));
  show(picture.line(orange, "below 100 Hz"), draw(BandLimitedNoise<double>({.seed = 7}), 201));
  return picture;
}

}  // namespace forces
