// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/concept.hpp>
#include <palpate/collision/surface_intersection.hpp>
#include <palpate/contact/contact_options.hpp>
#include <palpate/contact/cut_lips.hpp>
#include <palpate/contact/free_motion.hpp>
#include <palpate/contact/region_shapes.hpp>
#include <palpate/contact/rigid_forces.hpp>
#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/core/refill.hpp>
#include <palpate/mesh/surface_topology.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <utility>
#include <vector>

namespace palpate {

/// What happens in one place of a contact. Its first body, or the first sheet of a body in itself, feels this; the other one the opposite.
template <RealScalar Scalar>
struct ContactRegion {
  using Vector = Vector3<Scalar>;

  double volume = 0;                   ///< m³ in common
  double spared = 0;                   ///< m³ of it that were there as it began to press, where a body in itself had been held back: they do not
  Scalar area = 0, pressure = 0;       ///< m², across the normal; Pa
  Vector point = Vector::Zero();       ///< m, its middle
  Vector normal = Vector::UnitZ();     ///< from the first body into the second
  Vector friction = Vector::Zero();    ///< N, on the first
  Vector moment = Vector::Zero();      ///< N m, on the first, along the surface: where it is deeper at one side
  Scalar torsion = 0;                  ///< N m, on the first about the normal
  bool slips = false;

  Vector force() const noexcept { return friction - pressure * area * normal; }   ///< N, on the first
};

/// Where friction sticks, and what it pressed with: with the bodies' states, all that a contact's future is made of.
template <RealScalar Scalar>
struct ContactState {
  struct Anchor {
    std::vector<int> vertices;                                // of the first side, ascending
    Vector3<Scalar> slip = Vector3<Scalar>::Zero();           // m, of the first side against the second since it holds
    Scalar turn = 0, most = 0, max_turn = 0;                 // rad; as far as friction holds
    double presses = 0, spared = 0;                           // m³
  };
  std::vector<Anchor> anchors;
  std::vector<int> held_back;                                 // vertices, see SurfaceIntersection
  std::array<std::vector<std::pair<int, Vector3<Scalar>>>, 2> forces{};   // N, on vertices of each body
  std::vector<PartedVertex<Scalar>> parted{};                 // of the lips of cuts
  Scalar last_step = 0;
};

namespace detail {

/// A body's surface as SurfaceIntersection wants it.
template <class Body>
struct BodySkin {
  using Scalar = typename Body::Scalar;

  explicit BodySkin(Body& its_body) : topology(its_body.tissue().surface()), points(its_body.positions()), body(its_body) {}

  template <class Visit>
  void visit_triangles_in_box(Vector3<Scalar> const& low, Vector3<Scalar> const& high, Visit&& visit) {
    body.visit_triangles_in_box(low, high, visit);
  }

  SurfaceTopology const& topology;
  typename SurfaceTree<Scalar>::Points points;
  Body& body;
};

template <class Body>
void require_closed(char const* whose, char const* which, Body const& body) {
  auto const& surface = body.tissue().surface();
  for (int t = 0; t < surface.triangle_count(); ++t) {
    auto const c = surface.corners(t);
    for (std::size_t k = 0; k < 3; ++k)
      if (int const a = c[k], b = c[(k + 1) % 3]; body.triangle_across(a, b) < 0)
        throw InvalidMesh(message(whose, ": the surface of ", which, " is open at the edge of vertices ", a, " and ", b, "; give a closed one, or a solid"));
  }
}

/// The pressures and frictions of all regions of a contact, of two bodies or of one in itself, as at the end of a step; see BodyContact. In this order:
///   begin()                            what stuck is kept
///   intersection().find(…)             or find_own
///   take_intersection()                and what else is to be added to shapes()
///   gather(owner, body, motion, h)     of each body, 0 and 1; 0 alone where it is one
///   prepare()
///   respond(owner, motion)
///   solve(h)
///   push(owner, body)
template <RealScalar Scalar>
class ContactRegions {
 public:
  using Vector = Vector3<Scalar>;
  using Region = ContactRegion<Scalar>;
  using State = ContactState<Scalar>;

  ContactRegions(BodyContactOptions<Scalar> const& options, bool is_own) : options_(options), is_own_(is_own) {}

