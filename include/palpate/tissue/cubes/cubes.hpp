// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/collision/closest_point.hpp>
#include <palpate/collision/surface_tree.hpp>
#include <palpate/core/columns.hpp>
#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/core/random.hpp>
#include <palpate/mesh/surface_topology.hpp>
#include <palpate/mesh/triangle_mesh.hpp>
#include <palpate/statics/local_relaxation.hpp>
#include <palpate/tissue/cubes/cube_grid.hpp>

#include <Eigen/Geometry>

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

namespace palpate {

/// What a body of cubes is made of, and how it is relaxed.
template <RealScalar Scalar>
struct CubesOptions {
  Scalar edge{};                       ///< of a cube [m]
  Scalar young{};                      ///< Young's modulus [Pa]; Poisson's ratio is 1/4
  Scalar density = 1000;               ///< kg/m³
  Scalar pretension = 0;               ///< by which share springs are shorter than their spacing: a cut gapes
  int levels = 0;                      ///< how often a touched cube is split, each time in 8: 0 … 4
  int join_after = 100;                ///< steps after the last touch; then it is one cube again
  int touched_cubes = 8;               ///< so many split at once allocate nothing
  VisitOrder order = VisitOrder::breadth_first;
  Scalar relaxation = Scalar(1.2);     ///< α, above 0 and below 2
  int sweeps = 6;                      ///< of a step
  double seconds = std::numeric_limits<double>::infinity();   ///< of a step at most, by `clock`
  double (*clock)() = LocalRelaxation::steady_seconds;        ///< s; not asked where there is no limit
  Seed seed{1};                        ///< of the random order
  void validate() const;
};

/// Which vertices of a face get a force that acts on it.
enum class TouchSpread {
  nearest_vertex,   ///< all on one
  face_corners,     ///< on four, by distance: bilinear weights, so that force and moment are those of the touched point
};

/// A solid of cubes that share vertices, with springs along their edges and diagonals, brought towards rest by local relaxation: static, no inertia. The touched cube
/// is split and joined again; a cut detaches cubes from each other. A body of its own, for a Simulator and its tools as a SoftBody is.
///
///   Cubes body(make_organ<double>({.vertices = 2000}), {.edge = 0.01, .young = 5000.0, .levels = 1});
///   body.nail(0);
///   body.apply_force(body.nearest_vertex(tip), force);   // N, for the next step
///   body.step(1e-3);                                     // s
///   body.cut(from, to, from_now, to_now);                // m, a blade's edge that went from one place to another
///
/// Cubes      those of a grid whose middle is inside the surface, 3 × 3 × 3 points for 2 × 2 × 2 of them, no vertex twice. Touched, a cube becomes 8^levels: a force on
///            three of its vertices, as a tool's on a triangle of its skin, splits it after the step, and it is joined `join_after` steps after the last.
/// Springs    of each cube of edge s: 12 edges of 0.14 E s, 12 face and 4 space diagonals of 0.12 E s [N/m]; where cubes share two vertices theirs add up. From
///            C_ijkl = Σ k L² n_i n_j n_k n_l / s³: isotropic, λ = μ = 2 E/5, for small strains.
/// Hanging    a vertex in the middle of a larger cube's edge or face is where the mean of its 2 or 4 corners is, by distance, and what pulls it pulls
///            these by the same weights: no gap, and a uniform strain passes unchanged from large cubes to small ones.
/// Solution   x_i ← x_i + α F_i / k_i, one vertex after the other, F_i = Σ g_ij + f_i + m_i g − home spring, k_i a bound of ∂F_i/∂x_i in the rest shape:
///            converges for α < 2 there; where tissue is pulled out far, for α < 2/3 always. Breadth first begins at the touched vertices; a sweep ends where
///            little is left to do, every eighth goes through the body.
/// Contact    predicted_acceleration() and mobility() are those of a body that gives 3/k_i per newton in a step and rests where last step's forces left it.
/// Units      m, N, Pa, kg/m³, s.
/// Shapes     positions(), velocities(): 3 × size(), vertices inside too. Those of unsplit cubes come first and keep their numbers; what a cut copies and a split
///            adds follows. Of the skin, triangles 2 f and 2 f + 1 begin the face f of an unsplit cube, whatever it is split into; the rest follows.
/// Errors     InvalidArgument for options and values, InvalidMesh for a surface that is open or holds no cube, OutOfRange for an index; the body stays as it was.
///            A step after which something is not finite is not taken: it reports that it diverged.
/// Source     \cite haaland. Errata: the static condition is printed Σg − f = 0; the algorithm's Σg + f is right. Ours: stiffness from Young's modulus, hanging vertices,
///            detaching across the blade alone, joining.
/// Cost       a visit of a vertex 56 springs. A split or join O(split cubes · 8^levels), no allocation up to touched_cubes of them; a cut that opens faces
///            O(cubes), and allocates.
/// Limits     Poisson's ratio 1/4. Smooth surfaces become steps of a cube. A split cube is split all through, its faces open as one. Vertices of split cubes can not be
///            nailed by themselves: they are where all corners around them are. A load on many vertices by apply_force() touches.
template <RealScalar ScalarType>
class Cubes {
 public:
  using Scalar = ScalarType;
  using Vector = Vector3<Scalar>;
  using Options = CubesOptions<Scalar>;

  /// What tools ask of the tissue of any body.
  class Skin {
   public:
    SurfaceTopology const& surface() const noexcept { return surface_; }
    std::size_t revision() const noexcept { return revision_; }
    bool nailed(int i) const noexcept { return nailed_[static_cast<std::size_t>(i)] != 0; }

   private:
    friend Cubes;
    SurfaceTopology surface_;
    std::vector<char> nailed_;
    std::size_t revision_ = 0;
  };

  struct Report {
    bool diverged = false;   ///< the step was not taken, and its forces are dropped
    bool at_rest = false;    ///< nothing moves any more
    int moving = 0;          ///< vertices that the last sweep moved
    int sweeps = 0;
    int visits = 0;          ///< of vertices
    explicit operator bool() const noexcept { return !diverged; }
  };

  Cubes(TriangleMesh<Scalar> const& mesh, Options const& options)
      : options_(options), grid_(mesh, checked(options)), parts_(1 << options.levels), random_(options.seed) {
    for (std::size_t level = 0; level < 2; ++level) {
      Scalar const s = edges_[level] = level == 0 ? options.edge : options.edge / Scalar(parts_);
      for (int from = 0; from < 8; ++from)
        for (int r = 1; r < 8; ++r) {
          Vector const way = s * direction(from, from ^ r);
          Scalar const length = (1 - options.pretension) * way.norm();
          springs_[level][at(from)][at(r - 1)] = {
              way, (std::has_single_bit(unsigned(r)) ? Scalar(0.14) : Scalar(0.12)) * options.young * s, length, way.squaredNorm() - length * length, from ^ r};
        }
    }
    auto const [low, high] = low_and_high(mesh.points);
    diagonal_ = Vector(high - low).norm();
    build();
  }

