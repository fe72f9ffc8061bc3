// SPDX-License-Identifier: MIT
// A linear array probe presses on a thigh, and its picture, made up here, follows: a vein flattens under it, the bone below stays where it is.
//   1  force and vein over the depth of the probe
//   2  the pictures at three depths, from scatterers that the tissue carries
//   3  patches of one picture found again in the next one, beside where the tissue has gone; contrast of the speckle beside its closed form
#include "../album.hpp"
#include "scan.hpp"
#include "thigh.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

namespace {

using namespace echography;

constexpr double depths[] = {0, 0.005, 0.010, 0.0105, 0.014, 0.018};   // m
constexpr double shown[] = {0, 0.010, 0.018}, from = 0.010, to = 0.0105;

struct Picture {
  Eigen::ArrayXXd envelope;
  std::vector<Echo> echoes;
  double face, depth, force;
};

/// Three pictures side by side, grey by the decibels below an envelope that is white, with a scale of depth. Two by two of what is heard make a dot.
drawing::Raster side_by_side(std::array<Picture const*, 3> const& pictures, double white) {
  constexpr int high = static_cast<int>(depth / pixel / 2 + 0.5), wide = static_cast<int>(width / pixel / 2 + 0.5), left = 44, top = 40, gap = 12;
  drawing::Raster raster{.name = "echography_pictures", .width = left + 3 * (wide + gap), .height = top + high + gap};
  raster.grey.assign(static_cast<std::size_t>(raster.width * raster.height), 0);
  auto const dot = [&](int x, int y) -> unsigned char& { return raster.grey[static_cast<std::size_t>(y * raster.width + x)]; };
  for (int k = 0; k < 3; ++k) {
    Picture const& picture = *pictures[static_cast<std::size_t>(k)];
    int const begin = left + k * (wide + gap);
    for (int y = 0; y < high; ++y)
      for (int x = 0; x < wide; ++x) {
        double const decibels = 10 * std::log10(picture.envelope.block(2 * y, 2 * x, 2, 2).square().mean() / (white * white) + 1e-12);
        dot(begin + x, top + y) = static_cast<unsigned char>(11 * std::lround(23 * std::clamp(1 + decibels / range, 0.0, 1.0)));
      }
    char text[80];
    std::snprintf(text, sizeof text, "%c   %.0f mm, %.2f N", 'a' + k, 1e3 * picture.depth, picture.force);
    raster.words.push_back({text, begin, 12});
  }
  for (int mm = 0; mm < static_cast<int>(1e3 * depth); mm += 5) {
    int const y = top + static_cast<int>(1e-3 * mm / pixel / 2 + 0.5);
    for (int x = left - (mm % 10 == 0 ? 8 : 5); x < left - 2; ++x) dot(x, y) = 200;
    if (mm % 10 == 0) raster.words.push_back({std::to_string(mm), 8, y - 7});
  }
  raster.words.push_back({"mm", 8, 12});
  return raster;
}

auto matrix_of(std::vector<Eigen::Vector3i> const& triangles) {
  return Eigen::Map<Eigen::Matrix3Xi const>(triangles.front().data(), 3, std::ssize(triangles));
}

/// What lies behind the plane of the picture.
Mesh half(Mesh const& mesh) {
  Mesh behind{mesh.points, {}};
  std::vector<Eigen::Vector3i> kept;
  for (Eigen::Vector3i const t : mesh.triangles.colwise())
    if (std::min({mesh.points(2, t[0]), mesh.points(2, t[1]), mesh.points(2, t[2])}) < 0) kept.push_back(t);
  behind.points.row(2) = behind.points.row(2).cwiseMin(-0.0003);
  behind.triangles = matrix_of(kept);
  return behind;
}

/// The thigh cut open in the plane of the picture, and the probe.
drawing::View scene(Thigh const& thigh) {
  auto const now = [&, positions = thigh.positions()](Mesh const& mesh) {
    palpate::EmbeddedSurface carried(mesh, thigh.mesh);
    carried.update(positions);
    return carried.mesh();
  };
  constexpr double rounding = 0.004, long_way = 0.03;
  Vector const box(Thigh::half_width, long_way, Thigh::half_thickness), middle(0, thigh.face() + long_way, 0);
  auto const rounded = [&](Vector const& p) { return ((p - middle).cwiseAbs() - box + Vector::Constant(rounding)).cwiseMax(0.0).norm() - rounding; };
  drawing::View view{.name = "echography_thigh",
                     .mesh = palpate::make_implicit<double>(rounded, {middle - 1.2 * box, middle + 1.2 * box}, 2500),
                     .from = Vector(0.35, 0.25, 1),
                     .up = Vector::UnitY(),
                     .colour = {0.75, 0.78, 0.80},
                     .parts = {{half(now(thigh.skin)), {0.80, 0.60, 0.50}}, {half(thigh.vein_wall()), {0.20, 0.28, 0.55}}}};
  // The cut, ring by ring from the bone to the skin, without what lies in the vein.
  constexpr int around = 180, steps[] = {1, 36, 5};
  constexpr double edges[] = {0, anatomy::bone, 0.0675 - anatomy::fat, 0.0675};
  constexpr std::array<double, 3> colours[] = {{0.93, 0.91, 0.84}, {0.60, 0.16, 0.15}, {0.93, 0.80, 0.48}};
  for (std::size_t layer = 0; layer < 3; ++layer) {
    Mesh ring{palpate::Matrix3X<double>(3, around * (steps[layer] + 1)), {}};
    std::vector<Eigen::Vector3i> triangles;
    auto const index = [](int r, int a) { return r * around + a % around; };
    for (int r = 0; r <= steps[layer]; ++r)
      for (int a = 0; a < around; ++a) {
        double const radius = edges[layer] + (edges[layer + 1] - edges[layer]) * std::max<double>(r, 1e-3) / steps[layer], angle = 2 * pi * a / around;
        ring.points.col(index(r, a)) << radius * std::sin(angle), anatomy::middle(0) + radius * std::cos(angle), 0;
      }
    for (int r = 0; r < steps[layer]; ++r)
      for (int a = 0; a < around; ++a)
        for (auto const& [i, j, k] : {std::array{index(r, a), index(r + 1, a), index(r, a + 1)}, {index(r, a + 1), index(r + 1, a), index(r + 1, a + 1)}})
          if (anatomy::outside_vein((ring.points.col(i) + ring.points.col(j) + ring.points.col(k)) / 3) > 0) triangles.emplace_back(i, j, k);
    ring.triangles = matrix_of(triangles);
    if (layer > 0) ring = now(ring), ring.points.row(2).setZero();
    view.parts.push_back({ring, colours[layer]});
  }
  return view;
}

drawing::Album example() {
  Thigh thigh;
  Scatterers const scatterers(thigh.mesh, palpate::Seed{24});
  std::printf("a thigh of %td tetrahedra\n%.1f MHz: wavelength %.3f mm, pulse %.2f mm long, beam %.2f mm wide at %.0f mm\n\n", thigh.mesh.tetrahedra.cols(),
              1e-6 * frequency, 1e3 * wavelength, 1e3 * pulse_length, 1e3 * beam_width, 1e3 * focus);

  drawing::Picture chart("echography_vein", "A vein under a linear array probe", "force on the probe [N]", "share of that at rest");
  chart.y().from = 0, chart.y().to = 1.1;
  auto& curve = chart.line(drawing::blue, "area of the vein");
  auto& flesh = chart.dashes(drawing::orange, "volume of the flesh");
  std::vector<Picture> pictures;
  drawing::Album album;
  double const at_rest = area(thigh.outline());
  std::printf("%10s %10s %12s %12s %12s %12s %12s\n", "depth [mm]", "force [N]", "vein [mm2]", "of at rest", "wide [mm]", "high [mm]", "flesh lost");
  for (double const d : depths) {
    thigh.press(d);
    auto const outline = thigh.outline();
    double const open = area(outline), lost = thigh.volume_lost();
    auto const [left, right] = std::ranges::minmax(outline, {}, [](auto const& side) { return side.first.x(); });
    double const wide = right.first.x() - left.first.x(), high = opening(outline, left.first.x() + wide / 2);
    std::printf("%10.1f %10.2f %12.1f %12.3f %12.2f %12.2f %12.5f\n", 1e3 * d, thigh.force(), 1e6 * open, open / at_rest, 1e3 * wide, 1e3 * high, lost);
    drawing::add(curve, thigh.force(), open / at_rest), drawing::add(flesh, thigh.force(), 1 - lost);
    auto echoes = scatterers.carried(thigh.positions());
    if (std::ranges::find(shown, d) == std::end(shown) && d != to) continue;
    auto envelope = scan(echoes, outline, thigh.face());
    pictures.push_back({std::move(envelope), std::move(echoes), thigh.face(), d, thigh.force()});
  }
  auto const at = [&](double d) -> Picture const& { return *std::ranges::find(pictures, d, &Picture::depth); };

  // Fully developed speckle: the envelope has the distribution of Rayleigh, whose mean over its deviation is √(π/(4 − π)) \cite burckhardt1978.
  auto const muscle = Patch(0.0105, 0.040, 0.013, 0.018).of(at(0).envelope);
  double const mean = muscle.mean(), deviation = std::sqrt((muscle - mean).square().mean());
  std::printf("\nspeckle of muscle: mean over deviation %.3f, of Rayleigh's distribution %.3f\n", mean / deviation, std::sqrt(pi / (4 - pi)));
  auto const level = [&](double d, Patch const& patch) { return 10 * std::log10(patch.of(at(d).envelope).square().mean() / muscle.square().mean() + 1e-6); };
  std::printf("dB of that: fat %.1f, vein %.1f, behind it %.1f and by hand %.1f, bone %.1f, behind it %.1f\n\n", level(0, {0.0, 0.0055, 0.020, 0.004}),
              level(0, {-0.006, 0.0262, 0.004, 0.004}), level(0, {-0.006, 0.041, 0.003, 0.014}), 2 * absorbed * frequency * 1e-6 * 200 * anatomy::vein,
              level(0, {0.0, 0.0545, 0.003, 0.0006}), level(0.018, {0.007, 0.061, 0.004, 0.005}));

  std::printf("from %.1f to %.1f mm, in mm to the right and up:\n%16s %18s %18s %12s\n", 1e3 * from, 1e3 * to, "patch", "in the picture", "tissue",
              "correlation");
  Picture const &before = at(from), &after = at(to);
  constexpr std::array<double, 2> places[] = {{0, 6}, {-12, 12}, {10, 12}, {-5, 27}, {9, 24}, {10, 35}, {-12, 35}};   // mm, across and down
  for (auto const& [across, down] : places) {
    auto const found = find_again(before.envelope, after.envelope, Patch(1e-3 * across, 1e-3 * down, 0.004, 0.003));
    Vector moved = Vector::Zero();   // of the scatterers in the patch
    int count = 0;
    for (std::size_t k = 0; k < before.echoes.size(); ++k) {
      Vector const p = before.echoes[k].at;
      if (std::abs(p.x() - 1e-3 * across) < 0.002 && std::abs(before.face - p.y() - 1e-3 * down) < 0.0015) moved += after.echoes[k].at - p, ++count;
    }
    moved *= 1e3 / count;
    std::printf("%8.0f %7.0f %9.3f %8.3f %9.3f %8.3f %12.4f\n", across, down, 1e3 * found.across, 1e3 * (after.face - before.face - found.down), moved.x(),
                moved.y(), found.correlation);
  }
  double aside = 0;
  for (Echo const& echo : at(0.018).echoes) aside = std::max(aside, std::abs(echo.at.z()));
  std::printf("scatterers leave the plane of the picture by %.2f mm at most\n\n", 1e3 * aside);

  album.charts.push_back(std::move(chart));
  album.views.push_back(scene(thigh));
  album.rasters.push_back(side_by_side({&at(shown[0]), &at(shown[1]), &at(shown[2])}, 12 * mean));   // the skin white, muscle in the middle
  return album;
}

}  // namespace

int main(int argc, char** argv) { return drawing::run_example("echography", argc, argv, example); }
