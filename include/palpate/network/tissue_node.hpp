// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/concept.hpp>
#include <palpate/body/shape_of.hpp>
#include <palpate/core/error.hpp>
#include <palpate/haptics/contact_coupling.hpp>
#include <palpate/haptics/surface_sensor.hpp>
#include <palpate/network/local_surface.hpp>
#include <palpate/network/messages.hpp>
#include <palpate/network/remote_tissue.hpp>
#include <palpate/network/weber_deadband.hpp>
#include <palpate/simulator/body_loop.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>

namespace palpate {

struct TissueNodeOptions {
  ContactCoupling coupling{};                     ///< between tool and tissue
  SurfaceKind surface = SurfaceKind::ball;        ///< plane or ball, what the hand's side is told
  double approach = 0.02;                         ///< m in front of the surface, from which on it is told: what a fast hand goes in the time of an answer
  double max_step = 0.002;                        ///< s: a tick is split evenly, tool and all, into parts no longer than this; rods and zones of influence settle slowly in longer implicit ones
  int max_body_steps = 100;                       ///< and each part into no more steps
  double hand_silent_after = 0.1;                 ///< s without a sample; then the tool is taken away from the tissue
  double fastest_hand = 5.0;                      ///< m/s: a tool that went farther was placed, not moved; velocities are shortened to it
  double restores_after = 1.0;                    ///< s for which the body has diverged; then it is as it was at first, cuts undone. Infinity: never
  WeberDeadbandOptions deadband{};                ///< of the answers
};

/// What the slow side hands to the fast one.
template <RealScalar S>
struct CapturedSurface {
  LocalSurface<S> near{};
  S stiffness = 0;       ///< N/m; 0: nothing is near
  S tip_radius = 0;      ///< m
  Vector3<S> pressed = Vector3<S>::Zero();   ///< direction of the contact; zero: nothing touches
  double time = 0.0;     ///< s, on the server's clock, of the capture,
  double handed_over = 0.0;   ///< and of when the fast side could have it: the end of the body's tick
  std::uint64_t revision = 0;
};

/// The slow side of a server: a body and its cutter, moved by samples of a hand that is elsewhere.
/// `tick` moves the tool to the newest sample, ticks the body and says what it answers; `captured()` is for the fast side. A hand that says nothing for a while,
/// or goes away, takes the tool with it; when it comes back, the tool is placed, not moved. No hand spoils the body for the next: one that stays diverged is restored. No sockets and no clock: whoever calls has both.
/// Errors     InvalidArgument for options that make no sense.
template <SimulatedBody BodyType, class CutterType>
class TissueNode {
 public:
  using Body = BodyType;
  using Scalar = typename Body::Scalar;

  TissueNode(Body body, CutterType cutter, TissueNodeOptions const& options = {})
      : options_(checked(options)), loop_(std::move(body), std::move(cutter), options.coupling, options.max_body_steps), deadband_(options.deadband), first_(loop_.body().save()) {
    loop_.sense_surface(options.surface, {.approach = options.approach});
  }

  /// A sample of the hand; one that is not newer than the last changes nothing.
  void take(HandReport const& sample, double now) noexcept {
    if (has_hand_ && sample.sequence <= sample_.sequence) return;
    constexpr double slack = 0.02;   // m
    double const passed = std::max(now - heard_, std::min(sample.time - sample_.time, options_.hand_silent_after));   // it may say any time
    bool const was_moved = (sample.position - sample_.position).norm() <= slack + options_.fastest_hand * passed;
    if (!has_hand_ || sample.pose_discontinuities != sample_.pose_discontinuities || now - heard_ > options_.hand_silent_after || !was_moved) ++pose_discontinuities_;
    sample_ = sample;
    if (double const speed = sample.velocity.norm(); speed > options_.fastest_hand) sample_.velocity *= options_.fastest_hand / speed;
    heard_ = now;
    has_hand_ = true;
  }
  /// The connection with the hand has ended.
  void hand_left() noexcept { has_hand_ = false; }

