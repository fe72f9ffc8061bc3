// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/collision/surface_tree.hpp>
#include <palpate/core/columns.hpp>
#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/mesh/measures.hpp>
#include <palpate/mesh/normals.hpp>
#include <palpate/mesh/rings.hpp>
#include <palpate/mesh/surface_topology.hpp>
#include <palpate/mesh/triangle_mesh.hpp>
#include <palpate/mesh/validation.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
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
/// Source     \cite ahmad2013 eq. 1–3. Errata: m1 > m2 > m3 is printed of negative numbers; it holds for magnitudes, |s_0| > |s_1| > |s_2|. The printed
///            search looks into one leaf and can miss the nearest vertex; SurfaceTree does not. As printed, p ← p + s F adds up tick by tick; here it is
///            where p comes to rest. Ours: the time law, which the source does not give, and that displacements of several forces add up.
/// Cost       apply_force O(two rings), step O(vertices that are away from home), a search O(those · log m) more: whatever the size of the body. Nothing
///            is allocated. A vertex is home, to 1e-7 of an edge, after some 16 τ.
/// Limits     no masses, so no gravity. Vertices do not pull each other: no tension, no volume is kept, and what is farther than two rings from a touch
///            stays at home, however fine the mesh. The middle of a triangle is 3/(1 + 2 s_1/s_0) times as stiff as a vertex. Nothing is cut. A force
///            that pulls the nearest vertex sideways to the tip keeps it the nearest: push along a normal, as ContactCoupling does. Under a rod that
///            lies on many vertices the force trembles where τ is shorter than the step.
/// Threads    one thread at a time; searches fit the tree to what has moved.
template <RealScalar ScalarType>
class VertexRings {
 public:
  using Scalar = ScalarType;
  using Vector = Vector3<Scalar>;
  using Options = VertexRingsOptions<Scalar>;

  /// What tools ask of the tissue of any body.
  class Skin {
   public:
    SurfaceTopology const& surface() const noexcept { return surface_; }
    std::size_t revision() const noexcept { return revision_; }
    bool nailed(int i) const noexcept { return nailed_[static_cast<std::size_t>(i)] != 0; }

   private:
    friend VertexRings;
    SurfaceTopology surface_;
    std::vector<char> nailed_;
    std::size_t revision_ = 0;
  };

  struct Report {
    bool diverged = false;   ///< the step was not taken, and its forces are dropped
    int moving = 0;          ///< vertices that are away from home
    int vertex = -1;         ///< the first that diverged
    explicit operator bool() const noexcept { return !diverged; }
  };

  VertexRings(TriangleMesh<Scalar> const& mesh, Options const& options) : options_(options), neighbours_(checked(mesh, options)), tree_(mesh) {
    auto const n = at(static_cast<int>(mesh.points.cols()));
    skin_.surface_ = SurfaceTopology(static_cast<int>(n), mesh.triangles);
    skin_.nailed_.assign(n, 0);
    for (Columns<Scalar, 3>* columns : {&rest_, &x_}) *columns = Columns<Scalar, 3>(mesh.points);
    for (Columns<Scalar, 3>* columns : {&u_, &v_, &load_}) columns->resize(static_cast<int>(n));
    normal_ = Columns<Scalar, 3>(vertex_normals(mesh));
    mean_edge_ = mean_edge_length(mesh);
    auto const [low, high] = low_and_high(mesh.points);
    diagonal_ = Vector(high - low).norm();
    last_ring_.assign(n, 0), is_away_.assign(n, 0), is_unfitted_.assign(n, 0);
    away_.reserve(n), unfitted_.reserve(n);
  }

  // --- what it is ---------------------------------------------------------------------------------------------------
  Options const& options() const noexcept { return options_; }
  Skin const& tissue() const noexcept { return skin_; }
  int size() const noexcept { return x_.size(); }
  auto positions() const noexcept { return x_.view(); }
  auto velocities() const noexcept { return v_.view(); }
  auto triangles() const noexcept { return skin_.surface_.triangles(); }
  TriangleMesh<Scalar> mesh() const { return {x_.view(), triangles()}; }        // a copy
  TriangleMesh<Scalar> rest_mesh() const { return {rest_.view(), triangles()}; }   // a copy
  Scalar mean_edge() const noexcept { return mean_edge_; }                      // m, at rest
  Scalar home_diagonal() const noexcept { return diagonal_; }                   // m, of the bounding box at rest
  Vector reference_position(int i) const { return (check(i), rest_[i]); }
  Vector reference_normal(int i) const { return (check(i), normal_[i]); }
  Vector displacement(int i) const { return (check(i), u_[i]); }   // m
  Scalar home_stiffness() const noexcept { return -1 / options_.slopes[0]; }   // k [N/m]
  /// What the spring at a vertex pulls with [N]: of a touched one at rest, the force on the hand.
  Vector home_force(int i) const { return (check(i), -home_stiffness() * u_[i]); }
  /// The vertices that are away from home, or that a force for the next step will move, in no order.
  std::span<int const> away() const noexcept { return away_; }

