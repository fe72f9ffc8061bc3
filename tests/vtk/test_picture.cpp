// SPDX-License-Identifier: MIT
#include "catch.hpp"
#include "scratch_folder.hpp"
#include "skip.hpp"

#include <palpate/mesh/grid.hpp>
#include <palpate/mesh/sphere.hpp>
#include <palpate/vtk/chart.hpp>
#include <palpate/vtk/picture.hpp>

#include <vtkImageData.h>
#include <vtkPNGReader.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <string>
#include <vector>

using namespace palpate;

namespace {

/// A picture as VTK's reader gives it back, pixel by pixel.
class Pixels {
 public:
  explicit Pixels(std::filesystem::path const& file) {
    reader_->SetFileName(file.string().c_str());
    reader_->Update();
  }
  int width() const { return reader_->GetOutput()->GetDimensions()[0]; }
  int height() const { return reader_->GetOutput()->GetDimensions()[1]; }
  /// From the left and the top, 0 … 1.
  std::array<int, 3> at(double across, double down) const {
    std::array<int, 3> rgb;
    for (int c = 0; c < 3; ++c)
      rgb[static_cast<std::size_t>(c)] = static_cast<int>(reader_->GetOutput()->GetScalarComponentAsDouble(
          int(across * (width() - 1)), int((1 - down) * (height() - 1)), 0, c));
    return rgb;
  }
  /// How many pixels look like `wanted`, each channel within 12 of 255.
  int count(std::array<int, 3> const& wanted) const {
    int found = 0;
    for (int y = 0; y < height(); ++y)
      for (int x = 0; x < width(); ++x) {
        bool same = true;
        for (int c = 0; c < 3; ++c)
          same = same && std::abs(reader_->GetOutput()->GetScalarComponentAsDouble(x, y, 0, c) - wanted[static_cast<std::size_t>(c)]) <= 12;
        found += same;
      }
    return found;
  }

 private:
  vtkNew<vtkPNGReader> reader_;
};

bool red(std::array<int, 3> const& rgb) { return rgb[0] > rgb[1] + 40 && rgb[0] > rgb[2] + 40; }

/// Without the triangles of the northern cap: a wound to look into.
TriangleMesh<double> opened(TriangleMesh<double> const& mesh, double height) {
  TriangleMesh<double> open{mesh.points, mesh.triangles};
  int kept = 0;
  for (int t = 0; t < mesh.triangles.cols(); ++t) {
    bool const cap = mesh.points(2, mesh.triangles(0, t)) > height && mesh.points(2, mesh.triangles(1, t)) > height &&
                     mesh.points(2, mesh.triangles(2, t)) > height;
    if (!cap) open.triangles.col(kept++) = mesh.triangles.col(t);
  }
  open.triangles.conservativeResize(3, kept);
  return open;
}

}  // namespace

// Yardstick: where a ball, a hole and a tool must be seen, by the geometry of the camera.
TEST_CASE("a picture shows the tissue, the wound and the tool", "[vtk][picture]") {
  VirtualDisplay const display;
  if (!display.ready()) PALPATE_SKIP(display.problem());
  ScratchFolder const folder;
  auto const ball = make_sphere<double>(0.05, 3);
  Camera const above = looking_at(Vector3<double>::Zero(), 0.08, {0.0, -0.2, 1.0}, {0.0, 1.0, 0.0});
  PictureStyle const small{.width = 320, .height = 240};

  write_picture(folder.path() / "closed.png", ball, above, std::nullopt, small);
  Pixels const closed(folder.path() / "closed.png");
  REQUIRE(closed.width() == 320);
  REQUIRE(closed.height() == 240);
  CHECK(red(closed.at(0.5, 0.5)));
  CHECK_FALSE(red(closed.at(0.05, 0.5)));

  write_picture(folder.path() / "open.png", opened(ball, 0.04), above, std::nullopt, small);
  Pixels const open(folder.path() / "open.png");
  CHECK(open.at(0.5, 0.5)[0] < closed.at(0.5, 0.5)[0] / 2);   // dark inside
  CHECK(red(open.at(0.5, 0.75)));

  PictureTool const tool{.tip = {0.0, 0.0, 0.05}, .axis = {1.0, 0.0, 0.3}, .edge = {-1.0, 0.0, 0.0}};
  write_picture(folder.path() / "tool.png", ball, above, tool, small);
  Pixels const with_tool(folder.path() / "tool.png");
  CHECK_FALSE(red(with_tool.at(0.75, 0.46)));   // the handle lies to the right
  CHECK(red(with_tool.at(0.3, 0.5)));

  PicturePart const green{.mesh = make_sphere<double>(0.06, 2), .colour = {0.0, 0.8, 0.0}};   // round the ball
  write_picture(folder.path() / "part.png", ball, above, std::nullopt, small, std::array{green});
  auto const part = Pixels(folder.path() / "part.png").at(0.5, 0.5);
  CHECK((part[1] > 2 * part[0] && part[1] > 2 * part[2]));

  for (auto const& entry : std::filesystem::directory_iterator(folder.path())) CHECK(entry.path().extension() == ".png");
  CHECK_THROWS_AS(write_picture(folder.path() / "none" / "a.png", ball, above, tool, small), FileError);
  CHECK_THROWS_AS(write_picture(folder.path() / "a.png", ball, above, tool, {.width = 0}), InvalidArgument);
  CHECK_THROWS_AS(looking_at(Vector3<double>::Zero(), 0.0, {0, 0, 1}, {0, 1, 0}), InvalidArgument);
}

