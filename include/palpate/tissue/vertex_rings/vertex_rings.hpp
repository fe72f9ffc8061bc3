// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/columns.hpp>
#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/mesh/rings.hpp>
#include <palpate/mesh/triangle_mesh.hpp>
#include <palpate/tissue/skin_body.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace palpate {

/// How far a touched vertex and two rings give way, and how fast.
template <RealScalar Scalar>
struct VertexRingsOptions {
  /// s_0, s_1, s_2 [m/N] of the touched vertex, its first and its second ring, per force on the hand: −1 < s_0 < s_1 < s_2 < 0.
  std::array<Scalar, 3> slopes{};
  Scalar return_time = Scalar(0.01);   ///< τ [s], in which 63 % of a displacement is gone; 0: at once
  void validate() const;
};

/// A surface without masses and links: a force moves the touched vertex and two rings around it, and each vertex hangs on a spring at its home position,
/// which brings it back and renders the force. A body of its own, for a Simulator and its tools as a SoftBody is.
///
///   VertexRings body(make_sphere<double>(0.1, 20), {.slopes = {-5e-3, -2.5e-3, -1e-3}});
///   body.apply_force(body.nearest_vertex(tip), -on_hand);   // N, for the next step
///   body.step(1e-3);                                        // s
///
/// Model      c u_i′ + k u_i = k Σ_j |s_r(i,j)| f_j,   u = x − X, f the forces on the tissue, r(i, j) how many edges are between i and j: 0, 1 or 2.
///            At rest u_i = s_r F with F = −f, the force on the hand. k = −1/s_0: so the touched vertex is where its own spring balances f, and
///            that spring's force, home_force(), is F. c = k τ: without force u fades as e^(−t/τ). A step is this solution, whatever its length.
/// Units      s_r [m/N], k [N/m], c [N·s/m], u [m], f [N]; world frame. The source has no units: with these, its range −1 < s < 0 says k > 1 N/m.
/// Shapes     positions(), velocities(): 3 × size(), one column per vertex, in the order of the mesh. A velocity is the mean of the last step.
/// Errors     InvalidArgument for slopes out of order or range, InvalidMesh for a mesh that is none, OutOfRange for an index; the body stays as it was.
///            A step whose forces would move a vertex 1000 times the body's diagonal is not taken: it reports that it diverged.
/// Source     \cite two_neighborhood2013 eq. 1–3. Errata: m1 > m2 > m3 is printed of negative numbers; it holds for magnitudes, |s_0| > |s_1| > |s_2|. The
///            printed search looks into one leaf and can miss the nearest vertex; SurfaceTree does not. As printed, p ← p + s F adds up tick by tick; here
///            it is where p comes to rest. Ours: the time law, which the source does not give, and that displacements of several forces add up.
/// Cost       apply_force O(two rings), step O(vertices that are away from home), a search O(those · log m) more: whatever the size of the body. Nothing
///            is allocated. A vertex is home, to 1e-7 of an edge, after some 16 τ.
/// Limits     no masses, so no gravity. Vertices do not pull each other: no tension, no volume is kept, and what is farther than two rings from a touch
///            stays at home, however fine the mesh. The middle of a triangle is 3/(1 + 2 s_1/s_0) times as stiff as a vertex. Nothing is cut. A force
///            that pulls the nearest vertex sideways to the tip keeps it the nearest: push along a normal, as ContactCoupling does. Under a rod that
///            lies on many vertices the force trembles where τ is shorter than the step.
template <RealScalar ScalarType>
class VertexRings : public SkinBody<ScalarType> {
  using Base = SkinBody<ScalarType>;

 public:
  using Scalar = ScalarType;
  using Vector = Vector3<Scalar>;
  using Options = VertexRingsOptions<Scalar>;
  using Base::size, Base::tissue;

