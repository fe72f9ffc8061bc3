// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/particle_state.hpp>
#include <palpate/body/surface_changes.hpp>
#include <palpate/body/temporary_particles.hpp>
#include <palpate/collision/surface_tree.hpp>
#include <palpate/core/error.hpp>
#include <palpate/core/huge_page_vector.hpp>
#include <palpate/core/reserve_and_prefault.hpp>
#include <palpate/mesh/measures.hpp>
#include <palpate/mesh/normals.hpp>
#include <palpate/mesh/triangle_mesh.hpp>
#include <palpate/tissue/concept.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <tuple>
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
  Scalar mean_edge() const noexcept { return mean_edge_; }   // m, of the undeformed, uncut surface
  bool is_held(int i) const {
    check(i);
    return holds(i);
  }
  /// How often the body was restored: triangles and particles that were remembered before may not exist any more.
  std::size_t restorations() const noexcept { return restorations_; }
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
  Vector reference_position(int i) const {
    check(i);
    return state_.home[i];
  }
  /// The smooth outward unit normal there.
  Vector reference_normal(int i) const {
    check(i);
    return state_.normal[i];
  }

  /// The diagonal of the undisturbed body's bounding box [m]: found once, and anew when the home shape has changed. What a cut adds lies within.
  Scalar home_diagonal() {
    if (!home_box_is_known_) {
      std::tie(home_low_, home_high_) = low_and_high(state_.home.view());
      home_box_is_known_ = true;
    }
    return Vector(home_high_ - home_low_).norm();
  }

  // --- where a tool is nearest --------------------------------------------------------------------------------------
  /// The surface vertex nearest to a point, on the body as it is now.
  int nearest_vertex(Vector const& point) {
    if (!is_finite(point)) throw InvalidArgument("nearest_vertex: the point is not finite");
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

  /// What has changed since forget_changes(): particles and triangles added, changed, gone. Before the first call, and after restore(),
  /// everything is new. One host at a time can follow a body so. Allocates nothing; O(m log m) for m triangles changed.
  SurfaceChanges changes() noexcept {
    return {changes_.first_particle(), size(), changes_.first_triangle(), tree_.size(), changes_.sorted(), temporary_count()};
  }
  void forget_changes() noexcept { changes_.forget(size(), tree_.size()); }

  /// Divides a triangle in three at barycentric weights, all > 0. Returns the new particle.
  int insert_in_triangle(int t, Vector const& w)
    requires CuttableTissue<Tissue>
  {
    return edit_below_temporaries([&] {
      Corners const c = tissue_.surface().corners(t);
      int const n = tissue_.insert_in_triangle(t, w);
      state_.template add_between<3>(c, {w[0], w[1], w[2]});
      divide_in_tree(t);
      append_to_tree(t);
      disturbed_.push_back(n);
      return n;
    });
  }

  /// Divides the edge a–b at X_a + s (X_b − X_a), 0 < s < 1, and the one or two triangles at it. Returns the new particle.
  int insert_on_edge(int a, int b, Scalar s)
    requires CuttableTissue<Tissue>
  {
    while (Temporary const* const temporary = temporaries_.at_edge(a, b)) make_permanent(temporary->id);
    return edit_below_temporaries([&] {
      int const left = tissue_.surface().triangle_with_edge(a, b);
      int const right = tissue_.surface().triangle_with_edge(b, a);
      int const n = tissue_.insert_on_edge(a, b, s);
      state_.template add_between<2>({a, b}, {1 - s, s});
      for (int const t : {left, right})
        if (t >= 0) divide_in_tree(t);
      disturbed_.push_back(n);
      return n;
    });
  }

  /// Gives `triangles`, all at p, a copy of p as their corner; mass and springs are shared by area. Returns the copy.
  /// Keep the temporary particles at p first: their triangles change numbers.
  int split_particle(int p, std::span<int const> triangles)
    requires CuttableTissue<Tissue>
  {
    return edit_below_temporaries([&] {
      int const n = tissue_.split_particle(p, triangles);
      state_.add_copy(p);
      for (int const t : triangles) {
        tree_.relabel(state_.position.view(), t, tissue_.surface().corners(t));
        changes_.edited(t);
      }
      ++topology_revision_;
      disturbed_.push_back(p), disturbed_.push_back(n);
      return n;
    });
  }

  /// Undoes the last split: the last particle, temporary ones aside, goes back into p.
  void merge_last_particle(int p)
    requires CuttableTissue<Tissue>
  {
    edit_below_temporaries([&] {
      int const last = size() - 1;
      state_.merge_last(p, tissue_.mass(p), tissue_.mass(last));
      tissue_.merge_last_particle(p);
      for (int const t : tissue_.surface().triangles_at(p)) patch_tree(t);   // while the tree may still look at the old corner
      pop_particle();
      fit_tree_at(p);
      disturbed_.push_back(p);
      return p;
    });
  }

  /// Hands a triangle from one copy of a particle to another; masses stay.
  void change_corner(int t, int before, int now)
    requires CuttableTissue<Tissue>
  {
    tissue_.change_corner(t, before, now);
    temporaries_.change_corner(t, before, now);
    patch_tree(t);
    disturbed_.push_back(before), disturbed_.push_back(now);
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
    if constexpr (RedistributesMass<Tissue>) {
      auto const moved = [&](int from, int to, Scalar share) { mix_velocity(from, to, share); };
      last_look_.resize(static_cast<std::size_t>(size()));
      ++look_;
      auto const look_at = [&](int p) {   // once: one that gives mass later keeps what it needs, by the receiver's measure
        if (std::exchange(last_look_[static_cast<std::size_t>(p)], look_) != look_) tissue_.even_mass(p, moved);
      };
      for (std::size_t k = std::min(evened_, disturbed_.size()); k < disturbed_.size(); ++k) {
        int const p = disturbed_[k];
        if (p >= size()) continue;   // gone again
        look_at(p);
        tissue_.for_each_neighbour(p, look_at);
      }
      evened_ = disturbed_.size();
    }
  }

  /// Slides a particle over the surface, to barycentric weights of a triangle at it: it is another point of the same surface then, undeformed,
  /// at home and as the body is now. Mass, velocity and forces stay with it. Keep the temporary particles at p first.
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

  // --- what is there for the eye only -------------------------------------------------------------------------------
  /// Temporary particles, one for each blade that is inside a triangle, follow the corners of the triangle they divide, without mass or
  /// springs. They are the last particles, and the two triangles that each adds are the last ones: their numbers change with every edit.
  int temporary_count() const noexcept { return temporaries_.count(); }
  bool is_temporary(int particle) const noexcept { return particle >= size() - temporary_count(); }
  /// Calls visit(particle, weight) for the particles that carry this one: itself, or the corners that a temporary one follows.
  template <class Visit>
  void for_each_carrier(int i, Visit visit) const {
    if (!is_temporary(i)) {
      visit(i, Scalar(1));
      return;
    }
    temporaries_[static_cast<std::size_t>(i - size() + temporary_count())].for_each_parent(visit);
  }
  /// The temporary particle, or −1 once it was removed or kept.
  int temporary_particle(TemporaryId id) const noexcept {
    Temporary const* const temporary = temporaries_.find(id);
    return temporary != nullptr ? temporary->particle : -1;
  }
  /// Whether t is one of the three triangles that this temporary particle makes of one.
  bool divides(TemporaryId id, int t) const noexcept {
    Temporary const* const temporary = temporaries_.find(id);
    return temporary != nullptr && temporary->divides(t);
  }

  /// Divides a triangle like insert_in_triangle, for the eye only.
  TemporaryId insert_temporary(int t, Vector const& w)
    requires CuttableTissue<Tissue>
  {
    TemporaryId const id = temporaries_.new_id();
    insert_temporary(t, w, id);
    return id;
  }

  /// Moves a temporary particle within its triangle, to barycentric weights of the corners it was inserted with.
  void move_temporary(TemporaryId id, Vector const& w)
    requires CuttableTissue<Tissue>
  {
    Temporary& t = *temporaries_.find(id);
    t.set_weights(w);
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
    place(t);
    fit_tree_at(t.particle);
  }

  /// Takes a temporary particle away again. Where a corner of its triangle was parted into two copies, the whole triangle is at the one
  /// that was there first.
  void remove_temporary(TemporaryId id)
    requires CuttableTissue<Tissue>
  {
    std::size_t const first = withdraw(place_of(id));
    return_withdrawn(first, 1);
  }

  /// Makes a temporary particle one that stays: the edit that insert_in_triangle would have been, not too near an edge. Its blade learns
  /// of it from take_kept().
  void make_permanent(TemporaryId id)
    requires CuttableTissue<Tissue>
  {
    std::size_t const k = place_of(id), first = withdraw(0);
    Temporary const t = temporaries_.withdrawn(first + k);
    int const second = tissue_.surface().triangle_count();
    int const n = insert_in_triangle(t.triangle, kept_weights(t.triangle, t.whole_weights()));
    hang_parts(t, {t.triangle, second, second + 1});
    if (t.split_corner >= 0) balance_copies(t.parents[static_cast<std::size_t>(t.split_corner)], t.parents[3]);
    temporaries_.keep(id, n);
    temporaries_.forget_withdrawn(first + k);
    return_withdrawn(first);
  }
  /// Weights of a point of a triangle where a particle may stay that snaps to nothing: the triangles around it keep an area, also where one cut after
  /// the other ends in the same thin triangle.
  Vector kept_weights(int t, Vector const& w) const {
    Corners const c = tissue_.surface().corners(t);
    return off_edges<Scalar>({tissue_.rest_position(c[0]), tissue_.rest_position(c[1]), tissue_.rest_position(c[2])}, w, min_kept_weight, mean_edge_ / 200);
  }
  /// The same for all that divide a triangle at this particle: whoever edits the triangles there asks for it first. False if there is none.
  bool keep_temporaries_at(int particle)
    requires CuttableTissue<Tissue>
  {
    bool kept = false;
    while (Temporary const* const temporary = temporaries_.following(particle)) {
      make_permanent(temporary->id);
      kept = true;
    }
    return kept;
  }
  /// The same for the one that divides triangle t, if there is one. Returns the particle, or −1.
  int make_permanent_in(int t)
    requires CuttableTissue<Tissue>
  {
    Temporary const* const temporary = temporaries_.in_triangle(t);
    if (temporary == nullptr) return -1;
    make_permanent(temporary->id);
    return temporaries_.last_kept();
  }
  void keep_temporaries()
    requires CuttableTissue<Tissue>
  {
    while (!temporaries_.empty()) make_permanent(temporaries_[0].id);
  }
  /// A cut that is being made ends a tick on a particle that may have been there before: whoever has parted that one no longer joins it again.
  void advance_cut_epoch() noexcept { ++cut_epoch_; }
  std::size_t cut_epoch() const noexcept { return cut_epoch_; }
  /// The particle that a temporary one has become, or −1; told once.
  int take_kept(TemporaryId id) noexcept { return temporaries_.take_kept(id); }

  /// Room for this many particles and triangles: up to there cutting does not allocate, also after restore(). A cutter grows its own lists
  /// once. Temporary particles and triangles count: leave room for two and two. What such a cut commonly grows into is touched; in large bodies
  /// the first touch of the rest waits for a page of 2 MiB.
  void reserve(int particles, int triangles) {
    state_.reserve(particles);
    tree_.reserve(triangles);
    changes_.reserve(triangles);
    reserved_triangles_ = std::max(reserved_triangles_, triangles);
    auto const more = static_cast<std::size_t>(std::max(0, particles - size()));
    reserve_and_prefault(disturbed_, 4 * static_cast<std::size_t>(particles), 4 * more);
    reserve_and_prefault(last_look_, static_cast<std::size_t>(particles));
    temporaries_.reserve(8);
    if constexpr (ReservesMemory<Tissue>) tissue_.reserve(particles, triangles);
  }

 protected:
  using Temporary = TemporaryParticle<Scalar>;

  explicit BodyShape(Tissue tissue) : tissue_(std::move(tissue)) {
    state_.resize(tissue_.size());
    for (int i = 0; i < tissue_.size(); ++i) state_.position[i] = state_.home[i] = tissue_.rest_position(i);
    set_normals();
    build_tree();
    mean_edge_ = mean_edge_length(rest_mesh());
    last_look_.resize(static_cast<std::size_t>(size()));   // now, not in the tick that cuts first
  }

  void check(int particle) const { detail::check_index("particle", particle, size()); }

  bool holds(int i) const noexcept { return state_.held[static_cast<std::size_t>(i)] != 0; }
  bool is_free(int i) const noexcept { return !tissue_.nailed(i) && !holds(i) && !is_temporary(i); }

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

  /// Temporary particles follow the corners of the triangles they divide.
  void place_temporaries() noexcept {
    for (Temporary const& temporary : temporaries_) place(temporary);
  }

  Tissue tissue_;
  ParticleState<Scalar> state_;
  SurfaceTree<Scalar> tree_;
  bool tree_is_fitted_ = false;
  TemporaryParticles<Scalar> temporaries_;
  std::size_t cut_epoch_ = 0;   // how often a cut has come to stand on a particle
  std::vector<int> disturbed_;   // particles whose springs an edit has changed since the last step
  std::size_t evened_ = 0;       // so many of them have been looked at by even_masses()
  HugePageVector<unsigned> last_look_;   // which of its calls looked at each particle last
  unsigned look_ = 0;
  std::size_t topology_revision_ = 0;
  std::size_t restorations_ = 0;
  Scalar mean_edge_ = 0;   // m
  Vector home_low_ = Vector::Zero(), home_high_ = Vector::Zero();   // m, of the undisturbed body
  bool home_box_is_known_ = false;
  int reserved_triangles_ = 0;
  detail::ChangeRecord changes_;   // of particles and triangles, for a host's copy

 private:
  static constexpr Scalar min_kept_weight = Scalar(0.1);   // of each corner of its triangle

  std::size_t place_of(TemporaryId id) const noexcept { return static_cast<std::size_t>(temporaries_.find(id) - &temporaries_[0]); }

  /// Takes the temporary particles from the k-th on away. Returns where they begin among the withdrawn.
  std::size_t withdraw(std::size_t k) {
    std::size_t const first = temporaries_.withdrawn_count();
    temporaries_.remember_from(k);
    for (std::size_t left = static_cast<std::size_t>(temporaries_.count()); left > k; --left) {
      Temporary const t = temporaries_[left - 1];
      temporaries_.remove_last();
      tree_.remove_last(state_.position.view());
      tree_.remove_last(state_.position.view());
      changes_.triangles_fell_to(tree_.size());
      tissue_.remove_temporary(t.triangle, {t.parents[0], t.parents[1], t.parents[2]});
      patch_tree(t.triangle);   // while the tree may still look at the old corner
      pop_particle();
    }
    return first;
  }
  /// Puts those that were withdrawn to this place there again, but for the first few.
  void return_withdrawn(std::size_t first, std::size_t left_out = 0) {
    for (std::size_t k = first + left_out; k < temporaries_.withdrawn_count(); ++k) {
      Temporary const t = temporaries_.withdrawn(k);
      int const second = tree_.size();
      insert_temporary(t.triangle, t.whole_weights(), t.id);
      hang_parts(t, {t.triangle, second, second + 1});
    }
    temporaries_.forget_withdrawn_from(first);
  }
  void insert_temporary(int t, Vector const& w, TemporaryId id) {
    Corners const c = tissue_.surface().corners(t);
    int const n = tissue_.insert_temporary(t, w);
    state_.template add_between<3>(c, {w[0], w[1], w[2]});
    temporaries_.add({id, t, tree_.size(), n, {c[0], c[1], c[2], -1}, {w[0], w[1], w[2], 0}});
    divide_in_tree(t);
    append_to_tree(t);
  }
  /// Hands the parts of a divided triangle that were at a copy of its corner over to that.
  void hang_parts(Temporary const& t, std::array<int, 3> const& parts) {
    for (std::size_t k = 0; k < 3; ++k)
      if (t.at_copy[k]) change_corner(parts[k], t.parents[static_cast<std::size_t>(t.split_corner)], t.parents[3]);
  }
  /// An edit that adds particles or triangles which stay, or takes such away: meanwhile nothing temporary is there.
  template <class Edit>
  auto edit_below_temporaries(Edit const& edit) {
    if (temporaries_.empty()) return edit();
    std::size_t const first = withdraw(0);
    auto const result = edit();
    return_withdrawn(first);
    return result;
  }

  void place(Temporary const& temporary) noexcept {
    Vector x = Vector::Zero(), v = Vector::Zero();
    temporary.for_each_parent([&](int i, Scalar weight) {
      x += weight * state_.position[i];
      v += weight * state_.velocity[i];
    });
    state_.position[temporary.particle] = x;
    state_.velocity[temporary.particle] = v;
  }

  /// Particle `to` has got this share of its mass from `from`: an inelastic impact.
  void mix_velocity(int from, int to, Scalar share) noexcept { state_.velocity[to] += share * (state_.velocity[from] - state_.velocity[to]); }

  void pop_particle() noexcept {
    state_.pop();
    changes_.particles_fell_to(size());
  }

  void patch_tree(int t) {
    Corners const now = tissue_.surface().corners(t);
    if (now != tree_.corners(t)) changes_.edited(t);
    tree_.replace(state_.position.view(), t, now);
    ++topology_revision_;
  }
  void divide_in_tree(int t) {
    tree_.divide(state_.position.view(), t, tissue_.surface().corners(t), tissue_.surface().corners(tree_.size()));
    changes_.edited(t);
    ++topology_revision_;
  }
  void append_to_tree(int sibling) { tree_.add(state_.position.view(), tissue_.surface().corners(tree_.size()), sibling); }
};

}  // namespace palpate
