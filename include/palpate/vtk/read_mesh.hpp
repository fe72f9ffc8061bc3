// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/mesh/triangle_mesh.hpp>
#include <palpate/vtk/detail/check_files.hpp>
#include <palpate/vtk/detail/message_trap.hpp>
#include <palpate/vtk/detail/scan_files.hpp>

#include <vtkCellArray.h>
#include <vtkDataSetReader.h>
#include <vtkDataSetSurfaceFilter.h>
#include <vtkNew.h>
#include <vtkPolyData.h>
#include <vtkSTLReader.h>
#include <vtkSmartPointer.h>
#include <vtkTriangleFilter.h>
#include <vtkXMLPolyDataReader.h>

#include <cctype>
#include <cmath>
#include <exception>
#include <filesystem>
#include <limits>
#include <string>

namespace palpate {

namespace detail {

template <class Reader>
vtkSmartPointer<vtkPolyData> output_of(Reader* reader, std::filesystem::path const& file) {
  reader->SetFileName(file.string().c_str());
  reader->Update();
  return reader->GetOutput();
}

/// A legacy file may hold any data set: of a volume, the outer surface.
inline vtkSmartPointer<vtkPolyData> read_legacy(std::filesystem::path const& file) {
  vtkNew<vtkDataSetReader> reader;
  reader->SetFileName(file.string().c_str());
  reader->Update();
  vtkDataSet* const data = reader->GetOutput();
  if (auto* const surface = vtkPolyData::SafeDownCast(data)) return surface;
  if (data == nullptr) return nullptr;
  vtkNew<vtkDataSetSurfaceFilter> outside;
  outside->SetInputData(data);
  outside->Update();
  return outside->GetOutput();
}

inline vtkSmartPointer<vtkPolyData> read_surface(std::filesystem::path const& file) {
  std::string const name = file.string();
  std::string extension = file.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  bool const known = extension == ".obj" || extension == ".stl" || extension == ".ply" || extension == ".vtk" ||
                     extension == ".vtp";
  if (!known)
    throw FileError(message(name, ": \"", extension, "\" is not a known kind of mesh file; give .obj, .stl, .ply, .vtk or .vtp"));
  std::string const bytes = read_bytes(file);
  if (extension == ".obj") return scan_obj(bytes, name);
  if (extension == ".stl") {
    check_stl_complete(bytes, name);
    return output_of(vtkNew<vtkSTLReader>().Get(), file);
  }
  if (extension == ".ply") return PlyScan(bytes, name)();
  if (extension == ".vtk") {
    LegacyCheck{bytes, name}();
    return read_legacy(file);
  }
  return output_of(vtkNew<vtkXMLPolyDataReader>().Get(), file);
}

/// VTK's filters follow every index: a corner that is no vertex must not reach them.
inline void check_faces(vtkCellArray* cells, vtkIdType points, std::string const& name) {
  if (!cells->IsValid()) throw FileError(message(name, ": the list of faces is damaged"));
  for (vtkIdType cell = 0; cell < cells->GetNumberOfCells(); ++cell) {
    vtkIdType size = 0;
    vtkIdType const* corners = nullptr;
    cells->GetCellAtId(cell, size, corners);
    for (vtkIdType i = 0; i < size; ++i)
      if (corners[i] < 0 || corners[i] >= points)
        throw FileError(message(name, ": face ", cell, " refers to vertex ", corners[i], ", the file has vertices 0 … ", points - 1,
                                "; was it cut short?"));
  }
}

}  // namespace detail

/// Reads a surface from an OBJ, STL, PLY or VTK file (legacy .vtk, of a volume its outer surface; .vtp).
///   point [m] = point in the file · metres_per_unit; see `metres_per("mm")`
/// Polygons and strips become triangles, in the order of the file. Vertices keep their order and are left as they are, unused and
/// doubled ones too (`validate` and `repair` speak about those); only STL, which has no shared vertices, gets equal corners merged.
/// Throws `FileError` in one line: no such file, empty, cut short, unknown kind, damaged, no triangles, a coordinate that is not finite.
/// Limits     VTK's messages are caught through its process-wide output window: do not read while another thread uses VTK.
///            An OBJ file cut exactly between two faces can not be told from a smaller mesh; it is then not closed. OBJ and PLY are
///            read here, since VTK tears OBJ surfaces apart and follows damaged PLY files out of bounds; the rest is VTK's reading.
template <RealScalar Scalar = double>
TriangleMesh<Scalar> read_mesh(std::filesystem::path const& file, double metres_per_unit = 1.0) {
  std::string const name = file.string();
  detail::require_positive("metres per unit", metres_per_unit, "m");
  detail::MessageTrap trap;
  vtkNew<vtkTriangleFilter> triangulated;
  try {
    vtkSmartPointer<vtkPolyData> const surface = detail::read_surface(file);
    if (!trap.message().empty())
      throw FileError(detail::message(name, ": the file is damaged or cut short (", trap.message(), ")"));
    if (surface == nullptr) throw FileError(detail::message(name, ": the file holds no mesh"));
    detail::check_faces(surface->GetPolys(), surface->GetNumberOfPoints(), name);
    detail::check_faces(surface->GetStrips(), surface->GetNumberOfPoints(), name);
    triangulated->SetInputData(surface);
    triangulated->PassVertsOff();
    triangulated->PassLinesOff();
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
      mesh.points(axis, i) = static_cast<Scalar>(x[axis] * metres_per_unit);
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
  return mesh;
}

}  // namespace palpate
