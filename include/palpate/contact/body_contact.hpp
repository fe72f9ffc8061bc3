// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/concept.hpp>
#include <palpate/collision/surface_intersection.hpp>
#include <palpate/contact/free_motion.hpp>
#include <palpate/contact/rigid_forces.hpp>
#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/mesh/surface_topology.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <limits>
#include <span>
#include <vector>

namespace palpate {

/// How two bodies press each other.
template <RealScalar Scalar>
struct BodyContactOptions {
  Scalar pressure = Scalar(1e4);     ///< Pa, where they are deep in one another; about Young's modulus of the softer one
  Scalar depth = Scalar(3e-3);       ///< m: a region of this mean depth has that pressure; one less deep, in proportion
  Scalar settling = Scalar(2e-3);    ///< s: the speed at which they close counts as the depth that it makes in this time
  Scalar friction = Scalar(0.3);     ///< Coulomb

  void validate() const {
    detail::OptionCheck const check{"BodyContact"};
    check.positive(".pressure", static_cast<double>(pressure), " Pa");
    check.positive(".depth", static_cast<double>(depth), " m");
    check.not_negative(".settling", static_cast<double>(settling), " s");
    check.not_negative(".friction", static_cast<double>(friction));
  }
};

/// The contact of two bodies, of any tissue: where they are in one another they press, and rub.
///
///   BodyContact contact(liver, kidney, {.friction = 0.4});
///   contact.apply(liver, kidney, 1e-3), liver.step(1e-3), kidney.step(1e-3);   // each tick
///
/// Pressure   of a region, a volume V that the bodies have in common, at the end of the step,
///              p = k min(1, (d + (h + τ) ḋ)/δ),   0 ≤ p,   d = V/A,   A = |Σ ∂V/∂x_i| over one side,   f_i = −p ∂V/∂x_i.
///            k is `pressure`, δ `depth`, τ `settling`. Deep in one another the force is −k ∂V/∂x; a body that rests is in by δ times the share of k that
///            bears it. V and its gradient are exact, see SurfaceIntersection: the forces on both sides balance, and so do their moments.
/// Moment     where a region is deeper at one side, its pressure is p + (k/δ) s·(x − c), as far as p < k: of that only the moment about c acts, (k/δ)(1 − d/δ) M × n with
///            M = ∫ (x − c) dV, on both sides as rigid motions take it, at the end of the step too. So a face that lies flat on another does not lean until it is out.
/// Friction   a spring along the surface, and one against spinning, as stiff as the region is across: k A/δ. It sticks up to friction · p A, and
///            2/3 of that times the region's radius; then its anchor is dragged along. So nothing creeps. Each side moves as the rigid motion that fits its vertices best, by area, says,
///            and takes force and moment about one point: these balance too.
/// Stability  pressures and frictions of all regions are found together, each with what the bodies give way to it, as at the end of the step: any k is stable. Explicit
///            bodies give way as 1/m says, implicit ones as their whole stiffness does.
/// Units      m, N, Pa, s; world frame.
/// Errors     InvalidArgument for options, for a step that is not positive, and for one body twice; InvalidMesh for a body whose surface is open as the contact is made.
/// Cost       that of SurfaceIntersection, and O(vertices that it moves) a sweep, at most 30; of an implicit body, while it is touched, a solution as a step takes, and
///            six more for each region. Allocates until its memory has the size that is needed, and after edits.
/// Limits     both surfaces are closed, and do not cross themselves. A body that is in the other without crossing its skin is not seen. The pressure's energy is exact
///            while A stays: where a region grows as it is pressed and shrinks as it is let go, on other ways, that is what is not; the damping is to be more than
///            that. Bodies come to rest where k/δ is at most some 2 E/l, E the softer one's modulus and l its edge; stiffer contacts tremble.
/// Source     \cite deformable_survey, tissue–tissue collision: from the contour inwards, non-linear penalty, friction. Ours: the exact volume and its gradient, the end
///            of the step, stick springs.
template <SimulatedBody First, SimulatedBody Second>
class BodyContact {
  static_assert(SearchableBody<First> && SearchableBody<Second>, "BodyContact: a body needs visit_triangles_in_box; see SearchableBody.");
  static_assert(std::same_as<typename First::Scalar, typename Second::Scalar>, "BodyContact: both bodies compute in one scalar.");

