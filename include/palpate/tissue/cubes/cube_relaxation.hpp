// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/columns.hpp>
#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/core/random.hpp>
#include <palpate/core/visit_order.hpp>
#include <palpate/mesh/triangle_mesh.hpp>
#include <palpate/tissue/cubes/cube_mesh.hpp>
#include <palpate/tissue/cubes/cubes_options.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

namespace palpate::detail {

/// Springs of cubes, masses for gravity, and the relaxation of what they pull. Of a vertex that hangs, what pulls it pulls its leaders.
template <RealScalar ScalarType>
class CubeRelaxation : public CubeMesh<ScalarType> {
  using Base = CubeMesh<ScalarType>;

 public:
  using typename Base::Scalar, typename Base::Vector;
  using Options = CubesOptions<Scalar>;
  using Base::size, Base::cubes;

  struct Report {
    bool diverged = false;   ///< the step was not taken, and its forces are dropped
    bool at_rest = false;    ///< nothing moves any more
    int moving = 0;          ///< vertices that the last sweep moved
    int sweeps = 0;
    int visits = 0;          ///< of vertices
    explicit operator bool() const noexcept { return !diverged; }
  };

  Options const& options() const noexcept { return options_; }

  Vector const& gravity() const noexcept { return gravity_; }
  void set_gravity(Vector const& gravity) {
    require_finite("gravity", gravity, "m/s²");
    gravity_ = gravity, is_quiet_ = false;
  }
  Scalar mass(int i) const { return (this->check(i), mass_[at(i)]); }   // kg, for gravity alone
  /// A nailed vertex of unsplit cubes stays where it rests.
  void nail(int i) {
    check_own(i, "nailed");
    this->mark_nailed(i);
    this->displace(i, Vector::Zero());
    for_each_follower(i, [&](int h, Scalar) { follow(h); });
    this->nail_between();
    is_quiet_ = pieces_are_known_ = false;
  }
  /// A spring from a vertex of unsplit cubes to where it rests (anchor spring, the source's nail) [N/m].
  void support(int i, Scalar stiffness) {
    check_own(i, "supported");
    require_non_negative("the stiffness of a home spring", stiffness, "N/m");
    support_[at(i)] = stiffness;
    refresh(i), is_quiet_ = pieces_are_known_ = false;
  }

  /// Adds a force on the tissue [N]: constant over the next step, consumed by it.
  void apply_force(int i, Vector const& force) {
    this->check(i), this->check_force(i, force);
    if (this->tissue().nailed(i)) return;
    if (!std::exchange(is_loaded_[at(i)], char{1})) loaded_.push_back(i);
    load_[i] += force;
  }
  /// Moves all to where they come to rest if the forces applied so far stay, and consumes these. Nothing is split or joined. `tolerance`: the largest move of a
  /// sweep as a share of an edge.
  Report solve_statics(Scalar tolerance = std::max(Scalar(1e-12), 4 * std::numeric_limits<Scalar>::epsilon()), int most = 100000) {
    is_quiet_ = false;
    return relax(most, std::numeric_limits<double>::infinity(), 0, tolerance, true);
  }

  /// The change of velocity over h [m/s²] to the mean of the next step of h seconds, with the forces applied so far.
  Vector predicted_acceleration(int i, Scalar h) const {
    this->check(i);
    if (!(h > 0) || this->tissue().nailed(i)) return Vector::Zero();
    Vector moved = Vector::Zero();   // by what forces are more than in the last step
    for_each_leader(i, [&](int m, Scalar w) {
      Vector more = Vector(load_[m]) - Vector(pushed_[m]);
      for_each_follower(m, [&](int k, Scalar share) { more += share * load_[k]; });
      moved += w * give(m) * more;
    });
    return (moved / h - v_[i]) / h;
  }
  /// What a force on vertex j adds to that of i by the newton: 1/kg. See StatesMobility.
  Scalar mobility(int i, int j, Scalar h) const noexcept {
    Scalar sum = 0;
    if (h > 0 && !this->tissue().nailed(i) && !this->tissue().nailed(j))
      for_each_leader(i, [&](int m, Scalar w) { for_each_leader(j, [&](int n, Scalar other) { sum += m == n ? w * other * give(m) : Scalar(0); }); });
    return h > 0 ? sum / (h * h) : Scalar(0);
  }