  /// A tick of the body of h seconds, that ends at `now` on the server's clock.
  TissueAnswer const& tick(double h, double now) {
    bool const here = has_hand_ && now - heard_ <= options_.hand_silent_after;
    ToolPose<Scalar> const to{sample_.position.template cast<Scalar>(), sample_.orientation.template cast<Scalar>(), sample_.velocity.template cast<Scalar>(),
                              static_cast<Scalar>(sample_.opening)};
    ToolPose<Scalar> const from = here && is_here_ && placed_ == pose_discontinuities_ ? from_ : to;
    int const parts = std::max(1, static_cast<int>(std::ceil(h / options_.max_step - 1e-9)));
    LocalModel<Scalar> model;
    for (int k = 1; k <= parts; ++k) {
      Scalar const share = static_cast<Scalar>(k) / static_cast<Scalar>(parts);
      PlacedTool<Scalar> tool{.is_placed = here, .pose = to, .pose_discontinuities = pose_discontinuities_};
      if (k < parts) {
        tool.pose.position = from.position + share * (to.position - from.position);
        tool.pose.orientation = from.orientation.slerp(share, to.orientation);
        tool.pose.opening = from.opening + share * (to.opening - from.opening);
      }
      model = loop_.tick(std::array{tool}, static_cast<Scalar>(h / parts))[0];
    }
    from_ = to, placed_ = pose_discontinuities_;
    diverged_for_ = model.diverged ? diverged_for_ + h : 0.0;
    if (diverged_for_ > options_.restores_after) loop_.restore(first_), diverged_for_ = 0.0;
    answer(model, here, now);
    capture(model, here, now);
    return answer_;
  }
  /// Is the answer of the last tick to be sent? A deadband leaves out what would not be felt.
  bool is_worth_sending(double now) noexcept {
    double const change = (answer_.force - sent_.force).norm();
    bool const anyway = answer_.phase != sent_.phase || answer_.diverged != sent_.diverged || answer_.restorations != sent_.restorations ||
                        answer_.stamp.revision != sent_.stamp.revision || answer_.stamp.pose_discontinuities != sent_.stamp.pose_discontinuities;
    if (!deadband_(change, sent_.force.norm(), now, anyway)) return false;
    answer_.stamp.sequence = ++sequence_;
    sent_ = answer_;
    return true;
  }
  /// A connection begins: its answers are numbered anew.
  void hand_came() noexcept {
    has_hand_ = false;
    sequence_ = 0;
    deadband_.reset();
  }

  TissueAnswer const& last() const noexcept { return answer_; }
  CapturedSurface<Scalar> const& captured() const noexcept { return captured_; }
  /// The tool as it is to be drawn, outside the tissue; none without a hand.
  std::optional<ToolPose<double>> shown() const noexcept {
    if (!is_here_) return std::nullopt;
    return ToolPose<double>{.position = RemoteTissue::outside(shown_from_, sample_.position), .orientation = sample_.orientation, .velocity = sample_.velocity, .opening = sample_.opening};
  }
  double contact_stiffness() const noexcept { return options_.coupling.stiffness; }
  WeberDeadband const& deadband() const noexcept { return deadband_; }
  BodyLoop<Body, CutterType>& loop() noexcept { return loop_; }
  Body& body() noexcept { return loop_.body(); }
  Body const& body() const noexcept { return loop_.body(); }

 private:
  static TissueNodeOptions const& checked(TissueNodeOptions const& options) {
    detail::OptionCheck const require{"TissueNode", true};
    options.coupling.validate();
    if (options.surface != SurfaceKind::plane && options.surface != SurfaceKind::ball)
      throw InvalidArgument("TissueNode: .surface is neither plane nor ball, which are what is sent; give one of them");
    require.not_negative(".approach", options.approach, " m");
    require(options.max_step >= 1e-6, ".max_step", options.max_step, " s", "give 1e-6 or more, 0.002 for most");
    require(options.max_body_steps >= 1, ".max_body_steps", options.max_body_steps, "give 1 or more");
    require.positive(".hand_silent_after", options.hand_silent_after, " s");
    require.positive(".fastest_hand", options.fastest_hand, " m/s");
    detail::OptionCheck{"TissueNode"}(options.restores_after > 0.0, ".restores_after", options.restores_after, " s", "give a time above zero, infinity for never");
    return options;
  }

  void answer(LocalModel<Scalar> const& model, bool here, double now) noexcept {
    TissueAnswer next;
    next.stamp = {.sequence = sequence_ + 1,
                  .hand = here ? sample_.sequence : 0,
                  .hand_time = here ? sample_.time : 0.0,
                  .pose_discontinuities = here ? sample_.pose_discontinuities : 0,
                  .revision = body().topology_revision(),
                  .time = now};
    next.phase = model.phase;
    next.diverged = model.diverged;
    next.restorations = body().restorations();
    next.home_point = model.home_point.template cast<double>();
    next.normal = model.normal.template cast<double>();
    next.tip_radius = static_cast<double>(model.tip_radius);
    next.force = model.tissue_force.template cast<double>();
    next.moment = model.tissue_moment.template cast<double>();
    next.cut_area = model.cut_area;
    if (!next.valid()) {   // a body that flies away: its answer is no number that one may send
      next.diverged = true;
      next.phase = CuttingPhase::no_contact;
      next.home_point.setZero(), next.force.setZero(), next.moment.setZero();
      next.normal = Vector3<double>::UnitZ();
      next.tip_radius = next.cut_area = 0.0;
    }
    answer_ = next;
  }

