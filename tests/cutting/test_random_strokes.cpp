// SPDX-License-Identifier: MIT
// Yardsticks: what no cut may change (testing/cut_invariants.hpp), momentum and energy of motion before each tick (testing/cut_motion.hpp), and the
// mesh itself, counted, beside the cutter's report: over thousands of strokes, many on each body, across each other.
// PALPATE_STROKES sets how many (10,000 if not set), PALPATE_SEED with which seed they begin. A stroke that fails is printed as a test case.
#include "random_strokes.hpp"
#include "shrink_stroke.hpp"
#include "stroke_bytes.hpp"

#include "catch.hpp"

#include <palpate/body/temporary_subdivision.hpp>
#include <palpate/core/random.hpp>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <vector>

using namespace palpate;

namespace {

std::uint64_t from_environment(char const* name, std::uint64_t otherwise) {
  char const* const asked = std::getenv(name);
  return asked != nullptr ? std::stoull(asked) : otherwise;
}

struct Drawn {
  int bodies = 0, strokes = 0, cuts = 0, largest = 0, failures = 0;
  long ticks = 0;
};

/// One to six strokes on a fresh body, each drawn over the wounds of those before.
template <class S>
void draw_a_body(std::string const& mesh, std::uint64_t seed, Drawn& drawn) {
  Random random(Seed{seed});
  StrokeScene<S> const& scene = stroke_scene<S>(mesh);
  StrokeCase<S> strokes{.mesh = mesh};
  if (std::uint64_t const kind = random.below(4); kind == 1)
    strokes.snap = S(0);
  else if (kind == 2)
    strokes.snap = scene.edge * std::exp(random.uniform(std::log(S(1e-3)), std::log(S(0.6))));
  strokes.steps = random.below(6) == 0 ? 2 : 0;
  strokes.blades = random.below(8) == 0 ? 2 + static_cast<int>(random.below(max_blades - 1)) : 1;
  if (random.below(5) == 0) strokes.crossings = 1 + static_cast<int>(random.below(5));
  StrokeRun run(strokes, scalpel_of<S>);
  ++drawn.bodies;
  for (std::uint64_t left = 1 + random.below(6); left > 0; --left) {
    RandomStrokes<S> draw(random, run.body().rest_mesh(), scene.edge);
    std::vector<Points<S>> together;
    for (int k = 0; k < strokes.blades; ++k) together.push_back(draw.draw());
    strokes.strokes.insert(strokes.strokes.end(), together.begin(), together.end());
    drawn.strokes += strokes.blades;
    if (auto const found = run.draw(together); !found.empty()) {
      ++drawn.failures;
      auto const smallest = shrunk(strokes, [](auto const& c) { return violations_of(c) != ""; });
      FAIL_CHECK("body of seed " << seed << " on the " << mesh << ": " << found << to_test_case(smallest, violations_of(smallest)));
      return;
    }
  }
  drawn.cuts += run.cuts(), drawn.ticks += run.ticks();
  drawn.largest = std::max(drawn.largest, run.body().size());
}

}  // namespace

TEST_CASE("random strokes across each other keep every invariant", "[cutting]") {
  std::uint64_t const first = from_environment("PALPATE_SEED", 1);
  auto const most = static_cast<int>(from_environment("PALPATE_STROKES", 10000));
  std::array<std::string, 10> const meshes{"grid", "small grid", "sphere", "small sphere", "tube", "small tube", "uneven", "small uneven", "grid", "organ"};
  Drawn drawn;
  for (std::uint64_t k = 0; drawn.strokes < most && drawn.failures < 8; ++k) {
    std::uint64_t const seed = first + k;
    CAPTURE(seed);
    std::string const& mesh = meshes[seed % meshes.size()];
    if (seed / meshes.size() % 8 == 7)
      draw_a_body<float>(mesh, seed, drawn);
    else
      draw_a_body<double>(mesh, seed, drawn);
  }
  INFO("seed " << first << ": " << drawn.strokes << " strokes on " << drawn.bodies << " bodies, " << drawn.cuts << " cuts, " << drawn.ticks << " ticks, up to "
               << drawn.largest << " particles");
  CHECK(drawn.strokes >= most);
  CHECK(drawn.cuts > drawn.strokes / 2);
  CHECK(drawn.failures == 0);
}

TEST_CASE("any bytes are strokes that keep every invariant", "[cutting]") {
  // What the fuzz target does (tests/fuzz), with bytes from a generator.
  Random random(Seed{7});
  int cuts = 0;
  for (int k = 0; k < 150; ++k) {
    std::vector<std::uint8_t> bytes(20 + random.below(180));
    for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random.below(256));
    auto const strokes = strokes_from_bytes<double>(bytes);
    CAPTURE(k);
    auto const found = violations_of(strokes);
    if (!found.empty()) FAIL_CHECK(to_test_case(strokes, found));
    cuts += static_cast<int>(strokes.strokes.size());
  }
  CHECK(cuts > 150);
}

// What the random strokes found once, shrunk.

TEST_CASE("a snap distance of zero leaves triangles with an area, however often one line is cut", "[cutting]") {
  StrokeCase<double> const strokes{.mesh = "small grid", .snap = 0, .strokes = {
      {{0.012, 0.005, 0.001}, {0.01186, 0.00464, -0.00573}, {0.00774, 0.01063, -0.00573}},
      {{0.008, 0.01, 0.001}, {0.008176, 0.010002, -0.005784}, {1e-06, 0.009998, -0.005784}, {0.008175, 0.010001, -0.005784}, {0, 0.01, -0.006}}}};
  CHECK(violations_of(strokes) == "");
}

