// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/mesh/tetrahedral_mesh.hpp>
#include <palpate/volume/detail/given_tetrahedra.hpp>
#include <palpate/volume/read_gmsh.hpp>
#include <palpate/vtk/detail/check_files.hpp>
#include <palpate/vtk/detail/message_trap.hpp>

#include <vtkCellType.h>
#include <vtkDataSetReader.h>
#include <vtkNew.h>
#include <vtkSmartPointer.h>
#include <vtkUnstructuredGrid.h>
#include <vtkXMLUnstructuredGridReader.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstddef>
#include <exception>
#include <filesystem>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

namespace palpate {

namespace detail {

/// Throws `FileError` unless a legacy file has its points, cells and types once each, each keyword at the begin of a line, and as many types as cells: VTK goes by
/// the beginnings of words wherever they stand, in either case, and would write beyond its lists. What comes before the data of points and cells is looked at.
inline void check_legacy_grid(std::string_view bytes, std::string const& name) {
  take_line(bytes), take_line(bytes);   // the title may say anything
  auto const lower = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; };
  auto const find = [&](std::string_view word, std::size_t from) {
    auto const found = std::search(bytes.begin() + static_cast<std::ptrdiff_t>(std::min(from, bytes.size())), bytes.end(), word.begin(), word.end(),
                                   [&](char a, char b) { return lower(a) == b; });
    return static_cast<std::size_t>(found - bytes.begin());
  };
  bytes = bytes.substr(0, std::min(find("point_data", 0), find("cell_data", 0)));
  std::array<long long, 3> count{};
  std::size_t before = 0;
  constexpr std::array<std::string_view, 3> keywords{"POINTS ", "CELLS ", "CELL_TYPES "};
  for (std::size_t k = 0; k < 3; ++k) {
    std::string word(keywords[k].substr(0, keywords[k].size() - 1));
    std::transform(word.begin(), word.end(), word.begin(), lower);
    std::size_t const at = find(word, 0);
    if (at == bytes.size() || bytes.substr(at, keywords[k].size()) != keywords[k] || at == 0 || bytes[at - 1] != '\n' || find(word, at + 1) != bytes.size() || at < before)
      throw FileError(message(name, ": \"", keywords[k].substr(0, word.size()), "\" has to begin one line, and POINTS, CELLS and CELL_TYPES come in this order; the file is no unstructured grid or is damaged"));
    before = at;
    std::string_view rest = bytes.substr(at + keywords[k].size());
    count[k] = to_number<long long>(take_word(rest)).value_or(-1);
  }
  if (count[2] < 0 || (count[2] != count[1] && count[2] + 1 != count[1]))   // from version 5 on offsets, one more
    throw FileError(message(name, ": ", count[1], " cells and ", count[2], " types of cells are announced; the file is damaged"));
}

inline vtkSmartPointer<vtkUnstructuredGrid> read_grid(std::filesystem::path const& file, std::string const& extension) {
  std::string const name = file.string(), bytes = read_bytes(file);
  if (extension == ".vtu") {
    if (bytes.find("</VTKFile>") == std::string::npos) throw FileError(message(name, ": there is no \"</VTKFile>\"; the file was cut short"));
    vtkNew<vtkXMLUnstructuredGridReader> reader;
    reader->SetFileName(name.c_str());
    reader->Update();
    return reader->GetOutput();
  }
  check_legacy_grid(bytes, name);
  LegacyCheck{bytes, name}();
  vtkNew<vtkDataSetReader> reader;
  reader->SetFileName(name.c_str());
  reader->Update();
  return vtkUnstructuredGrid::SafeDownCast(reader->GetOutput());
}

}  // namespace detail

/// Reads the tetrahedra of a VTK file (legacy .vtk or .vtu, an unstructured grid) or of a Gmsh file (.msh, see read_gmsh). Points, lines and faces in it are passed
/// over; tetrahedra that are inside out are turned, vertices of none are dropped, the rest keeps its order.
///   point [m] = point in the file · metres_per_unit; see `metres_per("mm")`
/// Throws `FileError` in one line: no such file, unknown kind, damaged or cut short, no unstructured grid, volumes that are no tetrahedra of four vertices, flat or double
/// tetrahedra, more than two at a face, a coordinate that is not finite.
/// Limits     VTK's messages are caught through its process-wide output window: do not read while another thread uses VTK.
template <RealScalar Scalar = double>
TetrahedralMesh<Scalar> read_volume(std::filesystem::path const& file, double metres_per_unit = 1.0) {
  detail::check_metres_per_unit(metres_per_unit);
  std::string const name = file.string();
  std::string extension = file.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (extension == ".msh") return read_gmsh<Scalar>(file, metres_per_unit);
  if (extension != ".vtk" && extension != ".vtu")
    throw FileError(detail::message(name, ": \"", extension, "\" is not a known kind of volume file; give .msh, .vtk or .vtu, or fill a surface that read_mesh reads"));

  detail::MessageTrap trap;
  std::vector<Vector3<double>> points;
  std::vector<std::array<int, 4>> tetrahedra;
  try {
    vtkSmartPointer<vtkUnstructuredGrid> const grid = detail::read_grid(file, extension);
    if (!trap.message().empty()) throw FileError(detail::message(name, ": the file is damaged or cut short (", trap.message(), ")"));
    if (grid == nullptr || grid->GetNumberOfPoints() == 0) throw FileError(detail::message(name, ": there is no unstructured grid in this file"));
    if (grid->GetNumberOfPoints() > std::numeric_limits<int>::max()) throw FileError(detail::message(name, ": the mesh has more vertices than an int counts"));
    for (vtkIdType i = 0; i < grid->GetNumberOfPoints(); ++i) {
      Vector3<double> p;
      grid->GetPoint(i, p.data());
      if (!is_finite(p)) throw FileError(detail::message(name, ": vertex ", i, " has a coordinate that is not a finite number (", p.x(), ", ", p.y(), ", ", p.z(), ")"));
      points.push_back(p);
    }
    vtkCellArray* const cells = grid->GetCells();
    if (cells != nullptr && (!cells->IsValid() || grid->GetCellTypesArray() == nullptr || grid->GetCellTypesArray()->GetNumberOfValues() < cells->GetNumberOfCells()))
      throw FileError(detail::message(name, ": the list of cells is damaged"));
    for (vtkIdType cell = 0; cells != nullptr && cell < cells->GetNumberOfCells(); ++cell) {
      int const type = grid->GetCellTypesArray()->GetValue(cell);
      if (type >= VTK_EMPTY_CELL && type <= VTK_QUAD) continue;   // points, lines, faces
      vtkIdType size = 0;
      vtkIdType const* corners = nullptr;
      cells->GetCellAtId(cell, size, corners);
      if (type != VTK_TETRA || size != 4)
        throw FileError(detail::message(name, ": cell ", cell, " is of VTK's type ", type, " with ", size, " vertices; only tetrahedra of four vertices (type 10) are read"));
      std::array<int, 4> own;
      for (std::size_t c = 0; c < 4; ++c) own[c] = corners[c] >= 0 && corners[c] < grid->GetNumberOfPoints() ? static_cast<int>(corners[c]) : -1;
      tetrahedra.push_back(own);
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