  void capture(LocalModel<Scalar> const& model, bool here, double now) {
    is_here_ = here;
    captured_.time = captured_.handed_over = now;
    captured_.revision = body().topology_revision();
    captured_.stiffness = here ? model.surface.patch.stiffness : Scalar(0);
    captured_.tip_radius = loop_.cutter().tip_radius();
    shown_from_ = SurfacePatch<double>{};
    if (!(captured_.stiffness > 0)) {
      captured_.near.clear();
      return;
    }
    shown_from_ = model.surface.patch.template cast<double>();
    auto& shape = detail::shape_of(body());
    auto const& contact = loop_.cutter().contact();
    bool const touches = model.phase == CuttingPhase::indenting && contact.touching;
    if (touches)
      captured_.pressed = contact.normal;
    else
      captured_.pressed.setZero();
    captured_.near.capture(shape, touches ? contact.triangle : shape.nearest_point(sample_.position.template cast<Scalar>()).triangle);
  }

  TissueNodeOptions options_;
  BodyLoop<Body, CutterType> loop_;
  WeberDeadband deadband_;
  decltype(std::declval<Body const&>().save()) first_;   // as the body was at first
  double diverged_for_ = 0.0;                            // s
  HandReport sample_{};
  double heard_ = -std::numeric_limits<double>::infinity();
  bool has_hand_ = false, is_here_ = false;
  std::uint64_t pose_discontinuities_ = 0, placed_ = 0, sequence_ = 0;
  ToolPose<Scalar> from_{};   // where the tool was after the last tick
  TissueAnswer answer_{}, sent_{};
  CapturedSurface<Scalar> captured_{};
  SurfacePatch<double> shown_from_{};
};

/// The fast side of a server: at each of its ticks the surface at the newest sample, out of what the slow side has captured last.
template <RealScalar S>
class SurfaceNode {
 public:
  explicit SurfaceNode(SurfaceKind kind = SurfaceKind::ball, WeberDeadbandOptions const& deadband = {}) : tracker_(kind), deadband_(deadband) {}

  /// The answer to this sample; `longest` is how far ahead [s] the captured surface may be carried on, about a tick of the body.
  SurfaceAnswer const& look(CapturedSurface<S> const& captured, HandReport const& sample, double now, double longest) noexcept {
    S const age = static_cast<S>(std::clamp(now - captured.time, 0.0, longest));
    is_late_ = now - captured.handed_over > std::max(0.1, 2.0 * longest);
    answer_.stamp = {.sequence = sequence_ + 1, .hand = sample.sequence, .hand_time = sample.time, .pose_discontinuities = sample.pose_discontinuities, .revision = captured.revision, .time = now};
    answer_.patch = tracker_.look(captured.near, sample.position.template cast<S>(), captured.tip_radius, captured.stiffness, age, captured.pressed).template cast<double>();
    if (!answer_.valid()) answer_.patch = {};
    tip_ = sample.position;
    return answer_;
  }
  /// Is it to be sent? Compared are the forces at the tip with the last one that was and with this one; in front of the surface by its height.
  /// Not where the body stands still: a hand that hears nothing fades its force, and one that heard surfaces alone would keep the tissue's last force.
  bool is_worth_sending(double now) noexcept {
    if (is_late_) return false;
    double const here = answer_.patch.distance(tip_), there = sent_.patch.distance(tip_), stiffness = answer_.patch.stiffness;
    bool const anyway = (stiffness > 0.0) != (sent_.patch.stiffness > 0.0) || answer_.stamp.revision != sent_.stamp.revision || answer_.stamp.pose_discontinuities != sent_.stamp.pose_discontinuities;
    double const turned = std::abs(here) * (answer_.patch.normal_at(tip_) - sent_.patch.normal_at(tip_)).norm();
    if (!deadband_(stiffness * (std::abs(here - there) + turned), stiffness * std::abs(here), now, anyway)) return false;
    answer_.stamp.sequence = ++sequence_;
    sent_ = answer_;
    return true;
  }
  void hand_came() noexcept {
    sequence_ = 0;
    sent_ = {};
    deadband_.reset();
  }
  WeberDeadband const& deadband() const noexcept { return deadband_; }

 private:
  SurfaceTracker<S> tracker_;
  WeberDeadband deadband_;
  SurfaceAnswer answer_{}, sent_{};
  Vector3<double> tip_ = Vector3<double>::Zero();
  std::uint64_t sequence_ = 0;
  bool is_late_ = false;   // the capture: the body has not ticked for long
};

}  // namespace palpate
