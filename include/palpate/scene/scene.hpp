// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/concept.hpp>
#include <palpate/body/substeps.hpp>
#include <palpate/core/error.hpp>
#include <palpate/core/for_each_place.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/scene/per_body.hpp>
#include <palpate/scene/scene_contacts.hpp>
#include <palpate/simulator/snapshot.hpp>
#include <palpate/simulator/step_control.hpp>

#include <algorithm>
#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <tuple>
#include <utility>
#include <vector>

namespace palpate {

/// One of a scene's bodies, in its place.
template <std::size_t I, class Body>
struct ScenePart {
  static constexpr std::size_t place = I;
  Body& body;
};

/// What came of a step of a scene.
struct SceneReport {
  int moving = 0;     ///< particles computed, of all bodies
  int diverged = -1;  ///< the first body that did, or −1
  explicit operator bool() const noexcept { return diverged < 0; }
};

/// Several bodies, each of its own tissue, integrator and region, and rigid obstacles: those that are told to touch each other, or themselves, do.
///
///   Scene scene(std::move(liver), std::move(kidney), Obstacle<double>(table));
///   scene.touch<0, 1>({.pressure = 5e3});                       // Pa
///   scene.touch<0, 2>({.friction = 0.4}), scene.touch<1, 2>();
///   scene.touch<0, 0>();                                        // where it is folded
///   scene.advance(1e-3);                                        // each tick
///
/// A simulator takes a scene where it takes a body: see scene_tool.hpp.
/// Steps      each body takes the fewest equal steps of a tick that it stands; see StepControl. Bodies whose boxes meet, and that touch each other, take as many as
///            the one that needs most: contact is found anew in each of these steps, as at its end. An obstacle binds nobody.
/// Order      tools, then contacts in the order in which they were named, then steps in the order of bodies, obstacles last: the same bytes in every run.
/// Shapes     what is drawn: bodies one behind the other, in their order; see BodySnapshot::bodies.
/// Units      m, N, s; world frame.
/// Limits     body<I>() may be told all but to be another: no `scene.body<0>() = other`. Contacts, steps and tools would go on with what they know of the first.
/// Errors     those of BodyContact and SelfContact. InvalidArgument where a pair is named twice, and for a pair that nobody named.
/// Threads    one thread at a time; a body's own execution may have more.
/// Cost       the bodies' steps, one BodyContact::apply a step of each pair whose boxes meet, and O(particles) a tick for the boxes.
template <class... Bodies>
class Scene {
  static_assert(sizeof...(Bodies) > 0, "Scene: a scene has a body, or several.");
  using All = std::tuple<Bodies...>;

 public:
  static constexpr std::size_t bodies = sizeof...(Bodies);
  template <std::size_t I>
  using Body = std::tuple_element_t<I, All>;
  using Scalar = typename Body<0>::Scalar;
  using Vector = Vector3<Scalar>;
  static_assert((std::same_as<typename Bodies::Scalar, Scalar> && ...), "Scene: all bodies compute in one scalar.");
  /// Whether a tool's cutter, or its PerBody, acts on all of them.
  template <class CutterType>
  static constexpr bool takes_cutter = detail::cuts_each<CutterType, Bodies...>;

  explicit Scene(Bodies... its_bodies) : bodies_(std::move(its_bodies)...) {
    for_each_body([&](auto i, auto& body) { std::get<i>(control_).reset(body); });
  }

  template <std::size_t I>
  auto& body() noexcept {
    return std::get<I>(bodies_);
  }
  template <std::size_t I>
  auto const& body() const noexcept {
    return std::get<I>(bodies_);
  }
  /// use(place, body), the place a constant, in their order.
  template <class Use>
  void for_each_body(Use const& use) {
    detail::for_each_place<bodies>([&](auto i) { use(i, std::get<i>(bodies_)); });
  }
  template <class Use>
  void for_each_body(Use const& use) const {
    detail::for_each_place<bodies>([&](auto i) { use(i, std::get<i>(bodies_)); });
  }

  /// From now on bodies I and J press and rub each other, or, where I is J, the body itself, with SelfContactOptions. The contact stays where it is.
  template <std::size_t I, std::size_t J>
  auto& touch(typename detail::SceneContacts<Bodies...>::template Options<I, J> const& options = {}) {
    static_assert(!detail::is_obstacle<Body<I>> || !detail::is_obstacle<Body<J>>, "Scene: obstacles do not touch each other, or themselves; no force moves them.");
    return contacts_.template add<I, J>(bodies_, options);
  }
  template <std::size_t I, std::size_t J>
  auto const& contact() const {
    return contacts_.template get<I, J>();
  }

