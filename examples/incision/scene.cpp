// SPDX-License-Identifier: MIT
#include "scene.hpp"

#include "../organ_file.hpp"

#include <palpate/collision/surface_tree.hpp>
#include <palpate/core/error.hpp>
#include <palpate/core/units.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/measures.hpp>
#include <palpate/mesh/normals.hpp>
#include <palpate/mesh/organ.hpp>
#include <palpate/volume/winding_number.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace incision {

using palpate::detail::message;

namespace {

/// Palpates without puncturing, comes back, goes in, follows the surface, and leaves.
palpate::Trajectory<double> stroke(SurfaceLine const& line, Organ const& organ, double length) {
  double const press = 0.75 * organ.puncture_depth, cut = organ.cut_depth, clear = 0.06 * organ.diagonal;
  auto const at = [&](std::size_t i, double depth) -> Vector { return line.points[i] - depth * line.normals[i]; };
  std::size_t const last = line.points.size() - 1;
  double const ramp = 0.3, cruise = std::max(1.0, length / 0.02);   // s; 2 cm/s

  auto path = palpate::Trajectory<double>::start(at(0, -clear));
  path.line(at(0, press), 0.8, palpate::Pace::minimum_jerk);
  path.hold(0.2);
  path.line(at(0, -0.3 * clear), 0.6, palpate::Pace::minimum_jerk);
  path.line(at(0, cut), 0.9, palpate::Pace::minimum_jerk);
  // Along the line from rest to rest: speed grows as 3x² − 2x³ over the ramp. A point every 10 ms.
  auto const gone = [&](double t) {   // of `cruise`, in seconds at full speed
    double const x = std::clamp(t / ramp, 0.0, 1.0);
    return ramp * (x * x * x - x * x * x * x / 2) + std::max(0.0, t - ramp);
  };
  double const cutting_time = cruise + ramp;
  int const pieces = static_cast<int>(std::ceil(100.0 * cutting_time));
  for (int k = 1; k <= pieces; ++k) {
    double const t = cutting_time * k / pieces;
    double const u = (t < cutting_time / 2 ? gone(t) : cruise - gone(cutting_time - t)) / cruise * double(last);
    auto const i = std::min(static_cast<std::size_t>(std::max(u, 0.0)), last - 1);
    double const rest = u - double(i);
    path.line((1.0 - rest) * at(i, cut) + rest * at(i + 1, cut), cutting_time / pieces);
  }
  path.line(at(last, -clear), 0.6, palpate::Pace::minimum_jerk);
  return path;
}

/// A blade that has to go deeper than the organ is thick before it cuts would leave at the other side.
void check_depth(double depth, Organ const& organ) {
  Eigen::RowVectorXd const heights = organ.up.transpose() * organ.mesh.points;
  palpate::LengthRange const within{.low = 1e-6, .high = heights.maxCoeff() - heights.minCoeff()};
  if (!within.contains(depth))
    throw palpate::InvalidArgument(message("--puncture-depth is ", palpate::unlikely_length(depth, "m", within),
                                           "; give it in metres, no more than the organ is thick"));
}

/// Tissue is about as dense as water; bounds far enough apart for a shell and for a body of lead.
void check_mass(double mass, double volume) {
  constexpr double low = 20.0, high = 20000.0;   // kg/m³
  auto const fits = [&](double kilograms) { return kilograms >= low * volume && kilograms <= high * volume; };
  if (fits(mass)) return;
  throw palpate::InvalidArgument(message("--mass is ", mass, " kg for ", volume, " m³, outside ", low, " … ", high, " kg/m³",
                                         fits(mass / 1000.0) ? message("; in g it would be ", mass / 1000.0, " kg") : std::string(),
                                         "; give it in kilograms"));
}

/// One line for each way in which a path can not be used, or the run is too short for it.
void check_path(palpate::Trajectory<double> const& path, TriangleMesh<double> const& mesh, double seconds, std::string const& name) {
  palpate::SurfaceTree<double> const tree(mesh);
  constexpr palpate::LengthRange reach{.low = 0.0, .high = palpate::organ_extent.high};
  Vector const middle = mesh.points.rowwise().mean();
  auto const distance = [&](Vector const& p) { return tree.nearest(mesh.points, p).distance; };
  palpate::WindingNumber const winding(mesh);
  auto const inside = [&](Vector const& p) { return winding(p) > 0.5; };
  if (inside(path.begin()))
    throw palpate::InvalidArgument(message(name, ": the path starts ", 1000.0 * distance(path.begin()),
                                           " mm inside the organ; let it start outside"));
  double nearest = std::numeric_limits<double>::infinity(), when = 0.0;
  Vector before = path.begin();
  auto const touches = [&](double time) {   // between the last time and this one
    Vector const p = path.at(time).position;
    if (double const away = (p - middle).norm(); !reach.contains(away))
      throw palpate::InvalidArgument(message(name, ": at ", time, " s the distance from the organ's middle is ",
                                             palpate::unlikely_length(away, "m", reach), "; write the path in metres, in the frame of the mesh"));
    double const d = distance(p);
    if (d < nearest) nearest = d, when = time;
    bool const through = d <= (p - before).norm() && (time == 0.0 || inside(p) != inside(before));
    before = p;
    return through;
  };
  double const end = std::min(seconds, path.duration());
  for (long long tick = 0; 1e-3 * double(tick) <= end; ++tick)
    if (touches(1e-3 * double(tick))) return;
  constexpr int looks = 10000;   // at what the run leaves out
  double const left_out = path.duration() - end;
  for (int i = 1; i <= looks && left_out > 0.0; ++i)
    if (double const time = end + left_out * i / looks; touches(time))
      throw palpate::InvalidArgument(message(name, ": a run of ", seconds, " s is too short: the path touches the organ at ", time, " s; ",
                                             time < longest_run ? "give a larger --seconds, or none" : message("let the path do so within ", longest_run, " s")));
  throw palpate::InvalidArgument(message(name, ": the path never touches the organ; it comes to ", 1000.0 * nearest, " mm at ", when,
                                         " s; is it in metres and in the frame of the mesh?"));
}

}  // namespace

