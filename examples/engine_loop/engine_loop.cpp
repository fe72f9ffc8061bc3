// SPDX-License-Identifier: MIT
// The loop belongs to an engine that draws 60 frames a second. Each frame ticks the body; the servo has a thread of its own at 1 kHz. The engine's buffers follow a
// cut by what changed. Then the same ticks in lock-step, as a test or a replay makes them.
#include <palpate/palpate.hpp>

#include <chrono>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace {

using namespace palpate;

constexpr double frame = 1.0 / 60.0;   // s

/// What an engine has: buffers on a graphics card, and how many bytes went there.
struct Engine {
  std::vector<int> indices;       // three of each triangle
  std::vector<double> vertices;   // three of each point
  std::size_t uploaded_indices = 0, frames = 0;

  template <class Body>
  void draw(Body& body) {
    auto const changes = body.changes();
    indices.resize(static_cast<std::size_t>(3 * changes.triangle_count));
    auto const triangles = body.triangles();
    auto const upload = [&](int t) {
      for (int k = 0; k < 3; ++k) indices[static_cast<std::size_t>(3 * t + k)] = triangles(k, t);
      uploaded_indices += 3;
    };
    for (int const t : changes.triangles) upload(t);
    for (int t = changes.first_triangle; t < changes.triangle_count; ++t) upload(t);
    body.forget_changes();
    auto const points = body.positions();   // these move in every frame
    vertices.clear();
    for (auto const& point : points.colwise()) vertices.insert(vertices.end(), point.begin(), point.end());
    ++frames;
  }
};

bool all_as_expected = true;
void expect(bool good, char const* what) {
  all_as_expected = all_as_expected && good;
  std::printf("%s%s\n", what, good ? "" : "   <- wrong");
}

auto simulator() {
  auto const skin = make_grid<double>(41, 41, 0.0025);   // 10 cm × 10 cm
  MassSpring<double> tissue(skin, {.mass = {.total = 0.05}, .link = {.stiffness = 80.0, .damping = 0.1}, .home = {.stiffness = 8.0, .damping = 0.05}});
  tissue.nail(boundary_vertices(skin));
  auto path = Trajectory<double>::start({0.03, 0.05, 0.002});
  path.line({0.03, 0.05, -0.010}, 0.4).line({0.07, 0.05, -0.010}, 1.0).line({0.07, 0.05, 0.010}, 0.3);
  return Simulator(ScriptedDevice<double>(std::move(path)), SoftBody(std::move(tissue), LeapfrogVerlet{}, ZoneOfInfluence{.rings = 6}),
                   ProgressiveCutter<double>({.puncture_depth = 0.006}), CuttingForce(liver_hysteresis<double>()));
}

/// The index buffer is what the body would have given anew.
template <class Body>
bool holds_body(Engine const& engine, Body const& body) {
  auto const triangles = body.triangles();
  bool same = engine.indices.size() == static_cast<std::size_t>(triangles.size());
  for (std::size_t k = 0; same && k < engine.indices.size(); ++k) same = engine.indices[k] == triangles.data()[k];
  return same;
}

}  // namespace

int main() try {
  // The servo on its thread, the body in the frames.
  auto in_frames = simulator();
  Engine engine;
  in_frames.start(1.7, 1 / frame);   // s at most, Hz
  auto next = std::chrono::steady_clock::now();
  while (in_frames.tick_body(frame)) {
    engine.draw(in_frames.body());
    next += std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::duration<double>(frame));
    std::this_thread::sleep_until(next);   // an engine waits for the screen here
  }
  Recording const felt = in_frames.finish();
  engine.draw(in_frames.body());
  std::printf("in frames: %zu frames, %zu servo ticks, largest force %.2f N, %zu of %zu indices uploaded again\n", engine.frames, felt.ticks().size(), felt.largest_force(),
              engine.uploaded_indices - engine.indices.size(), engine.indices.size());
  expect(felt.ticks().size() == 1700, "the servo ticked at 1 kHz");
  expect(in_frames.cutter().report().particles_added > 0, "the skin was cut");
  expect(holds_body(engine, in_frames.body()), "the engine's buffers followed");
  expect(engine.uploaded_indices < 2 * engine.indices.size(), "by what changed alone");

  // Both halves in lock-step: 16 or 17 servo ticks a frame, and the same bytes each time.
  auto const replay = [] {
    auto whole = simulator();
    Engine drawn;
    Recording recording;
    for (int k = 0; k < 102; ++k) {
      whole.tick(frame, [&](Tick const& tick) { recording.append(tick); });
      drawn.draw(whole.body());
    }
    return recording.to_csv();
  };
  std::string const once = replay();
  expect(once == replay(), "in lock-step: the same bytes twice");
  std::printf("%s\n", all_as_expected ? "all as expected" : "not as expected");
  return all_as_expected ? EXIT_SUCCESS : EXIT_FAILURE;
} catch (std::exception const& error) {
  std::fprintf(stderr, "engine_loop: %s\n", error.what());
  return EXIT_FAILURE;
}
