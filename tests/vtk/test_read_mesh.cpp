// SPDX-License-Identifier: MIT
#include "catch.hpp"
#include "scratch_folder.hpp"
#include "vtk/damage.hpp"

#include <palpate/core/units.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/sphere.hpp>
#include <palpate/vtk/detail/poly_data.hpp>
#include <palpate/vtk/detail/unstructured_grid.hpp>
#include <palpate/vtk/read_mesh.hpp>
#include <palpate/vtk/read_volume.hpp>

#include <Eigen/Dense>
#include <vtkDataSet.h>
#include <vtkFieldData.h>
#include <vtkFloatArray.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkPolyDataWriter.h>
#include <vtkStringArray.h>
#include <vtkUnstructuredGrid.h>
#include <vtkUnstructuredGridWriter.h>
#include <vtkXMLPolyDataReader.h>
#include <vtkXMLPolyDataWriter.h>
#include <vtkXMLWriter.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <iostream>
#include <random>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

using namespace palpate;

namespace {

// The yardstick of this file: a tetrahedron written down by hand, once per format.
constexpr double corners[4][3] = {{0, 0, 0}, {2, 0, 0}, {0, 3, 0}, {0, 0, 4}};
constexpr int faces[4][3] = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};

std::string const obj =
    "# a comment\nmtllib none\nv 0 0 0\nv 2 0 0\nv 0 3 0\nv 0 0 4\nvn 0 0 1\nvt 0 0\n"
    "f 1//1 3//1 2//1\nf 1/1/1 2/1/1 4/1/1\nf -4 -1 -2\nf 2 3 4\n";

std::string const stl_text = [] {
  std::ostringstream out;
  out << "solid tetrahedron\n";
  for (auto const& face : faces) {
    out << " facet normal 0 0 0\n  outer loop\n";
    for (int const corner : face)
      out << "   vertex " << corners[corner][0] << ' ' << corners[corner][1] << ' ' << corners[corner][2] << '\n';
    out << "  endloop\n endfacet\n";
  }
  out << "endsolid tetrahedron\n";
  return out.str();
}();

template <class Value>
void append(std::string& bytes, Value value) {
  bytes.append(reinterpret_cast<char const*>(&value), sizeof value);   // little-endian, as the machines we test on
}

std::string const stl_binary = [] {
  std::string bytes(80, ' ');
  append(bytes, std::uint32_t{4});
  for (auto const& face : faces) {
    for (int i = 0; i < 3; ++i) append(bytes, 0.0f);
    for (int const corner : face)
      for (double const x : corners[corner]) append(bytes, static_cast<float>(x));
    append(bytes, std::uint16_t{0});
  }
  return bytes;
}();

std::string const ply_text =
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 4\nproperty list uchar int vertex_indices\nend_header\n"
    "0 0 0\n2 0 0\n0 3 0\n0 0 4\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";

std::string const ply_binary = [] {
  std::string bytes =
      "ply\nformat binary_little_endian 1.0\nelement vertex 4\nproperty double x\nproperty double y\nproperty double z\n"
      "element face 4\nproperty list uchar int vertex_indices\nend_header\n";
  for (auto const& corner : corners)
    for (double const x : corner) append(bytes, x);
  for (auto const& face : faces) {
    append(bytes, std::uint8_t{3});
    for (int const corner : face) append(bytes, std::int32_t{corner});
  }
  return bytes;
}();

std::string const vtk_text =
    "# vtk DataFile Version 3.0\ntetrahedron\nASCII\nDATASET POLYDATA\nPOINTS 4 double\n0 0 0\n2 0 0\n0 3 0\n0 0 4\n"
    "POLYGONS 4 16\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";

std::string const vtk_volume =
    "# vtk DataFile Version 3.0\ntetrahedron\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 double\n0 0 0\n2 0 0\n0 3 0\n0 0 4\n"
    "CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\n";

std::string const vtp =
    "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"0.1\" byte_order=\"LittleEndian\">\n<PolyData>\n"
    "<Piece NumberOfPoints=\"4\" NumberOfPolys=\"4\">\n<Points>\n<DataArray type=\"Float64\" NumberOfComponents=\"3\" format=\"ascii\">"
    "0 0 0 2 0 0 0 3 0 0 0 4</DataArray>\n</Points>\n<Polys>\n"
    "<DataArray type=\"Int64\" Name=\"connectivity\" format=\"ascii\">0 2 1 0 1 3 0 3 2 1 2 3</DataArray>\n"
    "<DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\">3 6 9 12</DataArray>\n</Polys>\n</Piece>\n</PolyData>\n</VTKFile>\n";