Organ prepare_organ(Options const& options) {
  Organ organ;
  bool const own = options.mesh.empty();
  organ.name = own ? "the library's liver" : options.mesh.string();
  organ.mesh = own ? palpate::make_organ<double>({.vertices = options.resolution, .seed = 1}) : organ_file::read_organ("incision", options.mesh, options.unit);

  auto const& points = organ.mesh.points;
  organ.diagonal = (points.rowwise().maxCoeff() - points.rowwise().minCoeff()).norm();
  organ.up = upper_direction(organ.mesh, options.up);
  organ.edge = options.edge.value_or(organ.diagonal / 28);
  bool const solid = options.tissue == TissueName::solid;
  organ.puncture_depth = options.puncture_depth.value_or(solid ? 0.5 * organ.edge : std::min(0.018, organ.diagonal / 20.0));
  if (solid && organ.puncture_depth > 0.7 * organ.edge)   // a tip pushes a single triangle, which folds when it goes deeper
    throw palpate::InvalidArgument(message("--puncture-depth is ", organ.puncture_depth, " m; a solid with edges of ", organ.edge, " m is pressed no deeper than ", 0.7 * organ.edge,
                                           " m: give less, or a larger --edge"));
  organ.cut_depth = 1.15 * organ.puncture_depth;
  if (solid) {   // well into the tetrahedra, and well above the bed
    Eigen::RowVectorXd const heights = organ.up.transpose() * organ.mesh.points;
    organ.cut_depth = std::max(organ.cut_depth, std::min(1.6 * organ.edge, 0.3 * (heights.maxCoeff() - heights.minCoeff())));
  }
  double const volume = std::abs(palpate::volume(organ.mesh));   // m³
  organ.mass = options.mass.value_or(1060.0 * volume);
  if (options.puncture_depth) check_depth(*options.puncture_depth, organ);
  if (options.mass) check_mass(organ.mass, volume);

  // In proportion to the particles' mass, a body of any size and resolution swings at the same frequencies and allows the same step.
  double const particle = organ.mass / double(points.cols());
  organ.link_stiffness = options.link_stiffness.value_or(62500.0 * particle);
  organ.link_damping = options.link_damping.value_or(6.0 * particle);
  organ.home_stiffness = options.home_stiffness.value_or(25000.0 * particle);
  organ.home_damping = options.home_damping.value_or(310.0 * particle);

  auto const normals = palpate::vertex_normals(organ.mesh);
  for (int i = 0; i < points.cols(); ++i)
    if (normals.col(i).dot(organ.up) < 0.2) organ.underside.push_back(i);
  return organ;
}

