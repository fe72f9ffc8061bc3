// SPDX-License-Identifier: MIT
// Six strokes of a scalpel over a liver under pre-tension: each on a liver of its own, which moves while it is cut and gapes. Or six cuts through a solid
// block. Two pictures of each show the mesh and the wound.
#include "../exit_code.hpp"
#include "pictures.hpp"
#include "solid_cuts.hpp"
#include "strokes.hpp"

#include <palpate/core/detail/text.hpp>
#include <palpate/organs.hpp>
#include <palpate/palpate.hpp>
#include <palpate/testing/cut_invariants.hpp>
#include <palpate/vtk/virtual_display.hpp>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <string>
#include <system_error>
#include <type_traits>
#include <utility>
#include <vector>

namespace {

using namespace cutting;
using namespace palpate;

using Liver = SoftBody<MassSpring<double>, LeapfrogVerlet, WholeBody>;

constexpr double tick = 1e-3;   // s
constexpr double settling = 0.4;   // s
constexpr double puncture_depth = 0.003;   // m

Liver make_liver() {
  // Each link is a quarter shorter than its edge. The home springs are what holds the surface in shape: a wound gapes more the softer they are.
  return Liver(MassSpring<double>(make_organ<double>({.vertices = 1500}), {.mass = {.total = 0.6},
                                                                           .link = {.stiffness = 40.0, .damping = 0.02},
                                                                           .home = {.stiffness = 5.0, .damping = 0.05},
                                                                           .link_prestrain = 0.25}));
}

/// What is reported of a stroke: the sums over its cuts.
struct Counts {
  int particles = 0, triangles = 0;
  int vertex_edge = 0, vertex_vertex = 0, edge_vertex = 0, edge_edge = 0;
  double gap = 0.0;   // m, the largest distance between two particles that were one before their cut
  std::string broken;   // what is not as it must be after a cut, or ""

  void add(CutReport const& cut) {
    particles += cut.particles_added, triangles += cut.triangles_added;
    vertex_edge += cut.vertex_edge, vertex_vertex += cut.vertex_vertex, edge_vertex += cut.edge_vertex,
        edge_edge += cut.edge_edge;
  }
};

/// A blade on its way along its tips.
template <class Cutter>
struct Blade {
  Cutter cutter;
  Tips const* tips;
  std::size_t next = 0;

