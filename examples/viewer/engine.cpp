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

Engine::Engine(Setup const& setup, std::filesystem::path out, bool realtime)
    : out_(std::move(out)),
      realtime_(realtime),
      targets_(std::make_shared<HandTargets>(HandTarget{})),
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
  palpate::Recording const recording = simulation_->run(realtime_ ? stretch() : seconds, realtime_);
  keep(recording);
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
}

/// What a run gave. Ticks that found no room in the ring are in the recording.
void Engine::keep(palpate::Recording const& recording) {
  if (next_.doing != Doing::nothing)
    for (palpate::Tick const& tick : recording.ticks()) static_cast<void>(ticks_.try_append(tick));
  std::lock_guard const lock(mutex_);
  listen();
  double const taken = course_.now().tick.time;
  if (!realtime_)
    for (palpate::Tick const& tick : recording.ticks()) course_.take(tick, simulation_->way_out());
  else if (!recording.ticks().empty() && recording.ticks().back().time > taken)
    course_.take(recording.ticks().back(), simulation_->way_out());
}

void Engine::show() {
  next_.setup = simulation_->setup();
  next_.began_uncut = simulation_->is_uncut();
  next_.began_with = simulation_->revision();
  next_.wound = simulation_->wound();
  next_.can_replay = session_.has_value();
  std::lock_guard const lock(mutex_);
  live_ = next_;
}

void Engine::obey(Command command) {
  Doing const was = next_.doing;
  if (was == Doing::recording) end_recording();   // a recording is of one setup, from one body on
  if (was == Doing::replaying) end_replay();
  Setup setup = simulation_->setup();
  switch (command) {
    case Command::tissue:
    case Command::integrator:
      if (command == Command::tissue) setup.tissue = after(setup.tissue);
      else setup.integrator = after(setup.integrator);
      use(make_simulation(setup, organ_, targets_));
      simulation_->hand().mouse().place(tip());
      next_.note = command == Command::tissue ? std::string("tissue: ") + to_string(setup.tissue)
                                              : std::string("integrator: ") + to_string(setup.integrator);
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
    case Command::undo: next_.note = simulation_->undo() ? "took back the last cut" : "there is no cut to take back"; break;
    case Command::undo_all: {
      simulation_->undo_all();
      next_.note = "an uncut organ";
      std::lock_guard const lock(mutex_);
      course_.forget_energy(false);
      break;
    }
  }
}

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
  recorded_from_ = simulation_->begun_anew();
  use(recorded_from_->begun_anew());
  begin(Doing::recording, "recording");
  simulation_->hand().begin_log(static_cast<std::size_t>(longest_recording * 1000.0));
  ticks_ = palpate::Recording(static_cast<std::size_t>(longest_recording * 1000.0));
}

void Engine::end_recording() {
  next_.doing = Doing::nothing;
  auto configuration = configuration_of(recorded_from_->setup());
  configuration.set("clock", realtime_ ? "real time" : "lock-step").set("organ.is_uncut", recorded_from_->is_uncut());
  palpate::Session session{.configuration = std::move(configuration),
                           .device = simulation_->hand().capabilities(),
                           .hand = simulation_->hand().take_log()};
  session.hand.resize(std::min(session.hand.size(), ticks_.ticks().size()));
  session.events = palpate::phase_events(ticks_);
  session.recording = std::exchange(ticks_, {});
  if (session.recording.ticks().empty()) return;
  std::filesystem::path file;
  for (int k = 1; file.empty() || std::filesystem::exists(file); ++k) file = out_ / ("recording_" + std::to_string(k) + ".session");
  try {
    std::filesystem::create_directories(out_);
    palpate::write_session(file, session);
    written_.push_back(file);
    next_.note = "recorded: " + file.string();
  } catch (std::exception const& error) {
    next_.note = std::string("not saved: ") + error.what();
  }
  session_ = std::move(session);
}

void Engine::begin_replay() {
  if (!session_) {
    next_.note = "there is no recording yet: press r";
    return;
  }
  use(recorded_from_->begun_anew());
  simulation_->hand().begin_replay(palpate::replay_whatever(*session_));
  ticks_ = palpate::Recording(session_->recording.ticks().size());
  begin(Doing::replaying, "replaying");
}

void Engine::end_replay() {
  next_.doing = Doing::nothing;
  bool const whole = ticks_.ticks().size() == session_->recording.ticks().size();
  bool const same = whole && !palpate::first_difference(ticks_, session_->recording);
  next_.note = same ? "replayed: the same bytes" : whole ? "replayed" : "replay ended early";
  simulation_->hand().end_replay(tip());
}

void Engine::play(palpate::Session session) {
  recorded_from_ = simulation_;
  session_ = std::move(session);
  post(Command::replay);
}

}  // namespace viewer
