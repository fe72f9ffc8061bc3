// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/particle_state.hpp>
#include <palpate/collision/surface_tree.hpp>
#include <palpate/core/error.hpp>
#include <palpate/mesh/normals.hpp>
#include <palpate/mesh/triangle_mesh.hpp>
#include <palpate/tissue/concept.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace palpate {

/// The shape of a soft body: its tissue, where each particle is, the surface a tool can touch, and how all of that follows a cut.
/// Shapes     positions(), velocities(): 3 × size(), one column per particle, in the order of the mesh; particles that a cut adds are appended.
/// Invariant  tissue, per-particle state and search tree hold the same particles and triangles after every call.
/// Cost       an edit is O(triangles at the particles it touches) + O(log triangles); nearest_… fit the tree when the body has moved.
template <TissueModel TissueType>
class BodyShape {
 public:
  using Tissue = TissueType;
  using Scalar = typename Tissue::Scalar;
  using Vector = Vector3<Scalar>;
  using Corners = std::array<int, 3>;

  // --- what it is ---------------------------------------------------------------------------------------------------
  Tissue const& tissue() const noexcept { return tissue_; }
  int size() const noexcept { return state_.size(); }
  auto positions() const noexcept { return state_.position.view(); }
  auto velocities() const noexcept { return state_.velocity.view(); }
  auto triangles() const noexcept { return tissue_.surface().triangles(); }

  /// How far a particle is from its undeformed position [m].
  Vector displacement(int i) const {
    check(i);
    return state_.position[i] - tissue_.rest_position(i);
  }
  /// The surface as it is now. A copy: for pictures and measures, not for the servo.
  TriangleMesh<Scalar> mesh() const { return {state_.position.view(), triangles()}; }
  /// The undeformed surface, cuts included. A copy.
  TriangleMesh<Scalar> rest_mesh() const {
    TriangleMesh<Scalar> mesh{Matrix3X<Scalar>(3, size()), triangles()};
    for (int i = 0; i < size(); ++i) mesh.points.col(i) = tissue_.rest_position(i);
    return mesh;
  }
  /// Where a particle is in the undisturbed body: undeformed, or in equilibrium after settle(). Depth is counted from there.
  Vector home_position(int i) const {
    check(i);
    return state_.home[i];
  }
  /// The smooth outward unit normal there.
  Vector home_normal(int i) const {
    check(i);
    return state_.normal[i];
  }

  /// The diagonal of the undisturbed body's bounding box [m]: found once, and anew when the home shape has changed. What a cut adds lies within.
  Scalar home_diagonal() {
    if (!home_box_is_known_) {
      home_low_ = state_.home.view().rowwise().minCoeff(), home_high_ = state_.home.view().rowwise().maxCoeff();
      home_box_is_known_ = true;
    }
    return (home_high_ - home_low_).norm();
  }

  // --- where a tool is nearest --------------------------------------------------------------------------------------
  /// The surface vertex nearest to a point, on the body as it is now.
  int nearest_vertex(Vector const& point) {
    if (!point.allFinite()) throw InvalidArgument("nearest_vertex: the point is not finite");
    fit_tree();
    return tree_.nearest_vertex(state_.position.view(), point);
  }
  /// The surface point nearest to a point, on the body as it is now; not found() for a point that is not finite. A triangle that is likely
  /// near saves time.
  SurfacePoint<Scalar> nearest_point(Vector const& point, int hint = -1) {
    fit_tree();
    return tree_.nearest(state_.position.view(), point, hint);
  }

  // --- how its topology changes -------------------------------------------------------------------------------------
  /// Counts the changes of the triangles: a renderer whose count differs must take them anew.
  std::size_t topology_revision() const noexcept { return topology_revision_; }