  bool is_done() const { return next == tips->size(); }
};

void move_on(Liver& liver) {
  if (!liver.advance(tick)) throw Error("the liver diverged");
}

/// Draws the blades over the liver, which moves with them, until all are lifted.
template <class Cutter>
void draw(Liver& liver, std::vector<Blade<Cutter>>& blades, testing::CutInvariants<Liver> const& before, Counts& counts) {
  auto const is_done = [](Blade<Cutter> const& blade) { return blade.is_done(); };
  std::size_t checked = liver.topology_revision();
  while (!std::all_of(blades.begin(), blades.end(), is_done)) {
    for (Blade<Cutter>& blade : blades) {
      if (blade.is_done()) continue;
      blade.cutter.advance(liver, (*blade.tips)[blade.next++]);
      if (liver.topology_revision() == checked || !counts.broken.empty()) continue;
      counts.broken = testing::to_text(before.check(liver));
      checked = liver.topology_revision();
    }
    move_on(liver);
  }
}

void settle(Liver& liver) {
  for (double time = 0.0; time < settling; time += tick) move_on(liver);
}

/// Pulls a piece as far away as `shift` says: each home spring gets what it answers with there.
void part(Liver& liver, std::vector<int> const& piece, Vector const& shift) {
  for (double time = 0.0; time < settling; time += tick) {
    for (int const i : piece) liver.apply_force(i, liver.tissue().home(i).stiffness * shift);
    move_on(liver);
  }
}

template <class Cutter>
bool show(Stroke const& stroke, Cutter const& cutter, Canvas const& canvas) {
  Liver liver = make_liver();
  testing::CutInvariants const before(liver, {.moves_vertices = std::is_same_v<Cutter, SeparatingCutter<double>>});
  Counts counts;
  auto const measure = [&](Cutter const& used) {
    counts.add(used.report());
    for (auto const& [left, right] : used.lips())
      counts.gap = std::max(counts.gap, (liver.positions().col(left) - liver.positions().col(right)).norm());
  };

  std::vector<Blade<Cutter>> blades;
  for (Tips const& tips : stroke.blades) blades.push_back({cutter, &tips});
  draw(liver, blades, before, counts);
  settle(liver);
  for (Blade<Cutter> const& blade : blades) measure(blade.cutter);
  for (Tips const& tips : stroke.afterwards) {
    std::vector<Blade<Cutter>> once{{cutter, &tips}};
    draw(liver, once, before, counts);
    settle(liver);
    measure(once.front().cutter);
  }

  auto pieces = connected_components(liver.mesh());
  std::sort(pieces.begin(), pieces.end(), [](auto const& a, auto const& b) { return a.size() > b.size(); });
  for (std::size_t k = 1; k < pieces.size(); ++k) part(liver, pieces[k], stroke.part);
  write_pictures(canvas, stroke.name, liver.mesh(), stroke.seen_from);

  std::printf(
      "%-11s pieces %d  particles %+4d  triangles %+4d  V-P %2d  V-V %2d  P-V %2d  P-P %3d  gap %4.1f mm  invariants %s\n",
      stroke.name.c_str(), int(pieces.size()), counts.particles, counts.triangles, counts.vertex_edge, counts.vertex_vertex,
      counts.edge_vertex, counts.edge_edge, 1000.0 * counts.gap, counts.broken.empty() ? "hold" : "BROKEN");
  std::fflush(stdout);
  if (!counts.broken.empty()) std::fprintf(stderr, "cutting: %s: %s", stroke.name.c_str(), counts.broken.c_str());
  return counts.broken.empty();
}

/// That pictures can be drawn, and where. Throws where they can not.
void prepare(std::filesystem::path const& folder) {
  std::error_code problem;
  std::filesystem::create_directories(folder, problem);
  if (problem) throw FileError("can not make the folder " + folder.string() + ": " + problem.message() + "; choose another");
}

template <class Cutter>
int show_all(Cutter const& cutter, Canvas const& canvas) {
  bool good = true;
  for (Stroke const& stroke : strokes_over(make_liver().mesh())) good = show(stroke, cutter, canvas) && good;
  return good ? 0 : 1;
}

constexpr char const* usage = "usage: cutting FOLDER [--cutter progressive|separating|volume] [--width PIXELS]";

}  // namespace

/// Exit codes: 0 done; 2 the arguments can not be used, or no pictures can be drawn; 1 an invariant is broken, or anything else.
int main(int argc, char** argv) {
  std::string name = "progressive", width;
  Canvas canvas;
  for (int k = 1; k < argc; ++k) {
    std::string const argument = argv[k];
    if (argument == "--help") {
      std::printf("%s\n", usage);
      return 0;
    }
    if (argument == "--cutter" && k + 1 < argc)
      name = argv[++k];
    else if (argument == "--width" && k + 1 < argc)
      canvas.width = detail::to_number<int>(width = argv[++k]).value_or(0);
    else if (canvas.folder.empty() && !argument.empty() && argument.front() != '-')
      canvas.folder = argument;
    else
      return std::fprintf(stderr, "cutting: what is \"%s\"?\n%s\n", argument.c_str(), usage), 2;
  }
  if (canvas.folder.empty()) return std::fprintf(stderr, "cutting: say in which folder the pictures go\n%s\n", usage), 2;
  if (name != "progressive" && name != "separating" && name != "volume")
    return std::fprintf(stderr, "cutting: no cutter is called \"%s\"\n%s\n", name.c_str(), usage), 2;
  if (canvas.width < 160 || canvas.width > 7680) return std::fprintf(stderr, "cutting: --width is \"%s\"; a picture is 160 to 7680 pixels wide\n%s\n", width.c_str(), usage), 2;
  return exit_code_of("cutting", [&]() -> int {
    prepare(canvas.folder);
    VirtualDisplay const display;
    if (!display.ready()) throw FileError("no pictures can be drawn: " + display.problem());
    if (name == "volume") return show_solid_cuts(canvas) ? 0 : 1;
    if (name == "separating") return show_all(SeparatingCutter<double>({.puncture_depth = puncture_depth}), canvas);
    return show_all(ProgressiveCutter<double>({.puncture_depth = puncture_depth}), canvas);
  });
}