  BodyContactOptions<Scalar> const& options() const noexcept { return options_; }
  std::span<Region const> regions() const noexcept { return regions_; }
  SurfaceIntersection<Scalar> const& intersection() const noexcept { return common_; }
  SurfaceIntersection<Scalar>& intersection() noexcept { return common_; }
  /// Theirs are the first shapes.
  void take_intersection() { shapes_.take(common_); }
  RegionShapes<Scalar>& shapes() noexcept { return shapes_; }

  void begin() { remember(), regions_.clear(), rows_.clear(); }
  /// The vertices of a body, with the velocities that they will have without the contact.
  template <class Body>
  void gather(int number, Body const& body, FreeMotion<Body>& motion, Scalar h) {
    if (!shapes_.gradient(0).empty() || !shapes_.gradient(1).empty()) motion.begin(body, h);   // what is held back moves nothing
    Owner& its = owners_[at(number)];
    its.local.resize(std::max(its.local.size(), static_cast<std::size_t>(body.positions().cols())), -1);
    its.particles.clear(), its.mobility.clear();
    for_each_side_of(number, [&](int side) {
      refill(entries_[at(side)], shapes_.gradient(side).size(), Entry{Vector::Zero(), Vector::Zero(), Vector::Zero(), Vector::Zero()});
      for (auto const& one : shapes_.gradient(side))
        if (its.local[at(one.vertex)] < 0) {
          its.local[at(one.vertex)] = static_cast<int>(its.particles.size());
          its.particles.push_back({.index = one.vertex,
                                   .position = body.positions().col(one.vertex),
                                   .speed = body.velocities().col(one.vertex),
                                   .velocity = motion.velocity(body, one.vertex, h),
                                   .inverse_mass = own_mobility(body, one.vertex, h)});
        }
    });
    if constexpr (StatesMobility<Body>)
      for (Particle const& a : its.particles)
        for (Particle const& b : its.particles) its.mobility.push_back(body.mobility(a.index, b.index, h));
  }
  void prepare() {
    for (auto const& region : shapes_.regions()) {
      prepare(region);
      if (last_step_ > 0) inherit(region, rows_.back());
    }
  }
  /// How all particles of a body that gives way as a whole move by each row.
  template <class Body>
  void respond(int number, FreeMotion<Body>& motion) {
    Owner& its = owners_[at(number)];
    its.responses.clear();
    if (its.particles.empty()) return;
    if constexpr (FreeMotion<Body>::solves) {
      std::size_t const count = its.particles.size();
      its.responses.resize(rows_.size() * rows * count);
      for (std::size_t n = 0; n < rows_.size(); ++n)
        for (std::size_t r = 0; r < rows_[n].used(); ++r)
          motion.respond(
              [&](auto const& add) {
                for_each_side_of(number, [&](int side) {
                  auto const gradients = shapes_.gradient(side, shapes_.regions()[n]);
                  auto const entries = entries_of(n, side);
                  for (std::size_t k = 0; k < entries.size(); ++k) add(gradients[k].vertex, entries[k][r]);
                });
              },
              [&](std::size_t i) { return its.particles[i].index; }, std::span(its.responses).subspan((n * rows + r) * count, count));
    }
  }
  /// All regions, one after the other, until nothing changes. Where that fails nothing is pushed.
  void solve(Scalar h) {
    for (std::size_t n = 0; n < rows_.size(); ++n)
      for (std::size_t r = 0; r < rows; ++r) rows_[n].give[r] = give(n, r);
    last_step_ = h;
    is_solved_ = !regions_.empty() && find_multipliers(h);
    if (!is_solved_) regions_.clear(), rows_.clear();
  }
  /// Adds the forces to a body.
  template <class Body>
  void push(int number, Body& body) {
    Owner& its = owners_[at(number)];
    auto& forces = forces_[at(number)];
    forces.clear();
    for (Particle const& one : its.particles) {
      if (is_solved_ && !is_zero(one.force)) body.apply_force(one.index, one.force), forces.push_back({one.index, one.force});
      its.local[at(one.index)] = -1;
    }
  }
  /// Adds the forces of the last step to a body, or takes them back: sign 1 or −1. Edits may have taken vertices.
  template <class Body>
  void push_last(int number, Body& body, Scalar sign) {
    for (auto const& [vertex, force] : forces_[at(number)])
      if (vertex < body.positions().cols()) body.apply_force(vertex, sign * force);
  }