struct Format {
  char const* file;
  std::string const* bytes;
};
std::array<Format, 8> const formats{{{"t.obj", &obj},
                                     {"t.stl", &stl_text},
                                     {"b.STL", &stl_binary},
                                     {"t.ply", &ply_text},
                                     {"b.ply", &ply_binary},
                                     {"t.vtk", &vtk_text},
                                     {"v.vtk", &vtk_volume},
                                     {"t.vtp", &vtp}}};

/// The error's text, without the folder; says so when there was none.
std::string error_of(std::filesystem::path const& file) {
  try {
    (void)read_mesh<double>(file);
  } catch (FileError const& error) {
    std::string const text = error.what(), folder = file.parent_path().string() + "/";
    CHECK(text.find('\n') == std::string::npos);
    return text.starts_with(folder) ? text.substr(folder.size()) : text;
  }
  return "no error";
}

/// What the code under test prints to std::cerr; the reader must stay silent.
class ErrorStream {
 public:
  ErrorStream() : before_(std::cerr.rdbuf(kept_.rdbuf())) {}
  ~ErrorStream() { std::cerr.rdbuf(before_); }
  ErrorStream(ErrorStream const&) = delete;
  ErrorStream& operator=(ErrorStream const&) = delete;
  std::string text() const { return kept_.str(); }

 private:
  std::ostringstream kept_;
  std::streambuf* before_;
};

}  // namespace

TEMPLATE_TEST_CASE("every format gives the same tetrahedron, in metres", "[vtk][read]", PALPATE_TEST_SCALARS) {
  ScratchFolder const folder;
  for (auto const& [name, bytes] : formats) {
    CAPTURE(name);
    auto const mesh = read_mesh<TestType>(folder.write(name, *bytes), metres_per("cm"));
    REQUIRE(mesh.points.cols() == 4);
    REQUIRE(mesh.triangles.cols() == 4);
    double volume = 0;
    for (int t = 0; t < 4; ++t) {
      Eigen::Matrix3d p;
      for (int i = 0; i < 3; ++i) p.col(i) = mesh.points.col(mesh.triangles(i, t)).template cast<double>();
      volume += p.determinant() / 6;
    }
    CHECK(volume == Approx(2.0 * 3.0 * 4.0 / 6.0 * 1e-6).epsilon(1e-6));   // a right corner, outward faces
  }
}

TEST_CASE("vertices and triangles keep the order of the file", "[vtk][read]") {
  ScratchFolder const folder;
  for (auto const& [name, bytes] : {formats[0], formats[3], formats[4], formats[5], formats[7]}) {
    CAPTURE(name);
    auto const mesh = read_mesh<double>(folder.write(name, *bytes));
    for (int i = 0; i < 4; ++i)
      for (int axis = 0; axis < 3; ++axis) CHECK(mesh.points(axis, i) == corners[i][axis]);
    if (std::string(name) != "t.obj")
      for (int t = 0; t < 4; ++t)
        for (int i = 0; i < 3; ++i) CHECK(mesh.triangles(i, t) == faces[t][i]);
  }
}

TEST_CASE("a surface whose unit nobody stated is refused where metres make no sense", "[vtk][read][error]") {
  ScratchFolder const folder;
  auto const of_length = [&](std::string const& length) { return folder.write("liver.obj", "v 0 0 0\nv " + length + " 0 0\nv 0 1 0\nf 1 2 3\n"); };
  for (std::string const length : {"0.001", "2", "10"}) CHECK(read_mesh<double>(of_length(length)).points(0, 1) == std::stod(length));
  CHECK_THAT(error_of(of_length("163")), says("liver.obj: read in metres, the longest side would be 163 m", "in mm it would be 0.163 m", "metres_per_unit"));
  CHECK(read_mesh<double>(of_length("163"), metres_per("mm")).points(0, 1) == Approx(0.163));
  CHECK(read_mesh<double>(of_length("163"), metres_per("m")).points(0, 1) == 163);
  std::string const used = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";   // and a vertex of no triangle, the last or the first
  for (std::string const& text : {used + "v 0 0 -163\nf 1 2 3\n", "v 163 0 0\n" + used + "f 2 3 4\n"})
    CHECK(read_mesh<double>(folder.write("stray.obj", text)).points.cols() == 4);
}

