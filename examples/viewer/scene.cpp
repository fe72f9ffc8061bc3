// SPDX-License-Identifier: MIT
#include "scene.hpp"

#include <palpate/mesh/normals.hpp>
#include <palpate/vtk/detail/poly_data.hpp>
#include <palpate/vtk/detail/scalpel.hpp>
#include <palpate/vtk/picture.hpp>

#include <Eigen/Geometry>

#include <vtkArrowSource.h>
#include <vtkCamera.h>
#include <vtkCylinderSource.h>
#include <vtkLight.h>
#include <vtkMatrix4x4.h>
#include <vtkProperty.h>
#include <vtkSphereSource.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

namespace viewer {

namespace {

constexpr double tool_length = 0.14, probe_radius = 0.0026, tip_radius = 0.0019, proxy_radius = 0.0012, arrow_width = 0.020;   // m
constexpr double wall_depth = 0.010;   // m

vtkPolyDataMapper* mapper_of(vtkActor* actor) { return static_cast<vtkPolyDataMapper*>(actor->GetMapper()); }

void set_pose(vtkActor* actor, Eigen::Affine3d const& pose) {
  vtkNew<vtkMatrix4x4> matrix;
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 4; ++column) matrix->SetElement(row, column, pose.matrix()(row, column));
  actor->SetUserMatrix(matrix);
}

/// What the upper side casts onto the table, from the left and from behind. Where it lies twice, what comes from higher lies a little higher and later in
/// the list, so that both are blended.
Mesh shadow_of(Mesh const& organ) {
  Vector const ray(0.20, -0.04, -1.0);   // of 1 m downwards
  double const table = organ.points.row(2).minCoeff();
  Mesh cast{organ.points, {}};
  for (Eigen::Index i = 0; i < cast.points.cols(); ++i) cast.points.col(i) += (1.0 - 1e-3) * (organ.points(2, i) - table) * ray;
  std::vector<int> lit;
  for (int t = 0; t < organ.triangles.cols(); ++t)
    if (palpate::triangle_normal(organ, t).dot(ray) < 0.0) lit.push_back(t);
  auto const height = [&](int t) { return cast.points(2, organ.triangles(0, t)); };
  std::sort(lit.begin(), lit.end(), [&](int a, int b) { return height(a) < height(b); });
  cast.triangles = organ.triangles(Eigen::all, lit);
  return cast;
}

/// From the tip to the handle: held like a pen, from the right and from in front.
Vector const held_along = Vector(0.42, -0.34, 0.84).normalized();

}  // namespace

