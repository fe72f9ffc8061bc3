// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/collision/surface_tree.hpp>
#include <palpate/core/columns.hpp>
#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/mesh/measures.hpp>
#include <palpate/mesh/normals.hpp>
#include <palpate/mesh/surface_topology.hpp>
#include <palpate/mesh/triangle_mesh.hpp>
#include <palpate/mesh/validation.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <utility>
#include <vector>

namespace palpate {

/// What a body that is known by its skin alone has in common with others: where its vertices are and were at rest, how a tool finds them, what a renderer
/// draws. A model derives from it, and moves the vertices: see VertexRings and LongElements, and Cubes, whose skin grows.
/// Shapes     positions(), velocities(): 3 × size(), one column per vertex, in the order of the mesh. A velocity is the mean of the last step.
/// Cost       a search fits the tree first to what has moved since the last one.
/// Threads    one thread at a time.
template <RealScalar ScalarType>
class SkinBody {
 public:
  using Scalar = ScalarType;
  using Vector = Vector3<Scalar>;

  /// What tools ask of the tissue of any body, but for masses: there are none.
  class Skin {
   public:
    SurfaceTopology const& surface() const noexcept { return surface_; }
    std::size_t revision() const noexcept { return revision_; }
    bool nailed(int i) const noexcept { return nailed_[static_cast<std::size_t>(i)] != 0; }
    /// Whether a triangle is the wall of a wound.
    bool is_wound(int triangle) const noexcept { return !wound_.empty() && wound_[static_cast<std::size_t>(triangle)] != 0; }

   private:
    friend SkinBody;
    SurfaceTopology surface_;
    std::vector<char> nailed_, wound_;   // wounds: none, or of each triangle
    std::size_t revision_ = 0;
  };

  using Tissue = Skin;

  Skin const& tissue() const noexcept { return skin_; }
  int size() const noexcept { return x_.size(); }
  auto positions() const noexcept { return x_.view(); }
  auto velocities() const noexcept { return v_.view(); }
  auto triangles() const noexcept { return skin_.surface_.triangles(); }
  TriangleMesh<Scalar> mesh() const { return {x_.view(), triangles()}; }           // a copy
  TriangleMesh<Scalar> rest_mesh() const { return {rest_.view(), triangles()}; }   // a copy
  Scalar mean_edge() const noexcept { return mean_edge_; }                         // m, at rest
  Scalar home_diagonal() const noexcept { return diagonal_; }                      // m, of the bounding box at rest
  Vector reference_position(int i) const { return (check(i), rest_[i]); }
  Vector reference_normal(int i) const { return (check(i), normal_[i]); }
  Vector displacement(int i) const { return (check(i), u_[i]); }   // m
  bool is_held(int i) const { return (check(i), false); }

  /// The nearest vertex as the body is now, the lowest index among equals; −1 for a point that is not finite. A triangle that is likely near saves time.
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
  std::size_t topology_revision() const noexcept { return topology_revision_; }
  std::size_t restorations() const noexcept { return restorations_; }

  static constexpr bool any_step_is_stable = true;
  Scalar stable_step() const noexcept { return std::numeric_limits<Scalar>::infinity(); }
  Scalar guaranteed_stable_step() const noexcept { return stable_step(); }
  bool stable_step_fell() const noexcept { return false; }

  template <class Values>
  void draw_columns(Values const& values, Matrix3X<Scalar>& to) const {
    to = values;
  }
  void draw_triangles(Matrix<int, 3, Dynamic>& to) const { to = triangles(); }

 protected:
  SkinBody() = default;   // of a skin that set_skin gives
  SkinBody(TriangleMesh<Scalar> const& mesh, MeshRequirements const& wanted) {
    require_valid(mesh, wanted);
    set_skin(mesh.points, mesh.triangles);
    normal_ = Columns<Scalar, 3>(vertex_normals(mesh));
    mean_edge_ = mean_edge_length(mesh);
    diagonal_ = diagonal_of(mesh.points);
  }
  static Scalar diagonal_of(Matrix3X<Scalar> const& points) {
    auto const [low, high] = low_and_high(points);
    return Vector(high - low).norm();
  }

  static std::size_t at(int i) noexcept { return static_cast<std::size_t>(i); }
  void check(int i) const { detail::check_index("vertex", i, size()); }
  static void check_step(Scalar h) { detail::require_non_negative("the step", h, "s"); }
  static void check_force(int i, Vector const& force) {
    if (!is_finite(force)) detail::require_finite(detail::message("the force on vertex ", i), force, "N");
  }

  auto rest_positions() const noexcept { return rest_.view(); }
  /// Moves a vertex by u [m] from where it rests.
  template <class U>
  void displace(int i, U const& u) noexcept {
    u_[i] = u;
    x_[i] = rest_[i] + u_[i];
    if (!std::exchange(is_unfitted_[at(i)], char{1})) unfitted_.push_back(i);
  }
  template <class U, class V>
  void displace(int i, U const& u, V const& v) noexcept {
    v_[i] = v;
    displace(i, u);
  }
  void mark_nailed(int i) noexcept { skin_.nailed_[at(i)] = 1, ++skin_.revision_; }

