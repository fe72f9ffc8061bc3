// SPDX-License-Identifier: MIT
#include "../solid_picture.hpp"
#include "session.hpp"
#include "session_run.hpp"

#include <palpate/volume/embedded_surface.hpp>
#include <palpate/volume/fill.hpp>

#include <cstddef>
#include <utility>

namespace incision {

namespace {

/// A solid under the skin of the organ, which it carries for the pictures.
template <class Integrator>
Outcome run_with(Options const& options, Organ const& organ, Hand& hand, Integrator integrator) {
  Solid solid{.young = options.young.value_or(default_young), .poisson = options.poisson.value_or(default_poisson), .edge = organ.edge,
              .prestrain = options.prestrain.value_or(default_solid_prestrain), .toughness = options.toughness.value_or(default_toughness),
              .lip_friction = options.lip_friction.value_or(default_lip_friction)};
  auto const filling = palpate::fill(organ.mesh, {.edge = solid.edge});
  solid.filled = to_string(filling);
  solid.tetrahedra = static_cast<int>(filling.mesh.tetrahedra.cols());
  if (filling.pieces > 1)
    throw palpate::InvalidMesh(palpate::detail::message(organ.name, ": filled with an edge of ", solid.edge, " m the organ falls into ", filling.pieces,
                                                        " pieces; give a smaller --edge"));
  palpate::FiniteElements<double, palpate::StableNeoHookean<double>> tissue(
      filling.mesh, {.density = organ.mass / filling.volume, .material = {solid.young, solid.poisson}, .damping = {.alpha = 30.0}, .prestrain = solid.prestrain});
  auto const skin = palpate::surface(filling.mesh);
  auto const normals = palpate::vertex_normals(skin);
  for (int i = 0; i < normals.cols(); ++i)
    if (normals.col(i).norm() > 0.5 && normals.col(i).dot(organ.up) < 0.2) tissue.nail(i), ++solid.nailed;
  palpate::SoftBody body(std::move(tissue), integrator);   // settles under its pre-tension
  palpate::TriangleMesh<double> border = body.mesh();      // without the vertices inside
  palpate::repair(border);
  hand = prepare_hand(options, organ, border);

  Device device = make_device(options, hand);
  bool const realtime = options.realtime || keeps_time(device);
  palpate::Simulator simulator(std::move(device), std::move(body),
                               palpate::VolumeCutter<double>({.edge = {Vector::Zero(), (organ.cut_depth + 3 * organ.edge) * hand.blade()},
                                                              .puncture_depth = organ.puncture_depth,
                                                              .toughness = solid.toughness,
                                                              .lip_friction = solid.lip_friction}),
                               HandForce(options, hand.along), {.body_rate = 100.0, .servo = {.mapping = mapping_of(options, hand)}});
  palpate::EmbeddedSurface<double> carried(organ.mesh, filling.mesh);
  Outcome outcome = run_and_report(
      simulator, hand, realtime,
      [&](auto const& all, palpate::Tick const& tick) {
        auto const& cut = all.body();
        carried.follow(cut);
        Frame frame = frame_of(all, tick);
        auto const is_wound = [&](int t) { return cut.tissue().is_wound(t); };
        frame.drawn = drawing::solid_picture(carried.mesh(), {drawing::border_part(cut.positions(), cut.triangles(), is_wound, true), carried.skirt(cut)});
        return frame;
      },
      [](auto const& now) {   // of another thread's body, without the fine skin
        auto const is_wound = [&](int t) { return now.is_wound[static_cast<std::size_t>(t)] != 0; };
        return Frame{.time = now.time, .mesh = {now.points, now.triangles}, .drawn = drawing::solid_picture(drawing::border_part(now.points, now.triangles, is_wound, false), {drawing::border_part(now.points, now.triangles, is_wound, true)}),
                     .displacement = {}, .tip = now.tip, .phase = now.phase};
      });
  solid.stable_step = simulator.body().stable_step();
  solid.solved = simulator.body().solve_statistics();
  solid.cut = simulator.cutter().report();
  solid.area = simulator.cutter().area();
  solid.tetrahedra_after = simulator.body().tissue().tetrahedra();
  outcome.solid = solid;
  return outcome;
}

}  // namespace

Outcome run_solid(Options const& options, Organ const& organ, Hand& hand) {
  if (options.integrator == IntegratorName::leapfrog) return run_with(options, organ, hand, palpate::LeapfrogVerlet{});
  return run_with(options, organ, hand, palpate::BackwardEuler{});
}

}  // namespace incision
