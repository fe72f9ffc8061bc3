// SPDX-License-Identifier: MIT
#pragma once

#include "hook_hand.hpp"
#include "setup.hpp"

#include <palpate/core/event_ring.hpp>
#include <palpate/simulator/snapshot.hpp>
#include <palpate/simulator/tool_recordings.hpp>

#include <cstddef>
#include <cstdint>
#include <memory>

namespace viewer {

struct ServoTimes {
  double p99 = 0.0;    // s, of computing
  double rate = 0.0;   // Hz, reached; 0 in lock-step
  std::uint64_t ticks = 0, late = 0;
};

/// What cuts have done to a body.
struct Wound {
  double area = 0.0;   // m², undeformed: half of both walls, in a solid
  int pieces = 1;
};

/// A simulator behind one interface, so that the window need not know its type. Policies are chosen at compile time: here the integrator of springs and
/// a solid make types. Springs differ in values, cutters and couplings in a flag (AnyCutter, HandForce): three simulators instead of 42.
/// Threads    the first group from any, meanwhile too, one reader at a time; the others from one thread, between runs.
class Simulation {
 public:
  virtual ~Simulation() = default;

  /// Ends the run that goes on; one that is just beginning may not hear it.
  virtual void stop() noexcept = 0;
  /// The ticks of a run in real time, as they happen: of the mouse's tool, and of the hook.
  virtual palpate::EventRing<palpate::Tick, 1024>& live_ticks() noexcept = 0;
  virtual palpate::EventRing<palpate::Tick, 1024>& live_hook_ticks() noexcept = 0;
  virtual bool is_hooked() const noexcept = 0;
  /// From the tip to the proxy [m], of the last tick with contact.
  virtual Vector way_out() const noexcept = 0;
  virtual ServoTimes servo_times() const = 0;
  /// The body for the thread that draws.
  virtual palpate::SnapshotChannel<double>& snapshots() noexcept = 0;
  /// The organ as it lies there, untouched.
  virtual Mesh const& home() const noexcept = 0;

  /// Of the mouse's tool, and of the hook.
  virtual palpate::ToolRecordings run(double seconds, bool realtime) = 0;
  virtual double time() const noexcept = 0;   // s, of all its runs
  virtual ViewerHand& hand() noexcept = 0;
  virtual ViewerHook& hook() noexcept = 0;
  virtual Setup const& setup() const noexcept = 0;
  virtual bool is_uncut() const noexcept = 0;
  virtual std::size_t revision() const noexcept = 0;   // of the body's triangles

  virtual Wound const& wound() = 0;

  virtual void choose(Coupling coupling) = 0;
  virtual void choose(Blade blade) = 0;

  /// Remembers the body, where it was cut since it was remembered last and nothing touches it. Returns whether it was.
  virtual bool remember() = 0;
  /// Takes the last cut back; false when there is none.
  virtual bool undo() = 0;
  /// All cuts.
  virtual void undo_all() = 0;

  /// The same body, as it is now, in a simulator that has just begun: what is recorded from there on can be repeated to the byte.
  virtual std::shared_ptr<Simulation> begun_anew() = 0;
};

/// Makes or reads the organ: its upper side looks along z, its top is where the hand begins 3 cm above it. Throws palpate::Error for a file that can not
/// be used.
Mesh organ_of(Setup const& setup);

/// The simulator of an organ. The hands follow what is written to `targets`.
std::shared_ptr<Simulation> make_simulation(Setup const& setup, Mesh const& organ, Targets const& targets);

/// Those that there are, each compiled in a file of its own.
std::shared_ptr<Simulation> make_leapfrog(Setup const& setup, Mesh const& organ, Targets const& targets);
std::shared_ptr<Simulation> make_solid(Setup const& setup, Mesh const& organ, Targets const& targets);
std::shared_ptr<Simulation> make_backward_euler(Setup const& setup, Mesh const& organ, Targets const& targets);

}  // namespace viewer
