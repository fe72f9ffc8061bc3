// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/particle_state.hpp>
#include <palpate/body/surface_changes.hpp>
#include <palpate/body/temporary_subdivision.hpp>
#include <palpate/collision/surface_tree.hpp>
#include <palpate/core/error.hpp>
#include <palpate/core/huge_page_vector.hpp>
#include <palpate/core/reserve_and_prefault.hpp>
#include <palpate/mesh/measures.hpp>
#include <palpate/mesh/normals.hpp>
#include <palpate/mesh/solid_edit.hpp>
#include <palpate/mesh/topology_edit.hpp>
#include <palpate/mesh/tetrahedral_mesh.hpp>
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
  /// How often that was so, or tetrahedra were taken away: those and triangles that were remembered before may have other numbers.
  std::size_t renumberings() const noexcept { return restorations_ + removals_; }
  /// Which numbers its triangles and tetrahedra have: another one after some were taken away, and the one of then after a restore.
  std::size_t numbering() const noexcept { return numbering_; }
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
  /// The same as a picture shows it while a blade is inside: wounds are open up to the blade. See temporary_subdivisions().
  TriangleMesh<Scalar> drawn_mesh() const {
    TriangleMesh<Scalar> mesh;
    draw_columns(positions(), mesh.points);
    draw_triangles(mesh.triangles);
    return mesh;
  }
  /// The undeformed surface, cuts included. A copy.
  TriangleMesh<Scalar> rest_mesh() const {
    TriangleMesh<Scalar> mesh{Matrix3X<Scalar>(3, size()), triangles()};
    for (int i = 0; i < size(); ++i) mesh.points.col(i) = tissue_.rest_position(i);
    return mesh;
  }
  /// The tetrahedra of a solid, undeformed and as they are now, cuts included. Copies.
  TetrahedralMesh<Scalar> rest_solid() const
    requires CuttableSolid<Tissue>
  {
    return {rest_mesh().points, tissue_.topology().tetrahedra()};
  }
  TetrahedralMesh<Scalar> solid() const
    requires CuttableSolid<Tissue>
  {
    return {positions(), tissue_.topology().tetrahedra()};
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

  /// Calls visit(triangle) for all triangles of the body as it is now that may meet a box, or the straight way between two points [m], and some beside them.
  template <class Visit>
  void visit_triangles_in_box(Vector const& low, Vector const& high, Visit&& visit) {
    fit_tree();
    tree_.visit_in_box(low, high, visit);
  }
  template <class Visit>
  void visit_triangles_along(Vector const& from, Vector const& to, Visit&& visit) {
    fit_tree();
    tree_.visit_along(from, to, visit);
  }

  /// The triangle beyond the edge a → b of a triangle, or −1 at a border or wound. Beside a blade it is the one that a picture shows there.
  int triangle_across(int a, int b) const noexcept {
    auto const& surface = tissue_.surface();
    int const found = surface.triangle_with_edge(b, a);
    for (auto t = temporaries_.begin(); found < 0 && t != temporaries_.end(); ++t) {
      auto const other = [&](int p) { return p == t->lips[0] ? t->lips[1] : p == t->lips[1] ? t->lips[0] : p; };
      int const beyond = surface.triangle_with_edge(other(b), other(a));
      if (beyond >= 0 && (beyond == t->triangle || surface.triangle_with_edge(a, b) == t->triangle)) return beyond;
    }
    return found;
  }

  // --- how its topology changes -------------------------------------------------------------------------------------
  /// Counts the changes of the triangles: a renderer whose count differs must take them anew.
  std::size_t topology_revision() const noexcept { return topology_revision_; }

  /// What has changed since forget_changes(): particles and triangles added, changed, gone. Before the first call, and after restore(),
  /// everything is new. One host at a time can follow a body so. Allocates nothing; O(m log m) for m triangles changed.
  SurfaceChanges changes() noexcept {
    return {changes_.first_particle(), size(), changes_.first_triangle(), tree_.size(), changes_.sorted()};
  }
  void forget_changes() noexcept { changes_.forget(size(), tree_.size()); }

  /// What has been done to the tetrahedra of a solid since it was made, in order; after restore() up to then. Any number of hosts may follow.
  std::span<SolidEdit<Scalar> const> solid_edits() const noexcept { return solid_edits_; }

  /// Divides a triangle in three at barycentric weights, all > 0. Returns the new particle. Call make_permanent_in(t) first: a blade that is in it
  /// would be in the first of the three.
  int insert_in_triangle(int t, Vector const& w)
    requires CuttableTissue<Tissue>
  {
    Corners const c = tissue_.surface().corners(t);
    return edit(c, std::array{w[0], w[1], w[2]}, [&] { return tissue_.insert_in_triangle(t, w); });
  }

  /// Divides the edge a–b at X_a + s (X_b − X_a), 0 < s < 1, and the one or two triangles at it; of a solid, the tetrahedra round it. Returns the new
  /// particle.
  int insert_on_edge(int a, int b, Scalar s)
    requires(CuttableTissue<Tissue> || CuttableSolid<Tissue>)
  {
    std::array const weights{1 - s, s};
    int n = -1;
    if constexpr (CuttableTissue<Tissue>)
      if (!is_solid()) {
        make_permanent_on(a, b);
        n = edit(std::array{a, b}, weights, [&] { return tissue_.insert_on_edge(a, b, s); });
      }
    if constexpr (CuttableSolid<Tissue>)
      if (is_solid()) {
        TopologyEdit const made = tissue_.divide_edge(a, b, s);
        apply(made, weights);
        n = made.vertex;
      }
    return n;
  }

  /// Gives `triangles`, all at p, a copy of p as their corner; mass and springs are shared by area. Returns the copy.
  /// The list is the caller's own: that of the surface changes meanwhile. Call make_permanent_at(p) first.
  int split_particle(int p, std::span<int const> triangles)
    requires CuttableTissue<Tissue>
  {
    disturbed_.push_back(p);
    return edit(std::array{p}, std::array{Scalar(1)}, [&] { return tissue_.split_particle(p, triangles); });
  }

  /// Undoes the last split: the last particle goes back into p.
  void merge_last_particle(int p)
    requires CuttableTissue<Tissue>
  {
    int const last = size() - 1;
    Scalar const share = is_free(p) ? tissue_.mass(last) / (tissue_.mass(p) + tissue_.mass(last)) : Scalar(0);   // what is nailed or held stays where it is
    state_.merge_last(p, share);
    tissue_.merge_last_particle(p);
    for (int const t : tissue_.surface().triangles_at(p)) patch_tree(t);   // while the tree may still look at the old corner
    state_.pop();
    changes_.particles_fell_to(size());
    fit_tree_at(p);
    disturbed_.push_back(p);
  }

  /// Hands a triangle from one copy of a particle to another; masses stay.
  void change_corner(int t, int before, int now)
    requires CuttableTissue<Tissue>
  {
    tissue_.change_corner(t, before, now);
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

  /// Evens out the masses around all that was edited since the last call, where the tissue can: a cutter asks for it once a tick. Those of elastic solids stay
  /// as they are lumped where the integrator stands steps of any size. Momentum is kept, but for what goes into nails and hands, and the kinetic energy does not rise.
  void even_masses() {
    if constexpr (EvensMass<Tissue>)
      if (RedistributesMass<Tissue> || !any_step_is_stable_) look_at_masses();
    evened_ = disturbed_.size();
  }

  /// Slides a particle over the surface, to barycentric weights of a triangle at it: it is another point of the same surface then, undeformed,
  /// at home and as the body is now. Mass, velocity and forces stay with it. Call make_permanent_at(p) first.
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

  // --- the same of a solid; after all edits of a tick: finish_edits() -------------------------------------------------
  /// Gives some of the tetrahedra at a particle a copy of it; faces between those and the others open. Returns the copy.
  int split_vertex(int p, std::span<int const> tetrahedra)
    requires CuttableSolid<Tissue>
  {
    TopologyEdit const made = tissue_.split_vertex(p, tetrahedra);
    disturbed_.push_back(p);
    apply(made, std::array{Scalar(1)});
    return made.vertex;
  }
  /// Marks an inner face of a tetrahedron as cut, though not open yet.
  void mark_cut(int tetrahedron, int face)
    requires CuttableSolid<Tissue>
  {
    tissue_.mark_cut(tetrahedron, face);
  }
  /// Takes a tetrahedron away: the last one gets its number, and border triangles leave theirs to the last ones. Particles keep their numbers; one that no
  /// tetrahedron holds any more stays where it is, nailed, and weighs nothing.
  void remove_tetrahedron(int tetrahedron)
    requires RemovableSolid<Tissue>
  {
    TetrahedronRemoval const removal = tissue_.remove_tetrahedron(tetrahedron);
    auto const points = state_.position.view();
    for (auto const& corners : removal.opened()) tree_.add(points, corners, removal.gone_count > 0 ? removal.gone()[0] : -1);
    for (int const triangle : removal.gone()) {
      changes_.edited(triangle);
      tree_.remove(points, triangle);
      changes_.triangles_fell_to(tree_.size());
    }
    for (int const p : removal.corners) {
      disturbed_.push_back(p);
      if (!(tissue_.mass(p) > 0)) state_.velocity[p].setZero(), state_.remembered[p].setZero();
    }
    solid_edits_.push_back({.kind = SolidEdit<Scalar>::Kind::removed, .first = tetrahedron, .second = removal.last});
    ++topology_revision_, numbering_ = removals_ = std::max(removals_, numbering_) + 1;   // the latter may be another body's
  }
  /// Once after the edits of a tick: what is near what, the normals at what they have opened, and masses as even_masses() has them.
  void finish_edits()
    requires CuttableSolid<Tissue>
  {
    tissue_.finish_edits();
    auto const find_normal = [&](int p) {
      auto const of = [&](int t) {
        Corners const c = tissue_.surface().corners(t);
        return Vector((state_.home[c[1]] - state_.home[c[0]]).cross(state_.home[c[2]] - state_.home[c[0]]));
      };
      Vector sum = Vector::Zero();
      Scalar largest = 0;
      for (int const t : tissue_.surface().triangles_at(p)) sum += of(t), largest = std::max(largest, of(t).norm());
      auto const around = tissue_.surface().triangles_at(p);
      if (around.empty()) return;
      // At the end of a cut both walls face each other, and their normals sum up to nothing: then that of one of them.
      if (!(sum.norm() > Scalar(1e-3) * largest)) sum = of(around.front());
      state_.normal[p] = sum.normalized();
    };
    auto const first = disturbed_.begin() + static_cast<std::ptrdiff_t>(std::min(evened_, disturbed_.size()));
    std::sort(first, disturbed_.end());
    disturbed_.erase(std::unique(first, disturbed_.end()), disturbed_.end());
    std::for_each(first, disturbed_.end(), find_normal);
    even_masses();
  }

  // --- what is there for the eye only -------------------------------------------------------------------------------
  /// One for each blade that is inside a triangle: how a picture shows that triangle. Edits at the triangle's corners make it permanent first.
  std::span<TemporarySubdivision<Scalar> const> temporary_subdivisions() const noexcept { return temporaries_; }
  /// The subdivision, or null once it was removed or made permanent.
  TemporarySubdivision<Scalar> const* find_temporary(TemporaryId id) const noexcept {
    auto const found = std::find_if(temporaries_.begin(), temporaries_.end(), [&](Temporary const& temporary) { return temporary.id == id; });
    return found == temporaries_.end() ? nullptr : &*found;
  }
  /// A field of the particles, 3 × size(), with a column more for each temporary subdivision: its mean at the blade.
  template <class Columns>
  void draw_columns(Columns const& values, Matrix3X<Scalar>& to) const {
    to.resize(3, size() + std::ssize(temporaries_));
    to.leftCols(size()) = values;
    for (int column = size(); Temporary const& temporary : temporaries_)
      to.col(column++) = temporary.mean(tissue_.surface().corners(temporary.triangle), values);
  }
  /// The triangles with those that are divided for the eye, two more for each.
  void draw_triangles(Matrix<int, 3, Dynamic>& to) const {
    Eigen::Index last = tree_.size();
    to.resize(3, last + 2 * std::ssize(temporaries_));
    to.leftCols(last) = triangles();
    for (int blade = size(); Temporary const& temporary : temporaries_) {
      auto const parts = temporary.parts(tissue_.surface().corners(temporary.triangle), blade++);
      for (std::size_t k = 0; k < 3; ++k)
        for (int i = 0; i < 3; ++i) to(i, k == 0 ? temporary.triangle : last + static_cast<int>(k) - 1) = parts[k][static_cast<std::size_t>(i)];
      last += 2;
    }
  }

  /// A blade has come into triangle t, at barycentric weights, all > 0, over a corner of it; `lips` are the copies of that on the left and on the right of
  /// the cut, the same where it is closed.
  TemporaryId insert_temporary(int t, Vector const& w, int entered, std::array<int, 2> const& lips) {
    temporaries_.push_back({++last_temporary_, t, w, entered, lips});
    ++topology_revision_;
    return last_temporary_;
  }
  /// The blade is elsewhere in its triangle.
  void move_temporary(TemporaryId id, Vector const& w) noexcept {
    for (Temporary& temporary : temporaries_)
      if (temporary.id == id) temporary.weights = w;
  }
  /// The blade has left the triangle.
  void remove_temporary(TemporaryId id) {
    std::erase_if(temporaries_, [&](Temporary const& temporary) { return temporary.id == id; });
    ++topology_revision_;
  }

  /// Makes what is there for the eye an edit that stays, not too near an edge: insert_in_triangle, and the parts beside an open cut go to its
  /// lips. Its blade learns of it from take_kept(). Returns the new particle, or −1 where it is not there any more.
  int make_permanent(TemporaryId id)
    requires CuttableTissue<Tissue>
  {
    Temporary const* const found = find_temporary(id);
    if (found == nullptr) return -1;
    Temporary const t = *found;
    remove_temporary(id);
    Corners const corners = tissue_.surface().corners(t.triangle);
    int const second = tissue_.surface().triangle_count();
    int const n = insert_in_triangle(t.triangle, kept_weights(t.triangle, t.weights));
    if (int const corner = corners[static_cast<std::size_t>(t.entered)]; t.lips[0] != t.lips[1]) {
      auto const part = [&](std::size_t k) { return k == 0 ? t.triangle : second + static_cast<int>(k) - 1; };
      if (corner != t.lips[0]) change_corner(part(t.to_the_left()), corner, t.lips[0]);
      if (corner != t.lips[1]) change_corner(part(t.to_the_right()), corner, t.lips[1]);
      balance_copies(t.lips[0], t.lips[1]);
    }
    kept_.push_back({id, n});
    return n;
  }
  /// Weights of a point of a triangle where a particle may stay that snaps to nothing: the triangles around it keep an area, also where one cut after
  /// the other ends in the same thin triangle.
  Vector kept_weights(int t, Vector const& w) const {
    Corners const c = tissue_.surface().corners(t);
    return off_edges<Scalar>({tissue_.rest_position(c[0]), tissue_.rest_position(c[1]), tissue_.rest_position(c[2])}, w, min_kept_weight, mean_edge_ / 200);
  }
  /// The same for all at this particle, or beside it where they are open: whoever edits the triangles there asks for it first. False if there is none.
  bool make_permanent_at(int particle)
    requires CuttableTissue<Tissue>
  {
    return make_permanent_if([&](Temporary const& temporary) { return is_at(temporary, particle) || opens_beside(temporary, particle); }) >= 0;
  }
  /// The same for all at both ends of an edge.
  bool make_permanent_on(int a, int b)
    requires CuttableTissue<Tissue>
  {
    return make_permanent_if([&](Temporary const& temporary) { return is_at(temporary, a) && is_at(temporary, b); }) >= 0;
  }
  /// The same for the one in triangle t, if there is one. Returns the particle, or −1.
  int make_permanent_in(int t)
    requires CuttableTissue<Tissue>
  {
    return make_permanent_if([&](Temporary const& temporary) { return temporary.triangle == t; });
  }
  void make_all_permanent()
    requires CuttableTissue<Tissue>
  {
    make_permanent_if([](Temporary const&) { return true; });
  }
  /// The particle that a temporary subdivision was made permanent with, or −1; told once.
  int take_kept(TemporaryId id) noexcept {
    auto const found = std::find_if(kept_.begin(), kept_.end(), [&](auto const& kept) { return kept.first == id; });
    if (found == kept_.end()) return -1;
    int const particle = found->second;
    kept_.erase(found);
    return particle;
  }
  /// A cut that is being made has come to a particle that may have been there before: whoever has parted that one no longer joins it again.
  void advance_cut_epoch() noexcept { ++cut_epoch_; }
  std::size_t cut_epoch() const noexcept { return cut_epoch_; }

  /// Room for this many particles and triangles: up to there cutting does not allocate, also after restore(). A cutter grows its own lists
  /// once. What such a cut commonly grows into is touched; in large bodies the first touch of the rest waits for a page of 2 MiB.
  void reserve(int particles, int triangles) {
    state_.reserve(particles);
    tree_.reserve(triangles);
    changes_.reserve(triangles);
    reserved_triangles_ = std::max(reserved_triangles_, triangles);
    auto const more = static_cast<std::size_t>(std::max(0, particles - size()));
    reserve_and_prefault(disturbed_, 4 * static_cast<std::size_t>(particles), 4 * more);
    reserve_and_prefault(last_look_, static_cast<std::size_t>(particles));
    temporaries_.reserve(8), kept_.reserve(8);
    if constexpr (ReservesMemory<Tissue>) tissue_.reserve(particles, triangles);
  }

 protected:
  explicit BodyShape(Tissue tissue) : tissue_(std::move(tissue)) {
    state_.resize(tissue_.size());
    for (int i = 0; i < tissue_.size(); ++i) state_.position[i] = state_.home[i] = tissue_.rest_position(i);
    set_normals();
    take_tree(SurfaceTree<Scalar>(state_.position.view(), triangles()), true);
    mean_edge_ = mean_edge_length(rest_mesh());
    last_look_.resize(static_cast<std::size_t>(size()));   // now, not in the tick that cuts first
  }

  void check(int particle) const { detail::check_index("particle", particle, size()); }

  bool holds(int i) const noexcept { return state_.held[static_cast<std::size_t>(i)] != 0; }
  bool is_free(int i) const noexcept { return !tissue_.nailed(i) && !holds(i); }

  /// Whether it is cut as a solid: a tissue may know both.
  bool is_solid() const noexcept {
    if constexpr (CuttableTissue<Tissue> && CuttableSolid<Tissue>)
      return !tissue_.cuttable();
    else
      return CuttableSolid<Tissue>;
  }

  void set_normals() {
    state_.normal.view() = vertex_normals(TriangleMesh<Scalar>{state_.home.view(), triangles()});
    home_box_is_known_ = false;
    home_diagonal();   // now, not in the tick in which a tool comes
  }

  void take_tree(SurfaceTree<Scalar> const& tree, bool is_fitted) {
    tree_ = tree;
    tree_.reserve(reserved_triangles_);
    tree_is_fitted_ = is_fitted;
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

  Tissue tissue_;
  ParticleState<Scalar> state_;
  SurfaceTree<Scalar> tree_;
  bool tree_is_fitted_ = false;
  std::vector<TemporarySubdivision<Scalar>> temporaries_;
  std::vector<std::pair<TemporaryId, int>> kept_;   // made permanent with this particle, until their blades know
  TemporaryId last_temporary_ = 0;
  std::size_t cut_epoch_ = 0;   // how often a cut has come to stand on a particle
  std::vector<int> disturbed_;   // particles whose springs an edit has changed since the last step
  bool any_step_is_stable_ = false;   // SoftBody says so of its integrator
  std::size_t evened_ = 0;       // so many of them have been looked at by even_masses()
  HugePageVector<unsigned> last_look_;   // which of its calls looked at each particle last
  unsigned look_ = 0;
  std::size_t topology_revision_ = 0;
  std::size_t restorations_ = 0, removals_ = 0, numbering_ = 0;
  Scalar mean_edge_ = 0;   // m
  Vector home_low_ = Vector::Zero(), home_high_ = Vector::Zero();   // m, of the undisturbed body
  bool home_box_is_known_ = false;
  int reserved_triangles_ = 0;
  detail::ChangeRecord changes_;   // of particles and triangles, for a host's copy
  std::vector<SolidEdit<Scalar>> solid_edits_;

 private:
  static constexpr Scalar min_kept_weight = Scalar(0.1);   // of each corner of its triangle

  using Temporary = TemporarySubdivision<Scalar>;

  /// Whether a particle is a corner of a triangle that is divided for the eye, or the other copy of one.
  bool is_at(Temporary const& temporary, int particle) const noexcept {
    return particle == temporary.lips[0] || particle == temporary.lips[1] || tissue_.surface().corner_of(temporary.triangle, particle) >= 0;
  }
  /// Whether the edge that is open beside the triangle ends at a particle that this one shares an edge with.
  bool opens_beside(Temporary const& temporary, int particle) const noexcept {
    if (temporary.lips[0] == temporary.lips[1]) return false;
    Corners const c = tissue_.surface().corners(temporary.triangle);
    auto const k = static_cast<std::size_t>(temporary.entered);
    int const end = c[k] == temporary.lips[0] ? c[(k + 1) % 3] : c[(k + 2) % 3];
    auto const around = tissue_.surface().triangles_at(particle);
    return std::any_of(around.begin(), around.end(), [&](int t) { return tissue_.surface().corner_of(t, end) >= 0; });
  }
  /// The last particle, or −1.
  template <class Condition>
  int make_permanent_if(Condition const& condition) {
    int particle = -1;
    for (auto found = temporaries_.begin(); (found = std::find_if(temporaries_.begin(), temporaries_.end(), condition)) != temporaries_.end();)
      particle = make_permanent(found->id);
    return particle;
  }
  void look_at_masses() {
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
  }

  /// Particle `to` has got this share of its mass from `from`: an inelastic impact. What is nailed or held moves as it did.
  void mix_velocity(int from, int to, Scalar share) noexcept {
    if (is_free(to)) state_.velocity[to] += share * (state_.velocity[from] - state_.velocity[to]);
  }

  void patch_tree(int t) {
    Corners const now = tissue_.surface().corners(t);
    if (now != tree_.corners(t)) changes_.edited(t);
    tree_.replace(state_.position.view(), t, now);
    ++topology_revision_;
  }

  /// Edits the tissue by make(), which returns a new particle between these parents, and tells all that follow. Returns the particle.
  template <std::size_t Parents, class Make>
  int edit(std::array<int, Parents> const& parents, std::array<Scalar, Parents> const& weights, Make const& make) {
    TopologyEdit made;
    std::copy(parents.begin(), parents.end(), made.parent.begin());
    made.parent_count = static_cast<int>(Parents);
    made.first_triangle = tissue_.surface().triangle_count();
    made.vertex = make();
    made.end_triangle = tissue_.surface().triangle_count();
    apply(made, weights);
    return made.vertex;
  }

  /// What follows the tissue: state, search tree, the record of changes, and the particles whose springs have changed.
  void apply(TopologyEdit const& edit, std::span<Scalar const> weights) {
    if (edit.is_copy())
      state_.add_copy(edit.parent[0]);
    else
      state_.add_between(edit.parents(), weights);
    disturbed_.push_back(edit.vertex);
    auto const& surface = tissue_.surface();
    auto const points = state_.position.view();
    for (int t = edit.first_triangle; t < edit.end_triangle; ++t) {
      auto const beside = [&] {   // one that was there, whose leaf it is to share: across an edge, or at a corner; −1: the tree finds one
        int at_corner = -1;
        for (int const p : surface.corners(t))
          for (int const other : surface.triangles_at(p)) {
            if (other >= t) continue;
            auto const shared = std::ranges::count_if(surface.corners(t), [&](int q) { return surface.corner_of(other, q) >= 0; });
            if (shared == 2) return other;
            if (at_corner < 0) at_corner = other;
          }
        return at_corner;
      };
      tree_.add(points, surface.corners(t), beside());
      if (edit.end_tetrahedron > 0)   // of a solid: what was inside
        for (int const p : surface.corners(t)) disturbed_.push_back(p);
    }
    for (int const t : surface.triangles_at(edit.vertex)) {
      if (t >= edit.first_triangle) continue;
      if (edit.is_copy())
        tree_.relabel(points, t, surface.corners(t));   // where it was
      else
        tree_.replace(points, t, surface.corners(t));
      changes_.edited(t);
    }
    if constexpr (CuttableSolid<Tissue>)
      if (is_solid()) record(edit, weights);
    ++topology_revision_;
  }
  void record(TopologyEdit const& edit, std::span<Scalar const> weights)
    requires CuttableSolid<Tissue>
  {
    using Edit = SolidEdit<Scalar>;
    if (edit.is_copy()) return solid_edits_.push_back({.kind = Edit::Kind::split, .first = edit.parent[0], .second = edit.vertex});
    solid_edits_.push_back({.kind = Edit::Kind::inserted, .first = edit.parent[0], .second = edit.parent[1], .s = weights[1]});
    auto const& solid = tissue_.topology();
    for (int t = edit.first_tetrahedron; t < edit.end_tetrahedron; ++t) {
      int const whole = solid.neighbour(t, solid.corner_of(t, edit.parent[1]));
      auto const from = static_cast<signed char>(solid.corner_of(t, edit.vertex)), to = static_cast<signed char>(solid.corner_of(whole, edit.vertex));
      solid_edits_.push_back({.kind = Edit::Kind::divided, .from = from, .to = to, .first = whole, .second = t, .s = weights[1]});
    }
  }
};

}  // namespace palpate
