// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/collision/surface_tree.hpp>
#include <palpate/core/columns.hpp>
#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/mesh/triangle_mesh.hpp>
#include <palpate/tissue/cubes/cube_grid.hpp>
#include <palpate/tissue/skin_body.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace palpate::detail {

/// Cubes of a grid, some of them split, with the vertices that they share and their skin.
/// Vertices   those of unsplit cubes come first and keep their numbers; those of split ones follow, and are made anew by each refine().
/// Hanging    a vertex in the middle of an unsplit cube's edge or face follows its 2 or 4 corners, its leaders, by weights.
/// Skin       triangles 2 f and 2 f + 1 begin the face f of an unsplit cube, whatever it is split into: first the faces of the uncut body, then those of wounds as
///            they were opened, so that no cut gives them other numbers; the rest follows. A face beside a split cube goes through the vertices on its outline.
/// Cost       build() O(cubes); refine() O(split cubes · parts³), without allocation up to `max_split` of them.
template <RealScalar ScalarType>
class CubeMesh : public SkinBody<ScalarType> {
  using Base = SkinBody<ScalarType>;

 public:
  using Scalar = ScalarType;
  using Vector = Vector3<Scalar>;
  using Base::size;

  Vector reference_normal(int i) const {   // as the skin is now, which grows
    this->check(i);
    Vector sum = Vector::Zero();
    for (int const t : this->tissue().surface().triangles_at(i)) {
      auto const c = this->tissue().surface().corners(t);
      sum += Vector(rest_[c[1]] - rest_[c[0]]).cross(Vector(rest_[c[2]] - rest_[c[0]]));
    }
    return sum.stableNormalized();
  }
  static constexpr bool renumbers_particles = true;
  std::size_t renumberings() const noexcept { return renumberings_ + this->restorations(); }

  int cubes() const noexcept { return grid_.size(); }   // unsplit ones
  int leaves() const noexcept { return grid_.size() + static_cast<int>(fine_.cubes.size()) * (parts_ * parts_ * parts_ - 1); }
  Scalar volume() const noexcept { return Scalar(cubes()) * edge_ * edge_ * edge_; }   // m³, at rest
  /// Corner 4 z + 2 y + x of an unsplit cube.
  std::array<int, 8> const& corners(int cube) const { return (check_cube(cube), grid_.corners(cube)); }
  bool is_split(int cube) const { return (check_cube(cube), slot_[at(cube)] >= 0); }
  /// Whether a larger cube's edge or face leads this vertex.
  bool hangs(int i) const { return (this->check(i), hang_[at(i)].count > 0); }
  /// Which cube a triangle of the skin belongs to.
  int cube_of(int triangle) const { return (check_index("triangle", triangle, this->tissue().surface().triangle_count()), faces_[at(face_of(triangle))].cube); }
  /// Faces between two cubes that cuts have opened.
  int opened_faces() const noexcept { return static_cast<int>(grid_.opened().size()) / 2; }
  CubeGrid const& grid() const noexcept { return grid_; }
  /// visit(triangle) for the skin of a cube.
  template <class Visit>
  void for_each_triangle(int cube, Visit const& visit) const {
    for (int const f : face_[at(cube)])
      if (f >= 0) {
        visit(2 * f), visit(2 * f + 1);
        for (int k = 0; k < extra_[at(f)][1]; ++k) visit(2 * static_cast<int>(faces_.size()) + extra_[at(f)][0] + k);
      }
  }


 protected:
  using Base::at, Base::rest_, Base::x_, Base::u_, Base::v_;
  struct Face {
    int cube, side;
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

  CubeMesh(TriangleMesh<Scalar> const& surface, Scalar edge, int levels, int max_split)
      : grid_(surface, static_cast<double>(edge)), edge_(edge), parts_(1 << levels), max_split_(levels > 0 ? std::min(max_split, grid_.size()) : 0) {
    this->diagonal_ = Base::diagonal_of(surface.points);
    this->mean_edge_ = edge;
    build();
  }

  void check_cube(int c) const { check_index("cube", c, cubes()); }
  int max_vertices() const noexcept { return base_ + max_split_ * points(); }
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

