// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/concept.hpp>
#include <palpate/body/touch.hpp>
#include <palpate/core/error.hpp>
#include <palpate/cutting/blade_edge.hpp>
#include <palpate/cutting/blade_grip.hpp>

#include <cmath>
#include <cstddef>
#include <optional>
#include <span>

namespace palpate {

/// Couples an indenting tip to the touched surface point: a stiff damped spring that pushes and never pulls.
///   g = (x_s − (p − r n))·n   how far the tip is below the surface,   ġ = (v_s − v_p)·n
///   f = max(0, (k g + (c + h k)(ġ + h a)) / (1 + h (c + h k) w)),   w = Σ b_i²/m_i,   a = Σ b_i a_i·n
/// with b_i the barycentric weights of the triangle's corners and a_i the acceleration that tissue and gravity give them; where the body
/// states its mobility, w = Σ b_i b_j w_ij; in long steps of a body that forecasts them, as implicit ones are, w and a·n are of the
/// whole body's step.
/// This is the spring's force at the end of the step, so it is stable however stiff the spring and however light the particles; at rest f = k g. −f n acts on the tissue, shared by the corners by weight; +f n is the tissue's reaction on the tool.
/// A blade that is held across its edge drags the point of the tissue at it along the surface with the same spring, to all sides, up to a slip force; so does one
/// in a solid that resists it.
/// Units      k [N/m], c [N·s/m], force [N].
/// Source     \cite baraff1998 for the force at the end of the step.
/// Cost       O(links at three particles), no allocation; of a body that forecasts its steps one forecast with one response.
/// Limits     The step is one that the body itself stands. ExplicitEuler moves a particle only a step after it was pushed: under a
///            stiff contact with little damping it trembles within bounds.
struct ContactCoupling {
  double stiffness = 2000.0;   // N/m
  double damping = 2.0;        // N s/m

  void validate() const {
    detail::require_positive("the contact stiffness", stiffness, "N/m");
    detail::require_non_negative("the contact damping", damping, "N s/m");
  }

  /// Applies the contact force to the body for its next step of h seconds and returns the tissue's reaction on the tool [N].
  template <class Body>
  typename Body::Vector apply(Body& body, SurfaceContact<typename Body::Scalar> const& contact, typename Body::Vector const& tip,
                              typename Body::Vector const& tip_velocity, typename Body::Scalar tip_radius,
                              typename Body::Scalar h) const {
    using Scalar = typename Body::Scalar;
    using Vector = typename Body::Vector;
    if (!contact.touching) return Vector::Zero();
    auto const corners = body.tissue().surface().corners(contact.triangle);
    CoupledPoint<Body> at(body, corners, three(contact.barycentric), h);
    at.foresee(body, contact.normal, h);
    Scalar const k = static_cast<Scalar>(stiffness);
    Scalar const c = static_cast<Scalar>(damping) + h * k;
    Scalar const gap = (at.point - tip).dot(contact.normal) + tip_radius;
    Scalar const closing = (at.velocity - tip_velocity).dot(contact.normal);
    Scalar const force = (k * gap + c * (closing + h * at.acceleration.dot(contact.normal))) / (1 + h * c * at.mobility);
    if (!(force > 0) || !std::isfinite(force)) return Vector::Zero();
    at.for_each([&](int i, Scalar b) { body.apply_force(i, -b * force * contact.normal); });
    return force * contact.normal;
  }

  /// Drags a point of the tissue with the tip along the surface for the body's next step and returns the tissue's reaction on the tool [N].
  template <class Body>
  typename Body::Vector drag(Body& body, BladeHold<typename Body::Scalar> const& held, typename Body::Vector const& normal, typename Body::Vector const& tip,
                             typename Body::Vector const& tip_velocity, typename Body::Scalar h) const {
    using Scalar = typename Body::Scalar;
    using Vector = typename Body::Vector;
    auto const corners = body.tissue().surface().corners(held.triangle);
    CoupledPoint<Body> at(body, corners, three(held.barycentric), h);
    auto const along = [&](Vector const& v) { return Vector(v - v.dot(normal) * normal); };
    return hang_on(body, at, along, tip - at.point, tip_velocity - at.velocity, static_cast<Scalar>(stiffness), held.slip_force, h);
  }

  /// Lets the tissue along a blade hang on to it, for the body's next step, where the tool is `behind` its place at the end of the tick; returns the tissue's
  /// reaction on the tool [N].
  template <class Body>
  typename Body::Vector resist(Body& body, BladeGrip<typename Body::Scalar> const& grip, typename Body::Vector const& behind, typename Body::Vector const& tip_velocity,
                               typename Body::Scalar h) const {
    CoupledPoint<Body> at(body, grip.particles, grip.weights, h);
    auto const all = [](typename Body::Vector const& v) { return v; };
    return hang_on(body, at, all, grip.target - behind - at.point, tip_velocity - at.velocity, grip.stiffness, grip.slip_force, h);
  }

