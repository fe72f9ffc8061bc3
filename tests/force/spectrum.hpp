// SPDX-License-Identifier: MIT
// The spectrum of a sequence, by a fast Fourier transform of the textbook kind.
#pragma once

#include <cmath>
#include <complex>
#include <cstddef>
#include <numbers>
#include <utility>
#include <vector>

/// In place; the size is a power of two.
inline void fourier_transform(std::vector<std::complex<double>>& x) {
  std::size_t const n = x.size();
  for (std::size_t i = 1, j = 0; i < n; ++i) {
    std::size_t bit = n / 2;
    for (; (j & bit) != 0; bit /= 2) j ^= bit;
    j ^= bit;
    if (i < j) std::swap(x[i], x[j]);
  }
  for (std::size_t length = 2; length <= n; length *= 2)
    for (std::size_t start = 0; start < n; start += length)
      for (std::size_t k = 0; k < length / 2; ++k) {
        std::complex<double> const turned = std::polar(1.0, -2 * std::numbers::pi * double(k) / double(length)) * x[start + k + length / 2];
        x[start + k + length / 2] = x[start + k] - turned;
        x[start + k] += turned;
      }
}

/// The mean of the periodogram, with Hann's window, in equal bands from 0 to half the rate; 1 in each for white noise of variance 1.
inline std::vector<double> band_powers(std::vector<double> const& values, std::size_t bands) {
  std::vector<std::complex<double>> x(values.begin(), values.end());
  for (std::size_t k = 0; k < x.size(); ++k)   // the window's mean square is 3/8
    x[k] *= std::sqrt(8.0 / 3.0) * std::pow(std::sin(std::numbers::pi * double(k) / double(x.size())), 2);
  fourier_transform(x);
  std::vector<double> powers(bands, 0.0), counts(bands, 0.0);
  for (std::size_t k = 1; k < x.size() / 2; ++k) {
    std::size_t const band = k * bands / (x.size() / 2);
    powers[band] += std::norm(x[k]) / double(x.size());
    counts[band] += 1;
  }
  for (std::size_t band = 0; band < bands; ++band) powers[band] /= counts[band];
  return powers;
}
