// SPDX-License-Identifier: MIT
#include "simulation.hpp"

#include "../incision/upper_side.hpp"
#include "../organ_file.hpp"

#include <palpate/core/error.hpp>
#include <palpate/mesh/organ.hpp>

#include <Eigen/Geometry>

namespace viewer {

Mesh organ_of(Setup const& setup) {
  if (setup.mesh.empty()) return palpate::make_organ<double>({.vertices = setup.vertices});
  Mesh organ = organ_file::read_organ("viewer", setup.mesh, setup.unit);
  organ.points = (Eigen::Quaterniond::FromTwoVectors(incision::upper_direction(organ, setup.up), Vector::UnitZ()).matrix() * organ.points).eval();
  Vector const low = organ.points.rowwise().minCoeff(), high = organ.points.rowwise().maxCoeff();
  constexpr double depth = values_of(TissueName::soft).puncture_depth;
  if (!(high.z() - low.z() > depth))
    throw palpate::InvalidMesh(palpate::detail::message(setup.mesh.string(), ": the organ is ", 1000.0 * (high.z() - low.z()), " mm thick, and this tool cuts from ",
                                                        1000.0 * depth, " mm on; say with --unit what the file is written in, or take incision, which adapts its depth"));
  Vector const start = HandTarget{}.position;
  organ.points.colwise() += Vector(start.x() - (low.x() + high.x()) / 2, start.y() - (low.y() + high.y()) / 2, start.z() - 0.03 - high.z());
  return organ;
}

std::shared_ptr<Simulation> make_simulation(Setup const& setup, Mesh const& organ, Targets const& targets) {
  if (setup.tissue == TissueName::solid) return make_solid(setup, organ, targets);
  if (setup.integrator == IntegratorName::backward_euler) return make_backward_euler(setup, organ, targets);
  return make_leapfrog(setup, organ, targets);
}

}  // namespace viewer