  /// A nailed vertex stays at home, and a force on it moves nothing.
  void nail(int i) {
    check(i);
    skin_.nailed_[at(i)] = 1, ++skin_.revision_;
    set(i, Vector::Zero(), Vector::Zero()), load_[i].setZero();
  }
  bool is_held(int i) const { return (check(i), false); }

  // --- where a tool is nearest, on the body as it is now ---------------------------------------------------------------
  /// The nearest vertex, the lowest index among equals; −1 for a point that is not finite. A triangle that is likely near saves time.
  int nearest_vertex(Vector const& point, int hint = -1) noexcept {
    fit_tree();
    return tree_.nearest_vertex(x_.view(), point, hint);
  }
  SurfacePoint<Scalar> nearest_point(Vector const& point, int hint = -1) noexcept {
    fit_tree();
    return tree_.nearest(x_.view(), point, hint);
  }
  /// Calls visit(triangle) for all triangles that may meet a box [m], and some beside them.
  template <class Visit>
  void visit_triangles_in_box(Vector const& low, Vector const& high, Visit&& visit) {
    fit_tree();
    tree_.visit_in_box(low, high, visit);
  }
  int triangle_across(int a, int b) const noexcept { return skin_.surface_.triangle_with_edge(b, a); }
  std::size_t topology_revision() const noexcept { return 0; }

  // --- how it moves -------------------------------------------------------------------------------------------------
  /// Adds a force on the tissue [N]: constant over the next step, consumed by it.
  void apply_force(int i, Vector const& force) {
    check(i);
    if (!is_finite(force))
      throw InvalidArgument(detail::message("the force on vertex ", i, " is (", force[0], ", ", force[1], ", ", force[2], "); it must be finite"));
    if (skin_.nailed(i)) return;
    for_each_in_rings(i, [&](int j, std::size_t ring) {
      if (skin_.nailed(j)) return;
      load_[j] -= options_.slopes[ring] * force;
      if (!std::exchange(is_away_[at(j)], char{1})) away_.push_back(j);
    });
  }

  /// h ≥ 0.
  Report step(Scalar h) {
    if (!(h >= 0) || !std::isfinite(h)) throw InvalidArgument(detail::message("a step of ", h, " s; it must be finite and not negative"));
    return move(h, h > 0 ? share_of(h) : Scalar(0));
  }
  /// Moves all to where they would come to rest if the forces applied so far stayed, and consumes these.
  Report solve_statics() { return move(0, Scalar(1)); }

  /// Any step is stable.
  Scalar stable_step() const noexcept { return std::numeric_limits<Scalar>::infinity(); }
  Scalar guaranteed_stable_step() const noexcept { return stable_step(); }
  bool stable_step_fell() const noexcept { return false; }

  /// The change of velocity over h [m/s²] to the mean of the next step of h seconds, with the forces applied so far.
  Vector predicted_acceleration(int i, Scalar h) const {
    check(i);
    if (!(h > 0) || skin_.nailed(i)) return Vector::Zero();
    return (share_of(h) / h * (load_[i] - u_[i]) - v_[i]) / h;
  }
  /// What a force on vertex j adds to that of vertex i by the newton: 1/kg. See StatesMobility.
  Scalar mobility(int i, int j, Scalar h) const noexcept { return h > 0 ? compliance(i, j) * share_of(h) / (h * h) : Scalar(0); }
  /// How far a force on one vertex moves another at rest [m/N], not negative; the same both ways.
  Scalar compliance(int i, int j) const noexcept {
    if (skin_.nailed(i) || skin_.nailed(j)) return 0;
    if (i == j) return -options_.slopes[0];
    auto const is_beside = [&](int a) { return std::binary_search(neighbours_[a].begin(), neighbours_[a].end(), j); };
    if (is_beside(i)) return -options_.slopes[1];
    auto const around = neighbours_[i];
    return std::any_of(around.begin(), around.end(), is_beside) ? -options_.slopes[2] : Scalar(0);
  }

