// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/concept.hpp>
#include <palpate/collision/closest_point.hpp>
#include <palpate/core/error.hpp>
#include <palpate/core/random.hpp>
#include <palpate/testing/violations.hpp>

#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <limits>
#include <vector>

namespace palpate::testing {

struct BodyChecks {
  double force = 0.01;   ///< N, of a push; a larger one may bring the body to its limits
  double step = 1e-3;    ///< s; not above half the body's guaranteed stable step
  int steps = 20;        ///< under random pushes, each time
  Seed seed{1};
};

namespace detail {

/// The checks of check_body, each of a copy.
template <class Body>
class BodyBattery {
 public:
  using Scalar = typename Body::Scalar;
  using Vector = Vector3<Scalar>;

  BodyBattery(Body const& body, BodyChecks const& checks)
      : body_(body), checks_(checks), random_(checks.seed), h_(std::min(static_cast<Scalar>(checks.step), body.guaranteed_stable_step() / 2)) {}

  Violations run() {
    shape();
    if (!found_.empty()) return found_;
    rest();
    searches(body_);
    pushes();
    bad_values();
    restore();
    huge();
    return found_;
  }

 private:
  static constexpr Scalar tolerance = std::same_as<Scalar, float> ? Scalar(2e-4) : Scalar(1e-10);

  template <class... Parts>
  void tell(Parts const&... parts) {
    found_.push_back(palpate::detail::message(parts...));
  }
  static int size(Body const& body) { return static_cast<int>(body.positions().cols()); }
  Vector any(Scalar length) { return length * Vector(random_.uniform(Scalar(-1), Scalar(1)), random_.uniform(Scalar(-1), Scalar(1)), random_.uniform(Scalar(-1), Scalar(1))); }
  int any_of_skin(Body const& body) {
    int const t = static_cast<int>(random_.uniform(0.0, 1.0) * body.tissue().surface().triangle_count());
    return body.tissue().surface().corners(t)[static_cast<std::size_t>(random_.uniform(0.0, 2.999))];
  }
  /// A particle of the skin that can move, or −1.
  int any_free(Body const& body) {
    for (int k = 0; k < 1000; ++k)
      if (int const i = any_of_skin(body); !body.tissue().nailed(i) && !body.is_held(i)) return i;
    return -1;
  }
  static bool same(Body const& a, Body const& b) { return size(a) == size(b) && a.positions() == b.positions() && a.velocities() == b.velocities(); }
  void push(Body& body, int steps) {
    for (int k = 0; k < steps; ++k) {
      for (int n = 0; n < 3; ++n) body.apply_force(any_of_skin(body), any(static_cast<Scalar>(checks_.force)));
      body.step(h_);
    }
  }

  void shape() {
    auto const& surface = body_.tissue().surface();
    int const n = size(body_);
    if (n == 0 || surface.triangle_count() == 0) return tell("the body has ", n, " particles and ", surface.triangle_count(), " triangles; it needs some");
    if (body_.velocities().cols() != n) return tell("velocities() has ", body_.velocities().cols(), " columns, and positions() ", n);
    if (!is_finite(body_.positions()) || !is_finite(body_.velocities())) return tell("a position or velocity is not finite");
    if (!(h_ > 0)) return tell("guaranteed_stable_step() is ", body_.guaranteed_stable_step(), " s; it must be positive");
    Body body = body_;
    if (Scalar const stable = body.stable_step(); !(stable >= body_.guaranteed_stable_step() * (1 - tolerance)))
      tell("stable_step() is ", stable, " s, less than the guaranteed ", body_.guaranteed_stable_step(), " s");
    if (!(body.mean_edge() > 0) || !(body.home_diagonal() > 0)) tell("mean_edge() is ", body.mean_edge(), " m and home_diagonal() ", body.home_diagonal(), " m");
    for (int t = 0; t < surface.triangle_count(); ++t) {
      auto const c = surface.corners(t);
      for (std::size_t k = 0; k < 3; ++k) {
        int const a = c[k], b = c[(k + 1) % 3];
        if (a < 0 || a >= n) return tell("triangle ", t, " has the corner ", a, ", outside 0 … ", n - 1);
        Scalar const length = body_.reference_normal(a).norm();   // 0 where triangles cancel, as at the end of a wound
        if (length != 0 && !(std::abs(length - 1) < Scalar(1e-3))) return tell("reference_normal(", a, ") has the length ", length);
        int const beyond = body_.triangle_across(a, b);
        if (beyond < 0) continue;
        auto const other = surface.corners(beyond);
        if (beyond >= surface.triangle_count() || std::find(other.begin(), other.end(), a) == other.end() || std::find(other.begin(), other.end(), b) == other.end())
          return tell("triangle_across(", a, ", ", b, ") is ", beyond, ", which does not have that edge");
      }
    }
  }