  int cube_of_leaf(int leaf) const noexcept { return leaf < cubes() ? leaf : fine_.cubes[at((leaf - cubes()) / (parts_ * parts_ * parts_))]; }
  /// The corners, counter-clockwise, of the square of its face that holds a triangle.
  std::array<int, 4> square_of(int triangle) const noexcept {
    int const f = face_of(triangle);
    auto const [c, side] = faces_[at(f)];
    std::array<int, 4> corners;
    if (slot_[at(c)] < 0) {
      for (int k = 0; k < 4; ++k) corners[at(k)] = grid_.corners(c)[at(CubeGrid::side_corner(side, k))];
      return corners;
    }
    int const extra = triangle - 2 * static_cast<int>(faces_.size()), square = extra < 0 ? 0 : (extra - extra_[at(f)][0] + 2) / 2;
    for (int k = 0; k < 4; ++k) corners[at(k)] = vertex_in(c, c, side_point(side, square % parts_ + (k == 1 || k == 2), square / parts_ + (k >= 2)));
    return corners;
  }

  /// All of unsplit cubes, at rest; nothing is nailed.
  void build() {
    renumberings_ += fine_.cubes.empty() ? 0 : 1;
    base_ = grid_.vertices();
    int const c = cubes(), most = max_vertices();
    Matrix3X<Scalar> rest(3, base_);
    for (int v = 0; v < base_; ++v) {
      Vector3<double> const place = grid_.corner() + static_cast<double>(edge_) * grid_.vertex_place(v);
      rest.col(v) = place.template cast<Scalar>();
    }
    around_.assign(at(base_), {-1, -1, -1, -1, -1, -1, -1, -1}), hang_.assign(at(base_), {}), head_.assign(at(base_), -1);
    around_.reserve(at(most)), hang_.reserve(at(most)), last_u_.reserve(most), last_v_.reserve(most);
    followers_.clear(), followers_.reserve(at(4 * max_split_ * points()));
    slot_.assign(at(c), -1);
    for (Fine* list : {&fine_, &last_fine_})
      list->cubes.clear(), list->vertex.clear(), list->cubes.reserve(at(max_split_)), list->vertex.reserve(at(max_split_ * points()));
    leaves_.resize(at(c)), leaves_.reserve(at(c + max_split_ * parts_ * parts_ * parts_));
    for (int i = 0; i < c; ++i) set_leaf(i, grid_.corners(i), 0);

    faces_.clear();
    face_.assign(at(c), {-1, -1, -1, -1, -1, -1});
    auto const add_face = [&](int i, int side) { face_[at(i)][at(side)] = static_cast<int>(faces_.size()), faces_.push_back({i, side}); };
    for (int i = 0; i < c; ++i)
      for (int side = 0; side < 6; ++side)
        if (grid_.beside(i, side) < 0) add_face(i, side);
    for (int const one : grid_.opened()) add_face(one / 6, one % 6);
    auto const f = static_cast<int>(faces_.size());
    extra_.assign(at(f), {0, 0}), stamp_.assign(at(f), 0), patched_.clear(), patched_.reserve(at(f));
    int const extras = std::min(f, 9 * max_split_) * (2 * parts_ * parts_ + 4 * parts_);
    extra_face_.clear(), extra_face_.reserve(at(extras));
    Matrix<int, 3, Dynamic> triangles(3, 2 * f);
    std::vector<char> wound;
    for (int k = 0; k < f; ++k)
      for (int t = 0; t < 2; ++t) {
        for (int corner = 0; corner < 3; ++corner) triangles(corner, 2 * k + t) = plain(k, t)[at(corner)];
        wound.push_back(grid_.is_opened(faces_[at(k)].cube, faces_[at(k)].side));
      }
    this->set_skin(rest, triangles, std::move(wound));
    if (max_split_ > 0) this->reserve_skin(most, 2 * f + extras);
    this->count_revision();
  }

  /// These cubes are split, ascending, and no others. What was split before is in last_fine_.
  void refine(std::vector<int> const& split) {
    std::swap(fine_, last_fine_);
    fine_.cubes = split;
    last_u_ = u_, last_v_ = v_;
    // as if nothing were split
    while (this->tissue().surface().triangle_count() > 2 * static_cast<int>(faces_.size())) this->pop_triangle();
    for (int const k : patched_) {
      for (int t = 0; t < 2; ++t) this->set_triangle(2 * k + t, plain(k, t));
      extra_[at(k)] = {0, 0};
    }
    patched_.clear(), extra_face_.clear(), followers_.clear();
    leaves_.resize(at(cubes()));
    for (int const c : last_fine_.cubes) {
      set_leaf(c, grid_.corners(c), 0), slot_[at(c)] = -1;
      for (int const v : grid_.corners(c)) head_[at(v)] = -1;
    }
    while (size() > base_) this->pop_vertex();
    around_.resize(at(base_)), hang_.resize(at(base_));
    // and now split
    fine_.vertex.assign(fine_.cubes.size() * at(points()), -1);
    for (std::size_t slot = 0; slot < fine_.cubes.size(); ++slot) slot_[at(fine_.cubes[slot])] = static_cast<int>(slot);
    for (int const c : fine_.cubes) add_points(c);
    for (int const c : fine_.cubes) add_leaves(c);
    ++stamps_;
    for (int const c : fine_.cubes)
      for (int part = 0; part < 27; ++part) {
        int near = c;
        for (int a = 0, rest = part; a < 3 && near >= 0; ++a, rest /= 3)
          if (rest % 3 != 1) near = grid_.beside(near, 2 * a + rest % 3 / 2);
        if (near < 0) near = far_neighbour(c, part);
        if (near >= 0) patch(near);
      }
    this->count_revision(), ++renumberings_;
  }
  /// The nails of unsplit cubes' corners nail what lies between nailed ones alone.
  void nail_between() {
    for (std::size_t slot = 0; slot < fine_.cubes.size(); ++slot)
      for (int p = 0; p < points(); ++p) nail_fine(fine_.cubes[slot], p, fine_.vertex[slot * at(points()) + at(p)]);
  }

