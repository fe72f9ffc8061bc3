// SPDX-License-Identifier: MIT
#include "catch.hpp"
#include "device/message.hpp"
#include "scratch_folder.hpp"
#include "skip.hpp"
#include "vtk/damage.hpp"

#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/measures.hpp>
#include <palpate/mesh/sphere.hpp>
#include <palpate/mesh/validation.hpp>
#include <palpate/tissue/finite_elements.hpp>
#include <palpate/tissue/solid_fields.hpp>
#include <palpate/volume/fill.hpp>
#include <palpate/volume/section.hpp>
#include <palpate/vtk/read_volume.hpp>
#include <palpate/vtk/section_picture.hpp>
#include <palpate/vtk/series.hpp>
#include <palpate/vtk/virtual_display.hpp>

#include <vtkCellData.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPNGReader.h>
#include <vtkPointData.h>
#include <vtkUnstructuredGrid.h>
#include <vtkXMLUnstructuredGridReader.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <random>
#include <string>

using namespace palpate;
using palpate_test::message_of, palpate_test::unsaid;

namespace {

// Written by hand after "VTK File Formats": two tetrahedra, the second inside out, a triangle, a vertex of none.
std::string const legacy = R"(# vtk DataFile Version 2.0
a solid
ASCII
DATASET UNSTRUCTURED_GRID
POINTS 6 double
0 0 0
1 0 0
0 1 0
0 0 1
1 1 1
9 9 9
CELLS 3 14
3 0 1 2
4 0 1 2 3
4 1 2 3 4
CELL_TYPES 3
5
10
10
)";
std::string const xml = R"(<?xml version="1.0"?>
<VTKFile type="UnstructuredGrid" version="0.1" byte_order="LittleEndian">
  <UnstructuredGrid>
    <Piece NumberOfPoints="6" NumberOfCells="3">
      <Points>
        <DataArray type="Float64" NumberOfComponents="3" format="ascii">0 0 0 1 0 0 0 1 0 0 0 1 1 1 1 9 9 9</DataArray>
      </Points>
      <Cells>
        <DataArray type="Int64" Name="connectivity" format="ascii">0 1 2 0 1 2 3 1 2 3 4</DataArray>
        <DataArray type="Int64" Name="offsets" format="ascii">3 7 11</DataArray>
        <DataArray type="UInt8" Name="types" format="ascii">5 10 10</DataArray>
      </Cells>
    </Piece>
  </UnstructuredGrid>
</VTKFile>
)";
std::string with(std::string text, std::string const& what, std::string const& by) {
  auto const at = text.find(what);
  REQUIRE(at != std::string::npos);
  return text.replace(at, what.size(), by);
}

}  // namespace

TEMPLATE_TEST_CASE("VTK and Gmsh volumes are read in metres, turned and without unused vertices", "[vtk][read_volume]", PALPATE_TEST_SCALARS) {
  ScratchFolder const folder;
  std::string const gmsh = "$NOD\n5\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n5 1 1 1\n$ENDNOD\n$ELM\n2\n1 4 1 1 4 1 2 3 4\n2 4 1 1 4 2 3 4 5\n$ENDELM\n";
  for (auto const& file : {folder.write("a.vtk", legacy), folder.write("b.VTU", xml), folder.write("c.msh", gmsh)}) {
    auto const mesh = read_volume<TestType>(file, 0.01);
    INFO(file.string());
    CHECK(mesh.points.cols() == 5);
    REQUIRE(mesh.tetrahedra.cols() == 2);
    CHECK(validate(mesh).empty());
    CHECK(volume(mesh) == Approx(1e-6 / 2).epsilon(1e-5));   // 1/6 + 1/3 by determinants
  }
}