  /// Against all triangles, one by one.
  void searches(Body body) {
    push(body, 3);
    auto const x = body.positions();
    auto const& surface = body.tissue().surface();
    Vector const low = x.rowwise().minCoeff(), high = x.rowwise().maxCoeff();
    Scalar const size = (high - low).norm();
    for (int k = 0; k < 100; ++k) {
      Vector const p = (low + high) / 2 + any(Scalar(0.75) * size);
      SurfacePoint<Scalar> const nearest = body.nearest_point(p, k % 2 == 0 ? -1 : any_triangle(body));
      if (!nearest.found()) return tell("nearest_point(", p[0], ", ", p[1], ", ", p[2], ") found nothing");
      auto const c = surface.corners(nearest.triangle);
      Vector const there = nearest.barycentric[0] * x.col(c[0]) + nearest.barycentric[1] * x.col(c[1]) + nearest.barycentric[2] * x.col(c[2]);
      if (!((there - nearest.point).norm() <= tolerance * size)) return tell("nearest_point: its point is ", (there - nearest.point).norm(), " m off its barycentric weights");
      Scalar best = std::numeric_limits<Scalar>::infinity();
      for (int t = 0; t < surface.triangle_count(); ++t) {
        auto const corner = surface.corners(t);
        best = std::min(best, palpate::detail::closest_to_origin<Scalar>(x.col(corner[0]) - p, x.col(corner[1]) - p, x.col(corner[2]) - p).squared_distance);
      }
      if (!(std::abs(nearest.distance - std::sqrt(best)) <= tolerance * size))
        return tell("nearest_point(", p[0], ", ", p[1], ", ", p[2], ") is ", nearest.distance, " m away, and another is ", std::sqrt(best), " m");
      if constexpr (SearchableBody<Body>) {
        Vector const corner = p - Vector::Constant(size / 5), far = p + Vector::Constant(size / 5);
        std::vector<char> seen(static_cast<std::size_t>(surface.triangle_count()), 0);
        body.visit_triangles_in_box(corner, far, [&](int t) { ++seen[static_cast<std::size_t>(t)]; });
        for (int t = 0; t < surface.triangle_count(); ++t) {
          auto const inside = [&](int v) { return (x.col(v) - corner).minCoeff() > 0 && (far - x.col(v)).minCoeff() > 0; };
          auto const corners = surface.corners(t);
          if (seen[static_cast<std::size_t>(t)] != 1 && std::any_of(corners.begin(), corners.end(), inside))
            return tell("visit_triangles_in_box visits triangle ", t, ", which has a corner in the box, ", int(seen[static_cast<std::size_t>(t)]), " times");
        }
      }
    }
    if (body.nearest_point(Vector::Constant(std::numeric_limits<Scalar>::quiet_NaN())).found()) tell("nearest_point of a point that is not finite found one");
  }
  int any_triangle(Body const& body) { return static_cast<int>(random_.uniform(0.0, 0.999) * body.tissue().surface().triangle_count()); }

