// SPDX-License-Identifier: MIT
// The tissue's side of a haptic hierarchy: a sheet or a block of 10 cm, its upper side at z = 0, for the hand of a palpate-client and for onlookers.
#include "../command_line.hpp"
#include "../exit_code.hpp"
#include "on_signal.hpp"

#include <palpate/core/version.hpp>
#include <palpate/network/network.hpp>
#include <palpate/palpate.hpp>

#include <cstdint>
#include <cstdio>
#include <optional>
#include <string>
#include <utility>

namespace {

using namespace palpate;

struct Options {
  TissueServerOptions server{};
  bool solid = false, status = false;
};

std::optional<int> parse(Options& o, int argc, char** argv) {
  CLI::App app{"Simulates soft tissue and lets one hand elsewhere feel it over TCP, with any number of onlookers. Ends on Ctrl-C or SIGTERM."};
  app.set_version_flag("--version", std::string("palpate-server (palpate ") + PALPATE_VERSION_STRING + ")");
  app.get_formatter()->column_width(30);
  app.footer("Exit codes: 0 ended; 2 it can not listen, or an option is wrong, said in one line; 1 anything else.");
  app.add_option("--port", o.server.port, "0: any that is free")->check(command_line::range(0, 65535))->capture_default_str();
  app.add_option("--address", o.server.address, "to listen on; 0.0.0.0: all networks of this machine")->capture_default_str();
  app.add_option("--rate", o.server.rate, "of the body [Hz]")->check(command_line::range(1.0, 1e4))->capture_default_str();
  app.add_option("--surface-rate", o.server.surface_rate, "of the surface that the hand is told [Hz]")->check(command_line::range(50.0, 1e4))->capture_default_str();
  app.add_flag("--solid", o.solid, "a block of finite elements instead of a sheet of springs");
  app.add_flag("--status", o.status, "a line a second, also where this is no terminal");
  return command_line::parse(app, "palpate-server", argc, argv, [] {});
}

std::string status_of(TissueServerStatistics const& s) {
  return detail::message(s.has_hand ? "a hand" : "no hand", ", ", s.onlookers, " look on, ", s.body_ticks, " ticks, ", s.late_ticks, " late, ",
                         s.samples, " samples, rtt ", 1e3 * s.rtt, " ms");
}

template <class Body>
int serve(Body body, Options const& options) {
  TissueServer server(std::move(body), options.server);
  if (options.server.address != "127.0.0.1" && options.server.address != "::1")
    std::fprintf(stderr, "palpate-server: warning: whoever reaches %s can take the hand: there is no encryption and no authentication\n",
                 options.server.address.c_str());
  std::printf("palpate-server: listens on %s:%d\n", options.server.address.c_str(), server.port());
  std::fflush(stdout);
  network_pair::end_on_signals();
  {
    auto const watcher = network_pair::watch(options.status, [&] { return status_of(server.statistics()); }, [&] { server.stop(); });
    server.run();
  }
  auto const all = server.statistics();
  std::puts(detail::message("palpate-server: ended; ", all.hands, " hands, ", all.samples, " samples, ", all.surfaces, " surfaces and ", all.tissues,
                            " tissue answers, ", all.body_ticks, " ticks, ", all.late_ticks, " late, ", all.refused, " refused, ", all.protocol_problems(),
                            " broke the protocol").c_str());
  return 0;
}

int run(Options const& options) {
  if (options.solid) {
    constexpr double edge = 0.0125;
    TetrahedralMesh<double> block = make_block<double>(9, 9, 4, edge, BlockPattern::alternating);
    block.points.row(2).array() -= 3 * edge;
    FiniteElements<double, StableNeoHookean<double>> tissue(block, {.density = 1060.0, .material = {.young = 5e3, .poisson = 0.45}});
    tissue.nail(vertices_where(block, [](Vector3<double> const& p) { return p.z() < -3 * edge + 1e-9; }));
    return serve(SoftBody(std::move(tissue), BackwardEuler{}), options);
  }
  auto const skin = make_grid<double>(21, 21, 0.005);
  MassSpring<double> tissue(skin, {.mass = {.total = 0.1}, .link = {.stiffness = 80.0, .damping = 0.2}, .home = {.stiffness = 8.0, .damping = 0.1}});
  tissue.nail(boundary_vertices(skin));
  return serve(SoftBody(std::move(tissue), LeapfrogVerlet{}), options);
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  if (auto const code = parse(options, argc, argv)) return *code;
  return exit_code_of("palpate-server", [&] { return run(options); });
}