 public:
  using Scalar = typename First::Scalar;
  using Vector = Vector3<Scalar>;
  using Options = BodyContactOptions<Scalar>;

  /// What happens in one place.
  struct Region {
    double volume = 0;                   ///< m³ in common
    Scalar area = 0, pressure = 0;       ///< m², across the normal; Pa
    Vector point = Vector::Zero();       ///< m, its middle
    Vector normal = Vector::UnitZ();     ///< from the first body into the second
    Vector friction = Vector::Zero();    ///< N, on the first
    Vector moment = Vector::Zero();      ///< N m, on the first, along the surface: where it is deeper at one side
    Scalar torsion = 0;                  ///< N m, on the first about the normal
    bool slips = false;
  };

  BodyContact(First const& first, Second const& second, Options const& options = {}) : options_((options.validate(), options)) {
    require_closed("first", first), require_closed("second", second);
    reset(first, second);
  }

  Options const& options() const noexcept { return options_; }
  std::span<Region const> regions() const noexcept { return regions_; }
  /// Of the last apply(), on the first body [N]; on the second one the opposite acts.
  Vector force() const noexcept {
    Vector sum = Vector::Zero();
    for (Region const& one : regions_) sum += one.friction - one.pressure * one.area * one.normal;
    return sum;
  }
  SurfaceIntersection<Scalar> const& intersection() const noexcept { return common_; }

  /// Adds the contact's forces to both bodies for their next step of h seconds.
  void apply(First& first, Second& second, Scalar h) {
    detail::require_positive("BodyContact: a step", h, "s");
    if (static_cast<void const*>(&first) == static_cast<void const*>(&second)) throw InvalidArgument("BodyContact: both are one body; give two");
    if (restorations_ != std::array{first.restorations(), second.restorations()}) reset(first, second);
    remember();
    common_.find(Skin<First>{first.tissue().surface(), first.positions(), first}, Skin<Second>{second.tissue().surface(), second.positions(), second});
    regions_.clear(), rows_.clear();
    gather(sides_[0], 0, first, first_motion_, h), gather(sides_[1], 1, second, second_motion_, h);
    for (auto const& region : common_.regions()) {
      prepare(region, first, second);
      if (last_step_ > 0) inherit(region, rows_.back(), first, second);
    }
    respond(sides_[0], 0, first_motion_), respond(sides_[1], 1, second_motion_);
    for (std::size_t n = 0; n < rows_.size(); ++n)
      for (std::size_t r = 0; r < rows; ++r) rows_[n].give[r] = give(n, r);
    bool const is_solved = solve(h);
    push(first, sides_[0], 0, is_solved), push(second, sides_[1], 1, is_solved);
    last_step_ = h;
  }

  /// The anchors of friction: with the bodies' states, all that its future is made of.
  struct Anchor {
    std::vector<int> vertices;            // of the first body, ascending
    Vector slip = Vector::Zero();         // m, of the first body's side against the second's since it holds
    Scalar turn = 0, most = 0, most_turn = 0;   // rad; as far as friction holds
  };
  struct State {
    std::vector<Anchor> anchors;
    Scalar last_step = 0;
  };
  State save() const {
    if (was_restored_) return {{last_.begin(), last_.begin() + static_cast<std::ptrdiff_t>(last_count_)}, last_step_};
    State state{.anchors = std::vector<Anchor>(regions_.size()), .last_step = last_step_};
    for (std::size_t n = 0; n < regions_.size(); ++n) take(n, state.anchors[n]);
    return state;
  }
  /// After both bodies were restored.
  void restore(State const& state, First const& first, Second const& second) {
    reset(first, second);
    last_ = state.anchors, last_count_ = last_.size(), last_step_ = state.last_step, was_restored_ = true;
  }
  /// Forgets where it sticks.
  void reset(First const& first, Second const& second) {
    restorations_ = {first.restorations(), second.restorations()};
    regions_.clear(), rows_.clear();
    last_count_ = 0, last_step_ = 0, was_restored_ = false;
  }