  /// Divides a triangle in three at barycentric weights, all > 0. Returns the new particle.
  int insert_in_triangle(int t, Vector const& w)
    requires CuttableTissue<Tissue>
  {
    Corners const c = tissue_.surface().corners(t);
    int const n = tissue_.insert_in_triangle(t, w);
    state_.template add_between<3>(c, {w[0], w[1], w[2]});
    divide_in_tree(t);
    append_to_tree(t);
    disturbed_.push_back(n);
    return n;
  }

  /// Divides the edge a–b at X_a + s (X_b − X_a), 0 < s < 1, and the one or two triangles at it. Returns the new particle.
  int insert_on_edge(int a, int b, Scalar s)
    requires CuttableTissue<Tissue>
  {
    int const left = tissue_.surface().triangle_with_edge(a, b);
    int const right = tissue_.surface().triangle_with_edge(b, a);
    int const n = tissue_.insert_on_edge(a, b, s);
    state_.template add_between<2>({a, b}, {1 - s, s});
    for (int const t : {left, right})
      if (t >= 0) divide_in_tree(t);
    disturbed_.push_back(n);
    return n;
  }

  /// Gives `triangles`, all at p, a copy of p as their corner; mass and springs are shared by area. Returns the copy.
  /// Not while there is a temporary particle.
  int split_particle(int p, std::span<int const> triangles)
    requires CuttableTissue<Tissue>
  {
    int const n = tissue_.split_particle(p, triangles);
    state_.add_copy(p);
    for (int const t : triangles) tree_.relabel(state_.position.view(), t, tissue_.surface().corners(t));
    ++topology_revision_;
    disturbed_.insert(disturbed_.end(), {p, n});
    return n;
  }

  /// Undoes the last split: the last particle goes back into p.
  void merge_last_particle(int p)
    requires CuttableTissue<Tissue>
  {
    int const last = size() - 1;
    state_.merge_last(p, tissue_.mass(p), tissue_.mass(last));
    tissue_.merge_last_particle(p);
    for (int const t : tissue_.surface().triangles_at(p)) patch_tree(t);   // while the tree may still look at the old corner
    state_.pop();
    fit_tree_at(p);
    disturbed_.push_back(p);
  }

  /// Hands a triangle from one copy of a particle to another; masses stay.
  void change_corner(int t, int before, int now)
    requires CuttableTissue<Tissue>
  {
    tissue_.change_corner(t, before, now);
    if (temporary_)   // its place is between both copies
      for (std::size_t k = 0; k < 3; ++k)
        if (temporary_->parents[k] == before && temporary_->parents[3] < 0) {
          temporary_->parents[3] = now;
          temporary_->split_corner = static_cast<int>(k);
          temporary_->weights[k] = temporary_->weights[3] = temporary_->weights[k] / 2;
        }
    patch_tree(t);
    disturbed_.insert(disturbed_.end(), {before, now});
  }

  /// Shares the mass of two copies of one particle, still together, anew by the area around each. Mass takes its velocity along.
  void balance_copies(int p, int copy)
    requires CuttableTissue<Tissue>
  {
    Scalar const before = tissue_.mass(copy);
    tissue_.balance_copies(p, copy);
    Scalar const gained = tissue_.mass(copy) - before;
    if (gained > 0)
      mix_velocity(p, copy, gained / tissue_.mass(copy));
    else
      mix_velocity(copy, p, -gained / tissue_.mass(p));
  }

  /// Evens out the masses around all that was edited since the last call, where the tissue can: a cutter asks for it once a tick.
  /// Momentum is kept, and the kinetic energy does not rise.
  void even_masses() {
    if constexpr (EvensMasses<Tissue>) {
      auto const moved = [&](int from, int to, Scalar share) { mix_velocity(from, to, share); };
      for (std::size_t k = std::min(evened_, disturbed_.size()); k < disturbed_.size(); ++k) {
        int const p = disturbed_[k];
        if (p >= size()) continue;   // gone again
        tissue_.even_mass(p, moved);
        tissue_.for_each_neighbour(p, [&](int q) { tissue_.even_mass(q, moved); });
      }
      evened_ = disturbed_.size();
    }
  }

