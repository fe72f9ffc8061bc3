// SPDX-License-Identifier: MIT
#pragma once

#include "any_cutter.hpp"
#include "hand_force.hpp"
#include "simulation.hpp"
#include "watched_hook.hpp"

#include <palpate/body/pieces.hpp>
#include <palpate/force/tissue_reaction.hpp>
#include <palpate/mesh/measures.hpp>
#include <palpate/mesh/normals.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/simulator/simulator.hpp>
#include <palpate/simulator/tool.hpp>
#include <palpate/tissue/concept.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

namespace viewer {

/// Two tools at one body: the mouse's, which palpates and cuts, and a hook that another hand holds in place.
template <class Body, class CutterType>
class SimulationOf final : public Simulation {
  using MouseTool = palpate::Tool<ViewerHand, CutterType, HandForce>;
  using HookTool = palpate::Tool<ViewerHook, WatchedHook, palpate::TissueReaction>;
  using Simulator = palpate::Simulator<Body, MouseTool, HookTool>;
  using Mark = decltype(std::declval<Simulator const&>().mark());

 public:
  SimulationOf(Setup const& setup, Body body, Targets const& targets, Mesh home, palpate::SimulatorOptions const& options = {})
      : SimulationOf(setup, std::move(body), MouseHand(targets.mouse, HandTarget{}.position), HookHand(targets.hook), std::move(home), options) {}

  /// With a hook that is in the tissue already, as it is there.
  SimulationOf(Setup const& setup, Body body, MouseHand hand, HookHand hook_hand, Mesh home, palpate::SimulatorOptions const& options,
               WatchedHook const* hook = nullptr)
      : setup_(setup),
        options_(options),
        home_(std::move(home)),
        simulator_(std::move(body), options,
                   MouseTool(ViewerHand(std::move(hand)), CutterType(setup.blade, values_of(setup.tissue).puncture_depth),
                             HandForce(setup.coupling, values_of(setup.tissue), way_out_)),
                   HookTool(ViewerHook(std::move(hook_hand)), hook != nullptr ? WatchedHook(*hook, is_hooked_) : WatchedHook(is_hooked_),
                            palpate::TissueReaction{})) {
    marks_.push_back(simulator_.mark());
    marked_ = simulator_.body().topology_revision();
    palpate::HandSample const hook_at = this->hook().hand().sample();
    std::array<palpate::ToolSnapshot<double>, 2> tools;
    tools[0].pose.position = this->hand().hand().position();
    tools[1].pose.position = hook_at.position;
    tools[1].pose.orientation = hook_at.orientation;
    simulator_.snapshots().publish(simulator_.body(), 0.0, tools[0].pose.position, palpate::CuttingPhase::no_contact, tools);
  }

  void stop() noexcept override { simulator_.stop(); }
  palpate::EventRing<palpate::Tick, 1024>& live_ticks() noexcept override { return simulator_.template live_ticks<0>(); }
  palpate::EventRing<palpate::Tick, 1024>& live_hook_ticks() noexcept override { return simulator_.template live_ticks<1>(); }
  bool is_hooked() const noexcept override { return is_hooked_->load(std::memory_order_relaxed); }
  Vector way_out() const noexcept override { return Vector(way_out_->read().data()); }

  palpate::ToolRecordings run(double seconds, bool realtime) override { return realtime ? simulator_.run_realtime(seconds) : simulator_.run(seconds); }
  palpate::SnapshotChannel<double>& snapshots() noexcept override { return simulator_.snapshots(); }
  Mesh const& home() const noexcept override { return home_; }
  ViewerHand& hand() noexcept override { return simulator_.template device<0>(); }
  ViewerHook& hook() noexcept override { return simulator_.template device<1>(); }
  double time() const noexcept override { return simulator_.time(); }
  Setup const& setup() const noexcept override { return setup_; }
  ServoTimes servo_times() const override {
    palpate::TickStatistics const servo = simulator_.template live_statistics<0>().servo;
    return {std::chrono::duration<double>(servo.compute().p99()).count(), servo.rate(), servo.ticks(), servo.overruns()};
  }
  std::size_t revision() const noexcept override { return simulator_.body().topology_revision(); }
  bool is_uncut() const noexcept override { return marks_.size() == 1 && simulator_.body().topology_revision() == marked_; }

