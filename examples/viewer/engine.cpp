// SPDX-License-Identifier: MIT
#include "engine.hpp"

#include <palpate/core/error.hpp>
#include <palpate/training/replay.hpp>
#include <palpate/training/session_io.hpp>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <utility>

namespace viewer {

namespace {

constexpr double longest_recording = 600.0;   // s
constexpr double longest_stretch = 60.0;      // s, of a run in real time, which keeps room for all its ticks

std::string text_of(Wound const& wound) {
  char text[80];
  std::snprintf(text, sizeof text, "cut: %.1f cm2, %d piece%s", 1e4 * wound.area, wound.pieces, wound.pieces == 1 ? "" : "s");
  return text;
}

/// What tells a recording of the mouse from others, kept in the hook's part of it: its ticks, and where and when it ended.
constexpr char const* mark_key = "mouse";
std::string mark_of(palpate::Recording const& mouse) {
  if (mouse.ticks().empty()) return "none";
  palpate::Tick const& last = mouse.ticks().back();
  char text[160];
  std::snprintf(text, sizeof text, "%zu ticks, the last at %.17g s, tip %.17g %.17g %.17g m", mouse.ticks().size(), last.time, last.tip.x(), last.tip.y(), last.tip.z());
  return text;
}

/// Of what a hand did, and what came of it.
template <class Hand>
palpate::Session session_of(palpate::Configuration configuration, LoggedHand<Hand>& hand, palpate::Recording& ticks) {
  palpate::Session session{.configuration = std::move(configuration), .device = hand.capabilities(), .hand = hand.take_log()};
  session.hand.resize(std::min(session.hand.size(), ticks.ticks().size()));
  session.events = palpate::phase_events(ticks);
  session.recording = std::exchange(ticks, {});
  return session;
}

}  // namespace

Setup setup_of(palpate::Session const& session, Setup setup) {
  auto const choose = [&](char const* key, auto& choice) {
    std::string const* const name = session.configuration.find(key);
    auto candidate = choice;
    for (int k = 0; name != nullptr && k < 3; ++k, candidate = after(candidate))
      if (*name == to_string(candidate)) choice = candidate;
  };
  choose("tissue", setup.tissue);
  choose("integrator", setup.integrator);
  choose("coupling", setup.coupling);
  choose("cutter", setup.blade);
  if (std::string const* const vertices = session.configuration.find("organ.vertices")) {
    setup.vertices = std::atoi(vertices->c_str());
    setup.mesh.clear();
  }
  if (std::string const* const mesh = session.configuration.find("organ.mesh")) {
    if (setup.mesh.empty()) setup.mesh = *mesh;   // else the file is elsewhere now
    if (!std::filesystem::exists(setup.mesh))
      throw palpate::FileError("the recording was made on the mesh " + *mesh + ", and there is no " + setup.mesh.string() + "; say with --mesh where it is");
    if (auto const* const unit = session.configuration.find("organ.unit")) setup.unit = *unit;
    if (auto const* const up = session.configuration.find("organ.up")) setup.up = *up;
  }
  return setup;
}

std::filesystem::path hook_file_of(std::filesystem::path const& recording) {
  return recording.parent_path() / (recording.stem().string() + "_hook" + recording.extension().string());
}

Recorded read_recorded(std::filesystem::path const& recording) {
  auto const is_hooks = [](palpate::Session const& session) {
    std::string const* const tool = session.configuration.find("tool");
    return tool != nullptr && *tool == "hook";
  };
  Recorded recorded{.mouse = palpate::read_session(recording), .hook = {}};
  if (is_hooks(recorded.mouse)) throw palpate::FileError(recording.string() + " is the hook's part of a recording; give the mouse's, whose name has no _hook");
  auto const file = hook_file_of(recording);
  if (!std::filesystem::exists(file)) return recorded;
  recorded.hook = palpate::read_session(file);
  auto const ours = mark_of(recorded.mouse.recording);
  auto const* const theirs = recorded.hook->configuration.find(mark_key);
  if (!is_hooks(*recorded.hook) || recorded.hook->recording.ticks().empty() || theirs == nullptr || *theirs != ours)
    throw palpate::FileError(file.string() + " is not the hook's part of " + recording.string() + "; move it away, or copy both again");
  return recorded;
}

Engine::Engine(Setup const& setup, std::filesystem::path out, bool realtime)
    : out_(std::move(out)),
      realtime_(realtime),
      organ_(organ_of(setup)),
      simulation_(make_simulation(setup, organ_, targets_)) {
  show();
}

Engine::~Engine() { stop(); }

void Engine::start() {
  runs_.store(true);
  ended_.store(false);
  thread_ = std::thread([this] {
    try {
      while (runs_.load()) run(0.0);
    } catch (std::exception const& error) {
      next_.note = std::string("stopped: ") + error.what();
      show();
    }
    ended_.store(true);
  });
}

void Engine::stop() {
  runs_.store(false);
  while (!ended_.load()) {   // a run that is just beginning does not hear it
    simulation()->stop();
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  if (thread_.joinable()) thread_.join();
}

void Engine::advance(double seconds) { run(seconds); }

void Engine::finish() {
  if (next_.doing == Doing::recording) end_recording();
}

void Engine::post(Command command) {
  std::lock_guard const lock(mutex_);
  commands_.push_back(command);
}

Live Engine::live() {
  std::lock_guard const lock(mutex_);
  listen();
  bool const is_done = cuts_ && course_.now().tick.phase == palpate::CuttingPhase::no_contact;
  if (realtime_ && (!commands_.empty() || is_done)) simulation_->stop();   // and again with the next picture, should it not have been heard
  Live live = live_;
  live.time = course_.time();
  live.now = course_.now();
  live.hook = {.tick = course_.hook(), .is_hooked = simulation_->is_hooked(), .lifted = live_.hook.lifted};
  live.servo = simulation_->servo_times();
  live.doing_seconds = live.doing == Doing::nothing ? 0.0 : course_.time() - doing_since_;
  live.chart.assign(course_.chart().begin(), course_.chart().end());
  return live;
}

std::shared_ptr<Simulation> Engine::simulation() const {
  std::lock_guard const lock(mutex_);
  return simulation_;
}

void Engine::use(std::shared_ptr<Simulation> simulation) {
  std::lock_guard const lock(mutex_);
  simulation_ = std::move(simulation);
  course_.forget_energy(true);
}

/// Of so many seconds in lock-step.
void Engine::run(double seconds) {
  std::vector<Command> commands;
  {
    std::lock_guard const lock(mutex_);
    commands.swap(commands_);
  }
  for (Command const command : commands) obey(command);
  show();
  {
    std::lock_guard const lock(mutex_);
    course_.begin_run(simulation_->time());
    cuts_ = false;
  }
  keep(simulation_->run(realtime_ ? stretch() : seconds, realtime_));
  if (simulation_->remember() && simulation_->wound().area > 0.0) next_.note = text_of(simulation_->wound());
  if (simulation_->hand().replay_is_over()) end_replay();
  if (next_.doing == Doing::recording && ticks_.ticks().size() == ticks_.capacity()) end_recording();
  show();
}

/// How long a run in real time may be [s].
double Engine::stretch() const {
  double const left = 1e-3 * static_cast<double>(ticks_.capacity() - ticks_.ticks().size());
  return next_.doing == Doing::nothing ? longest_stretch : std::clamp(left, 0.01, longest_stretch);
}

/// Takes the ticks that have come, under the lock.
void Engine::listen() {
  Vector const way_out = simulation_->way_out();
  while (auto const tick = simulation_->live_ticks().pop()) {
    course_.take(*tick, way_out);
    cuts_ |= tick->phase == palpate::CuttingPhase::moving;
  }
  while (auto const tick = simulation_->live_hook_ticks().pop()) course_.take_hook(*tick);
}

/// What a run gave. Ticks that found no room in the ring are in the recording.
void Engine::keep(palpate::ToolRecordings const& recordings) {
  palpate::Recording const &recording = recordings.recording(0), &hooks = recordings.recording(1);
  if (next_.doing != Doing::nothing) {
    for (palpate::Tick const& tick : recording.ticks()) static_cast<void>(ticks_.try_append(tick));
    for (palpate::Tick const& tick : hooks.ticks()) static_cast<void>(hook_ticks_.try_append(tick));
  }
  std::lock_guard const lock(mutex_);
  listen();
  double const taken = course_.now().tick.time;
  if (!realtime_)
    for (palpate::Tick const& tick : recording.ticks()) course_.take(tick, simulation_->way_out());
  else if (!recording.ticks().empty() && recording.ticks().back().time > taken)
    course_.take(recording.ticks().back(), simulation_->way_out());
  if (!hooks.ticks().empty()) course_.take_hook(hooks.ticks().back());
}

void Engine::show() {
  next_.setup = simulation_->setup();
  next_.began_uncut = simulation_->is_uncut();
  next_.began_with = simulation_->revision();
  next_.wound = simulation_->wound();
  next_.can_replay = recorded_.has_value();
  next_.hook.lifted = simulation_->hook().hand().lifted();
  std::lock_guard const lock(mutex_);
  live_ = next_;
}

void Engine::obey(Command command) {
  Doing const was = next_.doing;
  if (was == Doing::recording) end_recording();   // a recording is of one setup, from one body on
  if (was == Doing::replaying) end_replay();
  Setup setup = simulation_->setup();
  char const* lifted = "";
  switch (command) {
    case Command::tissue:
    case Command::integrator:
      if (command == Command::tissue) setup.tissue = after(setup.tissue);
      else setup.integrator = after(setup.integrator);
      lifted = lift_hook();
      use(make_simulation(setup, organ_, targets_));
      simulation_->hand().hand().place(tip());
      simulation_->hook().hand().lift();
      next_.note = command == Command::tissue ? std::string("tissue: ") + to_string(setup.tissue)
                                              : std::string("integrator: ") + to_string(setup.integrator);
      next_.note += lifted;
      break;
    case Command::coupling:
      simulation_->choose(after(setup.coupling));
      next_.note = std::string("coupling: ") + to_string(after(setup.coupling));
      break;
    case Command::blade:
      simulation_->choose(after(setup.blade));
      next_.note = std::string("cutter: ") + to_string(simulation_->setup().blade);
      break;
    case Command::record:
      if (was != Doing::recording) begin_recording();
      break;
    case Command::replay:
      if (was != Doing::replaying) begin_replay();
      break;
    case Command::undo:
      if (!simulation_->undo()) {
        next_.note = "there is no cut to take back";
        break;
      }
      next_.note = std::string("took back the last cut") + lift_hook();
      break;
    case Command::undo_all: {
      simulation_->undo_all();
      next_.note = std::string("an uncut organ") + lift_hook();
      std::lock_guard const lock(mutex_);
      course_.forget_energy(false);
      break;
    }
  }
}

/// A restored body, and a new one, know nothing of the hook: it is taken away, and has to be put in anew. Says so.
char const* Engine::lift_hook() { return simulation_->hook().hand().lift() ? "; hook lifted away" : ""; }

/// Where the tool is, between runs.
Vector Engine::tip() const {
  std::lock_guard const lock(mutex_);
  return course_.now().tick.tip;
}

void Engine::begin(Doing doing, std::string note) {
  next_.doing = doing;
  next_.note = std::move(note);
  std::lock_guard const lock(mutex_);
  doing_since_ = course_.time();
}

void Engine::begin_recording() {
  records_from_ = simulation_->begun_anew();
  use(records_from_->begun_anew());
  begin(Doing::recording, "recording");
  constexpr auto room = static_cast<std::size_t>(longest_recording * 1000.0);
  simulation_->hand().begin_log(room);
  simulation_->hook().begin_log(room);
  ticks_ = palpate::Recording(room);
  hook_ticks_ = palpate::Recording(room);
}

void Engine::end_recording() {
  next_.doing = Doing::nothing;
  auto configuration = configuration_of(records_from_->setup());
  configuration.set("clock", realtime_ ? "real time" : "lock-step").set("organ.is_uncut", records_from_->is_uncut());
  Recorded recorded{.mouse = session_of(configuration, simulation_->hand(), ticks_), .hook = {}};
  configuration.set("tool", "hook").set(mark_key, mark_of(recorded.mouse.recording));
  palpate::Session hook = session_of(std::move(configuration), simulation_->hook(), hook_ticks_);
  if (recorded.mouse.recording.ticks().empty()) return;   // the last recording stays the one that is replayed
  recorded_from_ = std::move(records_from_);
  bool const is_used = std::any_of(hook.hand.begin(), hook.hand.end(), [](auto const& sample) { return !HookHand::is_parked(sample.position); });
  if (is_used) recorded.hook = std::move(hook);
  auto const is_taken = [](auto const& path) { return std::filesystem::exists(path) || std::filesystem::exists(hook_file_of(path)); };
  std::filesystem::path file;
  for (int k = 1; file.empty() || is_taken(file); ++k) file = out_ / ("recording_" + std::to_string(k) + ".session");
  try {
    std::filesystem::create_directories(out_);
    palpate::write_session(file, recorded.mouse);
    written_.push_back(file);
    if (is_used) {
      palpate::write_session(hook_file_of(file), *recorded.hook);
      written_.push_back(hook_file_of(file));
    }
    next_.note = "recorded: " + file.string();
  } catch (std::exception const& error) {
    next_.note = std::string("not saved: ") + error.what();
  }
  recorded_ = std::move(recorded);
}

void Engine::begin_replay() {
  if (!recorded_) {
    next_.note = "there is no recording yet: press r";
    return;
  }
  use(recorded_from_->begun_anew());
  ViewerHook& hook = simulation_->hook();
  std::size_t const count = recorded_->mouse.recording.ticks().size();
  simulation_->hand().begin_replay(palpate::replay_whatever(recorded_->mouse));
  hook.begin_replay(recorded_->hook ? palpate::replay_whatever(*recorded_->hook)
                                    : palpate::ReplayDevice<double>(std::vector(count, HookHand(nullptr).sample()), hook.capabilities()));
  ticks_ = palpate::Recording(count);
  hook_ticks_ = palpate::Recording(count);
  begin(Doing::replaying, "replaying");
}

void Engine::end_replay() {
  next_.doing = Doing::nothing;
  bool const whole = ticks_.ticks().size() == recorded_->mouse.recording.ticks().size();
  bool const same = whole && !palpate::first_difference(ticks_, recorded_->mouse.recording) &&
                    (!recorded_->hook || !palpate::first_difference(hook_ticks_, recorded_->hook->recording));
  next_.note = same ? "replayed: the same bytes" : whole ? "replayed" : "replay ended early";
  simulation_->hand().end_replay();
  simulation_->hand().hand().place(tip());
  ViewerHook& hook = simulation_->hook();
  hook.end_replay();
  if (!hook_ticks_.ticks().empty()) hook.hand().place(hook.last().position, hook.last().orientation);
}

void Engine::play(Recorded recorded) {
  recorded_from_ = simulation_;
  recorded_ = std::move(recorded);
  post(Command::replay);
}

}  // namespace viewer
