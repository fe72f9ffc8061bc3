// SPDX-License-Identifier: MIT
#include <palpate/force/liver.hpp>

#include "catch.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <sstream>
#include <string>
#include <type_traits>
#include <utility>

using namespace palpate;

namespace {

// The thesis's printed tables, typed in a second time and evaluated without the library.
double printed_loading(double mm) {
  static double const w_in[] = {0.1959, -0.8624, -0.5384, -0.2533, -0.1185};
  static double const w_out[] = {0.0656, -0.3429, -0.1393, -0.1248, -0.0331};
  static double const b[] = {-13.8628, 18.5440, 10.0367, 3.7805, 1.0538};
  double force = 0.7025;
  for (int j = 0; j < 5; ++j) force += w_out[j] * std::tanh(w_in[j] * mm + b[j]);
  return force;
}

double printed_hysteresis(double mm, double flag) {
  static double const w_depth[] = {0.1211, 0.3226, -1.2783, -0.6281, -2.4796};
  static double const w_flag[] = {-8.8553, 0.4131, -6.0967, -0.4962, -4.0361};
  static double const w_out[] = {1.4730, 17.1267, -0.0032, -0.0200, 0.0002};
  static double const b[] = {-3.3122, -9.3809, 3.7464, 8.6331, 1.6728};
  double force = 18.6234;
  for (int j = 0; j < 5; ++j) force += w_out[j] * std::tanh(w_depth[j] * mm + w_flag[j] * flag + b[j]);
  return force;
}

}  // namespace

static_assert(DepthCurve<NetworkCurve<Network<float, 1, 5, 1>> const, float>);
static_assert(HysteresisCurve<NetworkCurve<Network<double, 2, 5, 1>> const, double>);
static_assert(std::is_same_v<decltype(liver_loading<double>()), NetworkCurve<Network<double, 1, 5, 1>>>);
static_assert(std::is_same_v<decltype(liver_hysteresis<float>()), NetworkCurve<Network<float, 2, 5, 1>>>);

// Yardstick: the tables evaluated with 60 digits in Python's decimal arithmetic.
TEMPLATE_TEST_CASE("the liver presets have the values of the printed tables", "", PALPATE_TEST_SCALARS) {
  struct Row {
    double depth, loading, loading2, unloading2;
  };
  Row const rows[] = {
    {0e-3, 0.0041032675443069058, 0.0045960480646592416, 0.0066464205735260688},
    {0.7e-3, 0.0052905588483403666, 0.0051354607920412187, 0.0066912905521659977},
    {1.8e-3, 0.0075138149053608052, 0.0066747849651029138, 0.0067012270549616755},
    {5e-3, 0.017253987473165342, 0.019745201089188057, 0.0067158380835586019},
    {10e-3, 0.053265182567202383, 0.05063492798951557, 0.0080067548131483486},
    {12e-3, 0.087997990945684834, 0.081120962801104965, 0.017245129421847347},
    {15e-3, 0.18298828001402681, 0.18460266003740317, 0.052733054015077753},
    {18e-3, 0.35695045186304714, 0.35058270815144194, 0.10805007045189814},
    {20.2e-3, 0.59254462687438469, 0.60058147190944744, 0.29923842001910211},
    {21e-3, 0.75916121714126428, 0.7531239822385678, 0.46775716894192854},
    {22e-3, 1.055868912108257, 1.0316772401988334, 0.84054799986525619},
    {22.83e-3, 1.2040432826793064, 1.3823034201697275, 1.3809514193591328},
  };
  auto const loading = liver_loading<TestType>();
  auto const hysteresis = liver_hysteresis<TestType>();
  // In float the output bias 18.6 limits the second network to a few of its own last bits.
  double const tolerance = std::is_same_v<TestType, double> ? 1e-12 : 40 * std::numeric_limits<float>::epsilon();
  for (Row const& row : rows) {
    TestType const depth = static_cast<TestType>(row.depth);
    CAPTURE(row.depth);
    CHECK(std::abs(double(loading(depth)) - row.loading) < tolerance);
    CHECK(std::abs(double(hysteresis(depth, Phase::loading)) - row.loading2) < tolerance);
    CHECK(std::abs(double(hysteresis(depth, Phase::unloading)) - row.unloading2) < tolerance);
  }
}