Scene::Scene() {
  renderer_->SetLayer(0);
  in_front_->SetLayer(1);
  in_front_->SetActiveCamera(renderer_->GetActiveCamera());
  in_front_->InteractiveOff();
  renderer_->GradientBackgroundOn();
  renderer_->SetBackground(0.90, 0.93, 0.94);
  renderer_->SetBackground2(0.60, 0.71, 0.76);

  organ_ = add(renderer_, colours::tissue);
  organ_->GetProperty()->SetSpecular(0.28);
  organ_->GetProperty()->SetSpecularPower(32.0);
  inside_->DeepCopy(organ_->GetProperty());
  inside_->SetColor(colours::interior[0], colours::interior[1], colours::interior[2]);
  inside_->SetSpecular(0.05);
  walls_ = add(renderer_, colours::wound);
  shadow_ = add(renderer_, {0.10, 0.14, 0.18});
  shadow_->GetProperty()->LightingOff();
  shadow_->GetProperty()->SetOpacity(0.15);
  shadow_->ForceOpaqueOn();   // blended where it is drawn: a pass for translucent things costs as much as all the rest

  auto const tool_world = Eigen::Affine3d(Eigen::Scaling(tool_length));
  blade_ = add(renderer_, {0.80, 0.82, 0.85});
  mapper_of(blade_)->SetInputData(palpate::detail::scalpel_blade(tool_world));
  handle_ = add(renderer_, {0.66, 0.71, 0.75});
  for (vtkActor* const steel : {blade_, handle_}) steel->GetProperty()->SetAmbient(0.45);
  mapper_of(handle_)->SetInputData(palpate::detail::scalpel_handle(tool_world));
  probe_ = add(renderer_, {0.80, 0.82, 0.85});
  vtkNew<vtkSphereSource> ball;
  ball->SetRadius(probe_radius);
  ball->SetThetaResolution(32);
  ball->SetPhiResolution(24);
  mapper_of(probe_)->SetInputConnection(ball->GetOutputPort());
  stem_ = add(renderer_, {0.60, 0.66, 0.70});
  vtkNew<vtkCylinderSource> stem;   // along y
  stem->SetRadius(0.0016);
  stem->SetHeight(tool_length);
  stem->SetCenter(0.0, tool_length / 2, 0.0);
  stem->SetResolution(24);
  mapper_of(stem_)->SetInputConnection(stem->GetOutputPort());

  hook_ = add(renderer_, {0.56, 0.70, 0.80});
  hook_->GetProperty()->SetAmbient(0.40);
  mapper_of(hook_)->SetInputData(palpate::detail::to_smooth_poly_data(palpate::make_hook_shape<double>(hook_shape).picture));

  auto const glow = [](vtkActor* actor) {   // the same colour wherever the light comes from, with a little shape
    actor->GetProperty()->SetAmbient(0.75);
    actor->GetProperty()->SetDiffuse(0.30);
    actor->GetProperty()->SetSpecular(0.0);
  };
  auto const dot = [&](Colour const& colour, double radius) {
    vtkActor* const actor = add(in_front_, colour);
    vtkNew<vtkSphereSource> sphere;
    sphere->SetRadius(radius);
    sphere->SetThetaResolution(24);
    sphere->SetPhiResolution(16);
    mapper_of(actor)->SetInputConnection(sphere->GetOutputPort());
    glow(actor);
    return actor;
  };
  arrow_ = add(in_front_, colours::force);
  vtkNew<vtkArrowSource> arrow;   // along x, of unit length
  arrow->SetShaftRadius(0.045);
  arrow->SetTipRadius(0.13);
  arrow->SetTipLength(0.30);
  arrow->SetShaftResolution(24);
  arrow->SetTipResolution(32);
  hook_arrow_ = add(in_front_, colours::hook_force);
  for (vtkActor* const each : {arrow_, hook_arrow_}) {
    mapper_of(each)->SetInputConnection(arrow->GetOutputPort());
    glow(each);
  }
  way_ = add(in_front_, colours::tip);
  mapper_of(way_)->SetInputConnection(way_line_->GetOutputPort());
  way_->GetProperty()->SetLineWidth(2.5f);
  way_->GetProperty()->LightingOff();
  proxy_ = dot(colours::proxy, proxy_radius);
  tip_ = dot(colours::tip, tip_radius);
  for (vtkActor* const hidden : {proxy_, way_, arrow_, walls_, probe_, stem_, hook_, hook_arrow_}) hidden->VisibilityOff();
}

vtkActor* Scene::add(vtkRenderer* renderer, Colour const& colour) {
  vtkNew<vtkPolyDataMapper> mapper;
  vtkNew<vtkActor> actor;
  actor->SetMapper(mapper);
  vtkProperty* const look = actor->GetProperty();
  look->SetColor(colour[0], colour[1], colour[2]);
  look->SetAmbient(0.18);
  look->SetDiffuse(0.85);
  look->SetSpecularColor(1.0, 1.0, 1.0);
  look->SetSpecular(0.35);
  look->SetSpecularPower(30.0);
  look->SetInterpolationToPhong();
  renderer->AddActor(actor);
  return actor;
}

void Scene::add_to(vtkRenderWindow* window) {
  window->AddRenderer(renderer_);
  window->AddRenderer(in_front_);
}