  struct Report {
    bool diverged = false;   ///< the step was not taken, and its forces are dropped
    int moving = 0;          ///< vertices that are away from home
    int vertex = -1;         ///< the first that diverged
    explicit operator bool() const noexcept { return !diverged; }
  };

  VertexRings(TriangleMesh<Scalar> const& mesh, Options const& options) : Base(mesh, {}), options_(options), neighbours_(mesh) {
    options.validate();
    load_.resize(size());
    last_ring_.assign(at(size()), 0), is_away_.assign(at(size()), 0);
    away_.reserve(at(size()));
  }

  Options const& options() const noexcept { return options_; }
  Scalar home_stiffness() const noexcept { return -1 / options_.slopes[0]; }   // k [N/m]
  /// What the spring at a vertex pulls with [N]: of a touched one at rest, the force on the hand.
  Vector home_force(int i) const { return -home_stiffness() * this->displacement(i); }
  /// The vertices that are away from home, or that a force for the next step will move, in no order.
  std::span<int const> away() const noexcept { return away_; }

  /// A nailed vertex stays at home, and a force on it moves nothing.
  void nail(int i) {
    this->check(i);
    this->mark_nailed(i);
    this->displace(i, Vector::Zero(), Vector::Zero()), load_[i].setZero();
  }

  /// Adds a force on the tissue [N]: constant over the next step, consumed by it.
  void apply_force(int i, Vector const& force) {
    this->check(i), this->check_force(i, force);
    if (tissue().nailed(i)) return;
    for_each_in_rings(i, [&](int j, std::size_t ring) {
      if (tissue().nailed(j)) return;
      load_[j] -= options_.slopes[ring] * force;
      if (!std::exchange(is_away_[at(j)], char{1})) away_.push_back(j);
    });
  }

  /// h ≥ 0.
  Report step(Scalar h) {
    this->check_step(h);
    return move(h, h > 0 ? share_of(h) : Scalar(0));
  }
  /// Moves all to where they would come to rest if the forces applied so far stayed, and consumes these.
  Report solve_statics() { return move(0, Scalar(1)); }

  /// The change of velocity over h [m/s²] to the mean of the next step of h seconds, with the forces applied so far.
  Vector predicted_acceleration(int i, Scalar h) const {
    if (!(h > 0) || tissue().nailed(i)) return Vector::Zero();
    return (share_of(h) / h * (load_[i] - this->displacement(i)) - this->velocities().col(i)) / h;
  }
  /// What a force on vertex j adds to that of vertex i by the newton: 1/kg. See StatesMobility.
  Scalar mobility(int i, int j, Scalar h) const noexcept { return h > 0 ? compliance(i, j) * share_of(h) / (h * h) : Scalar(0); }
  /// How far a force on one vertex moves another at rest [m/N], not negative; the same both ways.
  Scalar compliance(int i, int j) const noexcept {
    if (tissue().nailed(i) || tissue().nailed(j)) return 0;
    if (i == j) return -options_.slopes[0];
    auto const is_beside = [&](int a) { return std::binary_search(neighbours_[a].begin(), neighbours_[a].end(), j); };
    if (is_beside(i)) return -options_.slopes[1];
    auto const around = neighbours_[i];
    return std::any_of(around.begin(), around.end(), is_beside) ? -options_.slopes[2] : Scalar(0);
  }

  /// Everything that makes the body's future: what is away from home, forces for the next step, nails.
  struct State {
    struct Vertex {
      int index;
      Vector displacement, velocity, load;
    };
    std::vector<Vertex> away;
    typename Base::SkinState skin;
  };
  State save() const {
    State state{{}, this->save_skin()};
    for (int const i : away_) state.away.push_back({i, this->displacement(i), this->velocities().col(i), load_[i]});
    return state;
  }
  void restore(State const& state) {
    this->require_own(state.skin);
    reset();
    this->restore_skin(state.skin);
    for (auto const& vertex : state.away) {
      away_.push_back(vertex.index), is_away_[at(vertex.index)] = 1;
      this->displace(vertex.index, vertex.displacement, vertex.velocity), load_[vertex.index] = vertex.load;
    }
  }
  /// All home, and no force waits. Nails stay.
  void reset() noexcept {
    for (int const i : away_) this->displace(i, Vector::Zero(), Vector::Zero()), load_[i].setZero(), is_away_[at(i)] = 0;
    away_.clear();
  }