  // --- what it is ---------------------------------------------------------------------------------------------------
  Options const& options() const noexcept { return options_; }
  Skin const& tissue() const noexcept { return skin_; }
  int size() const noexcept { return x_.size(); }
  auto positions() const noexcept { return x_.view(); }
  auto velocities() const noexcept { return v_.view(); }
  auto triangles() const noexcept { return skin_.surface_.triangles(); }
  TriangleMesh<Scalar> mesh() const { return {x_.view(), triangles()}; }           // a copy; vertices inside have no triangle
  TriangleMesh<Scalar> rest_mesh() const { return {rest_.view(), triangles()}; }   // a copy
  Scalar mean_edge() const noexcept { return options_.edge; }
  Scalar home_diagonal() const noexcept { return diagonal_; }   // m, of the surface's bounding box
  Vector reference_position(int i) const { return (check(i), rest_[i]); }
  Vector reference_normal(int i) const {
    check(i);
    Vector sum = Vector::Zero();
    for (int const t : skin_.surface_.triangles_at(i)) {
      auto const c = skin_.surface_.corners(t);
      sum += Vector(rest_[c[1]] - rest_[c[0]]).cross(Vector(rest_[c[2]] - rest_[c[0]]));
    }
    return sum.stableNormalized();
  }
  Vector displacement(int i) const { return (check(i), u_[i]); }   // m
  bool is_held(int i) const { return (check(i), false); }

  int cubes() const noexcept { return grid_.size(); }   // unsplit ones
  int leaves() const noexcept { return grid_.size() + static_cast<int>(fine_.cubes.size()) * (parts_ * parts_ * parts_ - 1); }
  Scalar volume() const noexcept { return Scalar(cubes()) * options_.edge * options_.edge * options_.edge; }   // m³, at rest
  /// Corner 4 z + 2 y + x of an unsplit cube.
  std::array<int, 8> const& corners(int cube) const { return (check_cube(cube), grid_.corners(cube)); }
  bool is_split(int cube) const { return (check_cube(cube), slot_[at(cube)] >= 0); }
  /// Whether a larger cube's edge or face leads this vertex.
  bool hangs(int i) const { return (check(i), hang_[at(i)].count > 0); }
  /// Which cube a triangle of the skin belongs to.
  int cube_of(int triangle) const { return (detail::check_index("triangle", triangle, skin_.surface_.triangle_count()), faces_[at(face_of(triangle))].cube); }
  /// Faces between two cubes that cuts have opened.
  int opened_faces() const noexcept {
    int sides = 0;
    for (auto const bits : grid_.opened()) sides += std::popcount(bits);
    return sides / 2;
  }

  Vector const& gravity() const noexcept { return gravity_; }
  void set_gravity(Vector const& gravity) {
    check_finite("gravity", gravity, "m/s²");
    gravity_ = gravity, is_quiet_ = false;
  }
  Scalar mass(int i) const { return (check(i), mass_[at(i)]); }   // kg, for gravity alone
  /// A nailed vertex of unsplit cubes stays where it rests.
  void nail(int i) {
    check_own(i, "nailed");
    skin_.nailed_[at(i)] = 1, ++skin_.revision_;
    move_to(i, Vector::Zero());
    for_each_follower(i, [&](int h, Scalar) { follow(h); });
    for (std::size_t slot = 0; slot < fine_.cubes.size(); ++slot)
      for (int p = 0; p < points(); ++p) nail_fine(fine_.cubes[slot], p, fine_.vertex[slot * at(points()) + at(p)]);
    is_quiet_ = false;
  }
  /// A spring from a vertex of unsplit cubes to where it rests (anchor spring, the source's nail) [N/m].
  void support(int i, Scalar stiffness) {
    check_own(i, "supported");
    detail::require_non_negative("the stiffness of a home spring", stiffness, "N/m");
    support_[at(i)] = stiffness;
    refresh(i), is_quiet_ = false;
  }

  // --- where a tool is nearest, on the body as it is now ---------------------------------------------------------------
  /// The nearest vertex of the skin, the lowest index among equals; −1 for a point that is not finite. A triangle that is likely near saves time.
  int nearest_vertex(Vector const& point, int hint = -1) noexcept { return (fit_tree(), tree_.nearest_vertex(x_.view(), point, hint)); }
  SurfacePoint<Scalar> nearest_point(Vector const& point, int hint = -1) noexcept { return (fit_tree(), tree_.nearest(x_.view(), point, hint)); }
  /// Calls visit(triangle) for all triangles that may meet a box [m], and some beside them.
  template <class Visit>
  void visit_triangles_in_box(Vector const& low, Vector const& high, Visit&& visit) {
    fit_tree();
    tree_.visit_in_box(low, high, visit);
  }
  /// The same as nearest_point by the source's way: depth first through the octree of cubes. Fits it first, to all cubes, where the body has moved.
  SurfacePoint<Scalar> nearest_point_in_octree(Vector const& point);
  int triangle_across(int a, int b) const noexcept { return skin_.surface_.triangle_with_edge(b, a); }
  std::size_t topology_revision() const noexcept { return topology_revision_; }
  std::size_t renumberings() const noexcept { return renumberings_ + restorations_; }

  // --- how it moves -------------------------------------------------------------------------------------------------
  /// Adds a force on the tissue [N]: constant over the next step, consumed by it.
  void apply_force(int i, Vector const& force) {
    check(i);
    check_finite("the force on a vertex", force, "N");
    if (skin_.nailed(i)) return;
    if (!std::exchange(is_loaded_[at(i)], char{1})) loaded_.push_back(i);
    load_[i] += force;
  }
  /// The same at a point of the skin, on vertices of the face there; the cube counts as touched.
  void apply_force_at(SurfacePoint<Scalar> const& touched, Vector const& force, TouchSpread spread = TouchSpread::face_corners);

  /// h ≥ 0.
  Report step(Scalar h) {
    if (!(h >= 0) || !std::isfinite(h)) throw InvalidArgument(detail::message("a step of ", h, " s; it must be finite and not negative"));
    Report const report = relax(options_.sweeps, options_.seconds, h > 0 ? 1 / h : Scalar(0), quiet, false);
    if (options_.levels > 0) split_and_join();
    return report;
  }
  /// Moves all to where they come to rest if the forces applied so far stay, and consumes these. Nothing is split or joined. `tolerance`: the largest move of a
  /// sweep as a share of an edge.
  Report solve_statics(Scalar tolerance = std::max(Scalar(1e-12), 4 * std::numeric_limits<Scalar>::epsilon()), int most = 100000) {
    is_quiet_ = false;
    return relax(most, std::numeric_limits<double>::infinity(), 0, tolerance, true);
  }

  /// Any step is stable.
  Scalar stable_step() const noexcept { return std::numeric_limits<Scalar>::infinity(); }
  Scalar guaranteed_stable_step() const noexcept { return stable_step(); }
  bool stable_step_fell() const noexcept { return false; }
  /// The change of velocity over h [m/s²] to the mean of the next step of h seconds, without the forces applied so far.
  Vector predicted_acceleration(int i, Scalar h) const {
    check(i);
    if (!(h > 0) || skin_.nailed(i)) return Vector::Zero();
    Vector back = Vector::Zero();
    for_each_leader(i, [&](int m, Scalar w) { back += w * give(m) * pushed_[m]; });
    return (-back / h - v_[i]) / h;
  }
  /// What a force on vertex j adds to that of i by the newton: 1/kg. See StatesMobility.
  Scalar mobility(int i, int j, Scalar h) const noexcept {
    Scalar sum = 0;
    if (h > 0 && !skin_.nailed(i) && !skin_.nailed(j))
      for_each_leader(i, [&](int m, Scalar w) { for_each_leader(j, [&](int n, Scalar other) { sum += m == n ? w * other * give(m) : Scalar(0); }); });
    return h > 0 ? sum / (h * h) : Scalar(0);
  }

  /// What still pulls a vertex: springs, gravity, home spring, forces for the next step, and of what hangs on it [N]. Zero where it hangs, or is nailed.
  Vector net_force(int i) const { return (check(i), is_free(i) ? force_on(i) : Vector(Vector::Zero())); }
  /// Of springs and home springs [J].
  Scalar elastic_energy() const noexcept;