  State save() const {
    if (was_restored_)
      return {.anchors = {last_.begin(), last_.begin() + static_cast<std::ptrdiff_t>(last_count_)}, .held_back = held_back_, .forces = forces_, .last_step = last_step_};
    State state{.anchors = std::vector<Anchor>(regions_.size()), .held_back = {common_.held_back().begin(), common_.held_back().end()}, .last_step = last_step_};
    state.forces = forces_;
    for (std::size_t n = 0; n < regions_.size(); ++n) take(n, state.anchors[n]);
    return state;
  }
  void restore(State const& state) {
    forget();
    held_back_ = state.held_back, forces_ = state.forces;
    last_count_ = state.anchors.size(), last_step_ = state.last_step, was_restored_ = true;
    if (last_.size() < last_count_) last_.resize(last_count_);
    std::copy(state.anchors.begin(), state.anchors.end(), last_.begin());   // the others keep their memory
  }
  /// Where it sticks.
  void forget() noexcept {
    regions_.clear(), rows_.clear();
    for (auto& forces : forces_) forces.clear();
    last_count_ = 0, last_step_ = 0, was_restored_ = false;
  }

 private:
  using Anchor = typename State::Anchor;
  struct Particle {
    int index;
    Vector position, speed;  // m, m/s: now
    Vector velocity;         // m/s, at the end of the step
    Scalar inverse_mass;     // 1/kg
    Vector force = Vector::Zero();
  };
  static constexpr std::size_t rows = 6, tilt = 1, along = 3, spin = 5;   // across, about two directions along the surface, along these, about the normal
  using Entry = std::array<Vector, rows>;  // force on a vertex by each row's multiplier
  struct Owner {                           // of one side, or of both
    std::vector<Particle> particles;
    std::vector<int> local;                // of each vertex of the body, while it is listed
    std::vector<Scalar> mobility;          // of each pair, where the body states it
    std::vector<Vector> responses;         // of each particle to each row of each region, where the body gives way as a whole
    /// What a particle moves by a row's multiplier of 1 over 1 s, where it is asked there.
    Vector const& response(std::size_t region, std::size_t r, std::size_t i) const noexcept { return responses[(region * rows + r) * particles.size() + i]; }
  };
  struct Row {
    std::array<Scalar, rows> give{}, multiplier{};   // in their units per N s
    std::array<Vector, 2> directions{Vector::Zero(), Vector::Zero()};
    std::array<Scalar, 2> leans{}, bends{};   // about these: the depth's first moment [m⁴], the area's second one [m⁴]
    Scalar stiffness = 0, radius = 0;      // N/m of the region, m
    std::array<Scalar, 2> slip{};          // m
    Scalar turn = 0;                       // rad
    bool turns = false, rubs = false;
    std::size_t used() const noexcept { return rubs ? rows : turns ? along : std::size_t{1}; }
  };

  static std::size_t at(int i) noexcept { return static_cast<std::size_t>(i); }
  Owner& owner(int side) noexcept { return owners_[is_own_ ? 0 : at(side)]; }
  Particle const& of(int side, int vertex) noexcept {
    Owner const& its = owner(side);
    return its.particles[at(its.local[at(vertex)])];
  }
  template <class Visit>
  void for_each_side_of(int number, Visit const& visit) const {
    for (int side = 0; side < 2; ++side)
      if (is_own_ || side == number) visit(side);
  }
  auto entries_of(std::size_t region, int side) noexcept {
    auto const& r = shapes_.regions()[region];
    return std::span(entries_[at(side)]).subspan(r.begin[at(side)], r.end[at(side)] - r.begin[at(side)]);
  }

