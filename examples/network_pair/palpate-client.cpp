// SPDX-License-Identifier: MIT
// The hand's side of a haptic hierarchy: a device at 1 kHz that feels what a palpate-server simulates.
#include "../command_line.hpp"
#include "../exit_code.hpp"
#include "on_signal.hpp"

#include <palpate/core/version.hpp>
#include <palpate/device/built_in_devices.hpp>
#include <palpate/network/network.hpp>
#include <palpate/palpate.hpp>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>

namespace {

using namespace palpate;

struct Options {
  HapticClientOptions client{};
  double seconds = 6.0;
  std::string device = "press", out;
  bool status = false;
};

std::optional<int> parse(Options& o, int argc, char** argv) {
  CLI::App app{"Feels, with a device here, the tissue that a palpate-server simulates elsewhere."};
  app.set_version_flag("--version", std::string("palpate-client (palpate ") + PALPATE_VERSION_STRING + ")");
  app.get_formatter()->column_width(30);
  app.footer("Devices:\npress\n    goes into the middle of the tissue by 4 mm, holds for 1.5 s, goes out: every 3 s\n" + built_in_devices().help() +
             "\nExit codes: 0 done; 2 no server, or an option is wrong, said in one line; 1 anything else.");
  app.add_option("--server", o.client.server, "name or address")->capture_default_str();
  app.add_option("--port", o.client.port, "that the server says it listens on")->check(command_line::range(1, 65535))->required();
  app.add_option("--seconds", o.seconds, "of the session [s]")->check(command_line::range(0.01, 2e4))->capture_default_str();
  app.add_option("--device", o.device, "press, or one of those below")->capture_default_str();
  app.add_option("--deadband", o.client.deadband.fraction, "of the force, that a sample must change to be sent; 0: all are")
      ->check(command_line::range(0.0, 0.9))->capture_default_str();
  app.add_option("--out", o.out, "file for the session, tick by tick (CSV)");
  app.add_flag("--status", o.status, "a line a second, also where this is no terminal");
  return command_line::parse(app, "palpate-client", argc, argv, [] {});
}

AnyDevice<double> device_of(Options const& options) {
  if (options.device != "press") return built_in_devices().make(options.device);
  constexpr double x = 0.0505, y = 0.0502, above = 0.01, below = -0.004;   // m
  auto way = Trajectory<double>::start({x, y, above});
  for (double time = 0.0; time < options.seconds; time += 3.0)
    way.line({x, y, below}, 0.5).line({x, y, below}, 1.5).line({x, y, above}, 0.5).line({x, y, above}, 0.5);
  return ScriptedDevice<double>(std::move(way));
}

std::string status_of(HapticClientStatistics const& s) {
  return detail::message(s.is_connected ? "connected" : "not connected", ", ", s.servo.ticks(), " ticks, ", s.answers.surfaces, " surfaces, ",
                         s.answers.tissues, " tissue answers, ", s.reconnects, " reconnects, rtt ", 1e3 * s.rtt, " ms, latency ", 1e3 * s.latency, " ms");
}

int run(Options const& options) {
  std::filesystem::path const folder = std::filesystem::path(options.out).parent_path();
  if (!folder.empty() && !is_directory(folder)) throw FileError(detail::message(folder.string(), " is no folder; make it before the session, or give another --out"));
  if (is_directory(std::filesystem::path(options.out))) throw FileError(options.out + " is a folder; give --out a file");
  HapticClient client(device_of(options), options.client);
  network_pair::end_on_signals();
  Recording session;
  {
    auto const watcher = network_pair::watch(options.status, [&] { return status_of(client.statistics()); }, [&] { client.stop(); });
    session = client.run_realtime(options.seconds);
  }
  auto const all = client.statistics();
  double const last = session.ticks().empty() ? 0.0 : session.ticks().back().force.norm();
  std::printf("palpate-client: %zu ticks at %.1f Hz, %llu overruns; largest force %.3f N, force at the end %g N\n", session.ticks().size(), all.servo.rate(),
              static_cast<unsigned long long>(all.servo.overruns()), session.largest_force(), last);
  std::puts(detail::message("palpate-client: ", all.sent, " samples sent, ", all.left_out, " left out; ", all.answers.surfaces, " surfaces and ",
                            all.answers.tissues, " tissue answers used; ", all.reconnects, " reconnects, rtt ", 1e3 * all.rtt, " ms").c_str());
  if (!options.out.empty()) session.write_csv(options.out);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  if (auto const code = parse(options, argc, argv)) return *code;
  return exit_code_of("palpate-client", [&] { return run(options); });
}