TEST_CASE("polygons become triangles; unused and doubled vertices stay", "[vtk][read]") {
  ScratchFolder const folder;
  // A concave pentagon: a fan from its first corner would leave it. Area by the shoelace formula: 3.
  auto const mesh = read_mesh<double>(
      folder.write("arrow.obj", "v 2 1 0\nv 9 9 9\nv 0 2 0\nv 0 2 0\nv 0 0 0\nv 1 1 0\nv 1 \\\n0 0\nv 2 2 0\nf 4 6 5 7 1 8"));
  CHECK(mesh.points.cols() == 8);
  double area = 0;
  for (int t = 0; t < mesh.triangles.cols(); ++t) {
    Eigen::Vector3d const a = mesh.points.col(mesh.triangles(0, t)), b = mesh.points.col(mesh.triangles(1, t)),
                          c = mesh.points.col(mesh.triangles(2, t));
    double const z = (b - a).cross(c - a).z() / 2;
    CHECK(z > 0);
    area += z;
  }
  double shoelace = 0;
  int const loop[] = {3, 5, 4, 6, 0, 7};
  for (int i = 0; i < 6; ++i) {
    auto const p = mesh.points.col(loop[i]), q = mesh.points.col(loop[(i + 1) % 6]);
    shoelace += (p.x() * q.y() - q.x() * p.y()) / 2;
  }
  CHECK(area == Approx(shoelace));
}

TEST_CASE("a file that is not there, empty or of an unknown kind is named in one line", "[vtk][read][error]") {
  ScratchFolder const folder;
  CHECK(error_of(folder.path() / "none.obj") == "none.obj: the file does not exist; check the path");
  CHECK(error_of(folder.write("empty.obj", "")) == "empty.obj: the file is empty");
  CHECK(error_of(folder.write("blank.vtk", " \n\n")) == "blank.vtk: the file is empty");
  CHECK_THAT(error_of(folder.write("mesh.3ds", "x")), says("mesh.3ds", "\".3ds\"", ".obj, .stl, .ply, .vtk or .vtp"));
  std::filesystem::create_directory(folder.path() / "folder.stl");
  CHECK(error_of(folder.path() / "folder.stl") == "folder.stl: this is a folder; give a file");
  CHECK(error_of(folder.write("points.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n")) == "points.obj: there are no triangles in this file");
  CHECK(error_of(folder.write("points.ply", ply_text.substr(0, ply_text.find("element face")) + "end_header\n0 0 0\n2 0 0\n0 3 0\n0 0 4\n")) ==
        "points.ply: there are no triangles in this file");
  CHECK_THROWS_AS(read_mesh<double>(folder.path() / "none.obj", 0.0), InvalidArgument);
}

TEST_CASE("a file cut short is an error, wherever it was cut, and nothing is printed", "[vtk][read][error]") {
  ScratchFolder const folder;
  ErrorStream const stream;
  for (auto const& [name, bytes] : formats) {
    // An OBJ file announces nothing: cut between two lines it is a smaller mesh. Elsewhere only the last line's end may be missing.
    std::size_t const whole = bytes->find_last_not_of(" \n") + 1;
    if (std::string(name) == "t.obj") continue;
    std::size_t const announced = std::string(name) == "t.stl" ? bytes->find("endsolid") + 7 : whole - 1;
    for (std::size_t size = 1; size <= announced; size += 7) {
      CAPTURE(name, size);
      CHECK(error_of(folder.write(name, bytes->substr(0, size))) != "no error");
    }
  }
  CHECK(stream.text().empty());
}