  /// Body I is taken out: nothing moves, touches or draws it, until it is put back where it was. Tools come to it from outside again. A force that was applied to
  /// it and has not acted yet waits for that.
  template <std::size_t I>
  void take_out() {
    if (std::exchange(is_here_[I], false)) ++came_and_went_;
    for (auto const& pair : contacts_.pairs())
      if (pair->first == I || pair->second == I) pair->part(bodies_);
  }
  template <std::size_t I>
  void put_back() noexcept {
    if (!std::exchange(is_here_[I], true)) ++returns_[I], ++came_and_went_;
  }
  bool is_here(std::size_t place) const noexcept { return is_here_[place]; }
  /// How often it was put back.
  std::size_t returns(std::size_t place) const noexcept { return returns_[place]; }

  /// A tick of h seconds, at most so many steps of each body: where one wanted more it lags, see counts(). Forces applied before act through all of it.
  SceneReport advance(Scalar h, Substeps const& substeps = {}) {
    return advance(h, substeps, [](auto const&, int, EqualSteps<Scalar> const&) {});
  }
  /// push(part, k, steps) before step k of a body's steps, from 1 on; see ScenePart.
  template <class Push>
  SceneReport advance(Scalar h, Substeps const& substeps, Push const& push) {
    detail::require_positive("Scene: a tick", h, "s");
    if (substeps.most < 1) throw InvalidArgument(detail::message("Scene: at most ", substeps.most, " steps a tick; it must be at least 1"));
    for_each_body([&](auto i, auto& body) { std::get<i>(control_).allow(substeps.most), stand_[i] = is_here_[i] ? std::get<i>(control_).step_for(body, h) : h; });
    gather(h);
    ++ticks_, seconds_ += static_cast<double>(h);
    SceneReport report;
    for (bool const obstacles : {false, true})   // what touches an obstacle sees it on its way
      for (std::size_t group = 0; group < bodies; ++group)
        if (is_here_[group] && group_[group] == group && is_obstacle_[group] == obstacles) advance_group(group, h, substeps, push, report);
    return report;
  }
  /// One step of h seconds of every body, whatever they stand.
  SceneReport step(Scalar h) {
    detail::require_positive("Scene: a step", h, "s");
    gather(h);
    touch_each_other(h, [](auto const&) { return true; });
    SceneReport report;
    for_each_body([&](auto i, auto& body) {
      if (is_here_[i]) note(i, body.step(h), report);
    });
    return report;
  }

  /// The smallest of those that are here [s].
  Scalar stable_step() {
    Scalar least = std::numeric_limits<Scalar>::infinity();
    for_each_body([&](auto i, auto& body) {
      if (is_here_[i]) least = std::min(least, body.stable_step());
    });
    return least;
  }
  /// What happened to one of the bodies.
  template <std::size_t I>
  BodyCounts const& counts() const noexcept {
    return std::get<I>(control_).counts(body<I>());
  }
  /// Ticks and seconds of the scene; sums over all bodies, the largest lag and numbers of steps in a tick, the smallest stable step of those that are here, the
  /// tetrahedron of any of them that was turned over most.
  BodyCounts counts() const noexcept {
    BodyCounts all = counts<0>();
    all.ticks = ticks_, all.seconds = seconds_;
    if (!is_here_[0]) all.stable_step = std::numeric_limits<double>::infinity();
    detail::for_each_place<bodies>([&](auto i) {
      BodyCounts const& one = counts<i>();
      if (i == 0) return;
      all.steps += one.steps, all.capped += one.capped, all.stable_steps += one.stable_steps, all.stability_checks += one.stability_checks;
      all.guarded += one.guarded, all.diverged += one.diverged, all.inverted += one.inverted;
      if (!(one.lowest_determinant >= all.lowest_determinant)) all.inverted_element = one.inverted_element, all.lowest_determinant = one.lowest_determinant;
      all.max_steps_a_tick = std::max(all.max_steps_a_tick, one.max_steps_a_tick), all.max_steps_wanted = std::max(all.max_steps_wanted, one.max_steps_wanted);
      all.lag = std::max(all.lag, one.lag);
      if (is_here_[i]) all.stable_step = std::min(all.stable_step, one.stable_step);
    });
    return all;
  }
  /// So many seconds will have no tick.
  void leave_out(double seconds) noexcept {
    seconds_ += seconds;
    for_each_body([&](auto i, auto& body) {
      if (is_here_[i]) std::get<i>(control_).leave_out(body, seconds);
    });
  }