void Scene::place(double left, double low, double right, double high) {
  renderer_->SetViewport(left, low, right, high);
  in_front_->SetViewport(left, low, right, high);
}

void Scene::show_body(palpate::BodySnapshot<double> const& body, bool is_uncut) {
  bool const has_flesh = std::find(body.is_wound.begin(), body.is_wound.end(), 1) != body.is_wound.end();
  walls_->GetProperty()->SetAmbient(has_flesh ? 0.45 : 0.18);   // flesh lets light through
  if (has_flesh) return show_solid(body);
  Mesh const mesh{body.points, body.triangles};
  mapper_of(organ_)->SetInputData(palpate::detail::to_smooth_poly_data(mesh));
  organ_->GetProperty()->SetBackfaceCulling(is_uncut);   // the inside is seen through a cut alone
  organ_->SetBackfaceProperty(is_uncut ? nullptr : inside_.Get());
  walls_->SetVisibility(!is_uncut);
  if (!is_uncut) mapper_of(walls_)->SetInputData(palpate::detail::coloured_walls(mesh, wall_depth, colours::wound, colours::interior));
}

/// Skin, and the walls of wounds with normals of their own: sharp along the lips.
void Scene::show_solid(palpate::BodySnapshot<double> const& body) {
  std::vector<int> skin, flesh;
  for (int t = 0; t < body.triangles.cols(); ++t) (body.is_wound[static_cast<std::size_t>(t)] != 0 ? flesh : skin).push_back(t);
  auto const part = [&](std::vector<int> const& triangles) { return palpate::detail::to_smooth_poly_data(Mesh{body.points, body.triangles(Eigen::all, triangles)}); };
  mapper_of(organ_)->SetInputData(part(skin));
  mapper_of(walls_)->SetInputData(part(flesh));
  organ_->GetProperty()->BackfaceCullingOn();   // a solid has no inside to be seen
  organ_->SetBackfaceProperty(nullptr);
  walls_->VisibilityOn();
}

void Scene::show(Moment const& now, Blade blade, Vector const& place) {
  Vector const& tip = now.tick.tip;
  Eigen::Affine3d pose = Eigen::Affine3d::Identity();
  pose.linear().col(2) = held_along;
  pose.linear().col(0) = (Vector::UnitX() - held_along.x() * held_along).normalized();   // the blade's edge looks to the right
  pose.linear().col(1) = pose.linear().col(2).cross(pose.linear().col(0));
  pose.translation() = tip;
  set_pose(blade_, pose);
  set_pose(handle_, pose);
  set_pose(probe_, pose);
  Eigen::Affine3d const upright = pose * Eigen::AngleAxisd(std::numbers::pi / 2, Vector::UnitX());   // y to z
  set_pose(stem_, upright);
  bool const blunt = blade == Blade::none;
  blade_->SetVisibility(!blunt);
  handle_->SetVisibility(!blunt);
  probe_->SetVisibility(blunt);
  stem_->SetVisibility(blunt);

  tip_->SetPosition(tip.x(), tip.y(), tip.z());
  Vector const eye(renderer_->GetActiveCamera()->GetPosition());
  Vector const nearer = now.proxy + 2.0 * tip_radius * (eye - now.proxy).normalized();   // the same pixel, in front of the tip's ball
  proxy_->SetPosition(nearer.x(), nearer.y(), nearer.z());
  proxy_->SetVisibility(now.touches);
  Vector const end = now.touches ? now.proxy : place;
  way_->SetVisibility((end - tip).norm() > 2e-4);
  Colour const line = now.touches ? colours::tip : Colour{1.0, 1.0, 1.0};
  way_->GetProperty()->SetColor(line[0], line[1], line[2]);
  way_line_->SetPoint1(tip.x(), tip.y(), tip.z());
  way_line_->SetPoint2(end.x(), end.y(), end.z());

  show_arrow(arrow_, now.proxy, now.tick.force);
}