 private:
  template <class Body>
  struct Skin {   // as SurfaceIntersection wants it
    SurfaceTopology const& topology;
    typename SurfaceTree<Scalar>::Points points;
    Body& body;

    template <class Visit>
    void visit_triangles_in_box(Vector const& low, Vector const& high, Visit&& visit) {
      body.visit_triangles_in_box(low, high, visit);
    }
  };
  struct Particle {
    int index;
    Vector velocity;         // m/s, at the end of the step
    Scalar inverse_mass;     // 1/kg
    Vector force = Vector::Zero();
  };
  static constexpr std::size_t rows = 6, tilt = 1, along = 3, spin = 5;   // across, about two directions along the surface, along these, about the normal
  using Entry = std::array<Vector, rows>;  // force on a vertex by each row's multiplier
  struct Side {
    std::vector<Particle> particles;
    std::vector<int> local;                // of each vertex of the body, while it is listed
    std::vector<Entry> entries;            // in the order of the gradient
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
  auto entries_of(std::size_t region, int side) noexcept {
    auto const& r = common_.regions()[region];
    return std::span(sides_[at(side)].entries).subspan(r.begin[at(side)], r.end[at(side)] - r.begin[at(side)]);
  }

  template <class Body>
  static void require_closed(char const* which, Body const& body) {
    auto const& surface = body.tissue().surface();
    for (int t = 0; t < surface.triangle_count(); ++t) {
      auto const c = surface.corners(t);
      for (std::size_t k = 0; k < 3; ++k)
        if (int const a = c[k], b = c[(k + 1) % 3]; body.triangle_across(a, b) < 0)
          throw InvalidMesh(detail::message("BodyContact: the surface of the ", which, " body is open at the edge of vertices ", a, " and ", b, "; give a closed one, or a solid"));
    }
  }
  /// The vertices of a side, with the velocities that they will have without the contact.
  template <class Body>
  void gather(Side& side, int which, Body const& body, detail::FreeMotion<Body>& motion, Scalar h) {
    if (common_.touches()) motion.begin(body, h);
    side.local.resize(std::max(side.local.size(), static_cast<std::size_t>(body.positions().cols())), -1);
    side.particles.clear(), side.mobility.clear();
    auto const gradient = common_.gradient(which);
    side.entries.assign(gradient.size(), Entry{Vector::Zero(), Vector::Zero(), Vector::Zero(), Vector::Zero()});
    for (auto const& one : gradient)
      if (side.local[at(one.vertex)] < 0) {
        side.local[at(one.vertex)] = static_cast<int>(side.particles.size());
        side.particles.push_back({.index = one.vertex, .velocity = motion.velocity(body, one.vertex, h), .inverse_mass = detail::own_mobility(body, one.vertex, h)});
      }
    if constexpr (StatesMobility<Body>)
      for (Particle const& a : side.particles)
        for (Particle const& b : side.particles) side.mobility.push_back(body.mobility(a.index, b.index, h));
  }

