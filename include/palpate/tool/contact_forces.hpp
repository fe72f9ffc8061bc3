// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/concept.hpp>
#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

namespace palpate {

/// How a tool's rods push.
template <RealScalar Scalar>
struct ContactOptions {
  Scalar friction = Scalar(0.3);       ///< Coulomb, of the force along the surface to that across it
  Scalar stiffness = Scalar(2000);     ///< N/m, of tissue that is nailed or held: it can not give way
  Scalar damping = Scalar(2);          ///< N s/m, there
  Scalar recovery = Scalar(0.5);       ///< m/s, how fast what lies inside the tool is moved out, beside the tool's own way

  void validate() const {
    detail::OptionCheck const check{"ContactOptions"};
    check.not_negative(".friction", static_cast<double>(friction));
    check.positive(".stiffness", static_cast<double>(stiffness), " N/m");
    check.not_negative(".damping", static_cast<double>(damping), " N s/m");
    check.positive(".recovery", static_cast<double>(recovery), " m/s");
  }
};

/// A point of the tissue that a tool holds.
template <RealScalar Scalar>
struct PinnedPoint {
  int rod = 0;                                        ///< which does not push the triangle too,
  bool through = false;                               ///< and, where it has gone through it, nothing else: what is about it is in its way
  int triangle = -1;
  Vector3<Scalar> barycentric = Vector3<Scalar>::Zero();
  Vector3<Scalar> offset = Vector3<Scalar>::Zero();   ///< m, where in the tool's frame it is held
  Scalar limit = 0;                                   ///< N, above which it slips
  Vector3<Scalar> force = Vector3<Scalar>::Zero();    ///< N, on the tool in the last step
};

/// The forces of several contacts on one body in its next step, found together: they share particles.
///   at each contact   0 ≤ λ ⟂ v⁺·n + g/h ≤ 0,   |τ| ≤ μ λ against the tangential way of the tool,   v⁺ = v + h (a + M⁻¹ Σ f)
/// with n the way out of the tissue, g how deep the tool will be there if the tissue stays, a the acceleration that tissue and gravity give. So at the end
/// of the step nothing is inside the tool, and nothing is pushed farther than that: of a rigid contact the velocity is the tool's. g counts the tool's own
/// way in the step and no more than `recovery` · h of what was inside before. Tissue that is nailed or held yields by a spring, as ContactCoupling has it.
/// Solved by block Gauss-Seidel sweeps, forwards and backwards, each contact with its friction cone.
/// Units      m, N, s.
/// Source     \cite baraff1998 for the force at the end of the step.
/// Cost       O(links at the particles) and O(contacts) a sweep, at most 100 sweeps; allocates only beyond what was needed before. Of a body that states its
///            mobility, that of each pair of particles besides, and all that a contact moves in each sweep.
/// Limits     Explicit steps give way as 1/m says, and g is gone in one step. Implicit steps give way less, by the tissue's stiffness: there g falls by
///            the factor h²k/(m + h²k) a step, without overshoot, and the force at rest is the tissue's.
template <RealScalar Scalar>
class ContactForces {
 public:
  using Vector = Vector3<Scalar>;
  using Corners = std::array<int, 3>;

  explicit ContactForces(ContactOptions<Scalar> const& options) : options_(options) { options.validate(); }
  ContactOptions<Scalar> const& options() const noexcept { return options_; }

  void begin() noexcept { contacts_.clear(), particles_.clear(); }

  /// A contact that pushes: at a triangle's weights, with the way out, how deep the tool is at the end of the step [m], and the tool's way in it [m].
  void add(Corners const& corners, Vector const& weights, Vector const& normal, Scalar depth, Vector const& way) {
    contacts_.push_back({.particles = corners, .weights = weights, .normal = normal, .gap = depth, .way = way});
  }
  /// One that holds: how far the point is from its place at the end of the step [m], and the tool's way in it.
  void add(Corners const& corners, PinnedPoint<Scalar> const& pin, Vector const& lag, Vector const& way) {
    contacts_.push_back({.particles = corners, .weights = pin.barycentric, .lag = lag, .way = way, .limit = pin.limit, .holds = true});
  }

