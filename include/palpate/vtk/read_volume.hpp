// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/core/units.hpp>
#include <palpate/mesh/tetrahedral_mesh.hpp>
#include <palpate/volume/detail/given_tetrahedra.hpp>
#include <palpate/volume/read_gmsh.hpp>
#include <palpate/vtk/detail/check_files.hpp>
#include <palpate/vtk/detail/legacy_file.hpp>
#include <palpate/vtk/detail/message_trap.hpp>
#include <palpate/vtk/detail/xml_file.hpp>

#include <vtkCellArray.h>
#include <vtkCellType.h>
#include <vtkSmartPointer.h>
#include <vtkUnstructuredGrid.h>
#include <vtkXMLUnstructuredGridReader.h>

#include <array>
#include <exception>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace palpate {

namespace detail {

inline vtkSmartPointer<vtkUnstructuredGrid> read_grid(std::filesystem::path const& file, std::string const& extension) {
  std::string const name = file.string(), bytes = read_bytes(file);
  if (extension == ".vtu") {
    if (bytes.find("</VTKFile>") == std::string::npos) throw FileError(message(name, ": there is no \"</VTKFile>\"; the file was cut short"));
    return read_xml<vtkXMLUnstructuredGridReader>(bytes, name);
  }
  return vtkUnstructuredGrid::SafeDownCast(read_legacy(bytes, name, false));
}

}  // namespace detail

/// Reads the tetrahedra of a VTK file (legacy .vtk or .vtu, an unstructured grid) or of a Gmsh file (.msh, see read_gmsh). Points, lines and faces in it are passed
/// over; tetrahedra that are inside out are turned, vertices of none are dropped, the rest keeps its order: tetrahedron k is the k-th of
/// the file.
///   point [m] = point in the file · metres_per_unit; see `metres_per("mm")`. Not given, it is 1, and a file that is longer than 12 m is refused.
/// Throws `FileError` in one line: no such file, unknown kind, damaged or cut short, no unstructured grid, volumes that are no
/// tetrahedra of four vertices, a coordinate that is not finite; tetrahedra that are flat, name a vertex twice, are there twice
/// or overlap at a face that they share; more than two at a face; vertices that coincide.
/// Limits     VTK's messages are caught through its process-wide output window: do not read while another thread uses VTK.
///            VTK does not notice that base64 data in the middle of a .vtu are too short: their last coordinates are then any numbers.
template <RealScalar Scalar = double>
TetrahedralMesh<Scalar> read_volume(std::filesystem::path const& file, std::optional<double> metres_per_unit = {}) {
  detail::stated_or_metres(metres_per_unit);
  std::string const name = file.string();
  std::string const extension = detail::lower_case(file.extension().string());
  if (extension == ".msh") return read_gmsh<Scalar>(file, metres_per_unit);
  if (extension != ".vtk" && extension != ".vtu")
    throw FileError(detail::message(name, ": \"", detail::legible(extension), "\" is not a known kind of volume file; give .msh, .vtk or .vtu, or fill a surface that read_mesh reads"));

  detail::MessageTrap trap;
  std::vector<Vector3<double>> points;
  std::vector<std::array<int, 4>> tetrahedra;
  try {
    vtkSmartPointer<vtkUnstructuredGrid> const grid = detail::read_grid(file, extension);
    if (!trap.message().empty()) throw FileError(detail::message(name, ": the file is damaged or cut short (", detail::legible(trap.message()), ")"));
    if (grid == nullptr || grid->GetNumberOfPoints() == 0) throw FileError(detail::message(name, ": there is no unstructured grid in this file"));
    if (grid->GetNumberOfPoints() > std::numeric_limits<int>::max()) throw FileError(detail::message(name, ": the mesh has more vertices than an int counts"));
    for (vtkIdType i = 0; i < grid->GetNumberOfPoints(); ++i) {
      Vector3<double> p;
      grid->GetPoint(i, p.data());
      if (!is_finite(p)) throw FileError(detail::message(name, ": vertex ", i, " has a coordinate that is not a finite number (", p.x(), ", ", p.y(), ", ", p.z(), ")"));
      points.push_back(p);
    }
    vtkCellArray* const cells = grid->GetCells();
    if (cells != nullptr) detail::check_cell_array(cells, grid->GetNumberOfPoints(), "cell", name);
    if (cells != nullptr && (grid->GetCellTypesArray() == nullptr || grid->GetCellTypesArray()->GetNumberOfValues() < cells->GetNumberOfCells()))
      throw FileError(detail::message(name, ": there are fewer types than cells; the file is damaged"));
    for (vtkIdType cell = 0; cells != nullptr && cell < cells->GetNumberOfCells(); ++cell) {
      int const type = grid->GetCellTypesArray()->GetValue(cell);
      if (type >= VTK_EMPTY_CELL && type <= VTK_QUAD) continue;   // points, lines, faces
      vtkIdType size = 0;
      vtkIdType const* corners = nullptr;
      cells->GetCellAtId(cell, size, corners);
      if (type != VTK_TETRA || size != 4)
        throw FileError(detail::message(name, ": cell ", cell, " is of VTK's type ", type, " with ", size, " vertices; only tetrahedra of four vertices (type 10) are read"));
      tetrahedra.push_back({static_cast<int>(corners[0]), static_cast<int>(corners[1]), static_cast<int>(corners[2]), static_cast<int>(corners[3])});
    }
  } catch (Error const&) {
    throw;
  } catch (std::exception const& error) {   // a damaged number of elements can ask for more memory than there is
    throw FileError(detail::message(name, ": the file is damaged (", error.what(), ")"));
  }
  auto const mesh = detail::given_tetrahedra(points, tetrahedra, metres_per_unit, name);
  return {mesh.points.template cast<Scalar>(), mesh.tetrahedra};
}

}  // namespace palpate
