// SPDX-License-Identifier: MIT
#include "catch.hpp"
#include "scratch_folder.hpp"

#include <palpate/mesh/grid.hpp>
#include <palpate/vtk/read_mesh.hpp>
#include <palpate/vtk/series.hpp>

#include <filesystem>
#include <limits>
#include <string>

using namespace palpate;

// Yardstick: the .pvd text written out by hand, and VTK's own reader for the frames.
TEMPLATE_TEST_CASE("a series names its frames and each frame reads back", "[vtk][series]", PALPATE_TEST_SCALARS) {
  ScratchFolder const folder;
  SeriesWriter series(folder.path() / "a" / "tissue.pvd");
  CHECK(ScratchFolder::read(series.path()) ==
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\">\n  <Collection>\n  </Collection>\n</VTKFile>\n");

  auto mesh = make_grid<TestType>(3, 2, TestType(0.01));
  series.add(0.0, mesh);
  Matrix3X<TestType> displacement = Matrix3X<TestType>::Zero(3, mesh.points.cols());
  displacement(2, 4) = TestType(-0.005);
  mesh.points += displacement;
  series.add(0.04, mesh, displacement);
  auto const larger = make_grid<TestType>(4, 2, TestType(0.01));
  series.add(0.08, larger);

  CHECK(series.frames() == 3);
  CHECK(ScratchFolder::read(series.path()) ==
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\">\n  <Collection>\n"
        "    <DataSet timestep=\"0\" part=\"0\" file=\"tissue/tissue_0000.vtp\"/>\n"
        "    <DataSet timestep=\"0.04\" part=\"0\" file=\"tissue/tissue_0001.vtp\"/>\n"
        "    <DataSet timestep=\"0.08\" part=\"0\" file=\"tissue/tissue_0002.vtp\"/>\n"
        "  </Collection>\n</VTKFile>\n");
  auto const read = read_mesh<TestType>(folder.path() / "a" / "tissue" / "tissue_0001.vtp");
  CHECK(read.triangles == mesh.triangles);
  CHECK((read.points - mesh.points).cwiseAbs().maxCoeff() <= TestType(1e-9));   // stored as float
  CHECK(read_mesh<TestType>(folder.path() / "a" / "tissue" / "tissue_0002.vtp").points.cols() == 8);
  for (auto const& entry : std::filesystem::recursive_directory_iterator(folder.path()))
    if (entry.is_regular_file()) CHECK((entry.path().extension() == ".vtp" || entry.path().extension() == ".pvd"));
}

TEST_CASE("a series refuses what ParaView could not show", "[vtk][series][error]") {
  ScratchFolder const folder;
  auto const mesh = make_grid<double>(2, 2, 0.01);
  CHECK_THROWS_AS(SeriesWriter(folder.path() / "tissue.vtp"), InvalidArgument);
  // A folder below a regular file can not be made, whoever asks.
  CHECK_THROWS_AS(SeriesWriter(folder.write("file", "x") / "tissue.pvd"), FileError);
  SeriesWriter series(folder.path() / "tissue.pvd");
  CHECK_THROWS_WITH(series.add(std::numeric_limits<double>::quiet_NaN(), mesh), says("frame 0 is at nan s; give a finite time"));
  series.add(0.1, mesh);
  CHECK_THROWS_AS(series.add(0.1, mesh), InvalidArgument);
  Matrix3X<double> const three = Matrix3X<double>::Zero(3, 3);
  CHECK_THROWS_AS(series.add(0.2, mesh, three), InvalidArgument);
  CHECK(series.frames() == 1);
}