  // --- save and restore -----------------------------------------------------------------------------------------------
  /// Everything that makes the body's future: what is away from home, forces for the next step, nails.
  struct State {
    struct Vertex {
      int index;
      Vector displacement, velocity, load;
    };
    std::vector<Vertex> away;
    std::vector<char> nailed;
    std::size_t revision;
  };
  State save() const {
    State state{{}, skin_.nailed_, skin_.revision_};
    for (int const i : away_) state.away.push_back({i, u_[i], v_[i], load_[i]});
    return state;
  }
  void restore(State const& state) {
    reset();
    skin_.nailed_ = state.nailed, skin_.revision_ = state.revision;
    for (auto const& vertex : state.away) {
      away_.push_back(vertex.index), is_away_[at(vertex.index)] = 1;
      set(vertex.index, vertex.displacement, vertex.velocity), load_[vertex.index] = vertex.load;
    }
    ++restorations_;
  }
  std::size_t restorations() const noexcept { return restorations_; }
  /// All home, and no force waits. Nails stay.
  void reset() noexcept {
    for (int const i : away_) set(i, Vector::Zero(), Vector::Zero()), load_[i].setZero(), is_away_[at(i)] = 0;
    away_.clear();
  }

  // --- for a renderer -------------------------------------------------------------------------------------------------
  template <class Values>
  void draw_columns(Values const& values, Matrix3X<Scalar>& to) const {
    to = values;
  }
  void draw_triangles(Matrix<int, 3, Dynamic>& to) const { to = triangles(); }

 private:
  static std::size_t at(int i) noexcept { return static_cast<std::size_t>(i); }
  void check(int i) const { detail::check_index("vertex", i, size()); }
  static TriangleMesh<Scalar> const& checked(TriangleMesh<Scalar> const& mesh, Options const& options) {
    options.validate(), require_valid(mesh);
    return mesh;
  }

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

  void set(int i, Vector const& u, Vector const& v) noexcept {
    u_[i] = u, v_[i] = v;
    x_[i] = rest_[i] + u;
    if (!std::exchange(is_unfitted_[at(i)], char{1})) unfitted_.push_back(i);
  }

  /// Each vertex that is away goes this share of its way, in h seconds or at once.
  Report move(Scalar h, Scalar share) noexcept {
    Scalar const most = 1000 * diagonal_;   // m
    for (int const i : away_)
      if (!(load_[i].norm() < most)) {
        for (int const j : away_) load_[j].setZero();
        return {true, static_cast<int>(away_.size()), i};
      }
    std::size_t kept = 0;
    for (std::size_t k = 0; k < away_.size(); ++k) {
      int const i = away_[k];
      Vector const target = load_[i], way = share * (target - u_[i]), u = u_[i] + way;
      bool const is_pushed = target != Vector::Zero();
      load_[i].setZero();
      if (is_pushed || !(u.norm() < relaxed * mean_edge_)) {
        set(i, u, h > 0 ? Vector(way / h) : Vector(Vector::Zero()));
        away_[kept++] = i;
      } else {
        set(i, Vector::Zero(), Vector::Zero());
        is_away_[at(i)] = 0;
      }
    }
    away_.resize(kept);
    return {false, static_cast<int>(kept), -1};
  }

  /// Fits the boxes of the triangles at what has moved; of several corners that have, the lowest asks for it.
  void fit_tree() noexcept {
    auto const x = x_.view();
    for (int const i : unfitted_)
      for (int const t : skin_.surface_.triangles_at(i)) {
        auto const corners = skin_.surface_.corners(t);
        if (std::none_of(corners.begin(), corners.end(), [&](int c) { return c < i && is_unfitted_[at(c)] != 0; })) tree_.refit(x, std::span(&t, 1));
      }
    for (int const i : unfitted_) is_unfitted_[at(i)] = 0;
    unfitted_.clear();
  }

  static constexpr Scalar relaxed = Scalar(1e-7);   // of a mean edge: nearer than that is home

  Options options_;
  VertexNeighbours neighbours_;
  SurfaceTree<Scalar> tree_;
  Skin skin_;
  Columns<Scalar, 3> rest_, normal_, x_, u_, v_;   // m, 1, m, m, m/s
  Columns<Scalar, 3> load_;                        // m, where the forces for the next step push to
  std::vector<int> away_, unfitted_;               // of the tree: moved since it was fitted
  std::vector<char> is_away_, is_unfitted_;
  std::vector<std::uint64_t> last_ring_;           // which count reached each vertex last
  std::uint64_t ring_count_ = 0;
  Scalar mean_edge_ = 0, diagonal_ = 0;            // m
  std::size_t restorations_ = 0;
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
  if (!(return_time >= 0) || !std::isfinite(return_time))
    throw InvalidArgument(detail::message("VertexRings: return_time is ", return_time, " s; give a finite number, 0 for a return at once"));
}

}  // namespace palpate
