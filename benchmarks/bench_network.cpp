// SPDX-License-Identifier: MIT
// What the haptic hierarchy costs. By the thread's processor time, µs each, medians over the rounds:
//   message     an answer with a surface, encoded, cut out of a stream and decoded
//   capture     the triangles around the touched one copied, once a tick of the body
//   look        the surface at a new tip out of that copy, once a tick of the server's fast side
//   respond     the whole servo tick of a client in contact: device, hand-over, spring, tissue, safety chain
//   proxy       the same with a ProxyForce in place of the overlay, on a model that is there: a simulator's servo
//   respond/proxy   their ratio in a round
// and in real time, a client of its own server over loopback in contact for a second, beside a servo alone, in turn:
//   p99         of the servo's ticks, µs, with the network's thread beside it
//   p99_alone   the same servo without a network
//   p99_ratio   of the two, in a round; the machine's noise is in it
#include <palpate/body/soft_body.hpp>
#include <palpate/cutting/no_cutter.hpp>
#include <palpate/device/scripted_device.hpp>
#include <palpate/integrator/leapfrog_verlet.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/grid.hpp>
#include <palpate/network/network.hpp>
#include <palpate/simulator/simulator.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include "thread_time.hpp"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <thread>
#include <utility>
#include <vector>

namespace {

using namespace palpate;

auto sheet() {
  auto const skin = make_grid<double>(21, 21, 0.005);
  MassSpring<double> tissue(skin, {.mass = {.total = 0.1}, .link = {.stiffness = 80.0, .damping = 0.2}, .home = {.stiffness = 8.0, .damping = 0.1}});
  tissue.nail(boundary_vertices(skin));
  return SoftBody(std::move(tissue), LeapfrogVerlet{});
}
ScriptedDevice<double> pressing() {
  return ScriptedDevice<double>({{0.0, {0.052, 0.051, 0.004}}, {0.3, {0.052, 0.051, -0.002}}, {10.0, {0.058, 0.051, -0.002}}});
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}
template <class Work>
double microseconds(int times, Work const& work) {
  double const begun = benchmarks::thread_time();
  for (int k = 0; k < times; ++k) work(k);
  return 1e6 * (benchmarks::thread_time() - begun) / times;
}

void parts(benchmark::State& state) {
  TissueNode node(sheet(), NoCutter<double>{});
  HandReport report{.position = {0.052, 0.051, 0.0005}};
  for (int k = 0; k < 200; ++k) {   // down to 2 mm
    ++report.sequence;
    report.position.z() = std::max(-0.002, report.position.z() - 5e-5);
    node.take(report, 0.01 * k);
    node.tick(0.01, 0.01 * k);
  }
  SurfaceNode<double> surface;
  SurfaceAnswer const answer = surface.look(node.captured(), report, 2.0, 0.015);
  TissueAnswer const tissue = node.last();
  std::vector<double> message, capture, look, respond, proxy, ratio;
  for (auto _ : state) {
    std::array<std::byte, max_fixed_frame> frame;
    FrameStream stream;
    message.push_back(microseconds(1000, [&](int) {
      std::size_t const size = encode(answer, frame);
      std::copy_n(frame.begin(), size, stream.room().begin());
      stream.filled(size);
      ProtocolProblem problem{};
      benchmark::DoNotOptimize(decode<SurfaceAnswer>(stream.next().value(), problem));
    }));
    LocalSurface<double> piece;
    int const touched = node.body().nearest_point(report.position).triangle;
    capture.push_back(microseconds(200, [&](int) { piece.capture(node.body(), touched); }));
    look.push_back(microseconds(200, [&](int k) {
      report.position.x() = 0.052 + 1e-5 * k;
      benchmark::DoNotOptimize(surface.look(node.captured(), report, 2.0, 0.015));
    }));
    auto const ticks = [&](auto force) {
      ServoLoop<ScriptedDevice<double>, decltype(force), double> servo(pressing(), std::move(force));
      servo.begin_session(100.0);
      RemoteTissue remote;
      double begun = 0.0;
      for (int k = 0; k < 2300; ++k) {
        if (k == 300) begun = benchmarks::thread_time();
        double const now = 0.001 * k;
        if (k % 2 == 0) {
          SurfaceAnswer next = answer;
          next.stamp.sequence = static_cast<std::uint64_t>(k) + 1, next.stamp.hand = 0, next.stamp.revision = tissue.stamp.revision;
          if (k % 10 == 0) {
            TissueAnswer slow = tissue;
            slow.stamp.sequence = static_cast<std::uint64_t>(k) + 1, slow.stamp.hand = 0;
            remote.take(slow, now);
          }
          remote.take(next, now);
        }
        servo.read(0.001);
        benchmark::DoNotOptimize(servo.respond(remote.model(), now));
      }
      return 1e6 * (benchmarks::thread_time() - begun) / 2000;
    };
    respond.push_back(ticks(SurfaceThenTissue<double>{}));
    proxy.push_back(ticks(ProxyForce<double>{}));
    ratio.push_back(respond.back() / proxy.back());
  }
  state.counters["message"] = median(message);
  state.counters["capture"] = median(capture);
  state.counters["look"] = median(look);
  state.counters["respond"] = median(respond);
  state.counters["proxy"] = median(proxy);
  state.counters["respond/proxy"] = median(ratio);
}

void in_real_time(benchmark::State& state) {
  auto const us = [](DurationHistogram::Duration d) { return double(d.count()) / 1000.0; };
  std::vector<double> with, alone, ratio;
  for (auto _ : state) {
    {
      TissueServer server(sheet(), {.rate = 100.0});
      std::jthread const body([&](std::stop_token stop) { server.run(stop); });
      HapticClient client(pressing(), {.server = "localhost", .port = server.port()});
      client.run_realtime(1.0);
      with.push_back(us(client.statistics().servo.compute().p99()));
    }
    {
      Simulator simulator(pressing(), sheet(), NoCutter<double>{}, SurfaceThenTissue<double>{}, {.body_rate = 100.0});
      simulator.run_realtime(1.0);
      alone.push_back(us(simulator.statistics().servo.compute().p99()));
    }
    ratio.push_back(with.back() / alone.back());
  }
  state.counters["p99"] = median(with);
  state.counters["p99_alone"] = median(alone);
  state.counters["p99_ratio"] = median(ratio);
}

BENCHMARK(parts)->Iterations(21)->Unit(benchmark::kMillisecond);
BENCHMARK(in_real_time)->Iterations(5)->Unit(benchmark::kMillisecond);

}  // namespace