  /// Slides a particle over the surface, to barycentric weights of a triangle at it: it is another point of the same surface then, undeformed,
  /// at home and as the body is now. Mass, velocity and forces stay with it. Not beside a temporary particle.
  void slide_particle(int p, int t, Vector const& w)
    requires SeparableTissue<Tissue>
  {
    Corners const c = tissue_.surface().corners(t);
    auto const mean = [&](auto const& at) { return Vector(w[0] * at(c[0]) + w[1] * at(c[1]) + w[2] * at(c[2])); };
    Vector const rest = mean([&](int i) { return Vector(tissue_.rest_position(i)); });
    Vector const home = state_.home[p];
    for (int k = 0; k < 3; ++k)
      if (home_low_[k] < home_high_[k] && (home[k] <= home_low_[k] || home[k] >= home_high_[k])) home_box_is_known_ = false;
    for (auto* columns : {&state_.position, &state_.home, &state_.normal}) (*columns)[p] = mean([&](int i) { return Vector((*columns)[i]); });
    if (Scalar const length = state_.normal[p].norm(); length > 0) state_.normal[p] /= length;
    tissue_.move_rest(p, rest);
    fit_tree_at(p);
    ++topology_revision_;
    disturbed_.push_back(p);
  }

  /// Divides a triangle like insert_in_triangle, for the eye only: the particle follows the triangle's corners, without mass or springs.
  int insert_temporary(int t, Vector const& w)
    requires CuttableTissue<Tissue>
  {
    Corners const c = tissue_.surface().corners(t);
    int const n = tissue_.insert_temporary(t, w);
    state_.template add_between<3>(c, {w[0], w[1], w[2]});
    temporary_ = Temporary{t, n, {c[0], c[1], c[2], -1}, {w[0], w[1], w[2], 0}, -1};
    divide_in_tree(t);
    append_to_tree(t);
    return n;
  }

  /// Moves the temporary particle within its triangle, to barycentric weights of the corners it was inserted with.
  void move_temporary(Vector const& w)
    requires CuttableTissue<Tissue>
  {
    Temporary& t = *temporary_;
    t.weights = {w[0], w[1], w[2], 0};
    if (t.split_corner >= 0) {
      auto const k = static_cast<std::size_t>(t.split_corner);
      t.weights[k] = t.weights[3] = t.weights[k] / 2;
    }
    Vector rest = Vector::Zero(), home = Vector::Zero(), normal = Vector::Zero();
    for (std::size_t k = 0; k < 3; ++k) {
      Scalar const part = w[static_cast<int>(k)];
      rest += part * tissue_.rest_position(t.parents[k]);
      home += part * state_.home[t.parents[k]];
      normal += part * state_.normal[t.parents[k]];
    }
    tissue_.move_temporary(t.particle, rest);
    state_.home[t.particle] = home;
    state_.normal[t.particle] = normal.normalized();
    place_temporary();
    fit_tree_at(t.particle);
  }

  /// Takes the temporary particle away again; the triangle it divided gets `corners`.
  void remove_temporary(Corners const& corners)
    requires CuttableTissue<Tissue>
  {
    int const t = temporary_->triangle;
    tree_.remove_last(state_.position.view());
    tree_.remove_last(state_.position.view());
    tissue_.remove_temporary(t, corners);
    patch_tree(t);   // while the tree may still look at the old corner
    state_.pop();
    temporary_.reset();
  }

  /// The temporary particle, or −1.
  int temporary_particle() const noexcept { return temporary_ ? temporary_->particle : -1; }
  /// The triangle that is divided for it, or −1; two more, the last ones, belong to it.
  int temporary_triangle() const noexcept { return temporary_ ? temporary_->triangle : -1; }