// Yardstick: a second evaluation of the tables in plain code.
TEST_CASE("the liver presets are unchanged over their whole range") {
  auto const loading = liver_loading<double>();
  auto const hysteresis = liver_hysteresis<double>();
  for (int i = 0; i <= 22830; ++i) {
    double const depth = i * 1e-6;
    REQUIRE(std::abs(loading(depth) - printed_loading(depth * 1e3)) < 1e-12);
    REQUIRE(std::abs(hysteresis(depth, Phase::loading) - printed_hysteresis(depth * 1e3, 0)) < 1e-12);
    REQUIRE(std::abs(hysteresis(depth, Phase::unloading) - printed_hysteresis(depth * 1e3, 1)) < 1e-12);
  }
}

// Yardstick: what is known of the two published networks under tanh; with tanh(x/2) none of it holds.
TEST_CASE("the two published networks belong together") {
  auto const loading = liver_loading<double>();
  auto const hysteresis = liver_hysteresis<double>();
  double difference = 0, widest = 0, widest_at = 0, excess = 0;
  for (int i = 0; i <= 22800; ++i) {
    double const depth = i * 1e-6;
    double const loop = hysteresis(depth, Phase::loading) - hysteresis(depth, Phase::unloading);
    if (depth <= 0.021) difference = std::max(difference, std::abs(loading(depth) - hysteresis(depth, Phase::loading)));
    if (loop > widest) widest = loop, widest_at = depth;
    if (depth < 0.0018) excess = std::max(excess, -loop);
    if (depth > 0.00185) REQUIRE(loop > 0);
  }
  CHECK(difference < 0.0125);
  CHECK(difference > 0.0120);
  CHECK(widest == Approx(0.30).margin(0.005));
  CHECK(widest_at == Approx(0.0202).margin(1e-4));
  CHECK(excess == Approx(0.002).margin(1e-4));
  CHECK(loading(0.0) == Approx(0.0041).margin(5e-5));
  CHECK(hysteresis(0.0, Phase::loading) == Approx(0.0046).margin(5e-5));
  CHECK(loading(0.015) == Approx(0.1830).margin(5e-5));
  CHECK(hysteresis(0.015, Phase::loading) == Approx(0.1846).margin(5e-5));
  CHECK(loading(0.021) == Approx(0.759).margin(5e-4));
  CHECK(hysteresis(0.021, Phase::loading) == Approx(0.753).margin(5e-4));
  CHECK(loading(0.018) == Approx(0.36).margin(5e-3));

  // The loop closes at 22.83 mm, where the continuation begins.
  CHECK(std::abs(hysteresis(0.02283, Phase::loading) - hysteresis(0.02283, Phase::unloading)) < 2e-3);
  CHECK(hysteresis(0.0229, Phase::unloading) > hysteresis(0.0229, Phase::loading));
}

// Yardstick: the slopes at the ends with 60 digits, and a straight line.
TEST_CASE("beyond their range the liver curves go on along the tangent and are never negative") {
  auto const loading = liver_loading<double>(CurveGuard<double>{});   // without the cap
  auto const hysteresis = liver_hysteresis<double>(CurveGuard<double>{});
  for (double beyond : {1e-6, 1e-3, 0.01, 0.1}) {
    CAPTURE(beyond);
    CHECK(loading(0.02283 + beyond) == Approx(1.2040432826793064 + 104.82228128095072 * beyond).epsilon(1e-12));
    CHECK(hysteresis(0.02283 + beyond, Phase::loading) == Approx(1.3823034201697275 + 512.55759077653181 * beyond).epsilon(1e-12));
    CHECK(hysteresis(0.02283 + beyond, Phase::unloading) == Approx(1.3809514193591328 + 827.32680540280251 * beyond).epsilon(1e-12));
    CHECK(loading(-beyond) == Approx(std::max(0.0, 0.0041032675443069058 - 1.581613894593132 * beyond)).margin(1e-12));
    CHECK(hysteresis(-beyond, Phase::loading) == Approx(std::max(0.0, 0.0045960480646592416 - 0.8887826174331892 * beyond)).margin(1e-12));
    CHECK(hysteresis(-beyond, Phase::unloading) == Approx(std::max(0.0, 0.0066464205735260688 - 0.1291642881461329 * beyond)).margin(1e-12));
  }
}

