// SPDX-License-Identifier: MIT
#pragma once

#include "course.hpp"
#include "simulation.hpp"

#include <palpate/training/session.hpp>

#include <atomic>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace viewer {

/// The setup that a recording was made with; what it does not say stays, and so does a mesh: its file may be elsewhere now. Throws palpate::FileError
/// where that file is not there.
Setup setup_of(palpate::Session const& session, Setup setup);

/// The part of a recording that the hook has: a file beside that of the mouse, where it was used. `recording_1.session` has `recording_1_hook.session`.
std::filesystem::path hook_file_of(std::filesystem::path const& recording);
/// Reads both. Throws palpate::FileError where they are not what they should be.
struct Recorded {
  palpate::Session mouse;
  std::optional<palpate::Session> hook;   // without it the hook waited
};
Recorded read_recorded(std::filesystem::path const& recording);

enum class Command { tissue, integrator, coupling, blade, record, replay, undo, undo_all };

/// Runs the simulation, does what the keys ask for between two runs, and keeps what the window shows.
///   in real time     a thread of its own runs it in one piece, until a key wants the body, a cut is done and to be remembered, or a minute is over;
///                    the servo is a further thread within. `live` takes the ticks as they happen
///   in lock-step     `advance` runs a slice in the caller's thread: the same commands at the same times give the same bytes
/// Threads    `live`, `simulation`, `post` and `targets` from the window's thread; they hold a lock for a short copy. The servo never sees it.
class Engine {
 public:
  Engine(Setup const& setup, std::filesystem::path out, bool realtime);
  ~Engine();
  Engine(Engine const&) = delete;
  Engine& operator=(Engine const&) = delete;

  void start();                     // real time
  void stop();
  void advance(double seconds);     // lock-step

  void post(Command command);
  /// Plays a recorded hand on the organ, which `setup_of` has set up. Before the first slice.
  void play(Recorded recorded);
  /// Ends and keeps a recording that is being made. After the last slice.
  void finish();

  /// Takes the ticks since the last call.
  Live live();
  std::shared_ptr<Simulation> simulation() const;
  HandTargets& targets() noexcept { return *targets_.mouse; }
  HookTargets& hook_targets() noexcept { return *targets_.hook; }
  /// What was recorded, in the order of the files.
  std::vector<std::filesystem::path> const& written() const noexcept { return written_; }

 private:
  void run(double seconds);
  double stretch() const;
  void listen();
  void keep(palpate::ToolRecordings const& recordings);
  void obey(Command command);
  void use(std::shared_ptr<Simulation> simulation);
  char const* lift_hook();
  Vector tip() const;
  void begin(Doing doing, std::string note);
  void begin_recording();
  void end_recording();
  void begin_replay();
  void end_replay();
  void show();

  std::filesystem::path out_;
  bool realtime_;
  Targets targets_;
  Mesh const organ_;   // as it was made or read
  std::shared_ptr<Simulation> simulation_;

  Live next_;                                   // what the next show() shows, but for the ticks
  palpate::Recording ticks_, hook_ticks_;       // of the recording or replay
  std::shared_ptr<Simulation> recorded_from_, records_from_;   // as it was when the recording that is kept, or made, began; never run
  std::optional<Recorded> recorded_;
  std::vector<std::filesystem::path> written_;

  mutable std::mutex mutex_;   // of what follows, and of simulation_ where two threads see it
  std::vector<Command> commands_;
  Live live_;
  Course course_;
  double doing_since_ = 0.0;   // s
  bool cuts_ = false;          // since the body was remembered

  std::thread thread_;
  std::atomic<bool> runs_{false}, ended_{true};
};

}  // namespace viewer