  /// Finds the forces and applies them to the body for its next step of h seconds. False where that fails, or nothing is in contact: then all are zero.
  template <class Body>
  bool solve(Body& body, Scalar h) {
    if (contacts_.empty()) return false;
    gather(body, h);
    for (Contact& each : contacts_) prepare(each, h);
    constexpr Scalar tolerance = std::max(Scalar(1e-10), 8 * std::numeric_limits<Scalar>::epsilon());
    Scalar largest = 0;
    for (int sweep = 0; sweep < 100; ++sweep) {
      Scalar change = 0;
      auto const count = contacts_.size();
      for (std::size_t k = 0; k < count; ++k) change = std::max(change, improve(contacts_[sweep % 2 == 0 ? k : count - 1 - k], h));
      if (!std::isfinite(change)) return give_up();
      largest = std::max(largest, change);
      if (!(change > tolerance * largest)) break;
    }
    for (Contact const& each : contacts_)
      for (int j = 0; j < 3; ++j) particles_[at(each, j)].force += each.weights[j] / h * each.impulse;
    for (Particle const& each : particles_)
      if (!is_finite(each.force)) return give_up();
    for (Particle const& each : particles_)
      if (!is_zero(each.force)) body.apply_force(each.index, each.force);
    for (Contact& each : contacts_) each.impulse /= h;
    return true;
  }

  /// The force of the k-th contact on the tissue [N], in the order in which they were added, after solve().
  Vector const& force(std::size_t k) const noexcept { return contacts_[k].impulse; }

 private:
  struct Contact {
    Corners particles{};
    Vector weights = Vector::Zero(), normal = Vector::Zero();
    Scalar gap = 0;
    Vector lag = Vector::Zero(), way = Vector::Zero();
    Scalar limit = 0;
    bool holds = false;
    std::array<std::size_t, 3> local{};
    Vector target = Vector::Zero();    // m/s, velocity of the point at the end of the step
    Scalar mobility = 0, yield = 0;    // 1/kg
    Vector impulse = Vector::Zero();   // N s, on the tissue
  };
  struct Particle {
    int index;
    Vector velocity = Vector::Zero();   // m/s, at the end of the step
    Vector force = Vector::Zero();      // N
    Scalar inverse_mass = 0;            // 1/kg
  };

  bool give_up() noexcept {
    for (Contact& each : contacts_) each.impulse.setZero();
    return false;
  }

  static std::size_t at(Contact const& each, int corner) noexcept { return each.local[static_cast<std::size_t>(corner)]; }

  template <class Body>
  void gather(Body const& body, Scalar h) {
    for (Contact const& each : contacts_)
      for (int const i : each.particles) particles_.push_back({.index = i});
    auto const less = [](Particle const& a, Particle const& b) { return a.index < b.index; };
    std::sort(particles_.begin(), particles_.end(), less);
    particles_.erase(std::unique(particles_.begin(), particles_.end(), [](Particle const& a, Particle const& b) { return a.index == b.index; }),
                     particles_.end());
    for (Particle& each : particles_) {
      int const i = each.index;
      if (body.tissue().nailed(i) || body.is_held(i)) {
        each.velocity = body.velocities().col(i);
        continue;
      }
      each.velocity = body.velocities().col(i) + h * body.predicted_acceleration(i, h);
      each.inverse_mass = detail::own_mobility(body, i, h);
    }
    mobility_.clear(), coupled_.clear(), first_coupled_.clear();
    if constexpr (StatesMobility<Body>) {
      std::size_t const n = particles_.size();
      mobility_.assign(n * n, Scalar(0));
      for (std::size_t a = 0; a < n; ++a)
        for (std::size_t b = 0; b <= a; ++b)
          if (particles_[a].inverse_mass > 0 && particles_[b].inverse_mass > 0)
            mobility_[a * n + b] = mobility_[b * n + a] = body.mobility(particles_[a].index, particles_[b].index, h);
      for (std::size_t a = 0; a < n; ++a) {
        first_coupled_.push_back(coupled_.size());
        for (std::size_t b = 0; b < n; ++b)
          if (mobility_[a * n + b] != 0) coupled_.push_back(b);
      }
      first_coupled_.push_back(coupled_.size());
    }
    for (Contact& each : contacts_)
      for (std::size_t j = 0; j < 3; ++j)
        each.local[j] = static_cast<std::size_t>(std::lower_bound(particles_.begin(), particles_.end(), Particle{.index = each.particles[j]}, less) -
                                                 particles_.begin());
  }