// Yardstick: of a square seen from straight above the diagonal goes through the middle of the picture, and each triangle's centroid is a sixth of the side away.
TEST_CASE("a picture shows the edges of triangles where it is asked to", "[vtk][picture]") {
  VirtualDisplay const display;
  if (!display.ready()) PALPATE_SKIP(display.problem());
  ScratchFolder const folder;
  TriangleMesh<double> square{Matrix3X<double>(3, 4), Matrix<int, 3, Dynamic>(3, 2)};
  square.points << -0.05, 0.05, 0.05, -0.05, -0.05, -0.05, 0.05, 0.05, 0.0, 0.0, 0.0, 0.0;
  square.triangles << 0, 0, 1, 2, 2, 3;
  Camera const above = looking_at(Vector3<double>::Zero(), 0.08, {0.0, 0.0, 1.0}, {0.0, 1.0, 0.0});
  for (double const width : {0.0, 4.0}) {
    CAPTURE(width);
    PictureStyle const style{.width = 240, .height = 240, .lines = {0.0, 0.0, 0.0}, .line_width = width, .wound_depth = 0.0};
    write_picture(folder.path() / "square.png", square, above, std::nullopt, style);
    Pixels const picture(folder.path() / "square.png");
    CHECK(red(picture.at(0.5, 0.5)) == (width == 0.0));
    CHECK(red(picture.at(0.4, 0.4)));
    CHECK(red(picture.at(0.6, 0.6)));
  }
}