  /// What still pulls a vertex: springs, gravity, home spring, forces for the next step, and of what hangs on it [N]. Zero where it hangs, or is nailed.
  Vector net_force(int i) const { return (this->check(i), is_free(i) ? force_on(i) : Vector(Vector::Zero())); }
  /// Of springs and home springs [J].
  Scalar elastic_energy() const noexcept {
    Scalar sum = 0;
    for (std::size_t l = 0; l < leaves_.size(); ++l) {
      if (l < at(cubes()) && slot_[l] >= 0) continue;
      auto const& leaf = leaves_[l];
      for (int a = 0; a < 8; ++a)
        for (Spring const& spring : springs_[at(leaf.level)][at(a)]) {   // each is seen from both ends
          Scalar const longer = Vector(spring.along + u_[leaf.corner[at(spring.to)]] - u_[leaf.corner[at(a)]]).norm() - spring.length;
          sum += spring.stiffness / 4 * longer * longer;
        }
    }
    for (int i = 0; i < base_; ++i) sum += support_[at(i)] / 2 * Vector(u_[i]).squaredNorm();
    return sum;
  }

 protected:
  using Base::at, Base::rest_, Base::x_, Base::u_, Base::v_, Base::grid_, Base::base_, Base::parts_, Base::around_, Base::leaves_, Base::hang_, Base::slot_, Base::fine_,
      Base::for_each_leader, Base::for_each_follower;
  static constexpr Scalar quiet = std::max(Scalar(1e-8), 8 * std::numeric_limits<Scalar>::epsilon());   // of an edge in a sweep

  CubeRelaxation(TriangleMesh<Scalar> const& surface, Options const& options)
      : Base(surface, (options.validate(), options.edge), options.levels, options.touched_cubes), options_(options), random_(options.seed) {
    for (std::size_t level = 0; level < 2; ++level) {
      Scalar const s = edges_[level] = level == 0 ? options_.edge : options_.edge / Scalar(parts_);
      for (int from = 0; from < 8; ++from)
        for (int r = 1; r < 8; ++r) {
          Vector const way = s * direction(from, from ^ r);
          Scalar const length = (1 - options_.pretension) * way.norm();
          springs_[level][at(from)][at(r - 1)] = {
              way, (std::has_single_bit(unsigned(r)) ? Scalar(0.14) : Scalar(0.12)) * options_.young * s, length, way.squaredNorm() - length * length, from ^ r};
        }
    }
    begin();
  }

  void check_own(int i, char const* what) const {
    this->check(i);
    if (i < base_) return;
    throw InvalidArgument(message("vertex ", i, " goes when its cube is joined; only the first ", base_, " vertices can be ", what));
  }

  /// After build(): nothing pulls, and nothing has been touched.
  void begin() {
    int const most = this->max_vertices();
    for (Columns<Scalar, 3>* columns : {&load_, &pushed_, &before_}) columns->resize(0), columns->reserve(most);
    mass_.clear(), k_.clear(), seen_.clear(), is_loaded_.clear(), loaded_.clear(), touched_.clear();
    mass_.reserve(at(most)), k_.reserve(at(most)), seen_.reserve(at(most)), is_loaded_.reserve(at(most));
    loaded_.reserve(at(most)), touched_.reserve(at(most)), order_.reserve(at(most)), ring_end_.reserve(at(most));
    support_.assign(at(base_), 0);
    resize();
    for (int v = 0; v < base_; ++v) refresh(v);
    is_free_cube_.reserve(at(cubes())), queue_.reserve(at(cubes()));
    begin_order();
    is_quiet_ = pieces_are_known_ = false, largest_ = 1;
  }
  /// These cubes are split, ascending, and no others.
  void refine(std::vector<int> const& split) {
    give_loads_to_corners();
    Base::refine(split);
    auto const is_fine = [&](int i) { return i >= base_; };
    std::erase_if(loaded_, is_fine), std::erase_if(touched_, is_fine);
    resize();
    for (auto const* list : {&this->last_fine_, &fine_})
      for (int const c : list->cubes)
        for (int const v : grid_.corners(c)) refresh(v);
    for (int v = base_; v < size(); ++v) refresh(v);
    begin_order();
    is_quiet_ = false;
  }

