// SPDX-License-Identifier: MIT
#include "session.hpp"
#include "session_run.hpp"

#include <palpate/volume/embedded_surface.hpp>
#include <palpate/volume/fill.hpp>

#include <vector>

namespace incision {

namespace {

/// A solid under the skin of the organ, which it carries for the pictures.
template <class Integrator>
Outcome run_with(Options const& options, Organ const& organ, Hand& hand, Integrator integrator) {
  Solid solid{.young = options.young.value_or(default_young), .poisson = options.poisson.value_or(default_poisson), .edge = organ.edge};
  auto const filling = palpate::fill(organ.mesh, {.edge = solid.edge});
  solid.filled = to_string(filling);
  solid.tetrahedra = static_cast<int>(filling.mesh.tetrahedra.cols());
  if (filling.pieces > 1)
    throw palpate::InvalidMesh(palpate::detail::message(organ.name, ": filled with an edge of ", solid.edge, " m the organ falls into ", filling.pieces,
                                                        " pieces; give a smaller --edge"));
  palpate::FiniteElements<double, palpate::StableNeoHookean<double>> tissue(
      filling.mesh, {.density = organ.mass / filling.volume, .material = {solid.young, solid.poisson}, .damping = {.alpha = 30.0}});
  auto const skin = palpate::surface(filling.mesh);
  auto const normals = palpate::vertex_normals(skin);
  for (int i = 0; i < normals.cols(); ++i)
    if (normals.col(i).norm() > 0.5 && normals.col(i).dot(organ.up) < 0.2) tissue.nail(i), ++solid.nailed;
  palpate::SoftBody body(std::move(tissue), integrator);
  palpate::TriangleMesh<double> border = skin;   // without the vertices inside
  palpate::repair(border);
  hand = prepare_hand(options, organ, border);

  Device device = make_device(options, hand);
  bool const realtime = options.realtime || keeps_time(device);
  palpate::Simulator simulator(std::move(device), std::move(body), palpate::NoCutter<double>({.tip_radius = organ.probe_radius}), HandForce(options, hand.along),
                               {.body_rate = 100.0, .servo = {.mapping = mapping_of(options, hand)}});
  palpate::EmbeddedSurface<double> carried(organ.mesh, filling.mesh);
  auto const frame = [&](double time, auto const& positions, Vector const& tip, CuttingPhase phase, double depth) {
    carried.update(positions);
    return Frame{.time = time, .mesh = carried.mesh(), .displacement = carried.mesh().points - organ.mesh.points, .tip = tip, .phase = phase, .depth = depth};
  };
  Outcome outcome = run_and_report(
      simulator, hand, realtime, [&](auto const& all, palpate::Tick const& tick) { return frame(tick.time, all.body().positions(), tick.tip, tick.phase, tick.depth); },
      [&](auto const& now) { return frame(now.time, now.points, now.tip, now.phase, 0.0); });
  solid.stable_step = simulator.body().stable_step();
  solid.solved = simulator.body().solve_statistics();
  outcome.solid = solid;
  return outcome;
}

}  // namespace

Outcome run_solid(Options const& options, Organ const& organ, Hand& hand) {
  if (options.integrator == IntegratorName::leapfrog) return run_with(options, organ, hand, palpate::LeapfrogVerlet{});
  return run_with(options, organ, hand, palpate::BackwardEuler{});
}

}  // namespace incision
