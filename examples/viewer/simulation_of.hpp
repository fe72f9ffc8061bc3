// SPDX-License-Identifier: MIT
#pragma once

#include "any_cutter.hpp"
#include "hand_force.hpp"
#include "simulation.hpp"

#include <palpate/body/pieces.hpp>
#include <palpate/mesh/measures.hpp>
#include <palpate/mesh/normals.hpp>
#include <palpate/region/whole_body.hpp>
#include <palpate/simulator/simulator.hpp>
#include <palpate/tissue/concept.hpp>
#include <palpate/tissue/mass_spring.hpp>

#include <chrono>
#include <cmath>
#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

namespace viewer {

template <class Body, class CutterType>
class SimulationOf final : public Simulation {
  using Simulator = palpate::Simulator<ViewerHand, Body, CutterType, HandForce>;
  using Mark = decltype(std::declval<Simulator const&>().mark());

 public:
  SimulationOf(Setup const& setup, Body body, MouseHand hand, Mesh home, palpate::SimulatorOptions const& options = {})
      : setup_(setup),
        options_(options),
        home_(std::move(home)),
        simulator_(ViewerHand(std::move(hand)), std::move(body), CutterType(setup.blade, values_of(setup.tissue).puncture_depth),
                   HandForce(setup.coupling, values_of(setup.tissue), way_out_), options) {
    marks_.push_back(simulator_.mark());
    marked_ = simulator_.body().topology_revision();
    simulator_.snapshots().publish(simulator_.body(), 0.0, simulator_.device().mouse().position(), palpate::CuttingPhase::no_contact);
  }

  void stop() noexcept override { simulator_.stop(); }
  palpate::EventRing<palpate::Tick, 1024>& live_ticks() noexcept override { return simulator_.live_ticks(); }
  Vector way_out() const noexcept override { return Vector(way_out_->read().data()); }

  palpate::Recording run(double seconds, bool realtime) override { return realtime ? simulator_.run_realtime(seconds) : simulator_.run(seconds); }
  palpate::SnapshotChannel<double>& snapshots() noexcept override { return simulator_.snapshots(); }
  Mesh const& home() const noexcept override { return home_; }
  ViewerHand& hand() noexcept override { return simulator_.device(); }
  double time() const noexcept override { return simulator_.time(); }
  Setup const& setup() const noexcept override { return setup_; }
  ServoTimes servo_times() const override {
    palpate::TickStatistics const servo = simulator_.live_statistics().servo;
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
    simulator_.force().choose(coupling);
  }
  void choose(Blade blade) override {
    setup_.blade = simulator_.cutter().change(simulator_.body(), blade);
  }

  bool remember() override {
    if (simulator_.cutter().state() != palpate::CuttingPhase::no_contact || simulator_.cutter().is_behind() || simulator_.body().topology_revision() == marked_) return false;
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
    CutterType cutter = simulator_.cutter();
    cutter.change(body, setup_.blade);   // ends a cut in progress
    auto anew = std::make_shared<SimulationOf>(setup_, std::move(body), simulator_.device().mouse(), home_, options_);
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
  Simulator simulator_;
  std::vector<Mark> marks_;
  std::size_t marked_ = 0;   // the revision that the last mark, or the restoration to it, has
  Wound wound_;
  std::size_t wound_of_ = static_cast<std::size_t>(-1);   // the revision
};

/// A liver on a table: what looks down or sideways is nailed, and each link is a quarter shorter than its edge, so that a cut gapes.
template <class Integrator>
std::shared_ptr<Simulation> make_with(Integrator const& integrator, Setup const& setup, Mesh const& organ, std::shared_ptr<HandTargets> targets) {
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
  MouseHand hand(std::move(targets), HandTarget{}.position);
  return std::make_shared<SimulationOf<decltype(body), AnyCutter>>(setup, std::move(body), std::move(hand), std::move(home));
}

}  // namespace viewer