TEST_CASE("what is wrong with a file is said", "[vtk][read][error]") {
  ScratchFolder const folder;
  auto const cut = [&](char const* name, std::string const& bytes, std::size_t less) {
    return error_of(folder.write(name, bytes.substr(0, bytes.size() - less)));
  };
  CHECK(cut("t.obj", obj, 5) == "t.obj, line 12: a face has 1 corners; was the file cut short?");
  CHECK_THAT(error_of(folder.write("v.obj", obj.substr(0, obj.find(" 4\nvn")))), says("v.obj, line 6", "a vertex has fewer than three coordinates", "was the file cut short?"));
  CHECK_THAT(error_of(folder.write("i.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n")), says("i.obj, line 4", "vertex 4", "has 3", "cut short"));
  CHECK(error_of(folder.write("w.obj", "v 0 zero 0\n")) == "w.obj, line 1: \"zero\" is not a coordinate");
  CHECK(error_of(folder.write("z.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n")) == "z.obj, line 4: \"0\" is not a corner of a face");
  CHECK(error_of(folder.write("n.obj", "v 0 0 0\nf 1 -2 1\n")) == "n.obj, line 2: a face refers to vertex -2 of 1");
  CHECK(cut("t.stl", stl_text, 30) == "t.stl: there is no \"endsolid\"; the file was cut short");
  CHECK(cut("b.stl", stl_binary, 60) == "b.stl: the file announces 4 triangles and holds 2; it was cut short");
  CHECK_THAT(cut("t.ply", ply_text, 4), says("t.ply", "4 of \"face\"", "number 3", "cut short"));
  CHECK_THAT(cut("b.ply", ply_binary, 50), says("b.ply", "4 of \"face\"", "number 0", "cut short"));
  CHECK_THAT(cut("t.vtk", vtk_text, 12), says("t.vtk", "POLYGONS", "4 cells", "number 2", "cut short"));
  CHECK(cut("p.vtk", vtk_text, 70).starts_with("p.vtk: the file is damaged or cut short ("));
  CHECK(cut("t.vtp", vtp, 60).starts_with("t.vtp: the file is damaged or cut short ("));
  std::string far = ply_text;
  far.replace(far.rfind("3\n"), 1, "9");
  CHECK_THAT(error_of(folder.write("far.ply", far)), says("far.ply", "face 3", "vertex 9", "0 … 3", "cut short"));
}

TEST_CASE("a coordinate that is not finite is named", "[vtk][read][error]") {
  ScratchFolder const folder;
  auto const with = [](std::string text, std::string const& from, std::string const& to) {
    return text.replace(text.find(from), from.size(), to);
  };
  CHECK(error_of(folder.write("n.obj", with(obj, "0 3 0", "0 nan 0"))) ==
        "n.obj: the y coordinate of vertex 2 is not a finite number (nan)");
  CHECK(error_of(folder.write("i.obj", with(obj, "0 0 4", "0 0 -inf"))) ==
        "i.obj: the z coordinate of vertex 3 is not a finite number (-inf)");
  CHECK(error_of(folder.write("n.ply", with(ply_text, "2 0 0", "nan 0 0"))) != "no error");
  CHECK(error_of(folder.write("n.vtk", with(vtk_text, "2 0 0", "nan 0 0"))) != "no error");
  CHECK(error_of(folder.write("n.stl", with(stl_text, "2 0 0", "nan 0 0"))) != "no error");
}

// Cells and corners that VTK's surface filter would follow, or its reader before that.
// VTK makes room for as many blocks as compressed data announce, and for the block: 6 GB and two minutes for a file of 2 kB.
TEST_CASE("compressed data that announce more than a file can hold are refused at once", "[vtk][read][error]") {
  ScratchFolder const folder;
  vtkNew<vtkXMLPolyDataReader> reader;
  reader->ReadFromInputStringOn(), reader->SetInputString(vtp), reader->Update();
  for (auto const mode : {vtkXMLWriter::Ascii, vtkXMLWriter::Binary, vtkXMLWriter::Appended})
    for (bool const encodes : {true, false})
      for (bool const is_wide : {true, false}) {
        vtkNew<vtkXMLPolyDataWriter> writer;
        writer->SetInputData(reader->GetOutput());
        writer->SetDataMode(mode), writer->SetEncodeAppendedData(encodes), writer->SetCompressorTypeToZLib();
        is_wide ? writer->SetHeaderTypeToUInt64() : writer->SetHeaderTypeToUInt32();
        writer->WriteToOutputStringOn(), writer->Write();
        std::string const whole = writer->GetOutputString();
        CAPTURE(mode, encodes, is_wide);
        CHECK(read_mesh<double>(folder.write("whole.vtp", whole)).triangles.cols() == 4);
        if (mode == vtkXMLWriter::Ascii) continue;
        bool const is_inline = mode == vtkXMLWriter::Binary;
        std::size_t const start = is_inline ? whole.find_first_not_of(" \n", whole.find('>', whole.find("format=\"binary\"")) + 1) : whole.find('_', whole.find("<AppendedData")) + 1;
        std::size_t const header = is_wide ? 8 : 4;
        for (std::size_t const word : {std::size_t{0}, std::size_t{1}}) {   // how many blocks, how long they are
          std::string damaged = whole;
          std::size_t const at = word * header;
          if (is_inline || encodes)
            damaged.replace(start + (at + 2) / 3 * 4, 4, "////");
          else
            damaged.replace(start + at + 1, 3, "\xff\xff\xff");
          auto const before = std::chrono::steady_clock::now();
          CHECK_THAT(error_of(folder.write("damaged.vtp", damaged)), says("damaged.vtp", "compressed data announce more than this file can hold", "cut short"));
          CHECK(std::chrono::steady_clock::now() - before < std::chrono::seconds(5));
        }
      }
}