  void prepare(Contact& each, Scalar h) const {
    Scalar fixed = 0;   // share of what can not give way
    for (int j = 0; j < 3; ++j) {
      Scalar const b = each.weights[j], mobility = particles_[at(each, j)].inverse_mass;
      each.mobility += b * b * mobility;
      if (!(mobility > 0)) fixed += b;
      for (int k = 0; k < 3 && !mobility_.empty(); ++k)
        if (k != j) each.mobility += b * each.weights[k] * mobility_[at(each, j) * particles_.size() + at(each, k)];
    }
    Scalar const k = options_.stiffness, c = options_.damping;
    each.yield = fixed / (h * (c + h * k));
    Scalar const seconds = h + fixed * c / k;
    // Of what can give way no more is wanted in a step than the tool's way and the recovery; what can not is pushed by its spring.
    auto const within = [&](Scalar size, Scalar way) {
      Scalar const most = way + options_.recovery * h;
      return size > most ? most + fixed * (size - most) : size;
    };
    if (each.holds) {
      Scalar const size = each.lag.norm();
      each.target = (size > 0 ? within(size, each.way.norm()) / size : Scalar(1)) / seconds * each.lag;
      return;
    }
    Scalar const towards = -each.way.dot(each.normal);
    Scalar const gap = within(each.gap, std::max(Scalar(0), towards));
    each.target = (each.way + towards * each.normal) / h - gap / seconds * each.normal;
  }

  /// One contact, the others as they are. Returns how much the velocity there changed.
  Scalar improve(Contact& each, Scalar h) {
    Scalar const give = each.mobility + each.yield;
    if (!(give > 0)) return 0;
    Vector velocity = Vector::Zero();
    for (int j = 0; j < 3; ++j) velocity += each.weights[j] * particles_[at(each, j)].velocity;
    Vector const wanted = each.impulse - (velocity - each.target + each.yield * each.impulse) / give;
    Vector const change = allowed(each, wanted, h) - each.impulse;
    each.impulse += change;
    for (int j = 0; j < 3; ++j) {
      std::size_t const own = at(each, j);
      if (mobility_.empty()) {
        particles_[own].velocity += each.weights[j] * particles_[own].inverse_mass * change;
        continue;
      }
      for (std::size_t k = first_coupled_[own]; k < first_coupled_[own + 1]; ++k)
        particles_[coupled_[k]].velocity += each.weights[j] * mobility_[own * particles_.size() + coupled_[k]] * change;
    }
    return give * change.norm();
  }

  Vector allowed(Contact const& each, Vector const& wanted, Scalar h) const {
    if (each.holds) {
      Scalar const size = wanted.norm(), most = each.limit * h;
      return size > most ? Vector(most / size * wanted) : wanted;
    }
    Scalar const pressed = -wanted.dot(each.normal);
    if (!(pressed > 0)) return pressed <= 0 ? Vector(Vector::Zero()) : wanted;   // what is not a number is seen in the end
    Vector along = wanted + pressed * each.normal;
    Scalar const size = along.norm(), most = options_.friction * pressed;
    if (size > most) along *= most / size;
    return along - pressed * each.normal;
  }

  ContactOptions<Scalar> options_;
  std::vector<Contact> contacts_;
  std::vector<Particle> particles_;
  std::vector<Scalar> mobility_;                        // 1/kg, of each pair of particles, where the body states it
  std::vector<std::size_t> coupled_, first_coupled_;   // those that a force on each moves, and where they begin
};

}  // namespace palpate
