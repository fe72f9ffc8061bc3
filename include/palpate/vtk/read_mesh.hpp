// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/core/units.hpp>
#include <palpate/mesh/triangle_mesh.hpp>
#include <palpate/vtk/detail/check_files.hpp>
#include <palpate/vtk/detail/legacy_file.hpp>
#include <palpate/vtk/detail/message_trap.hpp>
#include <palpate/vtk/detail/scan_files.hpp>
#include <palpate/vtk/detail/xml_file.hpp>

#include <vtkCellArray.h>
#include <vtkCellType.h>
#include <vtkDataSet.h>
#include <vtkDataSetSurfaceFilter.h>
#include <vtkGenericCell.h>
#include <vtkNew.h>
#include <vtkPolyData.h>
#include <vtkSTLReader.h>
#include <vtkSmartPointer.h>
#include <vtkTriangleFilter.h>
#include <vtkUnsignedCharArray.h>
#include <vtkUnstructuredGrid.h>
#include <vtkXMLPolyDataReader.h>

#include <cmath>
#include <exception>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>

namespace palpate {

namespace detail {

/// The outer surface of a grid whose cells are what VTK's filter takes for granted: of linear, quadratic or cubic kinds with as many corners as those have.
inline vtkSmartPointer<vtkPolyData> outside_of(vtkUnstructuredGrid* grid, std::string const& name) {
  vtkCellArray* const cells = grid->GetCells();
  vtkUnsignedCharArray* const types = grid->GetCellTypesArray();
  if (cells == nullptr) return nullptr;
  check_cell_array(cells, grid->GetNumberOfPoints(), "cell", name);
  if (types == nullptr || types->GetNumberOfValues() < cells->GetNumberOfCells()) throw FileError(message(name, ": there are fewer types than cells; the file is damaged"));
  vtkNew<vtkGenericCell> kind;
  for (vtkIdType cell = 0; cell < cells->GetNumberOfCells(); ++cell) {
    int const type = types->GetValue(cell);
    bool const known = type <= VTK_HEXAGONAL_PRISM || (type >= VTK_QUADRATIC_EDGE && type <= VTK_CUBIC_LINE);
    if (!known) throw FileError(message(name, ": cell ", cell, " is of VTK's type ", type, ", which is not read; save linear or quadratic cells"));
    kind->SetCellType(type);
    vtkIdType const size = cells->GetCellSize(cell), right = kind->GetNumberOfPoints();   // 0: any number
    if (right != 0 && size != right)
      throw FileError(message(name, ": cell ", cell, " is of VTK's type ", type, " with ", size, " vertices, where ", right, " belong; the file is damaged"));
  }
  vtkNew<vtkDataSetSurfaceFilter> outside;
  outside->SetInputData(grid);
  outside->Update();
  return outside->GetOutput();
}

inline vtkSmartPointer<vtkPolyData> read_surface(std::filesystem::path const& file) {
  std::string const name = file.string();
  std::string const extension = lower_case(file.extension().string());
  bool const known = extension == ".obj" || extension == ".stl" || extension == ".ply" || extension == ".vtk" ||
                     extension == ".vtp";
  if (!known)
    throw FileError(message(name, ": \"", legible(extension), "\" is not a known kind of mesh file; give .obj, .stl, .ply, .vtk or .vtp"));
  std::string const bytes = read_bytes(file);
  if (extension == ".obj") return scan_obj(bytes, name);
  if (extension == ".stl") {
    check_stl_complete(bytes, name);
    vtkNew<vtkSTLReader> reader;
    reader->SetFileName(name.c_str());
    reader->Update();
    return reader->GetOutput();
  }
  if (extension == ".ply") return PlyScan(bytes, name)();
  if (extension == ".vtk") {
    vtkSmartPointer<vtkDataSet> const data = read_legacy(bytes, name, true);
    if (auto* const grid = vtkUnstructuredGrid::SafeDownCast(data)) return outside_of(grid, name);
    return vtkPolyData::SafeDownCast(data);
  }
  return read_xml<vtkXMLPolyDataReader>(bytes, name);
}

}  // namespace detail

/// Reads a surface from an OBJ, STL, PLY or VTK file (legacy .vtk of POLYDATA, or of an UNSTRUCTURED_GRID the outer surface; .vtp).
///   point [m] = point in the file · metres_per_unit; see `metres_per("mm")`. Not given, it is 1, and a file whose triangles
///   reach farther than 12 m is refused.
/// Polygons and strips become triangles, in the order of the file. Vertices keep their order and are left as they are, unused and
/// doubled ones too (`validate` and `repair` speak about those); only STL, which has no shared vertices, gets equal corners merged.
/// Throws `FileError` in one line: no such file, empty, cut short, unknown kind, damaged, no triangles, a coordinate that is not finite.
/// Limits     VTK's messages are caught through its process-wide output window: do not read while another thread uses VTK.
///            An OBJ file cut exactly between two faces can not be told from a smaller mesh; it is then not closed. OBJ and PLY are
///            read here, since VTK tears OBJ surfaces apart and follows damaged PLY files out of bounds; the rest is VTK's reading.
///            Of a grid, linear and quadratic cells are read, no polyhedra and none of higher order. VTK does not notice that base64 data
///            in the middle of a .vtp are too short: their last coordinates are then any numbers.
template <RealScalar Scalar = double>
TriangleMesh<Scalar> read_mesh(std::filesystem::path const& file, std::optional<double> metres_per_unit = {}) {
  std::string const name = file.string();
  double const metres = detail::stated_or_metres(metres_per_unit);
  detail::MessageTrap trap;
  vtkNew<vtkTriangleFilter> triangulated;
  try {
    vtkSmartPointer<vtkPolyData> const surface = detail::read_surface(file);
    if (!trap.message().empty())
      throw FileError(detail::message(name, ": the file is damaged or cut short (", detail::legible(trap.message()), ")"));
    if (surface == nullptr) throw FileError(detail::message(name, ": the file holds no mesh"));
    vtkNew<vtkPolyData> faces;   // and nothing of what else the file holds
    faces->SetPoints(surface->GetPoints());
    faces->SetPolys(surface->GetPolys());
    faces->SetStrips(surface->GetStrips());
    for (vtkCellArray* const list : {faces->GetPolys(), faces->GetStrips()}) detail::check_cell_array(list, faces->GetNumberOfPoints(), "face", name);
    triangulated->SetInputData(faces);
    triangulated->Update();
  } catch (Error const&) {
    throw;
  } catch (std::exception const& error) {   // a damaged number of elements can ask for more memory than there is
    throw FileError(detail::message(name, ": the file is damaged (", error.what(), ")"));
  }
  vtkPolyData* const read = triangulated->GetOutput();
  vtkIdType const points = read->GetNumberOfPoints(), triangles = read->GetNumberOfPolys();
  if (points == 0 || triangles == 0) throw FileError(detail::message(name, ": there are no triangles in this file"));
  if (points > std::numeric_limits<int>::max() || triangles > std::numeric_limits<int>::max())
    throw FileError(detail::message(name, ": the mesh has more vertices or triangles than an int counts"));

  TriangleMesh<Scalar> mesh;
  mesh.points.resize(3, points);
  for (vtkIdType i = 0; i < points; ++i) {
    double x[3];
    read->GetPoint(i, x);
    for (int axis = 0; axis < 3; ++axis) {
      mesh.points(axis, i) = static_cast<Scalar>(x[axis] * metres);
      if (!std::isfinite(mesh.points(axis, i)))
        throw FileError(detail::message(name, ": the ", std::string(1, static_cast<char>('x' + axis)),
                                        " coordinate of vertex ", i, " is not a finite number (", x[axis], ")"));
    }
  }
  mesh.triangles.resize(3, triangles);
  vtkCellArray* const polygons = read->GetPolys();
  for (vtkIdType t = 0; t < triangles; ++t) {
    vtkIdType size = 0;
    vtkIdType const* corners = nullptr;
    polygons->GetCellAtId(t, size, corners);
    for (int corner = 0; corner < 3; ++corner) mesh.triangles(corner, t) = static_cast<int>(corners[corner]);
  }
  Vector3<Scalar> low = mesh.points.col(mesh.triangles(0, 0)), high = low;   // of what is used: a vertex of none may lie anywhere
  for (int const v : mesh.triangles.reshaped())
    low = low.cwiseMin(mesh.points.col(v)), high = high.cwiseMax(mesh.points.col(v));
  detail::require_stated_unit(name, static_cast<double>((high - low).maxCoeff()), metres_per_unit);
  return mesh;
}

}  // namespace palpate
