// SPDX-License-Identifier: MIT
// Four tools in four hands that move at random, in and out of a body, and are now and then placed elsewhere. What has to hold whatever they do is what the safety
// chain promises of the device's side: every force is finite, none is above the cap, and none is a larger step from the last than the slew limit, unless it is zero.
// PALPATE_POSES: so many poses of each tool at each body; `setup.sh test --long` takes 10,000. test_rod_contact compares contact with brute force.
#include "catch.hpp"
#include "tool/tool_bodies.hpp"

#include <palpate/core/random.hpp>
#include <palpate/cutting/progressive_cutter.hpp>
#include <palpate/force/tissue_reaction.hpp>
#include <palpate/mesh/sphere.hpp>
#include <palpate/simulator/simulator.hpp>
#include <palpate/tool/forceps.hpp>
#include <palpate/tool/hook.hpp>
#include <palpate/tool/scalpel.hpp>
#include <palpate/volume/organ_volume.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <utility>

using namespace palpate;
using namespace palpate_test;

namespace {

constexpr double cap = 0.8, slew = 300.0;   // N, N/s

long poses_wanted() {
  char const* const asked = std::getenv("PALPATE_POSES");
  return asked != nullptr ? std::strtol(asked, nullptr, 10) : 30;
}

/// What one hand did, and what it was told to feel.
struct Felt {
  long poses = 0;
  std::uint64_t ticks = 0, forces = 0, broken = 0;
  double largest = 0, steepest = 0;   // N; N a tick
};

/// A hand that goes from pose to pose, each up to 20 mm and any turn from the last within 8 to 24 ticks, below 1 m/s; one in fifteen is elsewhere, at once.
/// Its fingers open and close a gripper likewise.
class RandomHand {
 public:
  RandomHand(std::uint64_t seed, Vector3<double> const& low, Vector3<double> const& high, Felt& felt)
      : random_(Seed{seed}), low_(low), high_(high), felt_(&felt) {
    from_ = to_ = anywhere();
  }

  Capabilities capabilities() const { return {.max_force = 3.3, .rate = 1000.0, .reports_orientation = true, .reports_gripper = true}; }
  DeviceStatus read(DeviceState<double>& state) noexcept {
    if (tick_ == ticks_) go_on();
    double const share = static_cast<double>(++tick_) / ticks_;
    state.position = from_.position + share * (to_.position - from_.position);
    state.orientation = from_.orientation.slerp(share, to_.orientation).normalized();
    state.gripper = from_.opening + share * (to_.opening - from_.opening);
    ++felt_->ticks;
    return DeviceStatus::ok;
  }
  DeviceStatus write(Wrench<double> const& wrench) noexcept {
    Vector3<double> const force = wrench.force;
    double const size = force.norm(), step = force.isZero(0) ? 0.0 : (force - last_).norm();
    if (!is_finite(force) || !(size <= cap * (1 + 1e-12)) || !(step <= 1e-3 * slew * (1 + 1e-9))) ++felt_->broken;
    felt_->largest = std::max(felt_->largest, size), felt_->steepest = std::max(felt_->steepest, step);
    felt_->forces += size > 0.01 ? 1 : 0;
    last_ = force;
    return DeviceStatus::ok;
  }

 private:
  ToolPose<double> anywhere() noexcept {
    ToolPose<double> pose;
    for (int k = 0; k < 3; ++k) pose.position[k] = random_.uniform(low_[k], high_[k]);
    Eigen::Vector4d turn;
    for (int k = 0; k < 4; ++k) turn[k] = random_.uniform(-1.0, 1.0);
    if (turn.norm() > 1e-3) pose.orientation = Eigen::Quaterniond(turn[0], turn[1], turn[2], turn[3]).normalized();
    pose.opening = random_.uniform(0.0, 1.0);
    return pose;
  }
  void go_on() noexcept {
    ++felt_->poses;
    from_ = to_, to_ = anywhere();
    tick_ = 0, ticks_ = 8 + static_cast<int>(random_.uniform(0.0, 17.0));
    if (random_.uniform<double>() < 1.0 / 15) return void(from_ = to_);   // placed there
    Vector3<double> const way = to_.position - from_.position;
    double const most = std::min(0.02, 0.9e-3 * ticks_) * random_.uniform(0.1, 1.0);
    if (way.norm() > most) to_.position = from_.position + most * way.normalized();
  }