  /// Normal, middle and the rows of a region.
  void prepare(typename SurfaceIntersection<Scalar>::Region const& region) {
    using Double = Vector3<double>;
    Double normal = Double::Zero();
    std::array<double, 2> weight{};
    std::array<Double, 2> middle{Double::Zero(), Double::Zero()};
    auto const place = [&](int side, int vertex) -> Double { return of(side, vertex).position.template cast<double>(); };
    for (int side = 0; side < 2; ++side)
      for (auto const& [vertex, gradient] : shapes_.gradient(side, region)) {
        Double const g = gradient.template cast<double>();
        if (side == 0) normal += g;
        weight[at(side)] += g.norm(), middle[at(side)] += g.norm() * place(side, vertex);
      }
    std::size_t const n = regions_.size();
    Region& now = regions_.emplace_back();
    Row& row = rows_.emplace_back();
    now.volume = region.volume;
    double const area = normal.norm();
    if (!(area > 0) || !(weight[0] > 0) || !(weight[1] > 0) || !(region.volume > 0)) return;
    normal /= area;
    Double const c = (middle[0] / weight[0] + middle[1] / weight[1]) / 2;
    now.area = static_cast<Scalar>(area), now.point = c.cast<Scalar>(), now.normal = normal.cast<Scalar>();
    row.stiffness = options_.pressure / options_.depth * now.area;
    double spread = 0;
    for (int side = 0; side < 2; ++side)
      for (auto const& [vertex, gradient] : shapes_.gradient(side, region))
        spread += static_cast<double>(gradient.norm()) / weight[at(side)] / 2 * (place(side, vertex) - c).squaredNorm();
    double const radius = std::sqrt(spread);
    row.radius = static_cast<Scalar>(radius);
    Double const u = normal.unitOrthogonal(), v = normal.cross(u);
    row.directions = {Vector(u.cast<Scalar>()), Vector(v.cast<Scalar>())};
    Double const lean = region.volume * (region.middle - c);
    for (std::size_t k = 0; k < 2; ++k) {
      Double const down = normal.cross(k == 0 ? u : v);
      row.leans[k] = static_cast<Scalar>(lean.dot(down)), row.bends[k] = static_cast<Scalar>(down.dot(region.spread * down));
    }
    row.turns = radius > 0, row.rubs = row.turns && options_.friction > 0;
    for (int side = 0; side < 2; ++side) {
      auto const gradients = shapes_.gradient(side, region);
      auto const entries = entries_of(n, side);
      for (std::size_t k = 0; k < entries.size(); ++k) entries[k][0] = -gradients[k].gradient;
      if (!row.turns) continue;
      double const sign = side == 0 ? 1 : -1;
      detail::RigidForces forces(radius);
      auto const share = [&](std::size_t k) { return static_cast<double>(gradients[k].gradient.norm()) / weight[at(side)]; };
      auto const arm = [&](std::size_t k) { return Double(place(side, gradients[k].vertex) - c); };
      for (std::size_t k = 0; k < gradients.size(); ++k) forces.add(share(k), arm(k));
      if (!forces.make(sign * u, sign * v, sign * normal)) row.turns = row.rubs = false;   // hardly more than a point
      for (std::size_t k = 0; k < entries.size(); ++k)
        for (std::size_t r = 1; r < rows; ++r) entries[k][r] = forces.on(r - 1, share(k), arm(k)).template cast<Scalar>();
    }
  }

  /// visit(side, entry, particle) for all vertices of a region.
  template <class Visit>
  void for_each(std::size_t region, Visit const& visit) {
    for (int side = 0; side < 2; ++side) {
      auto const gradients = shapes_.gradient(side, shapes_.regions()[region]);
      auto const entries = entries_of(region, side);
      for (std::size_t k = 0; k < entries.size(); ++k) visit(owner(side), entries[k], at(owner(side).local[at(gradients[k].vertex)]));
    }
  }
  /// How fast a row's own motion becomes, by its multiplier of 1 over 1 s.
  Scalar give(std::size_t region, std::size_t r) {
    Scalar sum = 0;
    for_each(region, [&](Owner const& side, Entry const& entry, std::size_t i) {
      if (!side.responses.empty()) return void(sum += entry[r].dot(side.response(region, r, i)));
      if (side.mobility.empty()) return void(sum += side.particles[i].inverse_mass * entry[r].squaredNorm());
      for_each(region, [&](Owner const& other, Entry const& its, std::size_t j) {
        if (&other == &side) sum += side.mobility[i * side.particles.size() + j] * entry[r].dot(its[r]);
      });
    });
    return sum;
  }
  Scalar rate(std::size_t region, std::size_t r) {
    Scalar sum = 0;
    for_each(region, [&](Owner const& side, Entry const& entry, std::size_t i) { sum += entry[r].dot(side.particles[i].velocity); });
    return sum;
  }
  void change(std::size_t region, std::size_t r, Scalar impulse) {
    for (Owner& side : owners_)
      for (std::size_t i = 0; i < side.particles.size() && !side.responses.empty(); ++i) side.particles[i].velocity += impulse * side.response(region, r, i);
    for_each(region, [&](Owner& side, Entry const& entry, std::size_t i) {
      if (!side.responses.empty()) return;
      if (side.mobility.empty()) return void(side.particles[i].velocity += impulse * side.particles[i].inverse_mass * entry[r]);
      for (std::size_t j = 0; j < side.particles.size(); ++j)
        side.particles[j].velocity += impulse * side.mobility[i * side.particles.size() + j] * entry[r];
    });
  }

