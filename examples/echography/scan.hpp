// SPDX-License-Identifier: MIT
#pragma once

#include "thigh.hpp"

#include <palpate/core/random.hpp>
#include <palpate/volume/section.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <numbers>
#include <vector>

namespace echography {

constexpr double pi = std::numbers::pi;
constexpr double frequency = 5e6, speed = 1540, wavelength = speed / frequency;   // Hz, m/s, m
constexpr double bandwidth = 0.4, aperture = 3, focus = 0.030;                     // of the frequency, at half amplitude; focus over width; m
constexpr double absorbed = 0.5;                                                   // dB/(cm MHz), one way
constexpr double pixel = 1e-4, width = 0.038, depth = 0.064;                       // m, of the picture
constexpr double range = 50;                                                       // dB, black to white
/// m, at half of the height: of a pulse, there and back; of the beam at the focus, which is √2 as wide `in_focus` from there.
inline double const pulse_length = 2 * std::log(2.0) / pi / (bandwidth * frequency) * speed;
constexpr double beam_width = wavelength * aperture, in_focus = 7 * wavelength * aperture * aperture;

/// How strongly a place at rest scatters, of muscle 1: sheets send most back where they lie across the beam.
inline double echogenicity(Vector const& p) {
  double const from_vein = anatomy::outside_vein(p), from_bone = anatomy::outside_bone(p), deep = anatomy::under_skin(p);
  if (from_vein < 0 || from_bone < 0) return 0;   // blood is too weak to be seen, and there is no flesh in a bone
  auto const facing = [&p](double x, double y) { return (p.y() - y) / std::hypot(p.x() - x, p.y() - y); };
  double const middle = anatomy::middle(0), up = facing(0, middle);
  if (from_bone < 0.0008) return 1 + 40 * std::pow(std::max(0.0, up), 6);
  if (from_vein < 0.0006) return 1.2 + 6 * std::pow(facing(anatomy::across, middle + anatomy::above), 4);
  if (deep < 0.0016) return 8;
  double const along = std::atan2(p.x(), p.y() - middle), wave = 0.0006 * std::sin(40 * along);
  if (deep < anatomy::fat - 0.0004) {   // lobules between septa that run with the skin
    bool const septum = std::abs(std::remainder(deep + 2 * wave - 0.0008, 0.0027)) < 0.00025 && std::sin(31 * along + 900 * deep) > -0.4;
    return septum ? 1.3 : 0.4;
  }
  if (deep < anatomy::fat + 0.0004) return 1 + 5 * std::pow(up, 8);                   // fascia
  if (std::abs(deep + 3 * wave - 0.0265) < 0.0003) return 1 + 2.5 * std::pow(up, 4);   // between two muscles
  bool const fibrous = deep < 0.0250 && std::abs(std::remainder(deep + wave, 0.0019)) < 0.00025 && std::sin(55 * along + 2600 * deep) > 0.3;
  return fibrous ? 3.5 : 1;
}

/// A scatterer where the tissue has carried it, and how strong it is.
struct Echo {
  Vector at;
  double strength;
};

/// Scatterers in the plane z = 0 at rest, strewn once and carried by their tetrahedra ever after.
class Scatterers {
 public:
  static constexpr double density = 48e6;   // 1/m²: 15 in a resolution cell at the focus

  Scatterers(palpate::TetrahedralMesh<double> const& mesh, palpate::Seed seed) {
    palpate::Random random(seed);
    auto const plane = palpate::section<double>(mesh, Vector::Zero(), Vector::UnitZ());
    for (std::size_t k = 0; k < plane.tetrahedron.size(); ++k) {
      auto const corners = plane.mesh.triangles.col(static_cast<Eigen::Index>(k));
      auto const nodes = mesh.tetrahedra.col(plane.tetrahedron[k]);
      Vector const a = plane.mesh.points.col(corners[0]), b = plane.mesh.points.col(corners[1]) - a, c = plane.mesh.points.col(corners[2]) - a;
      Eigen::Matrix4d places = Eigen::Matrix4d::Ones();
      for (int n = 0; n < 4; ++n) places.col(n).head<3>() = mesh.points.col(nodes[n]);
      Eigen::Matrix4d const weights_of = places.inverse();
      for (auto left = static_cast<int>(density * b.cross(c).norm() / 2 + random.uniform()); left > 0; --left) {
        double u = random.uniform(), v = random.uniform();
        if (u + v > 1) u = 1 - u, v = 1 - v;
        Vector const p = a + u * b + v * c;
        if (double const strength = echogenicity(p); strength > 0 && std::abs(p.x()) < 0.75 * width && p.y() > -0.01)
          all_.push_back({{nodes[0], nodes[1], nodes[2], nodes[3]}, weights_of * p.homogeneous(), strength});
      }
    }
  }

  std::vector<Echo> carried(palpate::Matrix3X<double> const& positions) const {
    std::vector<Echo> echoes;
    echoes.reserve(all_.size());
    for (Scatterer const& one : all_) {
      Vector at = Vector::Zero();
      for (int n = 0; n < 4; ++n) at += one.weight[n] * positions.col(one.node[static_cast<std::size_t>(n)]);
      echoes.push_back({at, one.strength});
    }
    return echoes;
  }