TEST_CASE("a blade that rests on the temporary triangle of another finds the surface again when that one is gone", "[cutting]") {
  StrokeCase<double> const strokes{.mesh = "small grid",
                                   .blades = 2,
                                   .strokes = {{{0.0177, 0.0085, 0.0002}, {0.018, 0.009, -0.007}, {0.018, 0.009, -0.007}},
                                               {{0.0079, 0.0101, 0.0005}, {0.012, 0.009, -0.003}, {0.013, 0.009, -0.003}, {0.014, 0.008, -0.003}}}};
  CHECK(violations_of(strokes) == "");
}

TEST_CASE("a blade that punctures where another has just opened the tissue keeps the ground under it when that one is lifted", "[cutting]") {
  StrokeCase<double> const strokes{
      .mesh = "grid",
      .snap = 5e-4,
      .blades = 2,
      .strokes = {{{0.013, 0.0347, 0.004}, {0.013, 0.0347, -0.003}, {0.015, 0.0347, -0.003}, {0.015, 0.0347, -0.003}, {0.015, 0.0347, 0.004}},
                  {{0.0145, 0.0346, 0.004}, {0.0145, 0.0346, 0.004}, {0.0145, 0.0346, 0.004}, {0.0145, 0.0346, -0.003}, {0.0145, 0.02, -0.003}}}};
  CHECK(violations_of(strokes) == "");
}

TEST_CASE("a blade goes on where another's has opened the tissue beside its last particle", "[cutting]") {
  StrokeCase<double> strokes{.mesh = "small uneven",
                             .snap = 0.004650803636614381,
                             .blades = 2,
                             .strokes = {{{0, 0.039, 0.007}, {0, 0.039, 0.005}, {0, 0.04, 0.004}, {0.0001, 0.0406, 0.0004}, {0.0003, 0.0401, 0.0003}, {0.001, 0.04, 0}},
                                         {{0.001, 0.038, 0.007}, {0.001, 0.039, 0.005}, {0.001, 0.039, 0.002}, {0, 0.045, 0.004}, {5e-06, 0.044675, 0.003518}}}};
  CHECK(violations_of(strokes) == "");   // it came to a lip that the other blade's triangle hung on

  strokes = {.mesh = "small tube", .snap = 0, .blades = 2, .strokes = {
      {{-0.018, 0, -0.01}, {-0.013, 0, -0.01}, {-0.004, 0, -0.01}, {-0.004, 0, -0.011}, {-0.004, -0.001, -0.013}, {-0.005, -0.002, -0.015}, {-0.0053, -0.0027, -0.0153}},
      {{-0.014, 0.014, -0.005}, {-0.004, 0.005, -0.008}, {-0.027, 0.004, -0.011}, {-0.003, -0.001, -0.013}, {-0.004, -0.002, -0.014}, {-0.004, -0.003, -0.015}}}};
  CHECK(violations_of(strokes) == "");   // the edge that it had come along was open meanwhile
}

TEST_CASE("the thin triangle in which one blade after the other stays keeps an area", "[cutting]") {
  // Its height fell to a tenth and less each time, and that of the triangles around the blade to a thousandth: less than float tells apart.
  StrokeCase<float> strokes{.mesh = "small tube", .blades = 3, .strokes = {
      {{-0.018f, -0.013f, 0}, {-0.0057f, -0.0041f, 0}, {0, -0.004f, 0.02f}, {0, -0.003f, 0.02f}, {-0.001f, -0.003f, 0.02f}},
      {{-0.018f, -0.013f, 0.02f}, {-0.013f, -0.01f, 0.02f}, {-0.001f, -0.002f, 0.02f}, {-0.00077f, -0.00193f, 0.02f}, {-0.001f, -0.002f, 0.02f}, {-0.00063f, -0.00195f, 0.02f}}}};
  CHECK(violations_of(strokes) == "");

  strokes.blades = 2;   // along the border, in turn
  strokes.strokes = {{{-0.017f, 0.0123f, -0.02f}, {-0.014f, 0.0102f, -0.02f}}, {{-0.03f, 0, -0.02f}, {-0.03f, 0, -0.02f}}};
  for (int i = 0; i < 7; ++i) {
    float const n = static_cast<float>(i);
    strokes.strokes[0].push_back({-0.007f + 0.0003f * n, 0.0045f - 0.001f * n, -0.02f});
    strokes.strokes[1].push_back({-0.01f + 0.0003f * n, -0.006f + 0.001f * n, -0.02f});
  }
  CHECK(violations_of(strokes) == "");
}

TEST_CASE("a point is kept off the edges of its triangle by a share of the height, or a distance, or a quarter of the height") {
  using Vector = Vector3<double>;
  std::array<Vector, 3> const corners{Vector(0, 0, 0), Vector(4, 0, 0), Vector(0, 3, 0)};   // heights 2.4, 4, 3
  CHECK((off_edges<double>(corners, {0.5, 0.3, 0.2}, 0.1, 0.1) - Vector(0.5, 0.3, 0.2)).norm() < 1e-15);
  Vector const by_share = off_edges<double>(corners, {1, 0, 0}, 0.1, 0.1), by_distance = off_edges<double>(corners, {1, 0, 0}, 0.1, 0.6);
  CHECK((by_share - Vector(0.8, 0.1, 0.1)).norm() < 1e-15);
  CHECK((by_distance - Vector(0.65, 0.15, 0.2)).norm() < 1e-15);   // 0.6 / 4, 0.6 / 3
  CHECK((off_edges<double>(corners, {1.2, 0, -0.2}, 0.1, 10) - Vector(0.5, 0.25, 0.25)).norm() < 1e-15);
}
