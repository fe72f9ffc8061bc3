// SPDX-License-Identifier: MIT
#include "pressing.hpp"

#include <palpate/body/soft_body.hpp>
#include <palpate/core/error.hpp>
#include <palpate/integrator/backward_euler.hpp>
#include <palpate/material/stable_neo_hookean.hpp>
#include <palpate/statics/newton_raphson.hpp>
#include <palpate/tissue/finite_elements.hpp>

#include <utility>

namespace palpation {

std::vector<Press> press(Options const& options, Organ const& organ, bool with_nodule, std::function<void(std::size_t)> const& done) {
  using namespace palpate;
  FiniteElements<double, StableNeoHookean<double>> tissue(organ.solid, {.density = options.density, .material = {options.young, options.poisson}});
  if (with_nodule) tissue.set_material(organ.hard, {organ.nodule_young, options.poisson});
  tissue.nail(organ.held);
  SoftBody body(std::move(tissue), BackwardEuler{});
  auto const rest = body.save();
  std::vector<char> on_skin(static_cast<std::size_t>(body.size()), 0);
  for (int const i : body.triangles().reshaped()) on_skin[static_cast<std::size_t>(i)] = 1;

  std::vector<Press> presses;
  for (Place const& place : organ.places) {
    body.restore(rest);
    std::vector<int> pad;
    for (int i = 0; i < body.size(); ++i)
      if (on_skin[static_cast<std::size_t>(i)] && !body.tissue().nailed(i) && (organ.solid.points.col(i) - place.point).norm() < options.pad) pad.push_back(i);
    if (pad.empty())
      throw InvalidArgument(palpate::detail::message("--pad: no vertex of the skin lies within ", 1000 * options.pad, " mm of the place at ", 1000 * place.along,
                                                     " mm; give a larger --pad or a smaller --edge"));
    constexpr int parts = 2;
    for (int part = 1; part <= parts; ++part) {
      for (int const i : pad) {
        double const share = (organ.solid.points.col(i) - place.point).norm() / options.pad;
        body.drag(i, organ.solid.points.col(i) - options.depth * part / parts * (1 - share * share) * place.normal);
      }
      body.solve_statics(NewtonRaphson{}, 1e-7);   // m, of a particle: what is left moves nothing that is seen
    }
    Press one;
    for (int const i : pad) one.force -= body.reaction(i).dot(place.normal);
    one.positions = body.positions();
    if (with_nodule) one.fields = solid_fields(body.tissue(), one.positions);
    presses.push_back(std::move(one));
    done(presses.size());
  }
  return presses;
}

}  // namespace palpation