TEST_CASE("what is wrong with a volume's file is said in one line", "[vtk][read_volume][error]") {
  ScratchFolder const folder;
  auto const says = [&](std::string const& name, std::string const& text, auto const&... words) {
    auto const file = folder.write(name, text);
    std::string const said = message_of([&] { read_volume(file); });
    CHECK(unsaid(said, name, words...) == "");
    CHECK(said.find('\n') == std::string::npos);
    CHECK_THROWS_AS(read_volume(file), FileError);
  };
  says("a.stl", legacy, ".stl", "fill");
  says("a.vtk", "", "empty");
  says("a.vtk", legacy.substr(0, legacy.find("4 1 2 3 4")), "CELLS");
  says("a.vtk", with(legacy, "10\n10\n", "10\n12\n"), "cell 2", "type 12");
  says("a.vtk", with(legacy, "4 1 2 3 4", "4 1 2 3 7"), "cell 2 refers to vertex 7", "vertices 0 … 5");
  says("a.vtk", with(legacy, "4 1 2 3 4", "4 1 2 3 300000000"), "CELLS: cell 2", "vertex 300000000");
  says("a.vtu", with(xml, "1 2 3 4<", "1 2 3 30000000<"), "cell 2 refers to vertex 30000000", "vertices 0 … 5");
  says("a.vtk", with(legacy, "4 1 2 3 4", "4 1 2 3 3"), "more than once");
  says("a.vtk", with(legacy, "0 0 1\n", "0 0 nan\n"), "z coordinate of vertex 3 is not a finite number (nan)");
  says("a.vtk", with(legacy, "0 1 0\n", "0 -inf 0\n"), "y coordinate of vertex 2 is not a finite number (-inf)");
  says("a.vtk", with(legacy, "0 0 1\n", "1 1 0\n"), "no volume");
  says("a.vtk", "# vtk DataFile Version 2.0\nx\nASCII\nDATASET POLYDATA\nPOINTS 3 float\n0 0 0 1 0 0 0 1 0\nPOLYGONS 1 4\n3 0 1 2\n", "no unstructured grid");
  says("a.vtk", with(legacy, "CELLS 3 14", "CELLSe3 14"), "CELLS");   // VTK takes it for CELLS 14 …, and writes beyond its list
  says("a.vtk", with(legacy, "CELL_TYPES 3", "CELL_TYPES 30"), "30 types");
  says("a.vtk", with(legacy, "CELL_TYPES 3\n5\n", "CELL_TYPES 2\n"), "3 cells and 2 types");   // in version 5 there is one type fewer than offsets
  says("a.vtk", with(legacy, "10\n10\n", "10\n42\n"), "cell 2", "polyhedron");
  says("a.vtk", with(legacy, "UNSTRUCTURED_GRID", "TABLE"), "no unstructured grid", "\"TABLE\"");
  for (std::string const value : {"-5", "99999999999", "3x", ""}) {
    says("a.vtu", with(xml, "NumberOfCells=\"3\"", "NumberOfCells = '" + value + "'"), "NumberOfCells is \"" + value + "\"", "damaged");
    says("a.vtu", with(xml, "NumberOfPoints=\"6\"", "NumberOfPoints=\"" + value + "\""), "NumberOfPoints is \"" + value + "\"", "damaged");
  }
  says("a.vtu", xml.substr(0, xml.size() / 2), "cut short");
  says("a.vtu", with(xml, "5 10 10", "5 5 5"), "no tetrahedra");
  std::string const long_one = with(legacy, "0 0 1\n", "0 0 163\n");
  says("a.vtk", long_one, "read in metres, the longest side would be 163 m", "in mm it would be 0.163 m", "metres_per_unit");
  CHECK(read_volume(folder.write("a.vtk", long_one), 1.0).points(2, 3) == 163);
  CHECK(unsaid(message_of([&] { read_volume(folder.path() / "none.vtk"); }), "none.vtk", "exist") == "");
}