  /// Room for this many particles and triangles: up to there cutting does not allocate, also after restore(). A cutter grows its own lists
  /// once. Temporary particles and triangles count: leave room for two and two.
  void reserve(int particles, int triangles) {
    state_.reserve(particles);
    tree_.reserve(triangles);
    reserved_triangles_ = std::max(reserved_triangles_, triangles);
    disturbed_.reserve(4 * static_cast<std::size_t>(particles));
    if constexpr (requires { tissue_.reserve(particles, triangles); }) tissue_.reserve(particles, triangles);
  }

 protected:
  struct Temporary {
    int triangle;
    int particle;
    std::array<int, 4> parents;      // three corners, and the copy of one of them once it is split
    std::array<Scalar, 4> weights;
    int split_corner;                // which of the three that is, or −1
  };

  explicit BodyShape(Tissue tissue) : tissue_(std::move(tissue)) {
    state_.resize(tissue_.size());
    for (int i = 0; i < tissue_.size(); ++i) state_.position[i] = state_.home[i] = tissue_.rest_position(i);
    set_normals();
    build_tree();
  }

  void check(int particle) const { detail::check_index("particle", particle, size()); }

  void set_normals() {
    state_.normal.view() = vertex_normals(TriangleMesh<Scalar>{state_.home.view(), triangles()});
    home_box_is_known_ = false;
    home_diagonal();   // now, not in the tick in which a tool comes
  }

  void build_tree() {
    tree_ = SurfaceTree<Scalar>(state_.position.view(), triangles());
    tree_.reserve(reserved_triangles_);
    tree_is_fitted_ = true;
    home_box_is_known_ = false;
    home_diagonal();   // now, not in the tick in which a tool comes
  }
  void fit_tree() noexcept {
    if (tree_is_fitted_) return;
    tree_.refit(state_.position.view());
    tree_is_fitted_ = true;
  }

  /// One particle has moved.
  void fit_tree_at(int particle) noexcept {
    if (tree_is_fitted_) tree_.refit(state_.position.view(), tissue_.surface().triangles_at(particle));
  }

  /// The temporary particle follows the corners of the triangle it divides.
  void place_temporary() noexcept {
    if (!temporary_) return;
    Vector x = Vector::Zero(), v = Vector::Zero();
    for (std::size_t k = 0; k < 4; ++k) {
      if (temporary_->parents[k] < 0) continue;
      x += temporary_->weights[k] * state_.position[temporary_->parents[k]];
      v += temporary_->weights[k] * state_.velocity[temporary_->parents[k]];
    }
    state_.position[temporary_->particle] = x;
    state_.velocity[temporary_->particle] = v;
  }

  Tissue tissue_;
  ParticleState<Scalar> state_;
  SurfaceTree<Scalar> tree_;
  bool tree_is_fitted_ = false;
  std::optional<Temporary> temporary_;
  std::vector<int> disturbed_;   // particles whose springs an edit has changed since the last step
  std::size_t evened_ = 0;       // so many of them have been looked at by even_masses()
  std::size_t topology_revision_ = 0;
  Vector home_low_ = Vector::Zero(), home_high_ = Vector::Zero();   // m, of the undisturbed body
  bool home_box_is_known_ = false;
  int reserved_triangles_ = 0;

 private:
  /// Particle `to` has got this share of its mass from `from`: an inelastic impact.
  void mix_velocity(int from, int to, Scalar share) noexcept { state_.velocity[to] += share * (state_.velocity[from] - state_.velocity[to]); }

  void patch_tree(int t) {
    tree_.replace(state_.position.view(), t, tissue_.surface().corners(t));
    ++topology_revision_;
  }
  void divide_in_tree(int t) {
    tree_.divide(state_.position.view(), t, tissue_.surface().corners(t), tissue_.surface().corners(tree_.size()));
    ++topology_revision_;
  }
  void append_to_tree(int sibling) { tree_.add(state_.position.view(), tissue_.surface().corners(tree_.size()), sibling); }
};

}  // namespace palpate