  struct State {
    std::tuple<decltype(std::declval<Bodies const&>().save())...> bodies;
    typename detail::SceneContacts<Bodies...>::State contacts;
    std::array<bool, sizeof...(Bodies)> is_here;
    std::tuple<typename StepControl<Bodies>::State...> steps;
  };
  State save() const {
    return {std::apply([](auto const&... body) { return std::tuple(body.save()...); }, bodies_), contacts_.save(), is_here_,
            std::apply([](auto const&... control) { return std::tuple(control.save()...); }, control_)};
  }
  /// Back to the state of then, to the byte: where friction sticks, too. Contacts named since begin anew. What follows is the same, to the byte. Throws InvalidArgument
  /// for a state of a scene whose contacts are others.
  void restore(State const& state) {
    contacts_.check(state.contacts);
    for_each_body([&](auto i, auto& body) { body.restore(std::get<i>(state.bodies)); });
    contacts_.restore(state.contacts, bodies_);
    if (std::exchange(is_here_, state.is_here) != state.is_here) ++came_and_went_;
    for_each_body([&](auto i, auto&) { std::get<i>(control_).restore(std::get<i>(state.steps)); });
  }
  std::size_t restorations() const noexcept { return sum([](auto const& body) { return body.restorations(); }); }
  /// Counts the changes of triangles, and bodies that come and go.
  std::size_t topology_revision() const noexcept { return sum([](auto const& body) { return body.topology_revision(); }) + came_and_went_; }

  /// All bodies as they are now, into one mesh.
  void draw(BodySnapshot<Scalar>& to) const {
    std::array<BodySnapshot<Scalar>, bodies>& each = drawn_;
    Eigen::Index points = 0, triangles = 0;
    bool has_changed = to.triangles.cols() == 0 || to.topology_revision != topology_revision();
    for_each_body([&](auto i, auto const& body) {
      if (!is_here_[i]) return void(each[i] = {});
      each[i].draw(body);
      has_changed = has_changed || to.bodies.size() != bodies || to.bodies[i].points != each[i].points.cols() || to.bodies[i].triangles != each[i].triangles.cols();
      points += each[i].points.cols(), triangles += each[i].triangles.cols();
    });
    to.points.resize(3, points), to.bodies.resize(bodies);
    if (has_changed) to.triangles.resize(3, triangles), to.is_wound.assign(static_cast<std::size_t>(triangles), 0);
    points = triangles = 0;
    for (std::size_t i = 0; i < bodies; ++i) {
      auto const n = each[i].points.cols(), t = each[i].triangles.cols();
      to.points.middleCols(points, n) = each[i].points;
      if (has_changed) {
        to.triangles.middleCols(triangles, t) = each[i].triangles.array() + static_cast<int>(points);
        std::copy(each[i].is_wound.begin(), each[i].is_wound.end(), to.is_wound.begin() + triangles);
      }
      to.bodies[i] = {points, n, triangles, t};
      points += n, triangles += t;
    }
    to.topology_revision = topology_revision();
  }

 private:
  template <class Of>
  std::size_t sum(Of const& of) const noexcept {
    return std::apply([&](auto const&... body) { return (of(body) + ...); }, bodies_);
  }
  template <class Report>
  void note(std::size_t i, Report const& of, SceneReport& report) const noexcept {
    report.moving += of.moving;
    if (!of && report.diverged < 0) report.diverged = static_cast<int>(i);
  }

  /// Which pairs are near each other in a tick of h seconds, and which bodies take equal steps.
  void gather(Scalar h) {
    for_each_body([&](auto i, auto const& body) {
      group_[i] = i;
      auto const x = body.positions();
      Scalar const way = h * body.velocities().cwiseAbs().maxCoeff();
      Vector const low = x.rowwise().minCoeff(), high = x.rowwise().maxCoeff();
      low_[i] = low - Vector::Constant(way), high_[i] = high + Vector::Constant(way);
    });
    near_.assign(contacts_.pairs().size(), 0);
    for (std::size_t k = 0; k < near_.size(); ++k) {
      auto& pair = *contacts_.pairs()[k];
      auto const [a, b] = std::pair(pair.first, pair.second);
      near_[k] = is_here_[a] && is_here_[b] && (low_[a].array() <= high_[b].array()).all() && (low_[b].array() <= high_[a].array()).all();
      if (near_[k] == 0) pair.part(bodies_);
      if (near_[k] == 0 || is_obstacle_[a] || is_obstacle_[b] || group_[a] == group_[b]) continue;
      std::size_t const stays = std::min(group_[a], group_[b]), goes = std::max(group_[a], group_[b]);
      for (std::size_t& group : group_)
        if (group == goes) group = stays;
    }
  }
  /// Of the pairs that are near, and are meant, each counts with all others.
  template <class IsMeant>
  void touch_each_other(Scalar h, IsMeant const& is_meant) {
    auto const for_each_pair = [&](auto const& use) {
      for (std::size_t k = 0; k < near_.size(); ++k)
        if (near_[k] != 0 && is_meant(*contacts_.pairs()[k])) use(*contacts_.pairs()[k]);
    };
    bool is_first = true;
    for_each_pair([&](auto& pair) {
      if (!std::exchange(is_first, false)) pair.expect(bodies_);
    });
    for_each_pair([&](auto& pair) { pair.apply(bodies_, h); });
  }

