// SPDX-License-Identifier: MIT
// One who looks on at a palpate-server: draws the tissue and the tool that a hand elsewhere moves, into a picture that is written again and again.
#include "../command_line.hpp"
#include "../exit_code.hpp"
#include "on_signal.hpp"

#include <palpate/core/error.hpp>
#include <palpate/core/version.hpp>
#include <palpate/mesh/sphere.hpp>
#include <palpate/mesh/triangle_mesh.hpp>
#include <palpate/network/onlooker.hpp>
#ifdef PALPATE_EXAMPLES_DRAW
#include <palpate/vtk/picture.hpp>
#include <palpate/vtk/virtual_display.hpp>
#endif

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace {

using namespace palpate;

struct Options {
  OnlookerOptions onlooker{};
  double seconds = 6.0, every = 0.5;
  std::string out;
  bool status = false;
};

std::optional<int> parse(Options& o, int argc, char** argv) {
  CLI::App app{"Looks on while somebody feels the tissue of a palpate-server, and draws it."};
  app.set_version_flag("--version", std::string("palpate-onlooker (palpate ") + PALPATE_VERSION_STRING + ")");
  app.get_formatter()->column_width(30);
  app.footer("Exit codes: 0 done; 1 no picture came, or anything else; 2 an option or the file can not be used, said in one line.");
  app.add_option("--server", o.onlooker.server, "name or address")->capture_default_str();
  app.add_option("--port", o.onlooker.port, "that the server says it listens on")->check(command_line::range(1, 65535))->required();
  app.add_option("--seconds", o.seconds, "to look on [s]")->check(command_line::range(0.01, 1e5))->capture_default_str();
  app.add_option("--out", o.out, "PNG file for the newest picture; the last with a tool in the tissue is kept beside it as NAME-touched.png");
  app.add_option("--every", o.every, "between two pictures in the file [s]")->check(command_line::range(0.05, 1e4))->capture_default_str();
  app.add_flag("--status", o.status, "a line a second, also where this is no terminal");
  return command_line::parse(app, "palpate-onlooker", argc, argv, [] {});
}

#ifdef PALPATE_EXAMPLES_DRAW
void draw(BodySnapshot<float> const& picture, std::filesystem::path const& file) {
  TriangleMesh<double> const tissue{picture.points.cast<double>(), picture.triangles};
  std::vector<PicturePart> parts;
  for (auto const& tool : picture.tools) {
    PicturePart ball{make_sphere<double>(0.002, 6)};
    ball.mesh.points.colwise() += Vector3<double>(tool.pose.position.cast<double>()) + Vector3<double>(0, 0, 0.002);   // its lowest point is the tip
    parts.push_back(std::move(ball));
  }
  PictureStyle style;
  style.width = 960, style.height = 640, style.wound_depth = 0.0;
  write_picture(file, tissue, framing(tissue, {0.2, -1.0, 0.6}, Vector3<double>::UnitZ(), 1.5), std::nullopt, style, parts);
}
#endif

std::string status_of(OnlookerStatistics const& s) {
  return palpate::detail::message(s.is_connected ? "connected" : "not connected", ", ", s.pictures, " pictures, ", s.received / 1000, " kB, rtt ", 1e3 * s.rtt,
                                  " ms");
}

int run(Options const& options) {
  std::filesystem::path const folder = std::filesystem::path(options.out).parent_path();
  if (!folder.empty() && !is_directory(folder))
    throw FileError(palpate::detail::message(folder.string(), " is no folder; make it before, or give another --out"));
  if (is_directory(std::filesystem::path(options.out))) throw FileError(options.out + " is a folder; give --out a file");
#ifdef PALPATE_EXAMPLES_DRAW
  VirtualDisplay const display;
#else
  if (!options.out.empty()) std::fprintf(stderr, "palpate-onlooker: --out is left out: it was built without VTK 9 (Debian: libvtk9-dev)\n");
#endif
  Onlooker onlooker(options.onlooker);
  network_pair::end_on_signals();
  std::atomic<bool> ends{false};
  auto const watcher = network_pair::watch(options.status, [&] { return status_of(onlooker.statistics()); }, [&] { ends.store(true); });
  using Clock = std::chrono::steady_clock;
  auto const seconds = [](double s) { return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(s)); };
  auto const end = Clock::now() + seconds(options.seconds);
  auto next = Clock::now();
  std::size_t files = 0;
  while (!ends.load() && Clock::now() < end) {
    if (onlooker.fetch() && Clock::now() >= next) {
      next = Clock::now() + seconds(options.every);
#ifdef PALPATE_EXAMPLES_DRAW
      if (!options.out.empty()) {
        std::filesystem::path const file = options.out;
        draw(onlooker.latest(), file);
        ++files;
        std::filesystem::path const touched = file.parent_path() / (file.stem().string() + "-touched" + file.extension().string());
        if (onlooker.latest().phase != CuttingPhase::no_contact) copy_file(file, touched, std::filesystem::copy_options::overwrite_existing);
      }
#endif
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  auto const& last = onlooker.latest();
  auto const all = onlooker.statistics();
  std::printf("palpate-onlooker: %llu pictures of %d points and %d triangles, %zu into a file; %llu connections\n",
              static_cast<unsigned long long>(all.pictures), static_cast<int>(last.points.cols()), static_cast<int>(last.triangles.cols()), files,
              static_cast<unsigned long long>(all.connections));
  if (all.pictures > 0) return 0;
  std::fprintf(stderr, "palpate-onlooker: no picture came from %s:%d in %g s%s; start the server there, and give the port that it says it listens on\n",
               options.onlooker.server.c_str(), int(options.onlooker.port), options.seconds, all.connections == 0 ? ": there was no connection" : "");
  return 1;
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  if (auto const code = parse(options, argc, argv)) return *code;
  return exit_code_of("palpate-onlooker", [&] { return run(options); });
}