TEST_CASE("a legacy volume may be in lower case, of version 5.1, and have data whose names are keywords", "[vtk][read_volume]") {
  ScratchFolder const folder;
  std::string lower = legacy;
  for (char& c : lower) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  lower.replace(0, lower.find('\n'), legacy, 0, legacy.find('\n'));
  std::string const offsets = with(with(legacy, "Version 2.0", "Version 5.1"), "CELLS 3 14\n3 0 1 2\n4 0 1 2 3\n4 1 2 3 4\n",
                                   "CELLS 4 11\nOFFSETS vtktypeint64\n0 3 7 11\nCONNECTIVITY vtktypeint64\n0 1 2 0 1 2 3 1 2 3 4\n");
  std::string const fields = legacy + "POINT_DATA 6\nSCALARS points int 1\nLOOKUP_TABLE default\n0 1 2 3 4 5\nCELL_DATA 3\nSCALARS cells int\nLOOKUP_TABLE default\n0 1 2\n";
  for (auto const& text : {lower, offsets, fields}) {
    INFO(text);
    CHECK(read_volume(folder.write("a.vtk", text)).tetrahedra.cols() == 2);
  }
  // What compresses well announces more points than the file has bytes.
  CHECK(message_of([&] { read_volume(folder.write("a.vtu", with(with(xml, "NumberOfCells=\"3\"", "NumberOfCells=\"9999\""), "version=", "compressor=\"vtkZLibDataCompressor\" version="))); })
            .find("NumberOfCells") == std::string::npos);
}

// 10⁵ in the long run; see CONTRIBUTING.md.
TEST_CASE("a damaged volume's file gives an error or a mesh, nothing worse", "[vtk][read_volume][fuzz]") {
  ScratchFolder const folder;
  std::mt19937_64 random(11);
  int read = 0, refused = 0;
  char const* const wanted = std::getenv("PALPATE_VTK_FILES");
  int const rounds = wanted != nullptr ? std::atoi(wanted) : 600;
  for (int round = 0; round < rounds; ++round) {
    std::string text = round % 2 == 0 ? legacy : xml;
    palpate_test::damage(text, random);
    auto const file = folder.write(round % 2 == 0 ? "a.vtk" : "a.vtu", text);
    try {
      if (!validate(read_volume(file, 1.0)).empty()) FAIL("an invalid mesh was read from:\n" << text);
      ++read;
    } catch (FileError const&) {
      ++refused;
    }
  }
  CHECK(read > rounds / 30);
  CHECK(refused > rounds / 6);
}

// Yardstick: VTK's own reader.
TEST_CASE("a series of a solid has its shape, displacement, stress and energy", "[vtk][series]") {
  ScratchFolder const folder;
  auto const mesh = make_block<double>(3, 3, 3, 0.01, BlockPattern::alternating);
  FiniteElements<double, StableNeoHookean<double>> const tissue(mesh, {.density = 1000, .material = {3000, 0.4}});
  Matrix3X<double> x = mesh.points;
  x.row(2) *= 0.9;
  x(0, 13) += 0.001;
  Matrix3X<double> const displacement = x - mesh.points;
  auto const fields = solid_fields(tissue, x);
  SeriesWriter series(folder.path() / "solid.pvd");
  series.add(0.0, TetrahedralMesh<double>{x, mesh.tetrahedra}, displacement, fields);
  auto const file = folder.path() / "solid" / "solid_0000.vtu";
  CHECK(ScratchFolder::read(series.path()).find("solid/solid_0000.vtu") != std::string::npos);
  auto const back = read_volume(file);
  CHECK(back.tetrahedra == mesh.tetrahedra);
  CHECK((back.points - x).cwiseAbs().maxCoeff() < 1e-8);   // stored as float
  vtkNew<vtkXMLUnstructuredGridReader> reader;
  reader->SetFileName(file.string().c_str());
  reader->Update();
  auto* const cells = reader->GetOutput()->GetCellData();
  auto* const stress = cells->GetArray("stress");
  REQUIRE(stress != nullptr);
  REQUIRE(stress->GetNumberOfComponents() == 6);
  REQUIRE(stress->GetNumberOfTuples() == mesh.tetrahedra.cols());
  for (Eigen::Index t = 0; t < mesh.tetrahedra.cols(); ++t) {
    int const i = static_cast<int>(t);
    for (int k = 0; k < 6; ++k) CHECK(stress->GetComponent(i, k) == Approx(fields.stress(k, t)).epsilon(1e-6).margin(1e-3));
    CHECK(cells->GetArray("von Mises stress")->GetTuple1(i) == Approx(fields.von_mises[t]).epsilon(1e-6));
    CHECK(cells->GetArray("strain energy density")->GetTuple1(i) == Approx(fields.energy_density[t]).epsilon(1e-6));
    CHECK(cells->GetArray("volume ratio")->GetTuple1(i) == Approx(fields.determinant[t]).epsilon(1e-6));
  }
  CHECK(reader->GetOutput()->GetPointData()->GetArray("displacement")->GetComponent(13, 0) == Approx(0.001).epsilon(1e-5));
  CHECK_THROWS_AS(series.add(0.1, make_block<double>(2, 2, 2, 0.01), displacement, fields), InvalidArgument);
  CHECK_THROWS_AS(series.add(0.1, TetrahedralMesh<double>{x, mesh.tetrahedra}, Matrix3X<double>(3, 2), fields), InvalidArgument);
  auto short_of_one = fields;
  short_of_one.stress.conservativeResize(Eigen::NoChange, 2);   // a file that no reader takes
  CHECK_THROWS_WITH(series.add(0.1, mesh, displacement, short_of_one), says("tetrahedra and fields of 2"));
  auto torn = mesh;
  torn.tetrahedra(0, 5) = 999;
  CHECK_THROWS_WITH(series.add(0.1, torn, displacement, fields), says("tetrahedron 5 names vertex 999"));
  CHECK(series.frames() == 1);
}