TEST_CASE("a damaged legacy file does not reach VTK's filters", "[vtk][read][error]") {
  ScratchFolder const folder;
  auto const said = [&](std::string text, std::string const& from, std::string const& to) {
    auto const at = text.find(from);
    REQUIRE(at != std::string::npos);
    return error_of(folder.write("a.vtk", text.replace(at, from.size(), to)));
  };
  std::string const cells = "CELLS 1 5\n4 0 1 2 3";
  std::string offsets = vtk_volume;
  offsets.replace(offsets.find("3.0"), 3, "5.1").replace(offsets.find(cells), cells.size(), "CELLS 2 4\nOFFSETS vtktypeint64\n0 4\nCONNECTIVITY vtktypeint64\n0 1 2 3");
  CHECK(said(vtk_volume, cells, "CELLS 1 5\n4 0 1 2 300000000") == "a.vtk: CELLS: cell 0 refers to vertex 300000000, the file has vertices 0 … 3; was it cut short?");
  CHECK(said(vtk_volume, cells, "CELLS 1 5\n4 0 1 2 -70000000") == "a.vtk: CELLS: cell 0 refers to vertex -70000000, the file has vertices 0 … 3; was it cut short?");
  CHECK(said(offsets, "vtk DataFile", "vtk DataFile") == "no error");
  CHECK(said(offsets, "0 1 2 3\nCELL_TYPES", "0 1 2 300000000\nCELL_TYPES") == "a.vtk: cell 0 refers to vertex 300000000, the file has vertices 0 … 3; was it cut short?");
  CHECK(said(offsets, "\n0 4\n", "\n0 400000\n") == "a.vtk: the list of cells is damaged; save the file again");
  CHECK(said(offsets, "CELLS 2 4\nOFFSETS vtktypeint64\n0 4\n", "CELLS 3 4\nOFFSETS vtktypeint64\n0 4 4\n") ==
        "a.vtk: 2 cells and 1 types of cells are announced; the file is damaged");
  CHECK(said(vtk_volume, "\n10\n", "\n24\n") == "a.vtk: cell 0 is of VTK's type 24 with 4 vertices, where 10 belong; the file is damaged");
  CHECK(said(vtk_volume, "\n10\n", "\n12\n") == "a.vtk: cell 0 is of VTK's type 12 with 4 vertices, where 8 belong; the file is damaged");
  CHECK_THAT(said(vtk_volume, "\n10\n", "\n71\n"), says("a.vtk: cell 0", "type 71", "not read"));
  CHECK_THAT(said(vtk_volume, "\n10\n", "\n250\n"), says("a.vtk: cell 0", "type 250", "not read"));
  CHECK_THAT(said(vtk_volume, "\n10\n", "\n42\n"), says("a.vtk: cell 0", "polyhedron", "tetrahedra"));
  CHECK(said(vtk_volume, cells, "CELLS 2 10\n4 0 1 2 3\n4 0 1 2 3") == "a.vtk: 2 cells and 1 types of cells are announced; the file is damaged");

  CHECK(said(vtk_text, "3 0 1 3", "3 0 3000000001 3") == "a.vtk: POLYGONS: cell 1 refers to vertex 3000000001, the file has vertices 0 … 3; was it cut short?");
  CHECK(said(vtk_text, "3 0 1 3", "3 0 1 -4294967295") == "a.vtk: POLYGONS: cell 1 refers to vertex -4294967295, the file has vertices 0 … 3; was it cut short?");
  CHECK_THAT(said(vtk_text, "POLYGONS 4 16\n", "POLYGONS 4 16 99999999\n"), says("a.vtk: POLYGONS announces 4 cells, number 0 is not complete"));
  CHECK_THAT(said(vtk_text, "POLYGONS 4 16\n", "POLYGONS 4 16\r99999999\n"), says("a.vtk: POLYGONS announces 4 cells, number 0 is not complete"));
  CHECK_THAT(said(vtk_text, "\nPOLYGONS 4 16\n", " polygons\t4 16\n99999999 "), says("a.vtk: POLYGONS announces 4 cells, number 0 is not complete"));
  CHECK_THAT(said(vtk_text, "4\nPOLYGONS 4 16\n", "4POLYGONS 4 16\n99999999 "), says("a.vtk: POLYGONS announces 4 cells, number 0 is not complete"));
  CHECK_THAT(said(vtk_text, "POLYGONS 4 16\n", "POLYGONS 0 0\nPOLYGONS 4 16\n"), says("a.vtk: POLYGONS", "more than once"));
  CHECK_THAT(said(vtk_text, "POLYGONS 4", "POLYGONSe4"), says("a.vtk: \"POLYGONSe4\"", "POLYGONS"));
  CHECK(said(vtk_text, "POINTS 4", "POINTS 99999999999") == "a.vtk: POINTS announces \"99999999999\", which does not fit; the file was cut short or is damaged");
  CHECK(said(vtk_text, "ASCII", "ASCI") == "a.vtk: \"asci\" stands where ASCII or BINARY should; the file was cut short or is damaged");
  CHECK(said(vtk_text, "3.0", "0.51e1") == "a.vtk: \"0.51e1\" is not a known version of VTK files");
  CHECK(said(vtk_text, "\nPOLYGONS 4 16\n", " polygons\t4 16 ") == "no error");

  for (char const* const other : {"STRUCTURED_POINTS", "STRUCTURED_GRID", "RECTILINEAR_GRID", "FIELD", "TABLE"})
    CHECK(said(vtk_text, "POLYDATA\nPOINTS 4", std::string(other) + "\nDIMENSIONS 3000 3000 300\nPOINTS 4") ==
          "a.vtk: there is no surface in this file, it holds \"" + std::string(other) + "\"; POLYDATA and UNSTRUCTURED_GRID are read");
}