  // --- splits and cuts ------------------------------------------------------------------------------------------------
  /// Splits a cube in 8^levels, as a touch does, or joins it. False where it is so already.
  bool split(int cube) { return set_split(cube, true); }
  bool join(int cube) { return set_split(cube, false); }
  /// A blade's edge went from a–b to c–d: opens each face between two cubes whose middles it came between. Returns how many.
  int cut(Vector const& a, Vector const& b, Vector const& c, Vector const& d);
  /// As the source cuts: each cube around a vertex gets its own, so all faces there open, along the blade too. Returns how many.
  int detach(int vertex);

  // --- save and restore -----------------------------------------------------------------------------------------------
  /// Everything that makes the body's future.
  struct State {
    std::vector<std::uint8_t> opened;
    std::vector<int> split, idle, hit, touches, touched, loaded;
    Matrix3X<Scalar> u, v, load, pushed;
    std::vector<char> nailed;
    std::vector<Scalar> support;
    Vector gravity;
    Random random;
    std::size_t revision;
    int sweep;
    bool is_quiet, was_loaded;
    Scalar largest;
  };
  State save() const {
    return {grid_.opened(), fine_.cubes,    idle_,    hit_,     touches_, touched_,        loaded_, u_.view(),  v_.view(),    load_.view(),
            pushed_.view(), skin_.nailed_, support_, gravity_, random_,  skin_.revision_, sweep_,  is_quiet_, was_loaded_, largest_};
  }
  void restore(State const& state) {
    grid_.set_opened(state.opened);
    build();
    fine_.cubes.clear(), wanted_ = state.split, idle_ = state.idle;
    refine();
    u_.view() = state.u, v_.view() = state.v, load_.view() = state.load, pushed_.view() = state.pushed;
    skin_.nailed_ = state.nailed, support_ = state.support, gravity_ = state.gravity, random_ = state.random, skin_.revision_ = state.revision;
    hit_ = state.hit, touches_ = state.touches, touched_ = state.touched, loaded_ = state.loaded, sweep_ = state.sweep;
    is_quiet_ = state.is_quiet, was_loaded_ = state.was_loaded, largest_ = state.largest;
    for (int const i : loaded_) is_loaded_[at(i)] = 1;
    for (int i = 0; i < size(); ++i) move_to(i, u_[i]), refresh(i);
    begin_order();
    ++restorations_;
  }
  std::size_t restorations() const noexcept { return restorations_; }

  // --- for a renderer -------------------------------------------------------------------------------------------------
  template <class Values>
  void draw_columns(Values const& values, Matrix3X<Scalar>& to) const {
    to = values;
  }
  void draw_triangles(Matrix<int, 3, Dynamic>& to) const { to = triangles(); }

 private:
  static constexpr Scalar response = 3;   // of a step, in 1/k_i: what a vertex of a half-space gives, with its neighbours
  static constexpr Scalar quiet = std::max(Scalar(1e-8), 8 * std::numeric_limits<Scalar>::epsilon());   // of an edge in a sweep

  struct Face {
    int cube, side;
  };
  struct Spring {
    Vector along;                                // m, in the rest shape
    Scalar stiffness, length, longer_squared;    // N/m, m, m²: along² − length²
    int to;                                      // corner
  };
  struct Leaf {
    std::array<int, 8> corner;
    int level;
  };
  struct Hang {   // on 2 or 4 others
    int count = 0;
    std::array<int, 4> on{};
    std::array<Scalar, 4> weight{};
  };
  struct Follower {   // a list per leader
    int vertex;
    Scalar weight;
    int next;
  };
  struct Fine {   // cubes that are split, ascending, and the vertices at all points of each
    std::vector<int> cubes, vertex;
  };

  static std::size_t at(int i) noexcept { return static_cast<std::size_t>(i); }
  void check(int i) const { detail::check_index("vertex", i, size()); }
  void check_cube(int c) const { detail::check_index("cube", c, cubes()); }
  void check_own(int i, char const* what) const {
    check(i);
    if (i < base_) return;
    throw InvalidArgument(detail::message("vertex ", i, " goes when its cube is joined; only the first ", base_, " vertices can be ", what));
  }
  static void check_finite(char const* what, Vector const& value, char const* unit) {
    if (is_finite(value)) return;
    throw InvalidArgument(detail::message(what, " is (", value[0], ", ", value[1], ", ", value[2], ") ", unit, "; it must be finite"));
  }
  static double checked(Options const& options) {
    options.validate();
    return static_cast<double>(options.edge);
  }
  Scalar give(int m) const noexcept { return skin_.nailed(m) ? Scalar(0) : response / k_[at(m)]; }   // m/N
  bool is_free(int i) const noexcept { return hang_[at(i)].count == 0 && !skin_.nailed(i); }
  template <class Visit>
  void for_each_leader(int i, Visit const& visit) const noexcept {
    Hang const& hang = hang_[at(i)];
    if (hang.count == 0) visit(i, Scalar(1));
    for (std::size_t k = 0; k < at(hang.count); ++k) visit(hang.on[k], hang.weight[k]);
  }
  template <class Visit>
  void for_each_follower(int i, Visit const& visit) const noexcept {
    for (int k = i < base_ ? head_[at(i)] : -1; k >= 0; k = followers_[at(k)].next) visit(followers_[at(k)].vertex, followers_[at(k)].weight);
  }

  // --- points of a split cube, (i, j, k) from 0 to parts_ ----------------------------------------------------------
  using Place = std::array<int, 3>;
  int points() const noexcept { return (parts_ + 1) * (parts_ + 1) * (parts_ + 1); }
  int number(Place const& p) const noexcept { return (p[2] * (parts_ + 1) + p[1]) * (parts_ + 1) + p[0]; }
  Place point(int p) const noexcept { return {p % (parts_ + 1), p / (parts_ + 1) % (parts_ + 1), p / (parts_ + 1) / (parts_ + 1)}; }
  Scalar weight(Place const& p, int corner) const noexcept {
    int product = 1;
    for (int a = 0; a < 3; ++a) product *= (corner >> a & 1) != 0 ? p[at(a)] : parts_ - p[at(a)];
    return Scalar(product) / Scalar(parts_ * parts_ * parts_);
  }
  /// The sides that a point lies on; how many.
  int sides_of(Place const& p, std::array<int, 3>& sides) const noexcept {
    int n = 0;
    for (int a = 0; a < 3; ++a)
      if (p[at(a)] == 0 || p[at(a)] == parts_) sides[at(n++)] = 2 * a + (p[at(a)] != 0);
    return n;
  }
  /// The vertex of another split cube at a point of this one.
  int vertex_in(int other, int c, Place p) const noexcept {
    for (std::size_t a = 0; a < 3; ++a) p[a] += parts_ * (grid_.place(c)[a] - grid_.place(other)[a]);
    return fine_.vertex[at(slot_[at(other)]) * at(points()) + at(number(p))];
  }
  void nail_fine(int c, int p, int v) noexcept {
    bool all = true;
    for (int k = 0; k < 8; ++k) all = all && (weight(point(p), k) == 0 || skin_.nailed(grid_.corners(c)[at(k)]));
    if (all && v >= base_) skin_.nailed_[at(v)] = 1, move_to(v, Vector::Zero());
  }

