// SPDX-License-Identifier: MIT
#pragma once

#include "drawn_strokes.hpp"

#include <palpate/testing/cut_motion.hpp>

#include <algorithm>
#include <exception>
#include <map>
#include <numbers>
#include <span>
#include <string>
#include <vector>

/// So many blades the random strokes draw in one body at once.
inline constexpr int max_blades = 3;

/// Strokes over one body, with all that is needed to draw them again.
template <class S>
struct StrokeCase {
  std::string mesh = "grid";             ///< see stroke_mesh()
  std::optional<S> snap = {};            ///< m, of the cutter
  int steps = 0;                         ///< of the body between two ticks; 0: it rests
  int crossings = 100;                   ///< crossings_per_tick of the cutter
  int blades = 1;                        ///< so many strokes are drawn at once, tick by tick in turn
  std::vector<Points<S>> strokes = {};   ///< of the tip, one point a tick
};

/// A tube around z, open at both ends: `around` × (`along` + 1) vertices, outward.
template <class S>
palpate::TriangleMesh<S> make_open_tube(int around, int along, S radius, S length) {
  palpate::TriangleMesh<S> mesh;
  mesh.points.resize(3, around * (along + 1));
  mesh.triangles.resize(3, 2 * around * along);
  for (int j = 0; j <= along; ++j)
    for (int i = 0; i < around; ++i) {
      double const angle = 2 * std::numbers::pi * i / around;
      mesh.points.col(j * around + i) << radius * S(std::cos(angle)), radius * S(std::sin(angle)), length * (S(j) / S(along) - S(0.5));
    }
  for (int j = 0; j < along; ++j)
    for (int i = 0; i < around; ++i) {
      int const a = j * around + i, b = j * around + (i + 1) % around, c = a + around, d = b + around;
      mesh.triangles.col(2 * (j * around + i)) << a, b, d;
      mesh.triangles.col(2 * (j * around + i) + 1) << a, d, c;
    }
  return mesh;
}

/// A bent sheet whose columns and rows of squares grow by half from each to the next: edges 1 : 25, triangles thin in both directions.
template <class S>
palpate::TriangleMesh<S> make_uneven_sheet(int columns, int rows) {
  palpate::TriangleMesh<S> mesh = palpate::make_grid<S>(columns, rows, S(1));
  for (Eigen::Index i = 0; i < mesh.points.cols(); ++i) {
    S const x = S(0.002) * (std::pow(S(1.5), mesh.points(0, i)) - 1), y = S(0.06) * (1 - std::pow(S(1.5), -mesh.points(1, i)));
    mesh.points.col(i) << x, y, S(2) * x * x + S(3) * y * y;
  }
  return mesh;
}

/// The meshes of the tests by name.
template <class S>
palpate::TriangleMesh<S> stroke_mesh(std::string const& name) {
  if (name == "grid") return palpate::make_grid<S>(9, 9, S(0.01));
  if (name == "sphere") return palpate::make_sphere<S>(S(0.05), 3);
  if (name == "organ") return palpate::make_organ<S>({.vertices = 300});
  if (name == "tube") return make_open_tube<S>(10, 8, S(0.03), S(0.1));
  if (name == "uneven") return make_uneven_sheet<S>(9, 9);
  if (name == "small grid") return palpate::make_grid<S>(4, 4, S(0.01));
  if (name == "small sphere") return palpate::make_sphere<S>(S(0.02), 1);
  if (name == "small tube") return make_open_tube<S>(5, 2, S(0.02), S(0.04));
  if (name == "small uneven") return make_uneven_sheet<S>(5, 5);
  throw palpate::InvalidArgument("no mesh has the name " + name);
}

template <class S>
using StrokeBody = palpate::SoftBody<palpate::MassSpring<S>, palpate::LeapfrogVerlet, palpate::WholeBody>;

/// A body and what no cut may change of it, made once for each mesh.
template <class S>
struct StrokeScene {
  explicit StrokeScene(palpate::TriangleMesh<S> const& surface)
      : mesh(surface), edge(palpate::mean_edge_length(mesh)), body(make_tissue(mesh), palpate::LeapfrogVerlet{}, palpate::WholeBody{}), before(body) {}

  palpate::TriangleMesh<S> mesh;
  S edge;   // m
  StrokeBody<S> body;
  palpate::testing::CutInvariants<StrokeBody<S>> before;
};

template <class S>
StrokeScene<S> const& stroke_scene(std::string const& name) {
  static std::map<std::string, StrokeScene<S>> scenes;
  auto found = scenes.find(name);
  if (found == scenes.end()) found = scenes.emplace(name, stroke_mesh<S>(name)).first;
  return found->second;
}

template <class S>
palpate::ProgressiveCutter<S> scalpel_of(StrokeCase<S> const& strokes) {
  return palpate::ProgressiveCutter<S>({.puncture_depth = S(0.2) * stroke_scene<S>(strokes.mesh).edge, .snap = strokes.snap, .crossings_per_tick = strokes.crossings});
}

/// Whether a cut is not over.
template <class Cutter>
bool is_cutting(Cutter const& cutter) {
  if constexpr (requires { cutter.is_behind(); })
    if (cutter.is_behind()) return true;
  return cutter.state() == palpate::CuttingPhase::moving;
}