// Yardstick: VTK's writers, whose files have fields and names of data besides.
TEST_CASE("legacy files of VTK's writers are read as they were written, binary and text, of versions 4.2 and 5.1", "[vtk][read]") {
  ScratchFolder const folder;
  auto const ball = make_sphere<double>(1.0, 4);
  auto const solid = make_block<double>(3, 3, 3, 0.1);
  auto const skin = palpate::detail::to_poly_data(ball);
  auto const grid = palpate::detail::to_unstructured_grid(solid);
  vtkNew<vtkFloatArray> array;
  array->SetName("lines");
  array->SetNumberOfValues(skin->GetNumberOfPoints());
  array->Fill(1.0);
  skin->GetPointData()->AddArray(array);
  vtkNew<vtkStringArray> text;
  text->SetName("text");
  text->InsertNextValue("two words");
  for (vtkDataSet* const data : {static_cast<vtkDataSet*>(skin), static_cast<vtkDataSet*>(grid)}) data->GetFieldData()->AddArray(text);
  for (int const type : {VTK_BINARY, VTK_ASCII})
    for (int const version : {vtkDataWriter::VTK_LEGACY_READER_VERSION_4_2, vtkDataWriter::VTK_LEGACY_READER_VERSION_5_1}) {
      CAPTURE(type, version);
      auto const file = (folder.path() / "a.vtk").string();
      auto const write = [&](auto const& writer, vtkDataSet* data) {
        writer->SetFileName(file.c_str());
        writer->SetFileType(type);
        writer->SetFileVersion(version);
        writer->SetInputData(data);
        writer->Write();
      };
      write(vtkNew<vtkPolyDataWriter>(), skin);
      auto const read = read_mesh<double>(file);
      CHECK((read.points - ball.points).cwiseAbs().maxCoeff() < 1e-6);   // stored as float
      CHECK(read.triangles == ball.triangles);
      write(vtkNew<vtkUnstructuredGridWriter>(), grid);
      CHECK(read_mesh<double>(file).triangles.cols() == palpate::surface(solid).triangles.cols());
      CHECK(read_volume<double>(file).tetrahedra == solid.tetrahedra);
    }
}

TEST_CASE("a damaged number in an XML file is shown", "[vtk][read][error]") {
  ScratchFolder const folder;
  std::string text = vtp;
  text.replace(text.find("NumberOfPolys=\"4\""), 17, "NumberOfPolys=\"-4\"");
  CHECK_THAT(error_of(folder.write("a.vtp", text)), says("a.vtp: NumberOfPolys is \"-4\"", "damaged"));
}