 private:
  struct Scatterer {
    std::array<int, 4> node;
    Eigen::Vector4d weight;
    double strength;
  };
  std::vector<Scatterer> all_;
};

/// The share of a scatterer's amplitude that comes back: next to nothing from behind the bone, more from behind blood, as gain over depth makes up for flesh.
inline double comes_back(Vector const& at, Thigh::Outline const& vein) {
  double const top = anatomy::bone * anatomy::bone - at.x() * at.x();
  if (top > 0 && at.y() < anatomy::middle(0) + std::sqrt(top) - 0.001) return 0.01;
  double const blood = opening(vein, at.x(), at.y());   // m, above the scatterer
  return std::pow(10.0, 2 * absorbed * frequency * 1e-6 * 100 * blood / 20);
}

/// The envelope of what the probe hears, rows downwards from its face, one column a beam:
///   |Σ s g(D − d) g(X − x) e^{2ik(D − d)}|,   k = 2π/λ, g Gaussians as wide as the pulse and as the beam at that depth
/// Source  \cite bamber1980: the echo is the tissue convolved with the pulse, and scatterers act each by itself.
inline Eigen::ArrayXXd scan(std::vector<Echo> const& echoes, Thigh::Outline const& vein, double face) {
  auto const rows = static_cast<Eigen::Index>(depth / pixel + 0.5), columns = static_cast<Eigen::Index>(width / pixel + 0.5);
  Eigen::MatrixXcd heard = Eigen::MatrixXcd::Zero(rows, columns);
  double const narrowing = std::sqrt(8 * std::log(2.0));   // full width at half of the height over σ
  struct Part {   // of a column or a row: a Gaussian as far as three σ
    Eigen::Index from, count;
    Eigen::VectorXd values;
    Part(double at, double sigma, Eigen::Index most)
        : from(std::clamp<Eigen::Index>(std::lround((at - 3 * sigma) / pixel), 0, most)),
          count(std::clamp<Eigen::Index>(std::lround((at + 3 * sigma) / pixel), from, most) - from),
          values(count) {
      for (Eigen::Index k = 0; k < count; ++k) {
        double const off = ((static_cast<double>(from + k) + 0.5) * pixel - at) / sigma;
        values[k] = std::exp(-off * off / 2);
      }
    }
  };
  for (Echo const& echo : echoes) {
    double const deep = face - echo.at.y(), spread = std::hypot(1, (deep - focus) / in_focus);
    Part const down(deep, pulse_length / narrowing, rows), side(echo.at.x() + width / 2, beam_width * spread / narrowing, columns);
    double const amplitude = echo.strength * comes_back(echo.at, vein) / std::sqrt(spread);
    heard.block(down.from, side.from, down.count, side.count) +=
        (std::polar(amplitude, -4 * pi * deep / wavelength) * down.values) * side.values.transpose();
  }
  return heard.array().abs();
}

/// Rows and columns of a picture, from a place [m] under the middle of the face.
struct Patch {
  Eigen::Index row, column, rows, columns;
  Patch(double across, double down, double wide, double high)
      : row(std::lround((down - high / 2) / pixel)), column(std::lround((across + (width - wide) / 2) / pixel)), rows(std::lround(high / pixel)),
        columns(std::lround(wide / pixel)) {}
  auto of(Eigen::ArrayXXd const& picture, Eigen::Index down = 0, Eigen::Index side = 0) const {
    return picture.block(row + down, column + side, rows, columns);
  }
};

/// Where a patch of one picture is found in another: how far to the side and down [m], and the correlation there.
struct Match {
  double across, down, correlation;
};
inline Match find_again(Eigen::ArrayXXd const& before, Eigen::ArrayXXd const& after, Patch const& patch, Eigen::Index farthest = 10) {
  auto const normalised = [](auto const& part) {
    Eigen::ArrayXXd const centred = part - part.mean();
    return Eigen::ArrayXXd(centred / std::sqrt(centred.square().sum()));
  };
  Eigen::ArrayXXd const sought = normalised(patch.of(before));
  Eigen::ArrayXXd found(2 * farthest + 1, 2 * farthest + 1);
  for (Eigen::Index d = -farthest; d <= farthest; ++d)
    for (Eigen::Index s = -farthest; s <= farthest; ++s) found(d + farthest, s + farthest) = (sought * normalised(patch.of(after, d, s))).sum();
  Eigen::Index row, column;
  double const best = found.maxCoeff(&row, &column);
  auto const finer = [&](Eigen::Index at, auto const& value) {   // the summit of a parabola through three
    if (at == 0 || at == 2 * farthest) return static_cast<double>(at - farthest);
    double const low = value(at - 1), high = value(at + 1);
    return static_cast<double>(at - farthest) + (low - high) / (2 * (low + high - 2 * best));
  };
  return {pixel * finer(column, [&](Eigen::Index k) { return found(row, k); }), pixel * finer(row, [&](Eigen::Index k) { return found(k, column); }), best};
}

}  // namespace echography