  /// Forces on vertices of split cubes, which may go, to the corners of the cubes, by trilinear weights.
  void give_loads_to_corners() {
    for (std::size_t n = 0, all = loaded_.size(); n < all; ++n) {
      int const i = loaded_[n];
      if (i < base_) continue;
      Vector const load = load_[i];
      for (int const corner : grid_.corners(cube_at(i))) {
        Scalar const share = (1 - (rest_[i] - rest_[corner]).cwiseAbs().array() / options_.edge).max(Scalar(0)).prod();
        if (share > 0) apply_force(corner, share * load);
      }
      load_[i].setZero(), is_loaded_[at(i)] = 0;
    }
    std::erase_if(loaded_, [&](int i) { return is_loaded_[at(i)] == 0; });
  }
  /// Which pieces nothing holds: gravity leaves them alone.
  void find_pieces() {
    if (pieces_are_known_) return;
    pieces_are_known_ = true, has_free_pieces_ = false;
    is_free_cube_.assign(at(cubes()), 1);
    queue_.clear();
    for (int c = 0; c < cubes(); ++c)
      for (int const v : grid_.corners(c))
        if (this->tissue().nailed(v) || support_[at(v)] > 0)
          if (std::exchange(is_free_cube_[at(c)], char{0})) queue_.push_back(c);
    for (std::size_t n = 0; n < queue_.size(); ++n)
      for (int side = 0; side < 6; ++side)
        if (int const next = grid_.linked(queue_[n], side); next >= 0 && std::exchange(is_free_cube_[at(next)], char{0})) queue_.push_back(next);
    has_free_pieces_ = queue_.size() < at(cubes());
  }
  /// A cube at a vertex, the last one.
  int cube_at(int i) const noexcept { return this->cube_of_leaf(*std::max_element(around_[at(i)].begin(), around_[at(i)].end())); }
  bool is_weightless(int i) const noexcept { return is_free_cube_[at(cube_at(i))] != 0; }

  /// k_i and m_i of a vertex, as cubes and followers around it are.
  void refresh(int i) noexcept {
    mass_[at(i)] = 0;
    for (int const leaf : around_[at(i)])
      if (leaf >= 0) {
        Scalar const s = edges_[at(leaves_[at(leaf)].level)];
        mass_[at(i)] += options_.density * s * s * s / 8;
      }
    if (i >= base_ && hang_[at(i)].count > 0) return;
    Eigen::Matrix<Scalar, 3, 3> sum = stiffness_at(i);
    if (i < base_) {
      sum.diagonal().array() += support_[at(i)];
      for_each_follower(i, [&](int h, Scalar w) { sum += w * w * stiffness_at(h); });
    }
    k_[at(i)] = sum.cwiseAbs().rowwise().sum().maxCoeff();
  }
  /// Σ k n nᵀ of the springs at a vertex, at rest.
  Eigen::Matrix<Scalar, 3, 3> stiffness_at(int i) const noexcept {
    Eigen::Matrix<Scalar, 3, 3> sum = Eigen::Matrix<Scalar, 3, 3>::Zero();
    for (int o = 0; o < 8; ++o)
      if (int const leaf = around_[at(i)][at(o)]; leaf >= 0)
        for (Spring const& spring : springs_[at(leaves_[at(leaf)].level)][at(7 ^ o)])
          sum += spring.stiffness / spring.along.squaredNorm() * spring.along * spring.along.transpose();
    return sum;
  }
  /// Of one vertex's own springs, gravity and forces. `longer`: plus the stiffness of those springs that are far longer than at rest, N/m.
  Vector own_force(int i, Scalar& longer) const noexcept {
    Vector force = load_[i];
    if (!has_free_pieces_ || !is_weightless(i)) force += mass_[at(i)] * gravity_;
    Vector const here = u_[i];
    if (i < base_) force -= support_[at(i)] * here;
    for (int o = 0; o < 8; ++o) {
      int const l = around_[at(i)][at(o)];
      if (l < 0) continue;
      auto const& leaf = leaves_[at(l)];
      for (Spring const& spring : springs_[at(leaf.level)][at(7 ^ o)]) {
        Vector const moved = u_[leaf.corner[at(spring.to)]] - here, d = spring.along + moved;
        Scalar const length = d.norm();
        if (length > Scalar(1.5) * spring.length && moved.squaredNorm() > spring.longer_squared) longer += spring.stiffness;
        // k (|d| − L)/|d|, without loss of digits where both are nearly the same
        if (length > 0) force += spring.stiffness * (spring.longer_squared + (spring.along + d).dot(moved)) / (length * (length + spring.length)) * d;
      }
    }
    return force;
  }
  Vector force_on(int i) const noexcept {
    Scalar longer = 0;
    return force_on(i, longer);
  }
  Vector force_on(int i, Scalar& longer) const noexcept {
    Vector force = own_force(i, longer);
    for_each_follower(i, [&](int h, Scalar w) {
      Scalar longer_there = 0;
      force += w * own_force(h, longer_there), longer += w * w * longer_there;
    });
    return force;
  }
  void follow(int i) noexcept {
    if (this->tissue().nailed(i)) return;
    Vector u = Vector::Zero();
    for_each_leader(i, [&](int m, Scalar w) { u += w * u_[m]; });
    this->displace(i, u);
  }
  /// Returns how far it went, in edges.
  Scalar visit(int i) noexcept {
    Scalar longer = 0;
    Vector const force = force_on(i, longer), move = options_.relaxation / (k_[at(i)] + longer) * force;   // long springs resist a move across them too
    this->displace(i, u_[i] + move);
    for_each_follower(i, [&](int h, Scalar) { follow(h); });
    ++visits_;
    Scalar const far = move.norm() / options_.edge;
    if (far > quiet) ++moving_;
    return far;
  }