  // --- build ----------------------------------------------------------------------------------------------------------
  void add_vertex(Vector const& rest, Vector const& u, Vector const& v) {
    rest_.push_back(rest), u_.push_back(u), v_.push_back(v), x_.push_back(Vector(rest + u));
    for (Columns<Scalar, 3>* columns : {&load_, &pushed_, &before_}) columns->push_back(Vector(Vector::Zero()));
    around_.push_back({-1, -1, -1, -1, -1, -1, -1, -1});
    mass_.push_back(0), k_.push_back(0), hang_.push_back({}), seen_.push_back(0);
    skin_.nailed_.push_back(0), is_loaded_.push_back(0), is_unfitted_.push_back(0);
    if (has_surface_) skin_.surface_.add_vertex();
  }
  void set_leaf(int leaf, std::array<int, 8> const& corners, int level) {
    leaves_[at(leaf)] = {corners, level};
    for (std::size_t k = 0; k < 8; ++k) around_[at(corners[k])][7 - k] = leaf;
  }

  /// All of unsplit cubes: vertices, springs, skin. Nothing is split, moved or nailed.
  void build() {
    base_ = grid_.vertices();
    int const c = cubes();
    int const fine = options_.levels > 0 ? std::min(options_.touched_cubes, c) : 0, most = base_ + fine * points();
    for (Columns<Scalar, 3>* columns : {&rest_, &x_, &u_, &v_, &load_, &pushed_, &before_}) columns->resize(0), columns->reserve(most);
    last_u_.reserve(most), last_v_.reserve(most);
    around_.clear(), mass_.clear(), k_.clear(), hang_.clear(), seen_.clear(), is_loaded_.clear(), is_unfitted_.clear(), skin_.nailed_.clear();
    around_.reserve(at(most)), mass_.reserve(at(most)), k_.reserve(at(most)), hang_.reserve(at(most)), seen_.reserve(at(most));
    is_loaded_.reserve(at(most)), is_unfitted_.reserve(at(most)), skin_.nailed_.reserve(at(most));
    unfitted_.clear(), loaded_.clear(), touched_.clear(), followers_.clear();
    unfitted_.reserve(at(most)), loaded_.reserve(at(most)), touched_.reserve(at(most)), order_.reserve(at(most)), ring_end_.reserve(at(most));
    followers_.reserve(at(4 * fine * points()));
    has_surface_ = false;
    for (int v = 0; v < base_; ++v) {
      Vector3<double> const place = grid_.corner() + static_cast<double>(options_.edge) * grid_.vertex_place(v);
      add_vertex(place.template cast<Scalar>(), Vector::Zero(), Vector::Zero());
    }
    head_.assign(at(base_), -1), support_.assign(at(base_), 0);
    slot_.assign(at(c), -1), idle_.resize(at(c)), touches_.assign(at(c), 0);
    fine_.vertex.clear(), fine_.cubes.clear(), wanted_.clear();
    for (Fine* list : {&fine_, &last_fine_}) list->cubes.reserve(at(fine)), list->vertex.reserve(at(fine * points()));
    wanted_.reserve(at(fine) + 1), hit_.reserve(at(c));
    leaves_.resize(at(c)), leaves_.reserve(at(c + fine * parts_ * parts_ * parts_));
    for (int i = 0; i < c; ++i) set_leaf(i, grid_.corners(i), 0);
    for (int v = 0; v < base_; ++v) refresh(v);

    faces_.clear();
    face_.assign(at(c), {-1, -1, -1, -1, -1, -1});
    for (bool const opened : {false, true})
      for (int i = 0; i < c; ++i)
        for (int side = 0; side < 6; ++side)
          if (grid_.linked(i, side) < 0 && grid_.is_opened(i, side) == opened) {
            face_[at(i)][at(side)] = static_cast<int>(faces_.size());
            faces_.push_back({i, side});
          }
    auto const f = static_cast<int>(faces_.size());
    extra_.assign(at(f), {0, 0}), stamp_.assign(at(f), 0), patched_.clear(), patched_.reserve(at(f));
    int const extras = std::min(f, 9 * fine) * (2 * parts_ * parts_ + 4 * parts_);
    extra_face_.clear(), extra_face_.reserve(at(extras));
    Matrix<int, 3, Dynamic> triangles(3, 2 * f);
    for (int k = 0; k < f; ++k)
      for (int t = 0; t < 2; ++t)
        for (int corner = 0; corner < 3; ++corner) triangles(corner, 2 * k + t) = plain(k, t)[at(corner)];
    skin_.surface_ = SurfaceTopology(base_, triangles);
    tree_ = SurfaceTree<Scalar>(x_.view(), triangles);
    has_surface_ = true;
    if (fine > 0) skin_.surface_.reserve(most, 2 * f + extras), tree_.reserve(2 * f + extras);
    boxes_.resize(2 * static_cast<int>(grid_.nodes().size())), is_octree_fitted_ = false;
    begin_order();
    is_quiet_ = false, largest_ = 1, ++skin_.revision_, ++topology_revision_, ++renumberings_;
  }
  /// A triangle of an unsplit face.
  std::array<int, 3> plain(int f, int t) const noexcept {
    auto const corner = [&](int k) { return grid_.corners(faces_[at(f)].cube)[at(detail::CubeGrid::side_corner(faces_[at(f)].side, k))]; };
    return {corner(0), corner(1 + t), corner(2 + t)};
  }
  int face_of(int triangle) const noexcept {
    int const extra = triangle - 2 * static_cast<int>(faces_.size());
    return extra < 0 ? triangle / 2 : extra_face_[at(extra)];
  }

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
  static Vector direction(int from, int to) noexcept {
    return Vector(Scalar((to & 1) - (from & 1)), Scalar((to >> 1 & 1) - (from >> 1 & 1)), Scalar((to >> 2) - (from >> 2)));
  }

  /// From what fine_ and wanted_ say, cubes are split and joined: those wanted are split, ascending.
  void refine() {
    std::swap(fine_, last_fine_);
    fine_.cubes = wanted_;
    for (auto const& [from, to] : {std::pair{&u_, &last_u_}, {&v_, &last_v_}}) *to = *from;
    // as if nothing were split
    auto const f = static_cast<int>(faces_.size());
    while (skin_.surface_.triangle_count() > 2 * f) {
      int const last = skin_.surface_.triangle_count() - 1;
      skin_.surface_.pop_triangle(), tree_.remove(x_.view(), last);
    }
    for (int const k : patched_) {
      for (int t = 0; t < 2; ++t) set_triangle(2 * k + t, plain(k, t));
      extra_[at(k)] = {0, 0};
    }
    patched_.clear(), extra_face_.clear(), followers_.clear();
    leaves_.resize(at(cubes()));
    for (int const c : last_fine_.cubes) {
      set_leaf(c, grid_.corners(c), 0), slot_[at(c)] = -1;
      for (int const v : grid_.corners(c)) head_[at(v)] = -1;
    }
    while (size() > base_) drop_vertex();
    // and now split
    fine_.vertex.assign(fine_.cubes.size() * at(points()), -1);
    for (std::size_t slot = 0; slot < fine_.cubes.size(); ++slot) slot_[at(fine_.cubes[slot])] = static_cast<int>(slot);
    for (int const c : fine_.cubes) add_points(c);
    for (int const c : fine_.cubes) add_leaves(c);
    for (auto const* list : {&last_fine_, &fine_})
      for (int const c : list->cubes)
        for (int const v : grid_.corners(c)) refresh(v);
    for (int v = base_; v < size(); ++v) refresh(v);
    ++stamps_;
    for (int const c : fine_.cubes)
      for (int part = 0; part < 27; ++part) {
        int near = c;
        for (int a = 0, rest = part; a < 3 && near >= 0; ++a, rest /= 3)
          if (rest % 3 != 1) near = grid_.beside(near, 2 * a + rest % 3 / 2);
        if (near < 0) near = far_neighbour(c, part);
        if (near >= 0) patch(near);
      }
    std::erase_if(touched_, [&](int i) { return i >= base_; });
    begin_order();
    is_octree_fitted_ = false, is_quiet_ = false;
    ++skin_.revision_, ++topology_revision_, ++renumberings_;
  }
  /// The cube at a place beside, over an edge or a corner, whatever way leads there.
  int far_neighbour(int c, int part) const noexcept {
    std::array<int, 3> sides{};
    int n = 0;
    for (int a = 0, rest = part; a < 3; ++a, rest /= 3)
      if (rest % 3 != 1) sides[at(n++)] = 2 * a + rest % 3 / 2;
    do {   // sides are in rising order
      int near = c;
      for (int k = 0; k < n && near >= 0; ++k) near = grid_.beside(near, sides[at(k)]);
      if (near >= 0) return near;
    } while (std::next_permutation(sides.begin(), sides.begin() + n));
    return -1;
  }
  void drop_vertex() noexcept {
    int const last = size() - 1;
    if (is_unfitted_[at(last)] != 0) std::erase(unfitted_, last);
    if (is_loaded_[at(last)] != 0) std::erase(loaded_, last);
    for (Columns<Scalar, 3>* columns : {&rest_, &x_, &u_, &v_, &load_, &pushed_, &before_}) columns->pop_back();
    around_.pop_back(), mass_.pop_back(), k_.pop_back(), hang_.pop_back(), seen_.pop_back();
    skin_.nailed_.pop_back(), is_loaded_.pop_back(), is_unfitted_.pop_back();
    skin_.surface_.pop_vertex();
  }
  void set_triangle(int t, std::array<int, 3> const& corners) { skin_.surface_.set_triangle(t, corners), tree_.replace(x_.view(), t, corners); }

