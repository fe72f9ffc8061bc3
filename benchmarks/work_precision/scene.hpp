// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/tissue/mass_spring.hpp>

#include <functional>
#include <string>
#include <vector>

namespace work_precision {

using namespace palpate;

/// A body at rest, what happens to it, and when its shape is compared with the reference: at `samples` equal intervals.
struct Scene {
  std::string name;    // in the CSV and in file names
  std::string title;   // of its chart
  MassSpring<double> tissue;
  double duration = 1;   // s
  int samples = 4;
  Vector3<double> velocity = Vector3<double>::Zero();   // m/s, of every particle at the start
  int touched = 0;
  Vector3<double> force = Vector3<double>::Zero();   // N, on the touched particle
  std::function<double(double)> share = [](double) { return 1.0; };   // of the force that acts at a time [s]
  bool smooth_load = false;   // else it is constant within an interval, and every integrator keeps its order
  bool swings = true;   // its undamped twin is run as well, for its energy
  std::function<double(double)> exact{};   // m along `velocity`, of every particle at a time; empty where no closed form is known

  double interval() const { return duration / samples; }
};

/// The impulse on one particle (m = 0.01 kg, ω = 4/s) with this damping ratio, and its closed form.
Scene impulse(std::string name, double damping_ratio);
/// n × n particles pressed in the middle for the first half of the time, as in the thesis, then let go.
Scene thesis_grid(int n);
/// 961 particles, pressed by a finger's force and let go.
Scene heart();
/// A stiff block of n × n × layers particles on a table, pushed aside slowly, then held: its fast modes limit explicit steps, nothing in the motion
/// needs them. An interval is a thousand of leapfrog's longest steps.
Scene stiff_block(int n, int layers, int samples);

std::vector<Scene> all_scenes();
/// Small ones that take seconds.
std::vector<Scene> quick_scenes();

/// The same tissue without any damping.
MassSpring<double> undamped(MassSpring<double> tissue);

}  // namespace work_precision