 private:
  template <class Body>
  struct CoupledPoint;

  /// A spring that slips, to the sides that are allowed: on the tissue; returns what acts on the tool.
  template <class Body, class Allowed>
  typename Body::Vector hang_on(Body& body, CoupledPoint<Body>& at, Allowed const& allowed, typename Body::Vector const& apart, typename Body::Vector const& velocity,
                                typename Body::Scalar k, typename Body::Scalar slip_force, typename Body::Scalar h) const {
    using Scalar = typename Body::Scalar;
    using Vector = typename Body::Vector;
    Scalar const c = static_cast<Scalar>(damping) + h * k;
    Vector const lag = allowed(apart), speed = allowed(velocity), pull = k * lag + c * speed;
    if (Scalar const size = pull.norm(); size > 0) at.foresee(body, Vector(pull / size), h);
    Vector force = (pull - h * c * allowed(at.acceleration)) / (1 + h * c * at.mobility);
    Scalar const size = force.norm();
    if (!std::isfinite(size)) return Vector::Zero();
    if (size > slip_force) force *= slip_force / size;
    at.for_each([&](int i, Scalar b) { body.apply_force(i, b * force); });
    return -force;
  }

  /// A point of the body: the mean of the particles that carry it, by weight.
  template <class Body>
  struct CoupledPoint {
    using Scalar = typename Body::Scalar;
    using Vector = typename Body::Vector;
    Vector point = Vector::Zero(), velocity = Vector::Zero();
    Vector acceleration = Vector::Zero();   // m/s², in a step of h seconds without the contact
    Scalar mobility = 0;                    // 1/kg
    std::span<int const> particles;
    std::span<Scalar const> weights;

    CoupledPoint(Body const& body, std::span<int const> carriers, std::span<Scalar const> shares, Scalar h) : particles(carriers), weights(shares) {
      for (std::size_t k = 0; k < particles.size(); ++k) add(body, particles[k], weights[k], h);
      if constexpr (StatesMobility<Body>)
        for (std::size_t a = 0; a < particles.size(); ++a)
          for (std::size_t b = 0; b < particles.size(); ++b)
            if (weights[a] > 0 && weights[b] > 0) mobility += weights[a] * weights[b] * body.mobility(particles[a], particles[b], h);
    }

    /// Where the body tells how its next step will go, and the step is long: that, exactly so along a unit vector, and what gives way along it, the tissue's
    /// stiffness counted.
    void foresee([[maybe_unused]] Body& body, [[maybe_unused]] Vector const& along, [[maybe_unused]] Scalar h) {
      if constexpr (ForecastsSteps<Body>) {
        bool is_stiff = false;
        for_each([&](int i, Scalar) { is_stiff = is_stiff || detail::is_stiff_in_step(body, i, h); });
        auto forecast = is_stiff && mobility > 0 ? body.forecast(h) : std::nullopt;
        if (!forecast) return;
        bool is_known = true;
        for_each([&](int i, Scalar) { is_known = is_known && detail::knows(*forecast, body, i, h); });
        if (!is_known) return;
        forecast->respond([&](auto const& add) { for_each([&](int i, Scalar b) { add(i, b * along); }); });
        Scalar give = 0;
        Vector change = Vector::Zero();   // m/s
        for_each([&](int i, Scalar b) { give += b * along.dot(forecast->response(i)), change += b / body.tissue().mass(i) * forecast->own(i); });
        change *= give / mobility;
        change += (forecast->along() - change.dot(along)) * along;
        acceleration = change / h, mobility = give;
      }
    }

    /// Calls visit(particle, weight) for those that carry it.
    template <class Visit>
    void for_each(Visit const& visit) const {
      for (std::size_t k = 0; k < particles.size(); ++k)
        if (Scalar const b = weights[k]; b > 0) visit(particles[k], b);
    }

   private:
    void add(Body const& body, int i, Scalar weight, Scalar h) {
      if (!(weight > 0)) return;
      point += weight * body.positions().col(i);
      velocity += weight * body.velocities().col(i);
      acceleration += weight * body.predicted_acceleration(i, h);
      if constexpr (!StatesMobility<Body>) {
        if (body.tissue().nailed(i) || body.is_held(i)) return;
        if (Scalar const mass = body.tissue().mass(i); mass > 0) mobility += weight * weight / mass;
      }
    }
  };

  template <class Scalar>
  static std::span<Scalar const> three(Vector3<Scalar> const& weights) noexcept {
    return {weights.data(), 3};
  }
};

}  // namespace palpate