  CubeGrid grid_;
  Scalar edge_;                              // m, of an unsplit cube
  int parts_ = 1, max_split_ = 0;           // of a split cube along an edge; without allocation
  int base_ = 0;                             // vertices of unsplit cubes
  std::vector<std::array<int, 8>> around_;   // of a vertex, the leaf in each octant
  std::vector<Leaf> leaves_;                 // of all cubes, unsplit; then those of split ones
  std::vector<Hang> hang_;                   // of each vertex
  std::vector<int> slot_;                    // of each cube: its place in fine_, or −1
  Fine fine_, last_fine_;                    // split now, and before the last refine()
  std::vector<Face> faces_;

 private:
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
    for (int k = 0; k < 8; ++k) all = all && (weight(point(p), k) == 0 || this->tissue().nailed(grid_.corners(c)[at(k)]));
    if (all && v >= base_) this->mark_nailed(v), this->displace(v, Vector::Zero());
  }

  void set_leaf(int leaf, std::array<int, 8> const& corners, int level) {
    leaves_[at(leaf)] = {corners, level};
    for (std::size_t k = 0; k < 8; ++k) around_[at(corners[k])][7 - k] = leaf;
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
      this->add_vertex(rest, u, v);
      around_.push_back({-1, -1, -1, -1, -1, -1, -1, -1}), hang_.push_back(hang);
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
        auto const vertex = [&, c = c, side = side](int i, int j) { return vertex_in(c, c, side_point(side, s + i, t + j)); };
        add_to_face(f, {vertex(0, 0), vertex(1, 0), vertex(1, 1)});
        add_to_face(f, {vertex(0, 0), vertex(1, 1), vertex(0, 1)});
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
        int const cut_off = turn(a, b, d), length = (d.s - a.s) * (d.s - a.s) + (d.t - a.t) * (d.t - a.t);
        if (cut_off > 0 && (n == 3 || cut_off < area) && (ear == n || length < shortest)) ear = k, shortest = length;
      }
      Point const &a = outline[(ear + n - 1) % n], &b = outline[ear], &d = outline[(ear + 1) % n];
      area -= turn(a, b, d);
      add_to_face(f, {a.vertex, b.vertex, d.vertex});
      for (--n; ear < n; ++ear) outline[ear] = outline[ear + 1];
    }
  }
  static int corner_at(Place const& p) noexcept { return (p[0] != 0) + 2 * (p[1] != 0) + 4 * (p[2] != 0); }
  void begin_patch(int f) {
    patched_.push_back(f);
    extra_[at(f)] = {static_cast<int>(extra_face_.size()), -2};
  }
  void add_to_face(int f, std::array<int, 3> const& corners) {
    int const k = extra_[at(f)][1]++;
    if (k < 0) return this->set_triangle(2 * f + 2 + k, corners);
    this->add_triangle(corners, 2 * f);
    extra_face_.push_back(f);
  }

  std::vector<int> head_;                    // of the followers of each vertex of unsplit cubes
  std::vector<Follower> followers_;
  Columns<Scalar, 3> last_u_, last_v_;
  std::vector<std::array<int, 6>> face_;     // of each cube
  std::vector<std::array<int, 2>> extra_;    // of each face: its first triangle beyond two, and how many
  std::vector<int> extra_face_, patched_;
  std::vector<std::uint64_t> stamp_;
  std::uint64_t stamps_ = 0;
  std::size_t renumberings_ = 0;
};

}  // namespace palpate::detail