  // --- a skin that grows; vertices inside may be in no triangle -------------------------------------------------------
  /// All anew: at rest, and nothing is nailed. `wound`: of each triangle, or none.
  void set_skin(Matrix3X<Scalar> const& rest, Matrix<int, 3, Dynamic> const& triangles, std::vector<char> wound = {}) {
    auto const n = static_cast<int>(rest.cols());
    tree_ = SurfaceTree<Scalar>(rest, triangles);
    skin_.surface_ = SurfaceTopology(n, triangles);
    skin_.nailed_.assign(at(n), 0), skin_.wound_ = std::move(wound);
    for (Columns<Scalar, 3>* columns : {&rest_, &x_}) columns->resize(n), columns->view() = rest;
    for (Columns<Scalar, 3>* columns : {&u_, &v_}) columns->resize(n), columns->view().setZero();
    is_unfitted_.assign(at(n), 0), unfitted_.clear();
    unfitted_.reserve(at(n));
  }
  void reserve_skin(int vertices, int triangles) {
    skin_.surface_.reserve(vertices, triangles), tree_.reserve(triangles), skin_.wound_.reserve(at(triangles));
    for (Columns<Scalar, 3>* columns : {&rest_, &x_, &u_, &v_}) columns->reserve(vertices);
    skin_.nailed_.reserve(at(vertices)), is_unfitted_.reserve(at(vertices)), unfitted_.reserve(at(vertices));
  }
  void add_vertex(Vector const& rest, Vector const& u, Vector const& v) {
    rest_.push_back(rest), u_.push_back(u), v_.push_back(v), x_.push_back(Vector(rest + u));
    skin_.nailed_.push_back(0), is_unfitted_.push_back(0);
    skin_.surface_.add_vertex();
  }
  void pop_vertex() noexcept {   // of no triangle
    if (is_unfitted_.back() != 0) std::erase(unfitted_, size() - 1);
    for (Columns<Scalar, 3>* columns : {&rest_, &x_, &u_, &v_}) columns->pop_back();
    skin_.nailed_.pop_back(), is_unfitted_.pop_back();
    skin_.surface_.pop_vertex();
  }
  /// `near`: a triangle beside it, for the tree; it is a wound where that is.
  void add_triangle(std::array<int, 3> const& corners, int near) {
    skin_.surface_.add_triangle(corners), tree_.add(x_.view(), corners, near);
    if (!skin_.wound_.empty()) skin_.wound_.push_back(skin_.is_wound(near));
  }
  void set_triangle(int t, std::array<int, 3> const& corners) { skin_.surface_.set_triangle(t, corners), tree_.replace(x_.view(), t, corners); }
  void pop_triangle() {
    int const last = skin_.surface_.triangle_count() - 1;
    skin_.surface_.pop_triangle(), tree_.remove(x_.view(), last);
    if (!skin_.wound_.empty()) skin_.wound_.pop_back();
  }
  /// Triangles have changed.
  void count_revision() noexcept { ++skin_.revision_, ++topology_revision_; }

  /// The nails, and them back.
  struct SkinState {
    std::vector<char> nailed;
    std::size_t revision;
    Scalar mean_edge, diagonal;   // whose
  };
  SkinState save_skin() const { return {skin_.nailed_, skin_.revision_, mean_edge_, diagonal_}; }
  void require_own(SkinState const& state) const {
    if (state.nailed.size() != skin_.nailed_.size())
      throw InvalidArgument(detail::message("a state of ", state.nailed.size(), " particles can not be restored in a body of ", skin_.nailed_.size(), "; it is another body's"));
    require_shape(state);
  }
  void require_shape(SkinState const& state) const {
    if (state.mean_edge != mean_edge_ || state.diagonal != diagonal_)
      throw InvalidArgument(detail::message("a state of a body ", state.diagonal, " m across with edges of ", state.mean_edge, " m can not be restored in one of ", diagonal_,
                                            " m with edges of ", mean_edge_, " m; it is another body's"));
  }
  void restore_skin(SkinState const& state) {
    require_own(state);
    skin_.nailed_ = state.nailed, skin_.revision_ = state.revision;
    ++restorations_;
  }

  Columns<Scalar, 3> rest_, x_, u_, v_;   // m, m, m, m/s
  Scalar mean_edge_ = 0, diagonal_ = 0;   // m

 private:
  /// Fits the boxes of the triangles at what has moved; of several corners that have, the lowest asks for it.
  void fit_tree() noexcept {
    auto const x = x_.view();
    if (4 * unfitted_.size() > at(size())) {
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

  SurfaceTree<Scalar> tree_;
  Skin skin_;
  Columns<Scalar, 3> normal_;
  std::vector<int> unfitted_;   // of the tree: moved since it was fitted
  std::vector<char> is_unfitted_;
  std::size_t topology_revision_ = 0, restorations_ = 0;
};

}  // namespace palpate
