// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/detail/whole_file.hpp>
#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/mesh/detail/simplices.hpp>
#include <palpate/mesh/tetrahedral_mesh.hpp>
#include <palpate/mesh/triangle_mesh.hpp>
#include <palpate/tissue/solid_fields.hpp>
#include <palpate/vtk/detail/message_trap.hpp>
#include <palpate/vtk/detail/poly_data.hpp>
#include <palpate/vtk/detail/unstructured_grid.hpp>

#include <vtkCellData.h>
#include <vtkDataSet.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPointSet.h>
#include <vtkXMLPolyDataWriter.h>
#include <vtkXMLUnstructuredGridWriter.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

namespace palpate {

/// Writes a moving surface or solid for ParaView: `tissue.pvd` with the times and `tissue/tissue_0000.vtp`, `…_0001.vtp`, one a frame; of a solid .vtu.
///   SeriesWriter series("out/tissue.pvd");
///   series.add(0.0, body.mesh(), body.displacements());
///   series.add(0.1, TetrahedralMesh<double>{body.positions(), tetrahedra}, body.displacements(), solid_fields(body.tissue(), body.positions()));
/// Every file is there as a whole or not at all, and the .pvd names only frames that are: a run that is stopped leaves a
/// series that opens. The number of vertices may change from frame to frame, as it does in a cut.
/// Errors     `FileError`: a folder or file that can not be written. `InvalidArgument`: a time that is not finite or does not grow, a
///            displacement that is not 3 × the number of vertices, fields that are not those of as many tetrahedra. `InvalidMesh`: a vertex that is not there.
/// Cost       `add` writes one frame and the list of all frames.
class SeriesWriter {
 public:
  /// An old series of this name is replaced frame by frame; its folder is made, not emptied.
  explicit SeriesWriter(std::filesystem::path pvd) : pvd_(std::move(pvd)) {
    if (pvd_.extension() != ".pvd")
      throw InvalidArgument(detail::message(pvd_.string(), ": a ParaView series ends in .pvd"));
    stem_ = pvd_.stem().string();
    folder_ = pvd_.parent_path() / stem_;
    std::error_code problem;
    std::filesystem::create_directories(folder_, problem);
    if (problem || !std::filesystem::is_directory(folder_))
      throw FileError(detail::message("can not make the folder ", folder_.string(), ": ",
                                      problem ? problem.message() : std::string("a file is in its place")));
    write_list();
  }

  /// Adds the frame at `time` [s].
  template <RealScalar Scalar>
  void add(double time, TriangleMesh<Scalar> const& mesh) {
    add_frame<vtkXMLPolyDataWriter>(time, ".vtp", *detail::to_smooth_poly_data(mesh));
  }
  /// With an array "displacement" [m], one column a vertex, to colour or warp by.
  template <RealScalar Scalar>
  void add(double time, TriangleMesh<Scalar> const& mesh, Matrix<Scalar, 3, Dynamic> const& displacement) {
    auto const surface = detail::to_smooth_poly_data(mesh);
    add_displacement(*surface, displacement);
    add_frame<vtkXMLPolyDataWriter>(time, ".vtp", *surface);
  }
  /// A solid where it is now, with its displacement, and of each tetrahedron "stress" [Pa], Cauchy's, "von Mises stress" [Pa], "strain energy density" [J/m3] and
  /// "volume ratio".
  template <RealScalar Scalar>
  void add(double time, TetrahedralMesh<Scalar> const& mesh, Matrix<Scalar, 3, Dynamic> const& displacement, SolidFields<Scalar> const& fields) {
    for (Eigen::Index const size : {fields.stress.cols(), fields.von_mises.size(), fields.energy_density.size(), fields.determinant.size()})
      if (size != mesh.tetrahedra.cols())
        throw InvalidArgument(detail::message("frame ", frames_, " has ", mesh.tetrahedra.cols(), " tetrahedra and fields of ", size));
    detail::check_corners(mesh);
    auto const solid = detail::to_unstructured_grid(mesh);
    add_displacement(*solid, displacement);
    auto* const cells = solid->GetCellData();
    cells->AddArray(detail::float_array("stress", fields.stress));
    cells->AddArray(detail::float_array("von Mises stress", fields.von_mises.transpose()));
    cells->AddArray(detail::float_array("strain energy density", fields.energy_density.transpose()));
    cells->AddArray(detail::float_array("volume ratio", fields.determinant.transpose()));
    add_frame<vtkXMLUnstructuredGridWriter>(time, ".vtu", *solid);
  }

  int frames() const noexcept { return frames_; }
  std::filesystem::path const& path() const noexcept { return pvd_; }

 private:
  template <RealScalar Scalar>
  void add_displacement(vtkPointSet& shape, Matrix<Scalar, 3, Dynamic> const& displacement) const {
    if (displacement.cols() != shape.GetNumberOfPoints())
      throw InvalidArgument(detail::message("frame ", frames_, " has ", shape.GetNumberOfPoints(), " vertices and ", displacement.cols(), " displacements"));
    shape.GetPointData()->AddArray(detail::float_array("displacement", displacement));
  }
  template <class Writer>
  void add_frame(double time, char const* extension, vtkDataSet& shape) {
    if (!std::isfinite(time)) throw InvalidArgument(detail::message("frame ", frames_, " is at ", time, " s; give a finite time"));
    if (frames_ > 0 && !(time > last_time_))
      throw InvalidArgument(detail::message("frame ", frames_, " is at ", time, " s, the one before at ", last_time_,
                                            " s; times must grow"));
    char name[32];
    std::snprintf(name, sizeof name, "_%04d%s", frames_, extension);
    std::filesystem::path const file = folder_ / (stem_ + name);
    {
      detail::MessageTrap const trap;
      vtkNew<Writer> writer;
      writer->WriteToOutputStringOn();
      writer->SetInputData(&shape);
      if (writer->Write() == 0)
        throw FileError(detail::message("can not write ", file.string(), ": ", trap.message()));
      detail::write_whole_file(file, writer->GetOutputString());
    }
    entries_ += "    <DataSet timestep=\"" + detail::to_text(time) + "\" part=\"0\" file=\"" +
                escaped(stem_ + "/" + stem_ + name) + "\"/>\n";
    last_time_ = time;
    ++frames_;
    write_list();
  }

  void write_list() const {
    detail::write_whole_file(pvd_, "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\">\n  <Collection>\n" +
                                       entries_ + "  </Collection>\n</VTKFile>\n");
  }

  static std::string escaped(std::string_view text) {
    std::string result;
    for (char const c : text) {
      if (c == '&') result += "&amp;";
      else if (c == '<') result += "&lt;";
      else if (c == '"') result += "&quot;";
      else result += c;
    }
    return result;
  }

  std::filesystem::path pvd_, folder_;
  std::string stem_, entries_;
  int frames_ = 0;
  double last_time_ = 0.0;
};

}  // namespace palpate