  struct Budget {
    double end;
    bool is_limited, is_spent = false;
    bool ask(double (*clock)(), int visits) {
      if (is_limited && visits % 64 == 63) is_spent = clock() >= end;
      return is_spent;
    }
  };

  Report relax(int sweeps, double seconds, Scalar per_second, Scalar tolerance, bool wants_rest) {
    bool const is_limited = std::isfinite(seconds);
    Budget budget{is_limited ? options_.clock() + seconds : 0, is_limited};
    Report report;
    if (!loaded_.empty() && touched_ != loaded_) touched_ = loaded_, begin_order();   // relaxation begins at the forces
    bool const is_loaded = !loaded_.empty();
    if (is_quiet_ && !is_loaded && !was_loaded_) {
      v_.view().setZero();
      report.at_rest = true;
      return report;
    }
    find_pieces();
    was_loaded_ = is_loaded;
    wants_rest = wants_rest || !is_loaded;   // under a tool that stays, what is near it is looked at, and the rest now and then
    before_ = u_;
    visits_ = 0, is_quiet_ = false;
    for (; report.sweeps < sweeps && !is_quiet_ && !budget.is_spent; ++report.sweeps) {
      bool const to_the_end = options_.order != VisitOrder::breadth_first || sweep_ % 8 == 7 || (wants_rest && !(largest_ > tolerance));
      moving_ = 0, ++sweep_;
      if (options_.order == VisitOrder::random) shuffle(std::span(order_), random_);
      largest_ = sweep_rings(to_the_end, budget);
      if (!std::isfinite(largest_)) break;
      is_quiet_ = to_the_end && !budget.is_spent && largest_ <= tolerance;
      if (!wants_rest && largest_ <= tolerance) break;
    }
    report.visits = visits_, report.moving = is_quiet_ ? 0 : std::max(moving_, 1), report.at_rest = is_quiet_;
    report.diverged = !(u_.view().cwiseAbs().maxCoeff() < 1000 * this->diagonal_);
    if (report.diverged) {
      for (int i = 0; i < size(); ++i) this->displace(i, before_[i]);
      largest_ = 1, is_quiet_ = false;
    }
    v_.view() = per_second * (u_.view() - before_.view());
    pushed_.view().setZero();
    for (int const i : loaded_) {
      Vector const load = load_[i];
      if (!report.diverged) for_each_leader(i, [&](int m, Scalar w) { pushed_[m] += w * load; });
      load_[i].setZero(), is_loaded_[at(i)] = 0;
    }
    loaded_.clear();
    return report;
  }
  void begin_order() noexcept {
    order_.clear(), ring_end_.clear();
    ++seen_count_, expanded_ = 0, unseen_from_ = 0;
    if (options_.order == VisitOrder::breadth_first)
      for (int const i : touched_) see(i);
    else   // one ring of all
      for (; unseen_from_ < size(); ++unseen_from_, ++expanded_) see(unseen_from_);
    if (!order_.empty()) ring_end_.push_back(static_cast<int>(order_.size()));
  }
  void see(int i) noexcept {
    if (std::exchange(seen_[at(i)], seen_count_) != seen_count_) order_.push_back(i);
  }
  /// One more ring of vertices, or where none is left, one of another piece; false where all are seen.
  bool add_ring() noexcept {
    auto const begin = order_.size();
    for (; expanded_ < begin; ++expanded_) {
      int const i = order_[expanded_];
      auto const see_around = [&](int v) {
        for (int const leaf : around_[at(v)])
          if (leaf >= 0)
            for (int const k : leaves_[at(leaf)].corner) see(k);
      };
      see_around(i);
      for_each_leader(i, [&](int m, Scalar) { see(m); });
      for_each_follower(i, [&](int h, Scalar) { see_around(h); });
    }
    for (; order_.size() == begin && unseen_from_ < size(); ++unseen_from_) see(unseen_from_);
    if (order_.size() == begin) return false;
    ring_end_.push_back(static_cast<int>(order_.size()));
    return true;
  }
  Scalar sweep_rings(bool to_the_end, Budget& budget) noexcept {
    Scalar largest = 0;
    std::size_t n = 0;
    for (std::size_t ring = 0; ring < ring_end_.size() || add_ring(); ++ring) {
      Scalar largest_here = 0;
      int const visits = visits_;
      for (; n < at(ring_end_[ring]); ++n)
        if (is_free(order_[n])) {
          if (Scalar const far = visit(order_[n]); !(far <= largest_here)) largest_here = far;
          if (budget.ask(options_.clock, visits_)) return std::max(largest, largest_here);
        }
      if (!(largest_here <= largest)) largest = largest_here;
      if (!to_the_end && visits_ > visits && !(largest_here > largest / 100)) break;
    }
    return largest;
  }

