// SPDX-License-Identifier: MIT
// Yardstick: faults that are planted, known to the tick: the checks see each of them, and shrinking leaves what it needs and no more.
#include "random_strokes.hpp"
#include "shrink_stroke.hpp"
#include "solid_strokes.hpp"

#include "catch.hpp"

#include <palpate/core/random.hpp>

#include <array>
#include <stdexcept>
#include <string>
#include <vector>

using namespace palpate;
using namespace palpate_test;

namespace {

enum class Fault { none, momentum, energy, loose_particle, report, throws };

/// A scalpel that does something wrong in the third tick that it cuts beyond x = 4 cm.
class FaultyScalpel {
 public:
  FaultyScalpel(StrokeCase<double> const& strokes, Fault fault) : scalpel_(scalpel_of(strokes)), fault_(fault) {}

  template <class Body>
  void advance(Body& body, Vector3<double> const& tip) {
    scalpel_.advance(body, tip);
    report_ = scalpel_.report();
    if (scalpel_.state() != CuttingPhase::moving || tip.x() < 0.04 || ++beyond_ != 3) return;
    switch (fault_) {
      case Fault::none: break;
      case Fault::momentum: body.drag(3, body.positions().col(3), {0, 0, 1}); break;
      case Fault::energy:   // two of the same mass, against each other
        body.drag(3, body.positions().col(3), {0, 0, 1});
        body.drag(4, body.positions().col(4), {0, 0, -1});
        break;
      case Fault::loose_particle: body.split_particle(3, {}); break;
      case Fault::report: report_.particles_added += 1; break;
      case Fault::throws: throw std::logic_error("planted");
    }
  }
  template <class Body>
  void reset(Body& body) {
    scalpel_.reset(body);
    report_ = scalpel_.report();
  }
  CuttingPhase state() const { return scalpel_.state(); }
  CutReport const& report() const { return report_; }
  std::vector<std::array<int, 2>> const& lips() const { return scalpel_.lips(); }

 private:
  ProgressiveCutter<double> scalpel_;
  CutReport report_;
  Fault fault_;
  int beyond_ = 0;
};

std::string violations_with(Fault fault, StrokeCase<double> const& strokes) {
  return violations_of(strokes, [fault](auto const& c) { return FaultyScalpel(c, fault); });
}

TriangleMesh<double> torus(int n, int m) {
  auto mesh = make_open_tube<double>(n, m, 0.01, 0.1);
  for (Eigen::Index i = 0; i < mesh.points.cols(); ++i) {   // bent until its ends meet
    double const turn = 2 * std::numbers::pi * (mesh.points(2, i) / 0.1), r = 0.03 - mesh.points(0, i);
    mesh.points.col(i) << r * std::cos(turn), mesh.points(1, i), r * std::sin(turn);
  }
  for (int& c : mesh.triangles.reshaped())
    if (c >= n * m) c -= n * m;
  mesh.points = mesh.points.leftCols(n * m).eval();
  return mesh;
}

template <class Mesh>
auto body_of(Mesh const& mesh) {
  return SoftBody(make_tissue(mesh), LeapfrogVerlet{}, WholeBody{});
}

}  // namespace

TEST_CASE("a planted fault is found, and shrunk to the ticks that it needs", "[cutting]") {
  auto const [fault, says] = GENERATE(table<Fault, std::string>({{Fault::momentum, "the momentum has changed"},
                                                                 {Fault::energy, "the kinetic energy has risen"},
                                                                 {Fault::loose_particle, "is in no triangle"},
                                                                 {Fault::report, "the report counts"},
                                                                 {Fault::throws, "throws: planted"}}));
  CAPTURE(says);
  StrokeCase<double> strokes{.mesh = "grid", .snap = 0.001, .steps = 1};
  Random random(Seed{3});
  for (int k = 0; k < 6; ++k) strokes.strokes.push_back(RandomStrokes<double>(random, stroke_mesh<double>("grid"), 0.01).draw());
  strokes.strokes.push_back(stroke_over<double>(stroke_mesh<double>("grid"), sampled<double>({{0.021, 0.034, 0}, {0.072, 0.038, 0}}, 0.002), 0.004, 0.003));
  REQUIRE(violations_with(Fault::none, strokes) == "");
  REQUIRE(violations_with(fault, strokes).find(says) != std::string::npos);
  int asked = 0;
  auto const smallest = shrunk(strokes, [&, wrong = fault](auto const& c) { return ++asked, violations_with(wrong, c) != ""; });
  auto const found = violations_with(fault, smallest);
  CAPTURE(asked, to_test_case(smallest, found));
  CHECK(found.find(says) != std::string::npos);
  REQUIRE(smallest.strokes.size() == 1);
  CHECK(smallest.strokes.front().size() == 4);   // from outside, and three ticks beyond
  CHECK(!smallest.snap);
  CHECK(smallest.steps == 0);
}