  Wound const& wound() override {
    Body const& body = simulator_.body();
    if (wound_of_ == body.topology_revision()) return wound_;
    wound_of_ = body.topology_revision();
    wound_ = {.area = 0.0, .pieces = static_cast<int>(palpate::pieces_of(body).size())};
    if constexpr (palpate::CuttableSolid<typename Body::Tissue>)
      for (int t = 0; t < body.tissue().surface().triangle_count(); ++t) {
        if (!body.tissue().is_wound(t)) continue;
        auto const corners = body.tissue().surface().corners(t);
        Vector const o = body.tissue().rest_position(corners[0]);
        wound_.area += (body.tissue().rest_position(corners[1]) - o).cross(body.tissue().rest_position(corners[2]) - o).norm() / 4;
      }
    return wound_;
  }

  void choose(Coupling coupling) override {
    setup_.coupling = coupling;
    simulator_.template force<0>().choose(coupling);
  }
  void choose(Blade blade) override {
    setup_.blade = simulator_.template tool<0>().change(simulator_.body(), blade);
  }

  bool remember() override {
    CutterType const& cutter = simulator_.template tool<0>();   // the hook may hold on
    if (cutter.state() != palpate::CuttingPhase::no_contact || cutter.is_behind() || simulator_.body().topology_revision() == marked_) return false;
    if (marks_.size() > max_marks) marks_.erase(marks_.begin() + 1);   // the first is the uncut body
    marks_.push_back(simulator_.mark());
    marked_ = simulator_.body().topology_revision();
    return true;
  }
  bool undo() override {
    bool const since = simulator_.body().topology_revision() != marked_;   // a cut that is still being made
    if (!since && marks_.size() == 1) return false;
    if (!since) marks_.pop_back();
    restore_last();
    return true;
  }
  void undo_all() override {
    marks_.erase(marks_.begin() + 1, marks_.end());
    restore_last();
  }

  std::shared_ptr<Simulation> begun_anew() override {
    Body body = simulator_.body();
    CutterType cutter = simulator_.template tool<0>();
    cutter.change(body, setup_.blade);   // ends a cut in progress
    auto anew = std::make_shared<SimulationOf>(setup_, std::move(body), hand().hand(), hook().hand(), home_, options_, &simulator_.template tool<1>());
    anew->marks_ = marks_;
    if (simulator_.body().topology_revision() != marked_) anew->marks_.push_back(anew->simulator_.mark());
    return anew;
  }

 private:
  static constexpr std::size_t max_marks = 20;

  void restore_last() {
    simulator_.restore(marks_.back());
    marked_ = simulator_.body().topology_revision();
  }

  Setup setup_;
  palpate::SimulatorOptions options_;
  Mesh home_;
  std::shared_ptr<WayOut> way_out_ = std::make_shared<WayOut>();
  std::shared_ptr<IsHooked> is_hooked_ = std::make_shared<IsHooked>(false);
  Simulator simulator_;
  std::vector<Mark> marks_;
  std::size_t marked_ = 0;   // the revision that the last mark, or the restoration to it, has
  Wound wound_;
  std::size_t wound_of_ = static_cast<std::size_t>(-1);   // the revision
};

/// A liver on a table: what looks down or sideways is nailed, and each link is a quarter shorter than its edge, so that a cut gapes.
template <class Integrator>
std::shared_ptr<Simulation> make_with(Integrator const& integrator, Setup const& setup, Mesh const& organ, Targets const& targets) {
  TissueValues const values = values_of(setup.tissue);
  double const mass = 1060.0 * std::abs(palpate::volume(organ)), particle = mass / static_cast<double>(organ.points.cols());
  palpate::MassSpring<double> tissue(organ, {.mass = {.total = mass},
                                             .link = {.stiffness = values.link_stiffness * particle, .damping = values.link_damping * particle},
                                             .home = {.stiffness = values.home_stiffness * particle, .damping = values.home_damping * particle},
                                             .link_prestrain = 0.25});
  std::vector<int> below;
  auto const normals = palpate::vertex_normals(organ);
  for (int i = 0; i < organ.points.cols(); ++i)
    if (normals(2, i) < 0.1) below.push_back(i);
  tissue.nail(below);
  palpate::SoftBody body(std::move(tissue), integrator, palpate::WholeBody{});   // settles under its pre-tension
  body.reserve(body.size() + 4000, static_cast<int>(organ.triangles.cols()) + 8000);
  Mesh home = body.mesh();
  return std::make_shared<SimulationOf<decltype(body), AnyCutter>>(setup, std::move(body), targets, std::move(home));
}

}  // namespace viewer