// Yardstick: the colours that the phases are documented to have, and their absence where the phase is absent.
TEST_CASE("a chart shows each phase in its colour, and the way back in one of its own", "[vtk][chart]") {
  VirtualDisplay const display;
  if (!display.ready()) PALPATE_SKIP(display.problem());
  ScratchFolder const folder;
  std::vector<ForceSample> samples;
  for (int i = 0; i < 300; ++i) {
    CuttingPhase const phase = i < 100 ? CuttingPhase::no_contact : i < 200 ? CuttingPhase::indenting : CuttingPhase::moving;
    samples.push_back({0.01 * i, 1e-4 * i, i < 100 ? 0.0 : 0.01 * i, phase});
  }
  samples[150].force = std::numeric_limits<double>::quiet_NaN();   // left out
  ChartStyle const style{.width = 640, .height = 400, .title = {}};
  for (auto const& [name, write] : {std::pair{"time.png", &write_force_time_chart}, std::pair{"depth.png", &write_force_depth_chart}}) {
    CAPTURE(name);
    write(folder.path() / name, samples, style);
    Pixels const chart(folder.path() / name);
    CHECK(chart.width() == 640);
    CHECK(chart.at(0.99, 0.02) == std::array{255, 255, 255});
    CHECK(chart.count({128, 128, 128}) > 100);
    CHECK(chart.count({0, 114, 178}) > 100);
    CHECK(chart.count({213, 94, 0}) > 100);
    CHECK(chart.count({0, 158, 115}) == 0);   // the tool never comes back
  }
  // Up and down by less than a fiftieth of the depth is a tremor; from the deepest point on the way back is drawn, up to it and no further.
  for (int i = 300; i < 340; ++i) samples.push_back({0.01 * i, 0.03 - (i % 2 == 0 ? 5e-4 : 0.0), 3.0, CuttingPhase::moving});
  write_force_depth_chart(folder.path() / "tremor.png", samples, style);
  CHECK(Pixels(folder.path() / "tremor.png").count({0, 158, 115}) == 0);
  for (int i = 340; i < 500; ++i) samples.push_back({0.01 * i, 0.03 - 1e-4 * (i - 339), 1.0, CuttingPhase::moving});
  write_force_depth_chart(folder.path() / "loop.png", samples, style);
  CHECK(Pixels(folder.path() / "loop.png").count({0, 158, 115}) > 100);
  CHECK(Pixels(folder.path() / "loop.png").count({213, 94, 0}) > 100);
  samples.resize(100);
  write_force_time_chart(folder.path() / "air.png", samples, style);
  CHECK(Pixels(folder.path() / "air.png").count({213, 94, 0}) == 0);
  CHECK_THROWS_AS(write_force_time_chart(folder.path() / "none.png", {}, style), InvalidArgument);
}

TEST_CASE("without a display a picture is refused, not a crash", "[vtk][picture][error]") {
  char const* const found = std::getenv("DISPLAY");
  std::string const before = found != nullptr ? found : "";
  setenv("DISPLAY", ":9999", 1);
  bool const drawn = display_available();
  ScratchFolder const folder;
  if (!drawn) {   // a VTK that draws without X always can
    try {
      write_picture(folder.path() / "a.png", make_grid<double>(2, 2, 0.1), Camera{});
      FAIL("no display was needed");
    } catch (FileError const& error) {
      CHECK(std::string(error.what()).find("there is no X display") != std::string::npos);
    }
  }
  if (found != nullptr)
    setenv("DISPLAY", before.c_str(), 1);
  else
    unsetenv("DISPLAY");
}

// Yardstick: the perspective of a pinhole, point by point; `view_angle` spans the shorter side.
TEST_CASE("a framed mesh is in the picture as a whole, and fills it", "[vtk][picture]") {
  auto mesh = make_sphere<double>(0.05, 6);
  mesh.points.row(0) *= 3.0;
  mesh.points.row(1).array() += 0.4;
  for (double const aspect : {4.0 / 3.0, 1.0, 0.5})
    for (Vector3<double> const& from : {Vector3<double>(0.1, -0.7, 0.8), Vector3<double>(1.0, 0.3, 0.1), Vector3<double>(-0.2, 0.1, -3.0)}) {
      Camera const camera = framing(mesh, from, {0.1, 0.9, 0.3}, aspect);
      Vector3<double> const ahead = (camera.target - camera.position).normalized(), right = ahead.cross(camera.up).normalized();
      double const half = std::tan(camera.view_angle / 2 * 3.14159265358979323846 / 180.0);
      double widest = 0.0;
      for (Eigen::Index i = 0; i < mesh.points.cols(); ++i) {
        Vector3<double> const p = mesh.points.col(i) - camera.position;
        REQUIRE(p.dot(ahead) > 0.0);
        widest = std::max({widest, std::abs(p.dot(right)) / p.dot(ahead) / (half * std::max(1.0, aspect)),
                           std::abs(p.dot(right.cross(ahead))) / p.dot(ahead) / (half * std::max(1.0, 1.0 / aspect))});
      }
      CHECK(widest <= 0.94 + 1e-9);
      CHECK(widest > 0.9);
      CHECK(ahead.dot(from) < 0.0);
    }
  CHECK_THROWS_AS(framing(mesh, {0, 0, 1}, {0, 0, 2}), InvalidArgument);
  CHECK_THROWS_AS(framing(TriangleMesh<double>{Matrix3X<double>(3, 0), Matrix<int, 3, Dynamic>(3, 0)}, {0, 0, 1}, {0, 1, 0}), InvalidArgument);
}