  void rest() {
    Body body = body_;
    for (Scalar const h : {Scalar(0), h_}) {
      bool const done = static_cast<bool>(body.step(h));
      Scalar const far = (body.positions() - body_.positions()).colwise().norm().maxCoeff();
      if (!done) tell("a step of ", h, " s at rest reports that it diverged");
      if (!(far <= (h > 0 ? Scalar(1e-3) : tolerance) * body.mean_edge())) return tell("at rest, without a force, a step of ", h, " s moves a particle by ", far, " m; give a body at rest");
    }
  }

  void pushes() {
    Body settled = body_;
    push(settled, checks_.steps);
    for (int k = 0; k < 10; ++k) {
      int const i = any_free(settled), j = any_free(settled);
      if (i < 0 || j < 0) break;
      Vector const force = any(static_cast<Scalar>(checks_.force));
      Body pushed = settled;
      pushed.apply_force(i, force);
      Scalar const gives = palpate::detail::own_mobility(settled, i, h_);
      Scalar const added = (Vector(pushed.predicted_acceleration(i, h_)) - Vector(settled.predicted_acceleration(i, h_))).dot(force) / force.squaredNorm();
      Scalar const slack = 100 * tolerance * (gives + Vector(settled.predicted_acceleration(i, h_)).norm() / force.norm());
      if (!(gives > 0)) return tell("a force on particle ", i, " is said to move it by ", gives, " /kg; it is free, so that must be positive");
      if (!(added > 0 && added <= gives + slack))
        return tell("a force on particle ", i, " adds ", added, " /kg to its predicted acceleration; that must be positive, and at most ", gives, " /kg, as its mobility says");
      if constexpr (StatesMobility<Body>) {
        Scalar const there = settled.mobility(i, j, h_), back = settled.mobility(j, i, h_);
        if (!(std::abs(there - back) <= 100 * tolerance * gives)) return tell("mobility(", i, ", ", j, ") is ", there, " /kg, and back ", back, "; it must be symmetric");
        Vector const other = Vector(pushed.predicted_acceleration(j, h_)) - Vector(settled.predicted_acceleration(j, h_));
        if (there > gives / 2 && !(other.norm() > 0))
          return tell("a force on particle ", i, " adds nothing to the predicted acceleration of ", j, ", and mobility(", j, ", ", i, ") is ", there, " /kg");
      } else if (!(std::abs(added - gives) <= slack)) {
        return tell("a force on particle ", i, " adds ", added, " /kg to its predicted acceleration, and 1/mass is ", gives, " /kg");
      }
      Body alone = settled;
      pushed = settled;
      pushed.apply_force(i, force);
      if (!pushed.step(h_) || !alone.step(h_)) return tell("a step under ", force.norm(), " N reports that it diverged; where that is true, give a smaller .force");
      Scalar const came = (pushed.positions().col(i) - alone.positions().col(i)).dot(force) / force.squaredNorm(), said = h_ * h_ * gives;
      if (!(came > said / 100 && came < 100 * said))
        return tell("a newton on particle ", i, " moves it by ", came, " m in a step, and what is predicted is ", said, " m, not even a hundredth or a hundred times that");
      alone = settled, pushed = settled;
      for (int step = 0; step < 3; ++step) pushed.apply_force(i, force), pushed.step(h_), alone.step(h_);
      if (!((pushed.positions().col(i) - alone.positions().col(i)).dot(force) > 0)) return tell("a push on particle ", i, " does not move it the way that it pushes");
    }
    for (int i = 0; i < size(settled); ++i)
      if (settled.tissue().nailed(i)) {
        if (settled.positions().col(i) != body_.positions().col(i)) return tell("particle ", i, " is nailed, and has moved");
        settled.apply_force(i, any(static_cast<Scalar>(checks_.force)));
        if (palpate::detail::own_mobility(settled, i, h_) != 0 || !Vector(settled.predicted_acceleration(i, h_)).isZero(0))
          return tell("particle ", i, " is nailed, and is predicted to move");
      }
  }