  /// The vertices of a split cube: shared with the split cubes before it, hanging where a linked cube is not split.
  void add_points(int c) {
    auto const last = std::lower_bound(last_fine_.cubes.begin(), last_fine_.cubes.end(), c);
    bool const was_split = last != last_fine_.cubes.end() && *last == c;
    int* const own = fine_.vertex.data() + at(slot_[at(c)]) * at(points());
    int const* const before = was_split ? last_fine_.vertex.data() + at(static_cast<int>(last - last_fine_.cubes.begin())) * at(points()) : nullptr;
    auto const& corners = grid_.corners(c);
    for (int n = 0; n < points(); ++n) {
      Place const p = point(n);
      std::array<int, 3> sides{};
      std::array<int, 4> around{};
      int const on = sides_of(p, sides);
      if (on == 3) {
        own[n] = corners[at((p[0] != 0) + 2 * (p[1] != 0) + 4 * (p[2] != 0))];
        continue;
      }
      int linked = 0;
      if (on == 2) linked = grid_.around_edge(c, sides[0], sides[1], around);
      if (on == 1)
        if (int const next = grid_.linked(c, sides[0]); next >= 0) around[at(linked++)] = next;
      bool hangs = false;
      for (int k = 0; k < linked; ++k) {
        int const other = around[at(k)];
        if (slot_[at(other)] < 0)
          hangs = true;
        else if (other < c)
          own[n] = vertex_in(other, c, p);
      }
      if (own[n] >= 0) continue;
      Vector rest = Vector::Zero(), u = Vector::Zero(), v = Vector::Zero();
      Hang hang;
      for (int k = 0; k < 8; ++k)
        if (Scalar const w = weight(p, k); w > 0) {
          int const corner = corners[at(k)];
          rest += w * rest_[corner], u += w * u_[corner], v += w * v_[corner];
          if (hangs) hang.on[at(hang.count)] = corner, hang.weight[at(hang.count++)] = w;
        }
      if (before != nullptr && !hangs) u = last_u_[before[n]], v = last_v_[before[n]];
      own[n] = size();
      add_vertex(rest, u, v);
      hang_.back() = hang;
      for (std::size_t k = 0; k < at(hang.count); ++k) {
        int& head = head_[at(hang.on[k])];
        followers_.push_back({own[n], hang.weight[k], std::exchange(head, static_cast<int>(followers_.size()))});
      }
      nail_fine(c, n, own[n]);
    }
  }
  void add_leaves(int c) {
    int const* const own = fine_.vertex.data() + at(slot_[at(c)]) * at(points());
    for (int z = 0; z < parts_; ++z)
      for (int y = 0; y < parts_; ++y)
        for (int x = 0; x < parts_; ++x) {
          std::array<int, 8> corners;
          for (int k = 0; k < 8; ++k) corners[at(k)] = own[number({x + (k & 1), y + (k >> 1 & 1), z + (k >> 2)})];
          leaves_.emplace_back();
          set_leaf(static_cast<int>(leaves_.size()) - 1, corners, 1);
        }
  }

  // --- skin of what is split, and beside it ---------------------------------------------------------------------------
  /// The skin of a cube's faces with all vertices on them.
  void patch(int c) {
    for (int side = 0; side < 6; ++side) {
      int const f = face_[at(c)][at(side)];
      if (f < 0 || std::exchange(stamp_[at(f)], stamps_) == stamps_) continue;
      if (slot_[at(c)] >= 0)
        patch_split(f);
      else
        patch_around(f);
    }
  }
  /// Point (s, t) of a side in counter-clockwise axes, of a split cube.
  Place side_point(int side, int s, int t) const noexcept {
    Place p{};
    bool const far = side % 2 != 0;
    std::size_t const axis = at(side / 2), u = (axis + 1) % 3, v = (axis + 2) % 3;
    p[axis] = far ? parts_ : 0, p[far ? u : v] = s, p[far ? v : u] = t;
    return p;
  }
  void patch_split(int f) {
    auto const [c, side] = faces_[at(f)];
    begin_patch(f);
    for (int t = 0; t < parts_; ++t)
      for (int s = 0; s < parts_; ++s) {
        auto const vertex = [&](int i, int j) { return vertex_in(c, c, side_point(side, s + i, t + j)); };
        add_triangle(f, {vertex(0, 0), vertex(1, 0), vertex(1, 1)});
        add_triangle(f, {vertex(0, 0), vertex(1, 1), vertex(0, 1)});
      }
  }
  /// Of an unsplit face whose edges hold vertices of split cubes: ears of the outline, the shortest first.
  void patch_around(int f) {
    auto const [c, side] = faces_[at(f)];
    struct Point {
      int s, t, vertex;
    };
    std::array<Point, 64> outline;
    std::size_t n = 0;
    bool has_more = false;
    for (int k = 0; k < 4; ++k) {
      int const s = k == 1 || k == 2 ? parts_ : 0, t = k >= 2 ? parts_ : 0, next_s = k < 2 ? parts_ : 0, next_t = k == 1 || k == 2 ? parts_ : 0;
      outline[n++] = {s, t, grid_.corners(c)[at(corner_at(side_point(side, s, t)))]};
      Place const middle = side_point(side, (s + next_s) / 2, (t + next_t) / 2);
      std::array<int, 3> sides{};
      if (parts_ < 2 || sides_of(middle, sides) != 2) continue;
      std::array<int, 4> around{};
      int const linked = grid_.around_edge(c, sides[0], sides[1], around);
      int split = -1;
      for (int i = 0; i < linked; ++i)
        if (slot_[at(around[at(i)])] >= 0) split = around[at(i)];
      for (int i = 1; split >= 0 && i < parts_; ++i, has_more = true) {
        int const on_s = s + (next_s - s) / parts_ * i, on_t = t + (next_t - t) / parts_ * i;
        outline[n++] = {on_s, on_t, vertex_in(split, c, side_point(side, on_s, on_t))};
      }
    }
    if (!has_more) return;
    begin_patch(f);
    auto const turn = [](Point const& a, Point const& b, Point const& d) { return (b.s - a.s) * (d.t - a.t) - (b.t - a.t) * (d.s - a.s); };
    int area = 2 * parts_ * parts_;
    while (n > 2) {
      std::size_t ear = n;
      int shortest = 0;
      for (std::size_t k = 0; k < n; ++k) {
        Point const &a = outline[(k + n - 1) % n], &b = outline[k], &d = outline[(k + 1) % n];
        int const size = turn(a, b, d), length = (d.s - a.s) * (d.s - a.s) + (d.t - a.t) * (d.t - a.t);
        if (size > 0 && (n == 3 || size < area) && (ear == n || length < shortest)) ear = k, shortest = length;
      }
      Point const &a = outline[(ear + n - 1) % n], &b = outline[ear], &d = outline[(ear + 1) % n];
      area -= turn(a, b, d);
      add_triangle(f, {a.vertex, b.vertex, d.vertex});
      for (--n; ear < n; ++ear) outline[ear] = outline[ear + 1];
    }
  }
  static int corner_at(Place const& p) noexcept { return (p[0] != 0) + 2 * (p[1] != 0) + 4 * (p[2] != 0); }
  void begin_patch(int f) {
    patched_.push_back(f);
    extra_[at(f)] = {static_cast<int>(extra_face_.size()), -2};
  }
  void add_triangle(int f, std::array<int, 3> const& corners) {
    int const k = extra_[at(f)][1]++;
    if (k < 0) return set_triangle(2 * f + 2 + k, corners);
    skin_.surface_.add_triangle(corners), tree_.add(x_.view(), corners, 2 * f);
    extra_face_.push_back(f);
  }
  /// visit(triangle) for all of a face.
  template <class Visit>
  void for_each_triangle(int f, Visit const& visit) const {
    visit(2 * f), visit(2 * f + 1);
    for (int k = 0; k < extra_[at(f)][1]; ++k) visit(2 * static_cast<int>(faces_.size()) + extra_[at(f)][0] + k);
  }