  Options options_;
  Columns<Scalar, 3> load_, pushed_;          // N, for the next step and of the last one
  std::vector<Scalar> support_;               // N/m, of each vertex of unsplit cubes
  std::vector<int> loaded_, touched_;         // vertices with a force, now and when there last was one
  std::vector<int> order_;                    // in which vertices are visited
  std::vector<char> is_loaded_;
  int sweep_ = 0;
  Vector gravity_ = Vector::Zero();           // m/s²
  Random random_;
  Scalar largest_ = 1;                        // move of the last sweep, in edges
  bool is_quiet_ = false, was_loaded_ = false, pieces_are_known_ = false, has_free_pieces_ = false;

 private:
  static constexpr Scalar response = 6;   // of a step, in 1/k_i: for vertices that are pushed together; alone one gives less, see test_cubes
  struct Spring {
    Vector along;                                // m, in the rest shape
    Scalar stiffness, length, longer_squared;    // N/m, m, m²: along² − length²
    int to;                                      // corner
  };

  Scalar give(int m) const noexcept { return this->tissue().nailed(m) ? Scalar(0) : response / k_[at(m)]; }   // m/N
  bool is_free(int i) const noexcept { return hang_[at(i)].count == 0 && !this->tissue().nailed(i); }
  static Vector direction(int from, int to) noexcept {
    return Vector(Scalar((to & 1) - (from & 1)), Scalar((to >> 1 & 1) - (from >> 1 & 1)), Scalar((to >> 2) - (from >> 2)));
  }

  /// What a vertex has, of all there are now: those of split cubes begin anew.
  void resize() {
    for (int const n : {base_, size()}) {
      for (Columns<Scalar, 3>* columns : {&load_, &pushed_, &before_}) columns->resize(n);
      mass_.resize(at(n)), k_.resize(at(n)), seen_.resize(at(n)), is_loaded_.resize(at(n));
    }
  }

  std::array<std::array<std::array<Spring, 7>, 8>, 2> springs_;   // of a cube, unsplit and split, from each of its corners
  std::array<Scalar, 2> edges_{};                                 // m, of cubes unsplit and split
  Columns<Scalar, 3> before_;                                     // m, as a step began
  std::vector<Scalar> mass_, k_;                                  // kg, N/m
  std::vector<char> is_free_cube_;                                // of each cube: in a piece that nothing holds
  std::vector<int> queue_;
  std::vector<std::uint64_t> seen_;
  std::uint64_t seen_count_ = 0;
  std::vector<int> ring_end_;   // in that order
  std::size_t expanded_ = 0;
  int unseen_from_ = 0, visits_ = 0, moving_ = 0;
};

}  // namespace palpate::detail