  void bad_values() {
    Body body = body_;
    Scalar const nan = std::numeric_limits<Scalar>::quiet_NaN();
    auto const refuses = [&](char const* what, auto const& use) {
      try {
        use();
        tell(what, " is taken");
      } catch (Error const&) {
      } catch (...) {
        tell(what, " is refused, but not by an exception that is an Error");
      }
    };
    refuses("a force on particle -1", [&] { body.apply_force(-1, any(1)); });
    refuses("a force on a particle that there is not", [&] { body.apply_force(size(body), any(1)); });
    refuses("a force that is not finite", [&] { body.apply_force(any_of_skin(body), Vector(0, nan, 0)); });
    refuses("a step that is not finite", [&] { body.step(nan); });
    refuses("a step back", [&] { body.step(-h_); });
    Body untouched = body_;
    body.step(h_), untouched.step(h_);
    if (!same(body, untouched)) tell("what was refused has changed the body");
  }

  void restore() {
    Body body = body_;
    push(body, checks_.steps);
    int const i = any_of_skin(body);
    Vector const waiting = any(static_cast<Scalar>(checks_.force));
    body.apply_force(i, waiting);   // for the next step
    auto const saved = body.save();
    Body const at_save = body;
    auto const restorations = body.restorations();
    Random const as_then = random_;
    push(body, checks_.steps);
    Body const once = body;
    Body twin = at_save;
    random_ = as_then;
    push(twin, checks_.steps);
    if (!same(twin, once)) tell("a copy does something else");
    body.restore(saved);
    if (!same(body, at_save)) return tell("restore does not bring back positions and velocities");
    if (body.restorations() <= restorations) tell("restorations() does not count that it was restored");
    random_ = as_then;
    push(body, checks_.steps);
    if (!same(body, once)) tell("after restore it goes on in another way");
  }

  /// Whatever is done to it, it says so rather than that something is no number.
  void huge() {
    Body body = body_;
    for (Scalar const force : {Scalar(1e6), Scalar(1e9)}) {
      for (int k = 0; k < 3; ++k) {
        int const i = any_free(body);
        if (i < 0) return;
        Matrix3X<Scalar> const before = body.positions();
        body.apply_force(i, any(force));
        bool const done = static_cast<bool>(body.step(h_));
        if (done && body.positions() == before)
          return tell("under ", force, " N nothing moves, and the step does not report that it was refused");
        if (!is_finite(body.positions()) || !is_finite(body.velocities())) return tell("after a force of ", force, " N a position or velocity is not finite");
      }
    }
  }

  Body const& body_;
  BodyChecks checks_;
  Random random_;
  Scalar h_;
  Violations found_;
};

}  // namespace detail

/// Checks a body as a Simulator uses one, besides its syntax. What has to hold:
///   shape      indices, normals and steps make sense
///   searches   nearest_point and visit_triangles_in_box find what all triangles asked one by one give
///   rest       without a force, a body at rest stays; steps report that they were taken
///   forces     what a force adds to predicted_acceleration is 1/mass, or at most mobility, which is symmetric; a push moves a particle its way,
///              within a hundredth and a hundred times of what is predicted; nails hold
///   values     that are not finite, or out of range, are refused, and nothing changes
///   state      save and restore bring back all that its future is made of, forces for the next step too; a copy does the same to the bit
///   huge       a force of 10⁹ N leaves no position that is not finite, and a step that is refused says so
/// Cost       some hundred steps, and 100 times all triangles: take a small body, at rest.
template <SimulatedBody Body>
  requires std::copyable<Body>
Violations check_body(Body const& body, BodyChecks const& checks = {}) {
  return detail::BodyBattery<Body>(body, checks).run();
}
/// For what is no body: says why.
template <class Body>
Violations check_body(Body const&, BodyChecks const& = {}) {
  static_assert(sizeof(palpate::detail::BodySentences<Body>) > 0);
  static_assert(SimulatedBody<Body> && std::copyable<Body>, "palpate: a body is copied with its simulator; give it a copy constructor and a copy assignment.");
  return {};
}

}  // namespace palpate::testing