  bool set_split(int cube, bool split) {
    check_cube(cube);
    if (split && options_.levels == 0) throw InvalidArgument(detail::message("cube ", cube, " is to be split, but options.levels is 0; give how often"));
    if ((slot_[at(cube)] >= 0) == split) return false;
    wanted_ = fine_.cubes;
    auto const place = std::lower_bound(wanted_.begin(), wanted_.end(), cube);
    if (split)
      wanted_.insert(place, cube), idle_[at(cube)] = 0;
    else
      wanted_.erase(place);
    refine();
    return true;
  }
  /// Splits what the last step's forces touched, joins what they have left long ago.
  void split_and_join() {
    wanted_.clear();
    bool changes = false;
    for (int const c : fine_.cubes)
      if (touches_[at(c)] > 0 || ++idle_[at(c)] <= options_.join_after)
        wanted_.push_back(c);
      else
        changes = true;
    for (int const c : hit_) {
      idle_[at(c)] = 0;
      if (touches_[at(c)] >= 3) {
        if (slot_[at(c)] < 0) wanted_.insert(std::lower_bound(wanted_.begin(), wanted_.end(), c), c), changes = true;
      }
      touches_[at(c)] = 0;
    }
    hit_.clear();
    if (changes) refine();
  }
  void touch(int cube, int times) {
    if (touches_[at(cube)] == 0) hit_.push_back(cube);
    touches_[at(cube)] += times;
  }
  int cube_of_leaf(int leaf) const noexcept { return leaf < cubes() ? leaf : fine_.cubes[at((leaf - cubes()) / (parts_ * parts_ * parts_))]; }