  bool find_multipliers(Scalar h) {
    Scalar const ahead = h + options_.settling;
    constexpr Scalar tolerance = std::max(Scalar(1e-12), 8 * std::numeric_limits<Scalar>::epsilon());
    for (int sweep = 0; sweep < 30; ++sweep) {
      Scalar changed = 0, largest = 0;
      for (std::size_t k = 0; k < regions_.size(); ++k) {
        std::size_t const n = sweep % 2 == 0 ? k : regions_.size() - 1 - k;
        Region& now = regions_[n];
        Row& row = rows_[n];
        if (!(now.area > 0)) continue;
        auto const set = [&](std::size_t r, Scalar wanted, Scalar unit) {
          Scalar const more = wanted - row.multiplier[r];
          row.multiplier[r] = wanted;
          if (more != 0) change(n, r, h * more);
          changed = std::max(changed, std::abs(more) * unit), largest = std::max(largest, std::abs(wanted) * unit);
        };
        Scalar const steep = options_.pressure / (options_.depth * now.area);   // Pa/m³
        Scalar const others = rate(n, 0) - h * row.multiplier[0] * row.give[0];
        set(0, std::clamp((steep * static_cast<Scalar>(now.volume - now.spared) - steep * ahead * others) / (1 + steep * ahead * h * row.give[0]), Scalar(0), options_.pressure), now.area);
        if (!row.turns) continue;
        Scalar const fills = static_cast<Scalar>(now.volume - now.spared) / (options_.depth * now.area), tilts = options_.pressure / options_.depth * std::max(Scalar(0), 1 - fills);
        for (std::size_t axis = 0; axis < 2; ++axis) {
          std::size_t const r = tilt + axis;
          Scalar const without = rate(n, r) - h * row.multiplier[r] * row.give[r], reach = std::sqrt(3 * row.bends[axis] / now.area);
          Scalar const wanted = -tilts * (row.leans[axis] + row.bends[axis] * ahead * without) / (1 + tilts * row.bends[axis] * ahead * h * row.give[r]);
          Scalar const most = row.multiplier[0] * now.area * reach;
          set(r, std::clamp(wanted, -most, most), 1 / row.radius);
        }
        if (!row.rubs) continue;
        Scalar const most = options_.friction * row.multiplier[0] * now.area;
        auto const held = [&](std::size_t r, Scalar stiffness, Scalar slip) {
          Scalar const without = rate(n, r) - h * row.multiplier[r] * row.give[r];
          return -stiffness * (slip + ahead * without) / (1 + stiffness * ahead * h * row.give[r]);
        };
        Scalar const one = held(along, row.stiffness, row.slip[0]), two = held(along + 1, row.stiffness, row.slip[1]), size = std::hypot(one, two);
        Scalar const share = size > most ? most / size : Scalar(1);
        now.slips = size > most;
        set(along, share * one, 1), set(along + 1, share * two, 1);
        Scalar const max_turn = most * row.radius * 2 / 3;
        set(spin, std::clamp(held(spin, row.stiffness * row.radius * row.radius, row.turn), -max_turn, max_turn), 1 / row.radius);
      }
      if (!std::isfinite(changed)) return false;
      if (!(changed > tolerance * largest)) break;
    }
    for (std::size_t n = 0; n < regions_.size(); ++n) {
      auto const& m = rows_[n].multiplier;
      regions_[n].pressure = m[0], regions_[n].torsion = m[spin];
      auto const& directions = rows_[n].directions;
      regions_[n].friction = m[along] * directions[0] + m[along + 1] * directions[1], regions_[n].moment = m[tilt] * directions[0] + m[tilt + 1] * directions[1];
      for_each(n, [&](Owner& side, Entry const& entry, std::size_t i) {
        for (std::size_t r = 0; r < rows; ++r) side.particles[i].force += m[r] * entry[r];
      });
    }
    for (Owner const& side : owners_)
      for (Particle const& one : side.particles)
        if (!is_finite(one.force)) return false;
    return true;
  }