  /// Normal, middle and the rows of a region.
  void prepare(typename SurfaceIntersection<Scalar>::Region const& region, First const& first, Second const& second) {
    using Double = Vector3<double>;
    Double normal = Double::Zero();
    std::array<double, 2> weight{};
    std::array<Double, 2> middle{Double::Zero(), Double::Zero()};
    auto const place = [&](int side, int vertex) -> Double {
      return Vector(side == 0 ? Vector(first.positions().col(vertex)) : Vector(second.positions().col(vertex))).template cast<double>();
    };
    for (int side = 0; side < 2; ++side)
      for (auto const& [vertex, gradient] : common_.gradient(side, region)) {
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
      for (auto const& [vertex, gradient] : common_.gradient(side, region))
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
      auto const gradients = common_.gradient(side, region);
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
  /// How all particles of a side that gives way as a whole move by each row.
  template <class Body>
  void respond(Side& side, int which, detail::FreeMotion<Body>& motion) {
    side.responses.clear();
    if constexpr (detail::FreeMotion<Body>::solves) {
      std::size_t const count = side.particles.size();
      side.responses.resize(rows_.size() * rows * count);
      for (std::size_t n = 0; n < rows_.size(); ++n)
        for (std::size_t r = 0; r < rows_[n].used(); ++r)
          motion.respond(
              [&](auto const& add) {
                auto const gradients = common_.gradient(which, common_.regions()[n]);
                auto const entries = entries_of(n, which);
                for (std::size_t k = 0; k < entries.size(); ++k) add(gradients[k].vertex, entries[k][r]);
              },
              [&](std::size_t i) { return side.particles[i].index; }, std::span(side.responses).subspan((n * rows + r) * count, count));
    }
  }

  /// visit(side, entry, particle) for all vertices of a region.
  template <class Visit>
  void for_each(std::size_t region, Visit const& visit) {
    for (int side = 0; side < 2; ++side) {
      auto const gradients = common_.gradient(side, common_.regions()[region]);
      auto const entries = entries_of(region, side);
      for (std::size_t k = 0; k < entries.size(); ++k) visit(sides_[at(side)], entries[k], at(sides_[at(side)].local[at(gradients[k].vertex)]));
    }
  }
  /// How fast a row's own motion becomes, by its multiplier of 1 over 1 s.
  Scalar give(std::size_t region, std::size_t r) {
    Scalar sum = 0;
    for_each(region, [&](Side const& side, Entry const& entry, std::size_t i) {
      if (!side.responses.empty()) return void(sum += entry[r].dot(side.response(region, r, i)));
      if (side.mobility.empty()) return void(sum += side.particles[i].inverse_mass * entry[r].squaredNorm());
      for_each(region, [&](Side const& other, Entry const& its, std::size_t j) {
        if (&other == &side) sum += side.mobility[i * side.particles.size() + j] * entry[r].dot(its[r]);
      });
    });
    return sum;
  }
  Scalar rate(std::size_t region, std::size_t r) {
    Scalar sum = 0;
    for_each(region, [&](Side const& side, Entry const& entry, std::size_t i) { sum += entry[r].dot(side.particles[i].velocity); });
    return sum;
  }
  void change(std::size_t region, std::size_t r, Scalar impulse) {
    for (Side& side : sides_)
      for (std::size_t i = 0; i < side.particles.size() && !side.responses.empty(); ++i) side.particles[i].velocity += impulse * side.response(region, r, i);
    for_each(region, [&](Side& side, Entry const& entry, std::size_t i) {
      if (!side.responses.empty()) return;
      if (side.mobility.empty()) return void(side.particles[i].velocity += impulse * side.particles[i].inverse_mass * entry[r]);
      for (std::size_t j = 0; j < side.particles.size(); ++j)
        side.particles[j].velocity += impulse * side.mobility[i * side.particles.size() + j] * entry[r];
    });
  }

  /// All regions, one after the other, until nothing changes. False where that fails, or there is none.
  bool solve(Scalar h) {
    if (regions_.empty()) return false;
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
        set(0, std::clamp((steep * static_cast<Scalar>(now.volume) - steep * ahead * others) / (1 + steep * ahead * h * row.give[0]), Scalar(0), options_.pressure), now.area);
        if (!row.turns) continue;
        Scalar const fills = static_cast<Scalar>(now.volume) / (options_.depth * now.area), tilts = options_.pressure / options_.depth * std::max(Scalar(0), 1 - fills);
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
        Scalar const most_turn = most * row.radius * 2 / 3;
        set(spin, std::clamp(held(spin, row.stiffness * row.radius * row.radius, row.turn), -most_turn, most_turn), 1 / row.radius);
      }
      if (!std::isfinite(changed)) return (regions_.clear(), rows_.clear(), false);
      if (!(changed > tolerance * largest)) break;
    }
    for (std::size_t n = 0; n < regions_.size(); ++n) {
      auto const& m = rows_[n].multiplier;
      regions_[n].pressure = m[0], regions_[n].torsion = m[spin];
      auto const& directions = rows_[n].directions;
      regions_[n].friction = m[along] * directions[0] + m[along + 1] * directions[1], regions_[n].moment = m[tilt] * directions[0] + m[tilt + 1] * directions[1];
      for_each(n, [&](Side& side, Entry const& entry, std::size_t i) {
        for (std::size_t r = 0; r < rows; ++r) side.particles[i].force += m[r] * entry[r];
      });
    }
    for (Side const& side : sides_)
      for (Particle const& one : side.particles)
        if (!is_finite(one.force)) return (regions_.clear(), rows_.clear(), false);
    return true;
  }
  template <class Body>
  void push(Body& body, Side& side, int which, bool is_solved) {
    for (Particle const& one : side.particles)
      if (is_solved && !is_zero(one.force)) body.apply_force(one.index, one.force);
    for (auto const& one : common_.gradient(which)) side.local[at(one.vertex)] = -1;
  }