/// What the report of a cut says, beside what came into the mesh since its puncture. For one blade in a body.
template <class Body>
class ReportCheck {
 public:
  /// After a tick; `was_cutting`, `size` and `triangles` are from before it.
  template <class Cutter>
  std::string check(Body const& body, Cutter const& cutter, bool was_cutting, int size, int triangles) {
    if (!was_cutting && cutter.state() == palpate::CuttingPhase::moving) size_ = size, triangles_ = triangles;
    if (!was_cutting && cutter.state() != palpate::CuttingPhase::moving) return {};
    int const particles_added = body.size() - size_;
    int const triangles_added = static_cast<int>(body.triangles().cols()) - triangles_;
    auto const& report = cutter.report();
    if (report.particles_added != particles_added || report.triangles_added != triangles_added)
      return palpate::detail::message("the report counts ", report.particles_added, " particles and ", report.triangles_added, " triangles, added were ",
                                      particles_added, " and ", triangles_added, "\n");
    for (auto const& [p, q] : cutter.lips())
      if (p < 0 || q < 0 || p >= body.size() || q >= body.size() || body.tissue().rest_position(p) != body.tissue().rest_position(q))
        return palpate::detail::message("the lips ", p, " and ", q, " do not lie on each other undeformed\n");
    return {};
  }

 private:
  int size_ = 0, triangles_ = 0;
};

/// Draws the strokes of a case one after the other; what is violated first, with stroke and tick, or "".
/// `make_cutter(case)` makes the cutter, a new one for each stroke.
template <class S, class MakeCutter>
class StrokeRun {
 public:
  StrokeRun(StrokeCase<S> const& strokes, MakeCutter make_cutter)
      : strokes_(strokes), make_cutter_(make_cutter), scene_(stroke_scene<S>(strokes.mesh)), body_(scene_.body) {
    if (strokes.steps == 0) return;
    body_.apply_force(body_.size() / 2, {S(0.2), S(-0.1), S(0.3)});
    step(10);
  }

  StrokeBody<S> const& body() const noexcept { return body_; }
  long ticks() const noexcept { return ticks_; }
  int cuts() const noexcept { return cuts_; }

  /// One stroke for each blade, at once.
  std::string draw(std::span<Points<S> const> together) {
    ++stroke_;
    using Cutter = decltype(make_cutter_(strokes_));
    std::vector<Cutter> cutters;
    std::size_t longest = 0;
    for (auto const& tips : together) {
      cutters.push_back(make_cutter_(strokes_));
      longest = std::max(longest, tips.size());
    }
    ReportCheck<StrokeBody<S>> report;
    for (std::size_t i = 0; i <= longest; ++i) {
      for (std::size_t k = 0; k < together.size(); ++k) {
        Cutter& cutter = cutters[k];
        if (i > together[k].size()) continue;
        bool const was_cutting = is_cutting(cutter);
        int const size = body_.size(), triangles = static_cast<int>(body_.triangles().cols());
        palpate::testing::CutMotion const motion(body_);
        std::string found;
        try {
          if (i < together[k].size())
            cutter.advance(body_, together[k][i]);
          else
            cutter.reset(body_);   // taken away
          ++ticks_;
          cuts_ += !was_cutting && is_cutting(cutter) ? 1 : 0;
          found = palpate::testing::to_text(scene_.before.check(body_)) + palpate::testing::to_text(motion.check(body_));
          if (found.empty() && together.size() == 1) found = report.check(body_, cutter, was_cutting, size, triangles);
        } catch (std::exception const& error) {
          found = std::string("throws: ") + error.what() + "\n";
        }
        if (!found.empty())
          return "stroke " + std::to_string(stroke_) + ", tick " + std::to_string(i) + " (" + palpate::to_string(cutter.state()) + ")\n" + found;
      }
      if (strokes_.steps > 0 && !step(strokes_.steps)) return "stroke " + std::to_string(stroke_) + ", tick " + std::to_string(i) + ": the body diverges\n";
    }
    return {};
  }

 private:
  bool step(int count) {
    S const h = S(0.5) * body_.stable_step();
    for (int i = 0; i < count; ++i)
      if (!body_.step(h)) return false;
    return true;
  }

  StrokeCase<S> const& strokes_;
  MakeCutter make_cutter_;
  StrokeScene<S> const& scene_;
  StrokeBody<S> body_;
  int stroke_ = -1, cuts_ = 0;
  long ticks_ = 0;
};

template <class S, class MakeCutter>
std::string violations_of(StrokeCase<S> const& strokes, MakeCutter make_cutter) {
  StrokeRun<S, MakeCutter> run(strokes, make_cutter);
  std::span<Points<S> const> left(strokes.strokes);
  while (!left.empty()) {
    std::size_t const together = std::min(left.size(), static_cast<std::size_t>(strokes.blades));
    if (auto found = run.draw(left.first(together)); !found.empty()) return found;
    left = left.subspan(together);
  }
  return {};
}
template <class S>
std::string violations_of(StrokeCase<S> const& strokes) {
  return violations_of(strokes, scalpel_of<S>);
}