  Random random_;
  Vector3<double> low_, high_;
  Felt* felt_;
  ToolPose<double> from_, to_;
  int tick_ = 0, ticks_ = 0;
  Vector3<double> last_ = Vector3<double>::Zero();
};

template <class Body, class Fourth>
void check_at_random(Body body, Fourth fourth) {
  auto const [low, high] = low_and_high(body.positions());
  Vector3<double> const margin = Vector3<double>::Constant(0.008);
  Felt felt[4];
  ServoOptions const careful{.safety = {.max_force = cap, .slew = slew}};
  auto const tool = [&](std::uint64_t k, auto cutter) {
    return Tool(RandomHand(100 + k, low - margin, high + margin, felt[k]), std::move(cutter), TissueReaction{}, {.servo = careful});
  };
  Simulator simulator(std::move(body), tool(0, BluntTool<double>(make_probe_shape<double>({.radius = 0.003, .length = 0.05}))),
                      tool(1, Hook<double>({.shape = {.point = 0.01, .shaft = 0.04}})), tool(2, Forceps<double>({.shape = {.shaft = 0.03}})),
                      tool(3, std::move(fourth)));
  auto const before = simulator.mark();
  auto const size = simulator.body().size();
  bool finite = true;
  long held = 0;   // ticks in which the forceps did
  long const poses = poses_wanted();
  for (long seen = 0; seen < poses; seen = std::min({felt[0].poses, felt[1].poses, felt[2].poses, felt[3].poses})) {
    simulator.run(0.25, [&](std::span<Tick const> ticks) {
      for (Tick const& tick : ticks) finite = finite && is_finite(tick.force) && is_finite(tick.tip);
      held += simulator.template tool<2>().grasp().holds_any() ? 1 : 0;
      if (simulator.body().size() > 2 * size) simulator.stop();   // it is cut to pieces
    });
    finite = finite && is_finite(simulator.body().positions());
    REQUIRE(finite);
    simulator.restore(before);
  }
  for (std::size_t k = 0; k < 4; ++k) {
    CAPTURE(k, felt[k].poses, felt[k].ticks, felt[k].forces, felt[k].largest, felt[k].steepest);
    CHECK(felt[k].broken == 0);
    CHECK(felt[k].poses >= poses);
    CHECK(felt[k].forces > 0);   // it touched, and was felt
  }
  CHECK(held > 0);
  CHECK(std::max({felt[0].largest, felt[1].largest, felt[2].largest}) == Approx(cap));                   // the cap was reached
  CHECK(std::max({felt[0].steepest, felt[1].steepest, felt[2].steepest}) == Approx(1e-3 * slew));   // so was the slew limit
}

/// Nailed below a height.
auto solid(TetrahedralMesh<double> const& mesh, double height) {
  FiniteElements<double, StableNeoHookean<double>> tissue(mesh, {.density = 1060.0, .material = {.young = 5e3, .poisson = 0.4}, .damping = {.alpha = 5.0}});
  tissue.nail(vertices_where(mesh, [&](Vector3<double> const& p) { return p.z() < height; }));
  return SoftBody(std::move(tissue), BackwardEuler{.max_iterations = 20});
}

auto scalpel() { return Scalpel<double>({.puncture_depth = 0.002, .toughness = 50.0, .lip_friction = 5.0, .max_tetrahedra = 60}); }

}  // namespace

TEST_CASE("Whatever four tools do at random, no force is above the cap, none steps above the slew limit, and all are finite", "[tool][random_poses]") {
  SECTION("a ball of springs") {
    auto const mesh = make_sphere<double>(0.03, 2);
    MassSpring<double> tissue(mesh, {.mass = {.total = 0.05}, .link = {.stiffness = 60, .damping = 0.02}, .home = {.stiffness = 6, .damping = 0.05}});
    check_at_random(SoftBody(std::move(tissue), LeapfrogVerlet{}), Scalpel<double, ProgressiveCutter<double>>(ProgressiveCutter<double>({.puncture_depth = 0.003})));
  }
  SECTION("an organ of finite elements") { check_at_random(solid(make_organ_volume<double>({.length = 0.12}, {.edge = 0.02}), -0.015), scalpel()); }
  SECTION("a block of finite elements") { check_at_random(solid(make_block<double>(7, 6, 4, 0.008, BlockPattern::alternating), 1e-6), scalpel()); }
}