// VTK follows damaged fields out of bounds, and texts among them that are not as many as announced.
TEST_CASE("data of fields, points and cells are not read, whatever they are", "[vtk][read]") {
  ScratchFolder const folder;
  auto const with = [](std::string text, std::string const& before, std::string const& what) { return text.insert(text.find(before), what); };
  for (std::string const field : {"FIELD FieldData 1\nt 1 1 nothing\n3\n", "FIELD FieldData 2\npoint_data 1 1 int\n3\n", "FIELD FieldData -1\n"}) {
    CHECK(error_of(folder.write("a.vtk", with(vtk_text, "POINTS", field))) == "no error");
    CHECK(error_of(folder.write("a.vtk", with(vtk_volume, "POINTS", field))) == "no error");
    CHECK_THAT(error_of(folder.write("a.vtk", with(vtk_text, "POLYGONS", field))), says("a.vtk: ", "FIELD stands after the first list"));
  }
  CHECK(error_of(folder.write("a.vtk", vtk_text + "POINT_DATA 4\nSCALARS a int 1\nLOOKUP_TABLE default\n0 1 2 3\nCELL_DATA -1\nFIELD b -1\n")) == "no error");
  std::string const texts = "<FieldData>\n<Array type=\"String\" Name=\"t\" NumberOfTuples=\"1\" format=\"ascii\">104 0 108 111 0</Array>\n</FieldData>\n";
  CHECK(error_of(folder.write("a.vtp", with(vtp, "<Piece", texts))) == "no error");
  CHECK(error_of(folder.write("a.vtp", with(vtp, "<Points>", "<PointData/><CellData Scalars=\"a\"><DataArray type=\"Int7\" Name=\"a\">1</DataArray></CellData>"))) == "no error");
  CHECK_THAT(error_of(folder.write("a.vtp", with(vtp, "<Points>", "<PointData>"))), says("a.vtp: the file is damaged or cut short"));
  CHECK_THAT(error_of(folder.write("a.vtp", with(vtp, "<Points>", "<PointData><PointData></PointData>"))), says("a.vtp: the file is damaged or cut short"));
}

TEST_CASE("a byte-order mark is passed over or named, and words of STL may be in upper case", "[vtk][read]") {
  ScratchFolder const folder;
  std::string const mark = "\xEF\xBB\xBF";
  for (auto const& [name, text] : {std::pair{"m.obj", std::string("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 5 5 5\nf 1 2 3\n")}, std::pair{"m.ply", ply_text}}) {
    auto const mesh = read_mesh<double>(folder.write(name, mark + text)), yardstick = read_mesh<double>(folder.write(name, text));
    CHECK(mesh.points == yardstick.points);
    CHECK(mesh.triangles == yardstick.triangles);
  }
  CHECK(error_of(folder.write("m.stl", mark + stl_text)) == "m.stl: the file begins with a byte-order mark; save it as text without one");
  std::string upper = stl_text;
  for (char& c : upper) c = c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
  CHECK(read_mesh<double>(folder.write("u.stl", upper)).triangles.cols() == 4);
  CHECK(error_of(folder.write("u.stl", upper.substr(0, upper.size() - 30))) == "u.stl: there is no \"endsolid\"; the file was cut short");
}

TEST_CASE("vertices of a PLY file have three coordinates, its corners are vertices", "[vtk][read][error]") {
  ScratchFolder const folder;
  auto const said = [&](std::string const& from, std::string const& to) {
    std::string text = ply_text;
    return error_of(folder.write("a.ply", text.replace(text.find(from), from.size(), to)));
  };
  CHECK(said("float x", "float u") == "a.ply: a vertex has no property \"x\"; it needs x, y and z");
  CHECK(said("float z", "float w") == "a.ply: a vertex has no property \"z\"; it needs x, y and z");
  CHECK(said("3 0 1 3", "3 0 1.9 3") == "a.ply: face 1 refers to vertex 1.9; write a whole number");
  CHECK(said("3 0 1 3", "3 0 nan 3") == "a.ply: face 1 refers to vertex nan; write a whole number");
  CHECK(said("3 0 1 3", "3 0 -2 3") == "a.ply: face 1 refers to vertex -2, the file has vertices 0 … 3; was it cut short?");
  CHECK(said("3 0 1 3", "3 0 3000000001 3") == "a.ply: face 1 refers to vertex 3000000001, the file has vertices 0 … 3; was it cut short?");
  CHECK_THAT(said("vertex 4", "vertex 9223372036854775807"), says("a.ply: the element \"vertex\"", "number"));
}