TEST_CASE("shrinking keeps a case that needs all it has", "[cutting]") {
  StrokeCase<double> const strokes{.mesh = "tube", .snap = 0.25, .steps = 2, .blades = 2, .strokes = {{{1.0 / 3, 0, 0}}, {{0, 0.5, 1}, {1, 1, 1}}}};
  auto const same = shrunk(strokes, [&](auto const& c) {
    return c.strokes == strokes.strokes && c.snap == strokes.snap && c.steps == strokes.steps && c.blades == strokes.blades;
  });
  CHECK(same.strokes == strokes.strokes);
  CHECK(to_test_case(same, "stroke 0, tick 0 (moving)\nno area\n") ==
        "TEST_CASE(\"strokes that failed: name what it was\") {\n"
        "  // stroke 0, tick 0 (moving)\n"
        "  // no area\n"
        "  StrokeCase<double> const strokes{.mesh = \"tube\", .snap = 0.25, .steps = 2, .blades = 2, .strokes = {{{0.3333333333333333, 0, 0}},\n"
        "      {{0, 0.5, 1}, {1, 1, 1}}}};\n"
        "  CHECK(violations_of(strokes) == \"\");\n"
        "}\n");
}

TEST_CASE("the checks see a handle and triangles with the same corners", "[cutting]") {
  auto sphere = body_of(stroke_mesh<double>("sphere"));
  auto ring = body_of(torus(6, 9));
  testing::CutInvariants const of_sphere(sphere), of_ring(ring);
  CHECK(testing::to_text(of_sphere.check(sphere)) == "");
  CHECK(testing::to_text(of_ring.check(ring)) == "");
  CHECK(testing::to_text(of_sphere.check(ring)).find("twice the number of handles is 2, before the cut it was 0") != std::string::npos);
  CHECK(testing::to_text(of_ring.check(sphere)).find("handles") == std::string::npos);   // a cut may open a handle

  TriangleMesh<double> pair;   // two triangles apart, which edits lay on each other, back to back
  pair.points.resize(3, 6);
  pair.points << 0, 1, 0, 3, 4, 3, 0, 0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0;
  pair.triangles.resize(3, 2);
  pair.triangles << 0, 3, 1, 4, 2, 5;
  auto pillow = body_of(pair);
  testing::CutInvariants const of_pair(pillow);
  CHECK(testing::to_text(of_pair.check(pillow)) == "");
  pillow.change_corner(1, 3, 0);
  pillow.change_corner(1, 4, 2);
  pillow.change_corner(1, 5, 1);
  CHECK(testing::to_text(of_pair.check(pillow)).find("two triangles have the corners 0 1 2") != std::string::npos);
}

TEST_CASE("strokes through a solid are made as few and short as they still fail", "[cutting]") {
  SolidCase all{7, {}};
  for (int n = 0; n < 5; ++n)
    for (int tick = 0; tick < 40; ++tick) {
      if (tick == 0) all.strokes.emplace_back();
      all.strokes.back().push_back({Place(n, tick, 0), Place(n, tick, 1), true});
    }
  auto const has = [](SolidCase const& some, double n, double tick) {
    return std::ranges::any_of(some.strokes, [&](auto const& own) { return std::ranges::any_of(own, [&](BladeTick const& at) { return at.from == Place(n, tick, 0); }); });
  };
  int asked = 0;
  auto const least = with_fewer_ticks(all, [&](SolidCase const& smaller) { return ++asked, has(smaller, 1, 17) && has(smaller, 1, 31) && has(smaller, 4, 0); });
  CHECK(asked <= 300);
  REQUIRE(least.strokes.size() == 2);
  CHECK(least.strokes[0].size() == 2);
  CHECK(least.strokes[1].size() == 1);
  CHECK(has(least, 1, 17));
  CHECK(has(least, 4, 0));
}
