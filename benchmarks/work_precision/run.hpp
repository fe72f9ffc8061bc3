// SPDX-License-Identifier: MIT
#pragma once

#include "counted.hpp"
#include "scene.hpp"

#include <palpate/body/soft_body.hpp>
#include <palpate/region/whole_body.hpp>

#include <ctime>
#include <limits>
#include <vector>

namespace work_precision {

template <class I>
using Body = SoftBody<MassSpring<double>, Counted<I>, WholeBody>;

/// A scene's body as it starts, its stable step known.
template <class I>
Body<I> start(Scene const& scene, I const& integrator, Counts& counts) {
  Body<I> body(scene.tissue, Counted<I>{integrator, &counts}, WholeBody{});
  if (!scene.velocity.isZero())
    for (int i = 0; i < body.size(); ++i) {
      body.drag(i, body.tissue().rest_position(i), scene.velocity);
      body.release(i);   // flies on with this velocity
    }
  body.stable_step();
  return body;
}

inline double seconds_since(std::clock_t begin) { return static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC; }

/// Where all particles were at the ends of a scene's intervals, and what it cost to find out.
struct Path {
  std::vector<Matrix3X<double>> displacement;   // shorter where it diverged or took too long
  bool diverged = false;
  double seconds = 0;                           // of stepping: processor time, which other programs disturb less
  Counts counts;
  bool complete(Scene const& scene) const { return static_cast<int>(displacement.size()) == scene.samples; }
};

/// Runs a scene in equal steps. Every step sees the force of its middle, so that each gives the same impulse. Stops when the time is up.
template <class I>
Path run(Scene const& scene, I const& integrator, int steps_an_interval, double longest_seconds = std::numeric_limits<double>::infinity()) {
  Path path;
  auto body = start(scene, integrator, path.counts);
  double const h = scene.interval() / steps_an_interval;
  for (int sample = 0; sample < scene.samples; ++sample) {
    bool finite = true;
    std::clock_t const begin = std::clock();
    for (int k = 0; k < steps_an_interval && finite; ++k) {
      double const share = scene.share(sample * scene.interval() + (k + 0.5) * h);
      if (share != 0) body.apply_force(scene.touched, share * scene.force);
      finite = static_cast<bool>(body.step(h));
      if (k % 1000 == 999 && path.seconds + seconds_since(begin) > longest_seconds) break;
    }
    path.seconds += seconds_since(begin);
    path.diverged = !finite;
    if (path.diverged || path.seconds > longest_seconds) return path;
    path.displacement.push_back(body.positions() - scene.tissue.rest_positions());
  }
  return path;
}

}  // namespace work_precision