// Yardstick: the sanitizers. Whatever the bytes are, there is a mesh whose corners exist, or one line of error.
TEST_CASE("a damaged file gives an error or a mesh, nothing worse", "[vtk][read][error]") {
  ScratchFolder const folder;
  std::minstd_rand random(20061);   // the same numbers with every library
  auto const below = [&](std::size_t n) { return static_cast<std::size_t>(random()) % n; };
  int refused = 0, read = 0;
  for (auto const& [name, bytes] : formats)
    for (int trial = 0; trial < 150; ++trial) {
      std::string damaged = *bytes;
      for (std::size_t hits = 1 + below(4); hits > 0; --hits) damaged[below(damaged.size())] = "09-. \n\xff\0z"[below(9)];
      CAPTURE(name, trial);
      try {
        auto const mesh = read_mesh<double>(folder.write(name, damaged), 1.0);
        CHECK(mesh.triangles.minCoeff() >= 0);
        CHECK(mesh.triangles.maxCoeff() < mesh.points.cols());
        CHECK(mesh.points.allFinite());
        ++read;
      } catch (FileError const& error) {
        CHECK(std::string(error.what()).find('\n') == std::string::npos);
        ++refused;
      }
    }
  CHECK(refused > 300);
  CHECK(read > 100);
}

// Yardstick: the same. Numbers are damaged more often; 10⁵ in the long run, see CONTRIBUTING.md.
TEST_CASE("a damaged surface's file gives an error or a mesh, nothing worse", "[vtk][read][fuzz]") {
  ScratchFolder const folder;
  std::string const cells = "CELLS 1 5\n4 0 1 2 3", polygons = "POLYGONS 4 16\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";
  std::string grid_of_offsets = vtk_volume, offsets = vtk_text;
  grid_of_offsets.replace(grid_of_offsets.find("3.0"), 3, "5.1")
      .replace(grid_of_offsets.find(cells), cells.size(), "CELLS 2 4\nOFFSETS vtktypeint64\n0 4\nCONNECTIVITY vtktypeint64\n0 1 2 3");
  offsets.replace(offsets.find("3.0"), 3, "5.1")
      .replace(offsets.find(polygons), polygons.size(), "POLYGONS 5 12\nOFFSETS vtktypeint64\n0 3 6 9 12\nCONNECTIVITY vtktypeint64\n0 2 1 0 1 3 0 3 2 1 2 3\n");
  std::string const fields = vtk_text + "POINT_DATA 4\nSCALARS a int 1\nLOOKUP_TABLE default\n0 1 2 3\nCELL_DATA 4\nSCALARS b int\nLOOKUP_TABLE default\n0 1 2 3\n";
  std::string const lists = vtk_text + "VERTICES 1 2\n1 0\nLINES 1 3\n2 0 3\nTRIANGLE_STRIPS 1 5\n4 0 1 2 3\n";
  std::vector<Format> files(formats.begin(), formats.end());
  std::string field = vtk_volume, texts = vtp;
  field.insert(field.find("POINTS"), "FIELD FieldData 2\ntext 1 1 string\ntwo%20words\nTime 1 1 float\n3\n");
  texts.insert(texts.find("<Piece"), "<FieldData>\n<Array type=\"String\" Name=\"text\" NumberOfTuples=\"1\" format=\"ascii\">104 101 108 0</Array>\n</FieldData>\n");
  for (auto const* const text : std::initializer_list<std::string const*>{&grid_of_offsets, &offsets, &fields, &lists, &field}) files.push_back({"o.vtk", text});
  files.push_back({"o.vtp", &texts});
  std::mt19937_64 random(13);
  int read = 0, refused = 0;
  char const* const wanted = std::getenv("PALPATE_VTK_FILES");
  int const rounds = wanted != nullptr ? std::atoi(wanted) : 600;
  for (int round = 0; round < rounds; ++round) {
    auto const& [name, bytes] = files[static_cast<std::size_t>(round) % files.size()];
    std::string text = *bytes;
    palpate_test::damage(text, random);
    CAPTURE(name, text);
    try {
      auto const mesh = read_mesh<double>(folder.write(name, text), 1.0);
      bool const exist = mesh.triangles.minCoeff() >= 0 && mesh.triangles.maxCoeff() < mesh.points.cols() && mesh.points.allFinite();
      if (!exist) FAIL("a corner or a coordinate does not exist");
      ++read;
    } catch (FileError const& error) {
      if (std::string(error.what()).find('\n') != std::string::npos) FAIL("not one line: " << error.what());
      ++refused;
    }
  }
  CHECK(read > rounds / 30);
  CHECK(refused > rounds / 6);
}