// Yardstick: viridis from dark violet to yellow, by where the values are.
TEST_CASE("a picture of a section shows values in their colours", "[vtk][section_picture]") {
  VirtualDisplay const display;
  if (!display.ready()) PALPATE_SKIP(display.problem());
  ScratchFolder const folder;
  auto const ball = fill(make_sphere<double>(0.03, 6), {.edge = 0.004}).mesh;
  Matrix<double, Dynamic, 1> values(ball.tetrahedra.cols());
  for (Eigen::Index t = 0; t < values.size(); ++t) {
    double x = 0;
    for (int c = 0; c < 4; ++c) x += ball.points(0, ball.tetrahedra(c, t)) / 4;
    values[t] = x;
  }
  Vector3<double> const normal(0, -1, 0);
  auto const file = folder.path() / "section.png";
  write_section_picture(file, section<double>(ball, Vector3<double>::Zero(), normal), values, surface(ball), normal, {.width = 400, .height = 300});
  vtkNew<vtkPNGReader> png;
  png->SetFileName(file.string().c_str());
  png->Update();
  REQUIRE(png->GetOutput()->GetDimensions()[0] == 400);
  auto const at = [&](int x, int y) {
    std::array<int, 3> rgb;
    for (int c = 0; c < 3; ++c) rgb[static_cast<std::size_t>(c)] = static_cast<int>(png->GetOutput()->GetScalarComponentAsDouble(x, y, 0, c));
    return rgb;
  };
  auto const left = at(120, 150), right = at(280, 150), corner = at(5, 5);
  CHECK(left[2] > left[1]);            // violet
  CHECK(right[1] > right[2] + 60);     // yellow
  CHECK(corner == std::array{255, 255, 255});
  // Of one value, the section is in its colour, to the bit almost, whatever tissue is before it: 0.993, 0.906, 0.144 is viridis' end.
  values.setConstant(2.0);
  write_section_picture(file, section<double>(ball, Vector3<double>::Zero(), normal), values, surface(ball), normal, {.width = 300, .height = 600, .range = {{1.0, 2.0}}});
  png->Modified(), png->Update();
  CHECK(std::abs(at(150, 300)[0] - 253) <= 1);
  CHECK(std::abs(at(150, 300)[1] - 231) <= 1);
  // Nothing of the ball leaves a picture that is taller than wide.
  int coloured = 0;
  for (int y = 0; y < 600; ++y) coloured += at(0, y) == std::array{255, 255, 255} ? 0 : 1;
  CHECK(coloured == 0);
  CHECK_THROWS_AS(write_section_picture(file, section<double>(ball, {0, 0, 1}, {0, 0, 1}), values, surface(ball), normal), InvalidArgument);
  CHECK_THROWS_AS(write_section_picture(file, section<double>(ball, {0, 0, 0}, {0, 0, 1}), values.head(3), surface(ball), normal), InvalidArgument);
}