  template <class Push>
  void advance_group(std::size_t group, Scalar h, Substeps const& substeps, Push const& push, SceneReport& report) {
    auto const for_each_of_it = [&](auto const& use) {
      for_each_body([&](auto i, auto& body) {
        if (group_[i] == group) use(i, body);
      });
    };
    Scalar stands = std::numeric_limits<Scalar>::infinity();
    for_each_of_it([&](auto i, auto&) { stands = std::min(stands, stand_[i]); });
    EqualSteps<Scalar> const steps = split_duration(h, stands, substeps.most);
    for_each_of_it([&](auto i, auto const& body) { std::get<i>(control_).begin_tick(body, steps); });
    auto const let_obstacles_look = [&](Scalar ahead) {
      for_each_body([&](auto i, auto& body) {
        if constexpr (is_obstacle_[i])
          if (is_here_[i]) body.look_ahead(ahead);
      });
    };
    bool goes_on = true;
    for (int k = 1; k <= steps.count && goes_on; ++k) {
      if (k > 1) let_obstacles_look(static_cast<Scalar>(k - 1) * steps.each);
      for_each_of_it([&](auto i, auto& body) {
        std::get<i>(control_).apply_forces(body, k);
        ScenePart<i, Body<i>> part{body};
        push(part, k, steps);
      });
      touch_each_other(steps.each, [&](auto const& pair) { return group_[is_obstacle_[pair.first] ? pair.second : pair.first] == group; });
      for_each_of_it([&](auto i, auto& body) {
        auto const of = body.step(steps.each);
        note(i, of, report);
        if (!std::get<i>(control_).took(of, steps.each)) goes_on = false;
      });
    }
    if (steps.count > 1) let_obstacles_look(Scalar(0));
    for_each_of_it([&](auto i, auto&) { std::get<i>(control_).end_tick(h, steps); });
  }

  static constexpr std::array<bool, bodies> all_here() noexcept {
    std::array<bool, bodies> all;
    all.fill(true);
    return all;
  }
  static constexpr std::array<bool, bodies> is_obstacle_{detail::is_obstacle<Bodies>...};

  All bodies_;
  detail::SceneContacts<Bodies...> contacts_;
  std::tuple<StepControl<Bodies>...> control_;
  std::array<bool, bodies> is_here_ = all_here();
  std::array<std::size_t, bodies> returns_{};
  std::size_t came_and_went_ = 0;
  std::uint64_t ticks_ = 0;
  double seconds_ = 0;   // of its ticks
  std::array<Scalar, bodies> stand_{};         // s, the largest step of each in this tick
  std::array<std::size_t, bodies> group_{};    // of each body the first that it takes equal steps with
  std::array<Vector, bodies> low_, high_;      // m
  std::vector<char> near_;                     // of each contact
  mutable std::array<BodySnapshot<Scalar>, bodies> drawn_;
};

/// Parts of which one is no body: what is wrong, and nothing that could fail besides.
template <class... Parts>
  requires(!(SimulatedBody<Parts> && ...))
class Scene<Parts...> {
  static_assert((SimulatedBody<Parts> && ...), "Scene: one of its parts is no body; of a tissue make one, SoftBody body(std::move(tissue)), of a rigid surface an Obstacle; see SimulatedBody.");

 public:
  using Refused = void;

  explicit Scene(Parts const&...) {}
};

/// A scene controls the steps of its bodies itself.
template <class... Bodies>
class StepControl<Scene<Bodies...>> {
  using SceneType = Scene<Bodies...>;

 public:
  using Scalar = typename SceneType::Scalar;

  template <class Push>
  bool advance(SceneType& scene, Scalar h, Push const& push) {
    return static_cast<bool>(scene.advance(h, {.most = allowed_}, push));
  }
  void reset(SceneType&) noexcept {}   // it does that as it is made and restored
  void leave_out(SceneType& scene, double seconds) noexcept { scene.leave_out(seconds); }
  void allow(int steps) noexcept { allowed_ = steps; }
  BodyCounts counts(SceneType const& scene) const noexcept {
    BodyCounts counts = scene.counts();
    counts.steps_allowed = allowed_;
    return counts;
  }

 private:
  int allowed_ = 1;
};

}  // namespace palpate