  // --- what sticks, from one step to the next ---------------------------------------------------------------------------
  void take(std::size_t n, Anchor& to) const {
    Row const& row = rows_[n];
    to.vertices.clear();
    for (auto const& one : shapes_.gradient(0, shapes_.regions()[n])) to.vertices.push_back(one.vertex);
    to.slip = row.slip[0] * row.directions[0] + row.slip[1] * row.directions[1], to.turn = row.turn;
    Scalar const most = options_.friction * regions_[n].pressure * regions_[n].area;
    to.most = row.stiffness > 0 ? most / row.stiffness : Scalar(0);
    to.max_turn = row.radius > 0 ? to.most * 2 / 3 / row.radius : Scalar(0);
    to.spared = regions_[n].spared, to.presses = regions_[n].volume - to.spared;
  }
  void remember() {
    if (was_restored_) return void(was_restored_ = false);
    held_back_.assign(common_.held_back().begin(), common_.held_back().end());
    last_count_ = regions_.size();
    if (last_.size() < last_count_) last_.resize(last_count_);
    for (std::size_t n = 0; n < last_count_; ++n) take(n, last_[n]);
  }
  /// The anchor of the region of the last step that it has most vertices in common with, and how it moved since.
  void inherit(typename SurfaceIntersection<Scalar>::Region const& region, Row& row) {
    std::size_t const n = regions_.size() - 1;
    Anchor const* from = nullptr;
    std::ptrdiff_t most = 0;
    Scalar turned = 1;   // a body's sheets in itself may have changed places
    double presses = 0, spared = 0;
    for (Anchor const& one : std::span(last_).first(last_count_)) {
      bool is_of_it = false;
      for (int side = 0; side < (is_own_ ? 2 : 1); ++side) {
        auto const gradients = shapes_.gradient(side, region);
        auto const shared = std::count_if(gradients.begin(), gradients.end(),
                                          [&](auto const& g) { return std::binary_search(one.vertices.begin(), one.vertices.end(), g.vertex); });
        if (shared > most) most = shared, from = &one, turned = side == 0 ? Scalar(1) : Scalar(-1);
        is_of_it = is_of_it || shared > 0;
      }
      if (is_of_it) presses += one.presses, spared += one.spared;
    }
    if (is_own_ && !shapes_.is_of_lips(n)) spare(region, row, presses, spared);
    if (from == nullptr || !row.rubs) return;
    std::array<Scalar, rows> moved{};
    for (int side = 0; side < 2; ++side) {
      auto const gradients = shapes_.gradient(side, region);
      auto const entries = entries_of(n, side);
      for (std::size_t k = 0; k < entries.size(); ++k) {
        Vector const v = of(side, gradients[k].vertex).speed;
        for (std::size_t r = along; r < rows; ++r) moved[r] += last_step_ * entries[k][r].dot(v);
      }
    }
    Vector slip = turned * from->slip + moved[along] * row.directions[0] + moved[along + 1] * row.directions[1];
    slip -= slip.dot(regions_[n].normal) * regions_[n].normal;
    if (Scalar const size = slip.norm(); size > from->most) slip *= from->most / size;
    row.slip[0] = slip.dot(row.directions[0]), row.slip[1] = slip.dot(row.directions[1]);
    row.turn = std::clamp(from->turn + moved[spin], -from->max_turn, from->max_turn);
  }

  /// What was held back until now presses from where it is: a body in itself must not be thrown apart by what nothing had worked against.
  void spare(typename SurfaceIntersection<Scalar>::Region const& region, Row& row, double presses, double spared) {
    Region& now = regions_.back();
    if (!(now.volume > 0)) return;
    auto const was_held_back = [&](int side) {
      return std::ranges::any_of(shapes_.gradient(side, region), [&](auto const& g) { return std::binary_search(held_back_.begin(), held_back_.end(), g.vertex); });
    };
    if (!held_back_.empty() && (was_held_back(0) || was_held_back(1))) spared = std::max(spared, now.volume - presses);
    now.spared = std::min(spared, now.volume);
    for (Scalar& lean : row.leans) lean *= static_cast<Scalar>(1 - now.spared / now.volume);
  }

  BodyContactOptions<Scalar> options_;
  SurfaceIntersection<Scalar> common_;
  RegionShapes<Scalar> shapes_;
  std::array<Owner, 2> owners_;
  std::array<std::vector<Entry>, 2> entries_;   // of each side, in the order of its gradient
  std::vector<Region> regions_;
  std::vector<Row> rows_;
  std::vector<Anchor> last_;   // of the last step, so many
  std::vector<int> held_back_; // vertices, in the last step
  std::array<std::vector<std::pair<int, Vector>>, 2> forces_;   // N, on vertices of each body, in the last step
  std::size_t last_count_ = 0;
  Scalar last_step_ = 0;
  bool is_own_, was_restored_ = false, is_solved_ = false;
};

}  // namespace detail

}  // namespace palpate