  // --- relaxation -----------------------------------------------------------------------------------------------------
  /// Of one vertex's own springs, gravity and forces.
  Vector own_force(int i) const noexcept {
    Vector force = load_[i] + mass_[at(i)] * gravity_;
    Vector const here = u_[i];
    if (i < base_) force -= support_[at(i)] * here;
    for (int o = 0; o < 8; ++o) {
      int const l = around_[at(i)][at(o)];
      if (l < 0) continue;
      Leaf const& leaf = leaves_[at(l)];
      for (Spring const& spring : springs_[at(leaf.level)][at(7 ^ o)]) {
        Vector const moved = u_[leaf.corner[at(spring.to)]] - here, d = spring.along + moved;
        Scalar const length = d.norm();
        // k (|d| − L)/|d|, without loss of digits where both are nearly the same
        if (length > 0) force += spring.stiffness * (spring.longer_squared + (spring.along + d).dot(moved)) / (length * (length + spring.length)) * d;
      }
    }
    return force;
  }
  Vector force_on(int i) const noexcept {
    Vector force = own_force(i);
    for_each_follower(i, [&](int h, Scalar w) { force += w * own_force(h); });
    return force;
  }
  void move_to(int i, Vector const& u) noexcept {
    u_[i] = u;
    x_[i] = rest_[i] + u;
    if (!std::exchange(is_unfitted_[at(i)], char{1})) unfitted_.push_back(i);
  }
  void follow(int i) noexcept {
    if (skin_.nailed(i)) return;
    Vector u = Vector::Zero();
    for_each_leader(i, [&](int m, Scalar w) { u += w * u_[m]; });
    move_to(i, u);
  }
  /// Returns how far it went, in edges.
  Scalar visit(int i) noexcept {
    Vector const move = options_.relaxation / k_[at(i)] * force_on(i);
    move_to(i, u_[i] + move);
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
    note_touched();
    bool const is_loaded = !loaded_.empty();
    if (is_quiet_ && !is_loaded && !was_loaded_) {
      v_.view().setZero();
      report.at_rest = true;
      return report;
    }
    was_loaded_ = is_loaded;
    wants_rest = wants_rest || !is_loaded;   // under a tool that stays, what is near it is looked at, and the rest now and then
    before_ = u_;
    visits_ = 0, is_quiet_ = false;
    for (; report.sweeps < sweeps && !is_quiet_ && !budget.is_spent; ++report.sweeps) {
      bool const to_the_end = options_.order != VisitOrder::breadth_first || sweep_ % 8 == 7 || (wants_rest && !(largest_ > tolerance));
      moving_ = 0, ++sweep_;
      largest_ = options_.order == VisitOrder::breadth_first ? sweep_rings(to_the_end, budget) : sweep_list(budget);
      if (!std::isfinite(largest_)) break;
      is_quiet_ = to_the_end && !budget.is_spent && largest_ <= tolerance;
      if (!wants_rest && largest_ <= tolerance) break;
    }
    report.visits = visits_, report.moving = is_quiet_ ? 0 : std::max(moving_, 1), report.at_rest = is_quiet_;
    report.diverged = !(u_.view().cwiseAbs().maxCoeff() < 1000 * diagonal_);
    if (report.diverged) {
      for (int i = 0; i < size(); ++i) move_to(i, before_[i]);
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
    is_octree_fitted_ = false;
    return report;
  }
  /// Relaxation begins at the forces; which cubes have felt three of them.
  void note_touched() {
    if (loaded_.empty()) return;
    if (options_.levels > 0)
      for (int const i : loaded_) {
        std::array<int, 8> done;
        std::size_t n = 0;
        for (int const leaf : around_[at(i)]) {
          int const c = leaf >= 0 ? cube_of_leaf(leaf) : -1;
          if (c < 0 || std::find(done.begin(), done.begin() + static_cast<std::ptrdiff_t>(n), c) != done.begin() + static_cast<std::ptrdiff_t>(n)) continue;
          done[n++] = c;
          touch(c, 1);
        }
      }
    if (touched_ != loaded_) touched_ = loaded_, begin_order();
  }

  void begin_order() noexcept {
    order_.clear(), ring_end_.clear();
    ++seen_count_, expanded_ = 0, unseen_from_ = 0;
    if (options_.order == VisitOrder::breadth_first) {
      for (int const i : touched_) see(i);
      if (!order_.empty()) ring_end_.push_back(static_cast<int>(order_.size()));
    } else {
      for (int i = 0; i < size(); ++i) order_.push_back(i);
    }
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
  Scalar sweep_list(Budget& budget) noexcept {
    if (options_.order == VisitOrder::random) shuffle(std::span(order_), random_);
    Scalar largest = 0;
    for (int const i : order_)
      if (is_free(i)) {
        if (Scalar const far = visit(i); !(far <= largest)) largest = far;
        if (budget.ask(options_.clock, visits_)) break;
      }
    return largest;
  }

  // --- searches -------------------------------------------------------------------------------------------------------
  void fit_tree() noexcept {
    auto const x = x_.view();
    if (8 * unfitted_.size() > at(size())) {
      tree_.refit(x);
    } else {
      for (int const i : unfitted_)
        for (int const t : skin_.surface_.triangles_at(i)) {
          auto const corners = skin_.surface_.corners(t);
          if (std::none_of(corners.begin(), corners.end(), [&](int c) { return c < i && is_unfitted_[at(c)] != 0; })) tree_.refit(x, std::span(&t, 1));
        }
    }
    for (int const i : unfitted_) is_unfitted_[at(i)] = 0;
    unfitted_.clear();
  }
  void fit_octree() noexcept;

  void reopen();

  Options options_;
  detail::CubeGrid grid_;
  int parts_ = 1, base_ = 0;   // of a split cube along an edge; vertices of unsplit cubes
  std::array<Scalar, 2> edges_{};                                    // m, of cubes unsplit and split
  std::array<std::array<std::array<Spring, 7>, 8>, 2> springs_;      // of a cube, unsplit and split, from each of its corners
  Skin skin_;
  SurfaceTree<Scalar> tree_;
  Columns<Scalar, 3> rest_, x_, u_, v_, load_, pushed_, before_, last_u_, last_v_;   // m, m, m, m/s, N for the next step and of the last one, m
  std::vector<std::array<int, 8>> around_;   // of a vertex, the leaf in each octant
  std::vector<Leaf> leaves_;                 // of all cubes, unsplit; then those of split ones
  std::vector<Scalar> mass_, k_, support_;   // kg, N/m, N/m
  std::vector<Hang> hang_;
  std::vector<int> head_;                    // of the followers of each vertex of unsplit cubes
  std::vector<Follower> followers_;
  Fine fine_, last_fine_;
  std::vector<int> slot_, idle_, touches_;   // of each cube: place in fine_, steps since the last touch, touched vertices
  std::vector<int> hit_, wanted_;            // cubes that are touched, and to be split
  std::vector<Face> faces_;
  std::vector<std::array<int, 6>> face_;     // of each cube
  std::vector<std::array<int, 2>> extra_;    // of each face: its first triangle beyond two, and how many
  std::vector<int> extra_face_, patched_;
  std::vector<std::uint64_t> stamp_, seen_;
  std::uint64_t stamps_ = 0, seen_count_ = 0;
  std::vector<int> loaded_, touched_, order_, ring_end_, unfitted_;
  std::vector<char> is_loaded_, is_unfitted_;
  std::size_t expanded_ = 0;
  int unseen_from_ = 0, sweep_ = 0, visits_ = 0, moving_ = 0;
  Columns<Scalar, 3> boxes_;                 // m, low and high of each node of the octree
  Vector gravity_ = Vector::Zero();          // m/s²
  Random random_;
  Scalar diagonal_ = 0, largest_ = 1;        // m; of the last sweep, in edges
  bool is_quiet_ = false, was_loaded_ = false, has_surface_ = false, is_octree_fitted_ = false;
  std::size_t topology_revision_ = 0, renumberings_ = 0, restorations_ = 0;
};

template <RealScalar Scalar>
Cubes(TriangleMesh<Scalar> const&, CubesOptions<Scalar> const&) -> Cubes<Scalar>;

template <RealScalar Scalar>
void Cubes<Scalar>::apply_force_at(SurfacePoint<Scalar> const& touched, Vector const& force, TouchSpread spread) {
  int const c = cube_of(touched.triangle), f = face_of(touched.triangle), side = faces_[at(f)].side;
  bool const is_split = slot_[at(c)] >= 0;
  Scalar const s = edges_[is_split ? 1 : 0];
  std::array<int, 4> corners;
  if (is_split) {
    int const extra = touched.triangle - 2 * static_cast<int>(faces_.size());
    int const square = extra < 0 ? 0 : (extra - extra_[at(f)][0] + 2) / 2;
    for (int k = 0; k < 4; ++k) corners[at(k)] = vertex_in(c, c, side_point(side, square % parts_ + (k == 1 || k == 2), square / parts_ + (k >= 2)));
  } else {
    for (int k = 0; k < 4; ++k) corners[at(k)] = grid_.corners(c)[at(detail::CubeGrid::side_corner(side, k))];
  }
  Vector home = Vector::Zero();
  for (int k = 0; k < 3; ++k) home += touched.barycentric[k] * rest_[skin_.surface_.corners(touched.triangle)[at(k)]];
  if (spread == TouchSpread::nearest_vertex) {
    auto const nearer = [&](int a, int b) { return (rest_[a] - home).squaredNorm() < (rest_[b] - home).squaredNorm(); };
    apply_force(*std::min_element(corners.begin(), corners.end(), nearer), force);
  } else {
    for (std::size_t k = 0; k < 4; ++k) {
      Vector const away = (home - rest_[corners[k]]).cwiseAbs() / s;
      Scalar share = 1;
      for (int a = 0; a < 3; ++a) share *= a == side / 2 ? Scalar(1) : std::max(Scalar(0), 1 - away[a]);
      apply_force(corners[k], share * force);
    }
  }
  if (options_.levels > 0) touch(c, 3);
}

template <RealScalar Scalar>
Scalar Cubes<Scalar>::elastic_energy() const noexcept {
  Scalar sum = 0;
  for (std::size_t l = 0; l < leaves_.size(); ++l) {
    if (l < at(cubes()) && slot_[l] >= 0) continue;
    Leaf const& leaf = leaves_[l];
    for (int a = 0; a < 8; ++a)
      for (Spring const& spring : springs_[at(leaf.level)][at(a)]) {   // each is seen from both ends
        Scalar const longer = Vector(spring.along + u_[leaf.corner[at(spring.to)]] - u_[leaf.corner[at(a)]]).norm() - spring.length;
        sum += spring.stiffness / 4 * longer * longer;
      }
  }
  for (int i = 0; i < base_; ++i) sum += support_[at(i)] / 2 * Vector(u_[i]).squaredNorm();
  return sum;
}

template <RealScalar Scalar>
void Cubes<Scalar>::fit_octree() noexcept {
  if (is_octree_fitted_) return;
  auto const& nodes = grid_.nodes();
  for (std::size_t n = nodes.size(); n-- > 0;) {
    Eigen::AlignedBox<Scalar, 3> box;
    if (int const c = nodes[n].cube; c >= 0) {
      for (int const f : face_[at(c)])
        if (f >= 0) for_each_triangle(f, [&](int t) { for (int const v : skin_.surface_.corners(t)) box.extend(Vector(x_[v])); });
    } else {
      for (int const child : nodes[n].child)   // one without skin has an empty box, which no search enters
        if (child >= 0 && boxes_[2 * child][0] <= boxes_[2 * child + 1][0]) box.extend(Vector(boxes_[2 * child])), box.extend(Vector(boxes_[2 * child + 1]));
    }
    boxes_[2 * static_cast<int>(n)] = box.min(), boxes_[2 * static_cast<int>(n) + 1] = box.max();
  }
  is_octree_fitted_ = true;
}

template <RealScalar Scalar>
SurfacePoint<Scalar> Cubes<Scalar>::nearest_point_in_octree(Vector const& point) {
  fit_octree();
  SurfacePoint<Scalar> best;
  if (!is_finite(point)) return best;
  constexpr Scalar slack = 1 + 64 * std::numeric_limits<Scalar>::epsilon();
  Scalar limit = std::numeric_limits<Scalar>::infinity();   // m², of the best
  auto const squared_distance = [&](int node) {
    return (point - Vector(boxes_[2 * node])).cwiseMin(Vector(boxes_[2 * node + 1]) - point).cwiseMin(Scalar(0)).squaredNorm();
  };
  auto const look = [&](int triangle) {
    auto const c = skin_.surface_.corners(triangle);
    auto const foot = detail::closest_to_origin<Scalar>(x_[c[0]] - point, x_[c[1]] - point, x_[c[2]] - point);
    if (!(foot.squared_distance < limit)) return;
    limit = foot.squared_distance;
    best = {triangle, foot.barycentric, Vector(point + foot.point), std::sqrt(foot.squared_distance)};
  };
  auto const search = [&](auto const& self, int node) -> void {
    auto const& [child, cube] = grid_.nodes()[at(node)];
    if (cube >= 0) {
      for (int const f : face_[at(cube)])
        if (f >= 0) for_each_triangle(f, look);
      return;
    }
    std::array<std::pair<Scalar, int>, 8> near;
    int n = 0;
    for (int const one : child)
      if (one >= 0) {
        std::pair<Scalar, int> const here{squared_distance(one), one};
        int place = n++;
        for (; place > 0 && here < near[at(place - 1)]; --place) near[at(place)] = near[at(place - 1)];
        near[at(place)] = here;
      }
    for (int k = 0; k < n && near[at(k)].first <= limit * slack; ++k) self(self, near[at(k)].second);
  };
  search(search, 0);
  return best;
}

/// After faces were opened: all anew, with what moves, nails and pushes the vertices before.
template <RealScalar Scalar>
void Cubes<Scalar>::reopen() {
  auto const last = save();
  std::vector<std::array<int, 8>> corners(at(cubes()));
  std::vector<std::array<int, 8>> const around = around_;
  for (int c = 0; c < cubes(); ++c) corners[at(c)] = grid_.corners(c);
  Fine const was_split = fine_;
  grid_.share_corners();
  build();
  // What splits of fine vertices is by cube and point; of others a cube that holds the copy tells which vertex it was.
  auto const count = [](std::array<int, 8> const& leaves) { return std::count_if(leaves.begin(), leaves.end(), [](int leaf) { return leaf >= 0; }); };
  auto const take = [&](int i, int from) {
    move_to(i, last.u.col(from));
    v_[i] = last.v.col(from), skin_.nailed_[at(i)] = last.nailed[at(from)];
    Scalar const share = Scalar(count(around_[at(i)])) / Scalar(count(around[at(from)]));
    load_[i] = share * last.load.col(from), pushed_[i] = share * last.pushed.col(from);
    if (load_[i] != Vector(Vector::Zero())) is_loaded_[at(i)] = 1, loaded_.push_back(i);
    return share;
  };
  for (int i = 0; i < base_; ++i) {
    auto const [c, k] = grid_.first(i);
    int const from = corners[at(c)][at(k)];
    Scalar const share = take(i, from);
    support_[at(i)] = share * last.support[at(from)];
    refresh(i);
  }
  idle_ = last.idle;
  if (!was_split.cubes.empty()) {
    wanted_ = was_split.cubes;
    refine();
    for (std::size_t n = 0; n < fine_.vertex.size(); ++n)
      if (int const v = fine_.vertex[n], from = was_split.vertex[n]; v >= base_) {
        if (hang_[at(v)].count == 0) move_to(v, last.u.col(from)), v_[v] = last.v.col(from);
      }
  }
  touched_ = last.touched;
  std::erase_if(touched_, [&](int i) { return i >= base_; });
  begin_order();
}

template <RealScalar Scalar>
int Cubes<Scalar>::cut(Vector const& a, Vector const& b, Vector const& c, Vector const& d) {
  for (Vector const& end : {a, b, c, d})
    check_finite("an end of the blade's edge", end, "m");
  auto const middle = [&](int cube) {
    Vector sum = Vector::Zero();
    for (int const v : grid_.corners(cube)) sum += x_[v];
    return Vector(sum / 8);
  };
  auto const passes = [](Vector const& p, Vector const& q, Vector const& i, Vector const& j, Vector const& k) {
    Vector const normal = (j - i).cross(k - i);
    Scalar const at_p = normal.dot(p - i), at_q = normal.dot(q - i);
    if ((at_p > 0) == (at_q > 0)) return false;
    Vector const x = p + at_p / (at_p - at_q) * (q - p);
    Scalar const slack = Scalar(-1e-5) * normal.squaredNorm();
    return normal.dot((j - i).cross(x - i)) >= slack && normal.dot((k - j).cross(x - j)) >= slack && normal.dot((i - k).cross(x - k)) >= slack;
  };
  Vector low = a, high = a;
  for (Vector const& end : {b, c, d}) low = low.cwiseMin(end), high = high.cwiseMax(end);
  int opened = 0;
  for (int cube = 0; cube < cubes(); ++cube) {
    Vector const here = middle(cube);
    for (int side = 1; side < 6; side += 2) {
      int const next = grid_.linked(cube, side);
      if (next < 0) continue;
      Vector const there = middle(next);
      if ((here.cwiseMin(there) - high).maxCoeff() > 0 || (low - here.cwiseMax(there)).maxCoeff() > 0) continue;
      if (passes(here, there, a, b, d) || passes(here, there, a, d, c)) opened += grid_.open(cube, side);
    }
  }
  if (opened > 0) reopen();
  return opened;
}

template <RealScalar Scalar>
int Cubes<Scalar>::detach(int vertex) {
  check_own(vertex, "detached");
  int opened = 0;
  for (int c = 0; c < cubes(); ++c)
    for (int k = 0; k < 8; ++k)
      if (grid_.corners(c)[at(k)] == vertex)
        for (int axis = 0; axis < 3; ++axis) opened += grid_.open(c, 2 * axis + (k >> axis & 1));
  if (opened > 0) reopen();
  return opened;
}

template <RealScalar Scalar>
void CubesOptions<Scalar>::validate() const {
  detail::OptionCheck const check{"Cubes"};
  check.positive(".edge", static_cast<double>(edge), " m");
  check.positive(".young", static_cast<double>(young), " Pa");
  check.not_negative(".density", static_cast<double>(density), " kg/m³");
  check(pretension >= 0 && pretension < 1, ".pretension", static_cast<double>(pretension), "springs are shorter by this share; give one from 0 to below 1");
  check(levels >= 0 && levels <= 4, ".levels", levels, "give how often a touched cube is split, 0 to 4");
  check(join_after >= 0, ".join_after", join_after, "give a number of steps, zero or more");
  check(touched_cubes >= 0, ".touched_cubes", touched_cubes, "give a number of cubes, zero or more");
  check(relaxation > 0 && relaxation < 2, ".relaxation", static_cast<double>(relaxation), "give a factor above 0 and below 2");
  check(sweeps >= 1, ".sweeps", sweeps, "give one or more");
  check(seconds > 0, ".seconds", seconds, " s", "give a time above zero, or none for no limit");
}

}  // namespace palpate
