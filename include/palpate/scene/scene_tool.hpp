// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/cutting/no_cutter.hpp>
#include <palpate/scene/per_body.hpp>
#include <palpate/scene/scene.hpp>
#include <palpate/simulator/body_loop.hpp>

#include <algorithm>
#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <tuple>
#include <type_traits>
#include <utility>

namespace palpate {

namespace detail {

/// The cutter that a tool is on body I.
template <class CutterType, std::size_t I, class Body>
struct CutterOn {
  static CutterType const& of(CutterType const& cutter) { return cutter; }
};
template <class... Cutters, std::size_t I, class Body>
struct CutterOn<PerBody<Cutters...>, I, Body> {
  static auto const& of(PerBody<Cutters...> const& cutter) { return std::get<I>(cutter.each); }
};
template <class CutterType, std::size_t I, RealScalar Scalar>
struct CutterOn<CutterType, I, Obstacle<Scalar>> {
  static NoCutter<Scalar> of(CutterType const& cutter) { return NoCutter<Scalar>({.tip_radius = cutter.tip_radius()}); }
};
template <class... Cutters, std::size_t I, RealScalar Scalar>
struct CutterOn<PerBody<Cutters...>, I, Obstacle<Scalar>> {
  static NoCutter<Scalar> of(PerBody<Cutters...> const& cutter) { return NoCutter<Scalar>({.tip_radius = std::get<I>(cutter.each).tip_radius()}); }
};
template <class CutterType, std::size_t I, class Body>
using CutterOnT = std::remove_cvref_t<decltype(CutterOn<CutterType, I, Body>::of(std::declval<CutterType const&>()))>;

template <class CutterType, class Places, class... Bodies>
struct ToolsOn;
template <class CutterType, std::size_t... I, class... Bodies>
struct ToolsOn<CutterType, std::index_sequence<I...>, Bodies...> {
  using type = std::tuple<BodyTool<Bodies, CutterOnT<CutterType, I, Bodies>>...>;
  static type made(CutterType const& cutter, ContactCoupling const& coupling) {
    return type(BodyTool<Bodies, CutterOnT<CutterType, I, Bodies>>(CutterOn<CutterType, I, Bodies>::of(cutter), coupling)...);
  }
  static constexpr bool presses = (BodyTool<Bodies, CutterOnT<CutterType, I, Bodies>>::presses_itself && ...);
};

/// Says, where it is instantiated, what keeps a cutter from a scene.
template <class CutterType, class... Bodies>
struct CutterSentences<CutterType, Scene<Bodies...>> {
  static_assert(cuts_each<CutterType, Bodies...>, "palpate: not every body of the scene takes this cutter; give Tool(device, PerBody(...), force) a cutter for each, in their places.");
};

}  // namespace detail

/// One tool on all bodies of a scene. Its servo is told the sum of what they press with, their moment and the area that was cut; contact, phase and surface are
/// those of the body that presses most. It stays with that one until another presses a quarter more.
template <class... Bodies, class CutterType>
class BodyTool<Scene<Bodies...>, CutterType> {
  using Each = detail::ToolsOn<CutterType, std::index_sequence_for<Bodies...>, Bodies...>;
  using SceneType = Scene<Bodies...>;

 public:
  using Scalar = typename SceneType::Scalar;
  static constexpr bool presses_itself = Each::presses;   // on every body: else its coupling is that of the others

  BodyTool(CutterType const& cutter, ContactCoupling const& coupling) : tools_(Each::made(cutter, coupling)) {}

  void advance(SceneType& scene, ToolPose<Scalar> const& tool, std::uint64_t pose_discontinuities) {
    tip_ = tool.position;
    scene.for_each_body([&](auto i, auto& body) {
      acts_[i] = scene.is_here(i);
      if (acts_[i])
        std::get<i>(tools_).advance(body, tool, pose_discontinuities + scene.returns(i));   // one that was put back is come to from outside
      else
        std::get<i>(tools_).rest();
    });
  }
  void rest() noexcept {
    for_each([](auto& tool) { tool.rest(); });
  }
  template <std::size_t I, class Body>
  void push(ScenePart<I, Body>& part, int i, int steps, Scalar each) {
    std::get<I>(tools_).push(part.body, i, steps, each);
  }

  LocalModel<Scalar> model(SceneType& scene, bool diverged) {
    std::array<LocalModel<Scalar>, sizeof...(Bodies)> models;
    scene.for_each_body([&](auto i, auto& body) {
      if (!scene.is_here(i)) return;
      models[i] = std::get<i>(tools_).model(body, diverged);
      cut_areas_[i] = models[i].cut_area;
    });
    for (std::size_t i = 0; i < models.size(); ++i)
      if (i != chosen_ && is_before(models[i], models[chosen_])) chosen_ = i;
    LocalModel<Scalar> all = models[chosen_];
    all.tissue_force.setZero(), all.tissue_moment.setZero();
    all.cut_area = std::accumulate(cut_areas_.begin(), cut_areas_.end(), 0.0);   // also of bodies that were taken out
    for (LocalModel<Scalar> const& one : models) {
      all.tissue_force += one.tissue_force, all.tissue_moment += one.tissue_moment;
    }
    all.surface.sequence = ++models_;   // of bodies that come and go no sum would rise
    all.restorations = scene.restorations(), all.diverged = diverged;
    return all;
  }

  void sense_surface(SurfaceKind kind) { for_each([&](auto& tool) { tool.sense_surface(kind); }); }
  void forget_press() noexcept { for_each([](auto& tool) { tool.forget_press(); }); }

  /// As a simulator shows it: state() and tip_radius(), and the cutter on body I.
  BodyTool& cutter() noexcept { return *this; }
  BodyTool const& cutter() const noexcept { return *this; }
  template <std::size_t I>
  auto& on() noexcept {
    return std::get<I>(tools_).cutter();
  }
  template <std::size_t I>
  auto const& on() const noexcept {
    return std::get<I>(tools_).cutter();
  }
  /// Moving where it moves through one body, indenting where it indents one.
  CuttingPhase state() const noexcept {
    CuttingPhase most = CuttingPhase::no_contact;
    std::size_t place = 0;
    std::apply([&](auto const&... tool) { ((most = acts_[place++] ? std::max(most, tool.cutter().state()) : most), ...); }, tools_);
    return most;
  }
  Scalar tip_radius() const noexcept { return std::get<0>(tools_).cutter().tip_radius(); }

 private:
  template <class Use>
  void for_each(Use const& use) {
    std::apply([&](auto&... tool) { (use(tool), ...); }, tools_);
  }
  bool is_before(LocalModel<Scalar> const& one, LocalModel<Scalar> const& other) const noexcept {
    bool const touches = one.phase != CuttingPhase::no_contact, other_touches = other.phase != CuttingPhase::no_contact;
    if (touches != other_touches) return touches;
    if (touches) return one.tissue_force.norm() > Scalar(1.25) * other.tissue_force.norm();
    bool const is_near = one.surface.stiffness() > 0, other_is_near = other.surface.stiffness() > 0;
    if (is_near != other_is_near) return is_near;
    return is_near && one.surface.patch.distance(tip_) < other.surface.patch.distance(tip_);
  }

  typename Each::type tools_;
  Vector3<Scalar> tip_ = Vector3<Scalar>::Zero();
  std::array<bool, sizeof...(Bodies)> acts_{};   // on these, in this tick
  std::array<double, sizeof...(Bodies)> cut_areas_{};   // m²
  std::size_t chosen_ = 0;
  std::uint64_t models_ = 0;
};

}  // namespace palpate