// Yardstick: the same straight lines, cut off by hand; inside the range the curves without a cap.
TEST_CASE("a cap holds beyond the range of the liver curves and changes nothing inside") {
  auto const free = liver_hysteresis<double>(CurveGuard<double>{});
  auto const capped = liver_hysteresis<double>();   // at 3 N, unless said otherwise
  auto const loading = liver_loading<double>({.largest_force = 1.5});
  for (int i = 0; i <= 2283; ++i)
    for (Phase const phase : {Phase::loading, Phase::unloading}) REQUIRE(capped(i * 1e-5, phase) == free(i * 1e-5, phase));
  for (double beyond : {1e-6, 1e-3, 0.0019, 0.0032, 0.01, 1e300}) {
    CAPTURE(beyond);
    CHECK(capped(0.02283 + beyond, Phase::loading) == Approx(std::min(3.0, 1.3823034201697275 + 512.55759077653181 * beyond)).epsilon(1e-12));
    CHECK(capped(0.02283 + beyond, Phase::unloading) == Approx(std::min(3.0, 1.3809514193591328 + 827.32680540280251 * beyond)).epsilon(1e-12));
    CHECK(loading(0.02283 + beyond) == Approx(std::min(1.5, 1.2040432826793064 + 104.82228128095072 * beyond)).epsilon(1e-12));
  }
  CHECK_THROWS_WITH(liver_hysteresis<double>({.largest_force = 1.0}), says(".largest_force is 1 N", "1.38230342 N", "no less"));
}

TEST_CASE("the liver presets are noexcept to evaluate") {
  auto const loading = liver_loading<double>();
  auto const hysteresis = liver_hysteresis<double>();
  STATIC_REQUIRE(noexcept(loading(0.01)));
  STATIC_REQUIRE(noexcept(hysteresis(0.01, Phase::unloading)));
}

// Yardstick: the data of the thesis, by hand: 3 N at 18 mm, 180 N/m of depth, and the range in which its two networks were trained.
TEST_CASE("every preset says what it was measured on, and nothing else is a preset") {
  CHECK(tissue_presets.size() == 4);
  for (TissuePreset const& preset : tissue_presets) {
    CAPTURE(preset.name);
    CHECK(find_tissue_preset(preset.name) == &preset);
    CHECK(preset.species == "not stated");
    CHECK((preset.slowest > 0 && preset.slowest <= preset.fastest && preset.shallowest < preset.deepest));
    std::ostringstream text;
    text << preset;
    for (auto const part : {preset.tissue, preset.tool, preset.source, preset.limits, force_disclaimer}) CHECK(text.str().find(part) != std::string::npos);
  }
  CHECK(find_tissue_preset("spleen") == nullptr);
  CHECK(liver_range<double>().high == find_tissue_preset("liver_hysteresis")->deepest);
  CHECK(liver_spring<double>()({.phase = CuttingPhase::indenting, .depth = 0.018}).z() == Approx(3.0));
  ToolContact<double> const fast{.phase = CuttingPhase::moving, .depth = 0.018, .velocity = {0, -100, 0}};
  CHECK(liver_friction<double>({0, 2, 0})(fast).y() == Approx(180 * 0.018).epsilon(1e-4));
}