void Scene::show_arrow(vtkActor* arrow, Vector const& from, Vector const& force) {
  double const length = arrow_per_newton * force.norm();
  arrow->SetVisibility(length > 5e-4);
  if (!(length > 5e-4)) return;
  Vector const x = force.normalized(), y = x.unitOrthogonal();
  double const width = std::min(arrow_width, 0.8 * length);
  Eigen::Affine3d pose = Eigen::Affine3d::Identity();
  pose.linear().col(0) = length * x;
  pose.linear().col(1) = width * y;
  pose.linear().col(2) = width * x.cross(y);
  pose.translation() = from;
  set_pose(arrow, pose);
}

void Scene::show_hook(palpate::ToolPose<double> const& pose, Vector const& force) {
  Eigen::Affine3d at = Eigen::Affine3d::Identity();
  at.linear() = pose.orientation.toRotationMatrix();
  at.translation() = pose.position;
  set_pose(hook_, at);
  hook_->VisibilityOn();
  show_arrow(hook_arrow_, pose.position, force);
}

void Scene::hide_hook() {
  hook_->VisibilityOff();
  hook_arrow_->VisibilityOff();
}

void Scene::look_at(Mesh const& organ) {
  palpate::Camera const camera = palpate::framing(organ, Vector(0.10, -0.92, 0.85), Vector::UnitZ(), 1.10, 0.12);
  vtkCamera* const eye = renderer_->GetActiveCamera();
  eye->SetPosition(camera.position.data());
  eye->SetFocalPoint(camera.target.data());
  eye->SetViewUp(camera.up.data());
  eye->SetViewAngle(camera.view_angle);
  middle_ = camera.target;
  framed_from_ = eye->GetDistance();

  mapper_of(shadow_)->SetInputData(palpate::detail::to_poly_data(shadow_of(organ)));

  // A key light from above and the left, a weaker one from the right, one from the eye: they stay with the organ.
  Vector const ahead = (camera.target - camera.position).normalized(), right = ahead.cross(Vector::UnitZ()).normalized(), above = right.cross(ahead);
  for (vtkRenderer* const renderer : {renderer_.Get(), in_front_.Get()}) {
    renderer->RemoveAllLights();
    renderer->AutomaticLightCreationOff();
    auto const light = [&](double across, double upwards, double towards, double strength, Colour const& colour) {
      Vector const position = camera.target + across * right + upwards * above - towards * ahead;
      vtkNew<vtkLight> lamp;
      lamp->SetLightTypeToSceneLight();
      lamp->SetPosition(position.data());
      lamp->SetFocalPoint(camera.target.data());
      lamp->SetColor(colour.data());
      lamp->SetIntensity(strength);
      renderer->AddLight(lamp);
    };
    light(-0.8, 1.0, 0.7, 0.80, {1.0, 0.97, 0.92});
    light(1.0, 0.1, 0.8, 0.35, {0.88, 0.94, 1.0});
    light(0.1, -0.5, 1.0, 0.30, {1.0, 1.0, 1.0});
  }
}

void Scene::turn(double across, double upwards) {
  vtkCamera* const eye = renderer_->GetActiveCamera();
  eye->Azimuth(across);
  Vector const from = Vector(eye->GetPosition()) - middle_;
  double const height = std::asin(std::clamp(from.normalized().z(), -1.0, 1.0)) * 180.0 / std::numbers::pi;
  eye->Elevation(std::clamp(height + upwards, 10.0, 85.0) - height);   // never below the table, never over the top
  eye->OrthogonalizeViewUp();
  eye->SetViewUp(0.0, 0.0, 1.0);
}

void Scene::come_nearer(double factor) {
  vtkCamera* const eye = renderer_->GetActiveCamera();
  double const distance = eye->GetDistance();
  if (distance / factor > framed_from_ / 3.0 && distance / factor < 3.0 * framed_from_) eye->Dolly(factor);
}

}  // namespace viewer