  // --- what sticks, from one step to the next ---------------------------------------------------------------------------
  void take(std::size_t n, Anchor& to) const {
    Row const& row = rows_[n];
    to.vertices.clear();
    for (auto const& one : common_.gradient(0, common_.regions()[n])) to.vertices.push_back(one.vertex);
    to.slip = row.slip[0] * row.directions[0] + row.slip[1] * row.directions[1], to.turn = row.turn;
    Scalar const most = options_.friction * regions_[n].pressure * regions_[n].area;
    to.most = row.stiffness > 0 ? most / row.stiffness : Scalar(0);
    to.most_turn = row.radius > 0 ? to.most * 2 / 3 / row.radius : Scalar(0);
  }
  void remember() {
    if (was_restored_) return void(was_restored_ = false);
    last_count_ = regions_.size();
    if (last_.size() < last_count_) last_.resize(last_count_);
    for (std::size_t n = 0; n < last_count_; ++n) take(n, last_[n]);
  }
  /// The anchor of the region of the last step that it has most vertices in common with, and how it moved since.
  void inherit(typename SurfaceIntersection<Scalar>::Region const& region, Row& row, First const& first, Second const& second) {
    std::size_t const n = regions_.size() - 1;
    Anchor const* from = nullptr;
    std::ptrdiff_t most = 0;
    for (Anchor const& one : std::span(last_).first(last_count_)) {
      auto const gradients = common_.gradient(0, region);
      auto const shared = std::count_if(gradients.begin(), gradients.end(),
                                        [&](auto const& g) { return std::binary_search(one.vertices.begin(), one.vertices.end(), g.vertex); });
      if (shared > most) most = shared, from = &one;
    }
    if (from == nullptr || !row.rubs) return;
    std::array<Scalar, rows> moved{};
    for (int side = 0; side < 2; ++side) {
      auto const gradients = common_.gradient(side, region);
      auto const entries = entries_of(n, side);
      for (std::size_t k = 0; k < entries.size(); ++k) {
        Vector const v = side == 0 ? Vector(first.velocities().col(gradients[k].vertex)) : Vector(second.velocities().col(gradients[k].vertex));
        for (std::size_t r = along; r < rows; ++r) moved[r] += last_step_ * entries[k][r].dot(v);
      }
    }
    Vector slip = from->slip + moved[along] * row.directions[0] + moved[along + 1] * row.directions[1];
    slip -= slip.dot(regions_[n].normal) * regions_[n].normal;
    if (Scalar const size = slip.norm(); size > from->most) slip *= from->most / size;
    row.slip[0] = slip.dot(row.directions[0]), row.slip[1] = slip.dot(row.directions[1]);
    row.turn = std::clamp(from->turn + moved[spin], -from->most_turn, from->most_turn);
  }

  Options options_;
  SurfaceIntersection<Scalar> common_;
  detail::FreeMotion<First> first_motion_;
  detail::FreeMotion<Second> second_motion_;
  std::array<Side, 2> sides_;
  std::vector<Region> regions_;
  std::vector<Row> rows_;
  std::vector<Anchor> last_;   // of the last step, so many
  std::size_t last_count_ = 0;
  std::array<std::size_t, 2> restorations_{};
  Scalar last_step_ = 0;
  bool was_restored_ = false;
};

template <SimulatedBody First, SimulatedBody Second>
BodyContact(First const&, Second const&, BodyContactOptions<typename First::Scalar> const&) -> BodyContact<First, Second>;

}  // namespace palpate