 private:
  using Base::at;

  /// How much of the way to where its forces push it a vertex goes in h seconds.
  Scalar share_of(Scalar h) const noexcept { return options_.return_time > 0 ? -std::expm1(-h / options_.return_time) : Scalar(1); }

  /// visit(vertex, ring) for the touched vertex and those of its two rings, once each.
  template <class Visit>
  void for_each_in_rings(int touched, Visit const& visit) noexcept {
    ++ring_count_;
    last_ring_[at(touched)] = ring_count_;
    visit(touched, 0);
    auto const first = neighbours_[touched];
    for (int const i : first) last_ring_[at(i)] = ring_count_, visit(i, 1);
    for (int const i : first)
      for (int const j : neighbours_[i])
        if (std::exchange(last_ring_[at(j)], ring_count_) != ring_count_) visit(j, 2);
  }

  /// Each vertex that is away goes this share of its way, in h seconds or at once.
  Report move(Scalar h, Scalar share) noexcept {
    Scalar const most = 1000 * this->home_diagonal();   // m
    for (int const i : away_)
      if (!(load_[i].norm() < most)) {
        for (int const j : away_) load_[j].setZero();
        return {true, static_cast<int>(away_.size()), i};
      }
    std::size_t kept = 0;
    for (std::size_t k = 0; k < away_.size(); ++k) {
      int const i = away_[k];
      Vector const target = load_[i], from = this->displacement(i), way = share * (target - from), u = from + way;
      bool const is_pushed = target != Vector::Zero();
      load_[i].setZero();
      if (is_pushed || !(u.norm() < relaxed * this->mean_edge())) {
        this->displace(i, u, h > 0 ? Vector(way / h) : Vector(Vector::Zero()));
        away_[kept++] = i;
      } else {
        this->displace(i, Vector::Zero(), Vector::Zero());
        is_away_[at(i)] = 0;
      }
    }
    away_.resize(kept);
    return {false, static_cast<int>(kept), -1};
  }

  static constexpr Scalar relaxed = Scalar(1e-7);   // of a mean edge: nearer than that is home

  Options options_;
  VertexNeighbours neighbours_;
  Columns<Scalar, 3> load_;                // m, where the forces for the next step push to
  std::vector<int> away_;
  std::vector<char> is_away_;
  std::vector<std::uint64_t> last_ring_;   // which count reached each vertex last
  std::uint64_t ring_count_ = 0;
};

template <RealScalar Scalar>
VertexRings(TriangleMesh<Scalar> const&, VertexRingsOptions<Scalar> const&) -> VertexRings<Scalar>;

template <RealScalar Scalar>
void VertexRingsOptions<Scalar>::validate() const {
  for (std::size_t r = 0; r < 3; ++r) {
    if (!(slopes[r] > -1 && slopes[r] < 0))
      throw InvalidArgument(detail::message("VertexRings: slope ", r, " is ", slopes[r],
                                            " m/N; give a number between -1 and 0: the tissue gives way against the force on the hand"));
    if (r > 0 && !(slopes[r] > slopes[r - 1]))
      throw InvalidArgument(detail::message("VertexRings: slope ", r, " is ", slopes[r], " m/N, and slope ", r - 1, " is ", slopes[r - 1],
                                            " m/N; give |s_0| > |s_1| > |s_2|: what is farther from the touch moves less"));
  }
  detail::require_non_negative("VertexRings: return_time", return_time, "s");
}

}  // namespace palpate
