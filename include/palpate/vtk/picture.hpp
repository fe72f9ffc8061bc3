// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/mesh/triangle_mesh.hpp>
#include <palpate/vtk/detail/off_screen.hpp>
#include <palpate/vtk/detail/poly_data.hpp>
#include <palpate/vtk/detail/scalpel.hpp>

#include <Eigen/Geometry>

#include <vtkActor.h>
#include <vtkCamera.h>
#include <vtkLight.h>
#include <vtkNew.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkRenderer.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <optional>
#include <span>

namespace palpate {

/// Where a picture is seen from. Units: metres; `view_angle` in degrees, of the shorter side of the picture.
struct Camera {
  Vector3<double> position{0.0, -0.5, 0.5};
  Vector3<double> target = Vector3<double>::Zero();
  Vector3<double> up = Vector3<double>::UnitZ();
  double view_angle = 24.0;
};

/// A camera that sees a ball, from the direction `from` (any length) as seen from the ball's middle.
inline Camera looking_at(Vector3<double> const& middle, double radius, Vector3<double> const& from, Vector3<double> const& up) {
  if (!(radius > 0.0) || !(from.norm() > 0.0) || !(from.cross(up).norm() > 0.0) || !is_finite(middle))
    throw InvalidArgument(detail::message("a camera needs a ball of positive radius and two directions that differ; the radius is ", radius));
  Camera camera;
  camera.target = middle;
  camera.up = up.normalized();
  camera.position = middle + from.normalized() * (radius / std::sin(camera.view_angle / 2 * 3.14159265358979323846 / 180.0));
  return camera;
}

/// A camera that sees all of a mesh, from a direction (any length): in a picture of this width over height, with a margin.
inline Camera framing(TriangleMesh<double> const& mesh, Vector3<double> const& from, Vector3<double> const& up, double aspect = 4.0 / 3.0,
                      double margin = 0.06) {
  if (mesh.points.cols() == 0 || !(from.norm() > 0.0) || !(from.cross(up).norm() > 0.0) || !(aspect > 0.0) || !(margin >= 0.0 && margin < 1.0))
    throw InvalidArgument("a camera needs a mesh, two directions that differ, a positive aspect and a margin from 0 to 1");
  Camera camera;
  Eigen::Matrix3d axes;   // right, up and back, as rows
  axes.row(2) = from.normalized().transpose();
  axes.row(0) = up.cross(from).normalized().transpose();
  axes.row(1) = Vector3<double>(axes.row(2)).cross(Vector3<double>(axes.row(0))).transpose();
  Matrix3X<double> const seen = axes * mesh.points;
  Vector3<double> const middle = (seen.rowwise().minCoeff() + seen.rowwise().maxCoeff()) / 2;
  double const tangent = std::tan(camera.view_angle / 2 * 3.14159265358979323846 / 180.0) * (1.0 - margin);
  double const across = tangent * std::max(1.0, aspect), down = tangent * std::max(1.0, 1.0 / aspect);   // view_angle is of the shorter side
  double distance = 0.0;
  for (Eigen::Index i = 0; i < seen.cols(); ++i) {
    Vector3<double> const p = seen.col(i) - middle;
    distance = std::max({distance, p.z() + std::abs(p.x()) / across, p.z() + std::abs(p.y()) / down});
  }
  camera.target = axes.transpose() * middle;
  camera.up = up.normalized();
  camera.position = camera.target + distance * from.normalized();
  return camera;
}

/// A scalpel in a picture. Units: metres. `axis` goes from the tip to the handle, `edge` is where the blade cuts; any lengths.
struct PictureTool {
  Vector3<double> tip = Vector3<double>::Zero();
  Vector3<double> axis = Vector3<double>::UnitZ();
  Vector3<double> edge = Vector3<double>::UnitX();
  double length = 0.14;
};

/// Another surface in a picture, both of its sides in one colour: a tool's picture where the tool is, or what lies beside the tissue. Metres; red, green, blue in 0 … 1.
struct PicturePart {
  TriangleMesh<double> mesh;
  std::array<double, 3> colour{0.72, 0.75, 0.78};
};

/// How a picture looks. Colours are red, green, blue in 0 … 1.
struct PictureStyle {
  int width = 1280;   ///< pixels
  int height = 960;
  std::array<double, 3> tissue{0.56, 0.20, 0.16};
  std::array<double, 3> wound{0.70, 0.07, 0.07};      ///< the wound at its lips
  std::array<double, 3> interior{0.16, 0.01, 0.02};   ///< deep in the wound, and the surface seen from inside
  std::array<double, 3> background{0.93, 0.95, 0.96};
  std::array<double, 3> background_top{0.62, 0.71, 0.76};
  std::array<double, 3> lines{0.12, 0.12, 0.18};
  double line_width = 0.0;      ///< pixels, of the triangles' edges; 0: none
  double wound_depth = 0.012;   ///< m, how far the walls below border edges reach; 0: none. A surface has no inside of its own
};

/// Draws a tissue surface, off screen, into a PNG file: smooth over vertices, sharp along cuts, its inside dark red, walls
/// below the lips of a cut so that a wound is seen as one, a scalpel, and any other parts.
/// Errors     `FileError` without a display (see `VirtualDisplay`) or when the file can not be written; none is left half-written.
/// Limits     every border of the surface is drawn as a wound: for a sheet of tissue set `wound_depth` to 0. Needs OpenGL 3.2;
///            Mesa's software drawing does. One picture at a time in a process.
template <RealScalar Scalar>
void write_picture(std::filesystem::path const& file, TriangleMesh<Scalar> const& mesh, Camera const& camera,
                   std::optional<PictureTool> const& tool = std::nullopt, PictureStyle const& style = {}, std::span<PicturePart const> parts = {}) {
  if (style.width < 16 || style.height < 16 || style.width > 16384 || style.height > 16384)
    throw InvalidArgument(detail::message("a picture of ", style.width, " x ", style.height, " pixels; give 16 … 16384"));
  detail::require_display(file);
  detail::MessageTrap const trap;
  vtkNew<vtkRenderer> renderer;

  auto const add = [&](vtkPolyData* surface, std::array<double, 3> const& colour, double shine, double power) {
    vtkNew<vtkPolyDataMapper> mapper;
    mapper->SetInputData(surface);
    vtkNew<vtkActor> actor;
    actor->SetMapper(mapper);
    vtkProperty* const look = actor->GetProperty();
    look->SetColor(colour[0], colour[1], colour[2]);
    look->SetAmbient(0.18);
    look->SetDiffuse(0.85);
    look->SetSpecularColor(1.0, 1.0, 1.0);
    look->SetSpecular(shine);
    look->SetSpecularPower(power);
    renderer->AddActor(actor);
    return actor->GetProperty();
  };

  vtkProperty* const tissue = add(detail::to_smooth_poly_data(mesh), style.tissue, 0.22, 28.0);
  tissue->SetInterpolationToPhong();
  tissue->SetEdgeVisibility(style.line_width > 0.0);
  tissue->SetLineWidth(static_cast<float>(style.line_width));
  tissue->SetEdgeColor(style.lines[0], style.lines[1], style.lines[2]);
  vtkNew<vtkProperty> inside;
  inside->DeepCopy(tissue);
  inside->SetColor(style.interior[0], style.interior[1], style.interior[2]);
  inside->SetSpecular(0.05);
  renderer->GetActors()->GetLastActor()->SetBackfaceProperty(inside);

  if (style.wound_depth > 0.0) {
    auto const walls = detail::coloured_walls(mesh, style.wound_depth, style.wound, style.interior);
    if (walls->GetNumberOfPolys() > 0) add(walls, style.wound, 0.25, 30.0)->SetInterpolationToPhong();
  }

  if (tool) {
    Vector3<double> const z = tool->axis.normalized();
    Vector3<double> x = tool->edge - tool->edge.dot(z) * z;
    if (!(x.norm() > 1e-9 * tool->edge.norm())) x = z.unitOrthogonal();
    x.normalize();
    Eigen::Affine3d world = Eigen::Affine3d::Identity();
    world.linear().col(0) = tool->length * x;
    world.linear().col(1) = tool->length * z.cross(x);
    world.linear().col(2) = tool->length * z;
    world.translation() = tool->tip;
    add(detail::scalpel_blade(world), {0.80, 0.82, 0.85}, 0.5, 30.0)->SetInterpolationToPhong();
    add(detail::scalpel_handle(world), {0.55, 0.60, 0.64}, 0.4, 25.0)->SetInterpolationToPhong();
  }

  for (PicturePart const& part : parts) add(detail::to_smooth_poly_data(part.mesh), part.colour, 0.5, 30.0)->SetInterpolationToPhong();

  vtkCamera* const eye = renderer->GetActiveCamera();
  eye->SetPosition(camera.position.data());
  eye->SetFocalPoint(camera.target.data());
  eye->SetViewUp(camera.up.data());
  eye->SetUseHorizontalViewAngle(style.width < style.height);
  eye->SetViewAngle(camera.view_angle);
  renderer->ResetCameraClippingRange();

  // A key light from above and the side, weaker ones from the other side and from the eye, one behind: as over an operating table.
  Vector3<double> const ahead = (camera.target - camera.position).normalized();
  Vector3<double> const right = ahead.cross(camera.up).normalized(), above = right.cross(ahead);
  double const distance = (camera.target - camera.position).norm();
  auto const light = [&](double across, double upwards, double towards, double strength, std::array<double, 3> const& colour) {
    Vector3<double> const position = camera.target + distance * (across * right + upwards * above - towards * ahead);
    vtkNew<vtkLight> lamp;
    lamp->SetLightTypeToSceneLight();
    lamp->SetPosition(position.data());
    lamp->SetFocalPoint(camera.target.data());
    lamp->SetColor(colour.data());
    lamp->SetIntensity(strength);
    renderer->AddLight(lamp);
  };
  renderer->AutomaticLightCreationOff();
  light(-0.8, 1.0, 0.7, 0.75, {1.0, 0.97, 0.92});
  light(1.0, 0.1, 0.8, 0.35, {0.88, 0.94, 1.0});
  light(0.1, -0.5, 1.0, 0.35, {1.0, 1.0, 1.0});
  light(0.3, 0.8, -0.9, 0.30, {1.0, 1.0, 1.0});

  renderer->GradientBackgroundOn();
  renderer->SetBackground(style.background[0], style.background[1], style.background[2]);
  renderer->SetBackground2(style.background_top[0], style.background_top[1], style.background_top[2]);

  detail::write_png(file, renderer, style.width, style.height);
}

}  // namespace palpate