Hand prepare_hand(Options const& options, Organ const& organ, TriangleMesh<double> const& settled) {
  double const afterwards = 2.2;   // s, for the wound to open
  std::optional<Hand> hand;
  if (options.tool.empty()) {
    double const length = stroke_length(settled);
    SurfaceLine const line = smoothest_line(settled, organ.up, length);
    if (line.points.size() < 2)
      throw palpate::InvalidMesh(message(organ.name, ": the side that looks up has no room for a stroke of ", 1000.0 * length,
                                         " mm; choose another with --up or give a path with --tool"));
    hand = Hand{.path = stroke(line, organ, length), .middle = line.points[line.points.size() / 2], .normal = line.normals[line.normals.size() / 2],
                .along = line.points.back() - line.points.front(), .length = length};
  } else {
    auto path = palpate::read_trajectory<double>(options.tool);
    hand = Hand{.path = path, .middle = Vector::Zero(), .normal = organ.up, .along = Vector::UnitX()};
  }
  constexpr double with_device = 10.0;   // s
  hand->seconds = options.seconds.value_or(options.device == "script" ? hand->path.duration() + afterwards : with_device);
  if (!(hand->seconds <= longest_run))
    throw palpate::InvalidArgument(message(options.tool.string(), ": the path takes ", hand->path.duration(), " s; a run is at most ", longest_run,
                                           " s, ", afterwards, " s of it for the wound to open; make it shorter, or say with --seconds how much of it to run"));
  if (options.device == "script") check_path(hand->path, settled, hand->seconds, options.tool.empty() ? organ.name : options.tool.string());

  if (!options.tool.empty()) {   // seen from above the touched part
    palpate::SurfaceTree<double> const tree(settled);
    auto const normals = palpate::vertex_normals(settled);
    std::vector<Vector> touched;
    Vector normal = Vector::Zero();
    double const duration = hand->path.duration(), margin = organ.diagonal / 50.0;
    for (int i = 0; i <= 400; ++i) {
      Vector const p = hand->path.at(duration * i / 400).position;
      auto const nearest = tree.nearest(settled.points, p);
      Vector n = Vector::Zero();
      for (int k = 0; k < 3; ++k) n += nearest.barycentric[k] * normals.col(settled.triangles(k, nearest.triangle));
      if ((p - nearest.point).dot(n) > 0.0 && nearest.distance > margin) continue;
      touched.push_back(nearest.point);
      normal += n;
    }
    if (!touched.empty()) {
      hand->middle = (touched.front() + touched.back()) / 2;
      hand->along = touched.back() - touched.front();
      hand->length = hand->along.norm();
      if (normal.norm() > 0.0) hand->normal = normal.normalized();
    }
    if (!(hand->along.norm() > 1e-6)) hand->along = hand->normal.unitOrthogonal();
  }
  hand->along = (hand->along - hand->along.dot(hand->normal) * hand->normal).normalized();
  hand->length = std::max(hand->length, stroke_length(settled) / 2);
  return *hand;
}

}  // namespace incision
