// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/reserve_and_prefault.hpp>
#include <palpate/mesh/tetrahedral_adjacency.hpp>
#include <palpate/mesh/tetrahedral_mesh.hpp>
#include <palpate/mesh/topology_edit.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace palpate {

/// The tetrahedra of a solid that is being edited: operators that insert a vertex or split one, each of which can be taken back, and edits of single
/// elements. The border follows each.
/// Cost       every edit is O(tetrahedra and border triangles at the vertices it touches) and allocates nothing within what was reserved.
/// Errors     an edit that can not be made throws InvalidArgument or OutOfRange before anything has changed.
/// Limits     topology only: whoever has the points says where a new vertex lies, and whether a tetrahedron still has a volume.
class TetrahedralTopology : public TetrahedralAdjacency {
 public:
  TetrahedralTopology() = default;

  /// Border triangles are numbered as `surface(mesh)` numbers them. Throws InvalidMesh.
  template <class Derived>
  TetrahedralTopology(int vertices, Eigen::MatrixBase<Derived> const& tetrahedra) : TetrahedralAdjacency(vertices) {
    corners_.reserve(static_cast<int>(tetrahedra.cols())), beyond_.reserve(static_cast<std::size_t>(tetrahedra.cols()));
    for (int t = 0; t < static_cast<int>(tetrahedra.cols()); ++t) {
      Corners const c{tetrahedra(0, t), tetrahedra(1, t), tetrahedra(2, t), tetrahedra(3, t)};
      if (auto const wrong = fault(c, -1); !wrong.empty())
        throw InvalidMesh(detail::message("tetrahedron ", t, ": ", wrong, "; `validate` lists what is wrong"));
      append(c);
    }
    for (int t = 0; t < tetrahedron_count(); ++t)
      for (int const k : {3, 2, 0, 1})
        if (int const beyond = place_of(reversed(face(t, k))); beyond < 0)
          add_border(t, k);
        else
          at(t)[k] = beyond;
  }
  template <RealScalar Scalar>
  explicit TetrahedralTopology(TetrahedralMesh<Scalar> const& mesh) : TetrahedralTopology(static_cast<int>(mesh.points.cols()), mesh.tetrahedra) {}

  // --- operators: one new vertex each ---------------------------------------------------------------------------------
  /// Divides the edge a–b: every tetrahedron (a, b, c, d) round it becomes (a, n, c, d), with the old number, and (n, b, c, d).
  TopologyEdit insert_on_edge(int a, int b) { return divide(std::array{a, b}); }

  /// Divides a face: the one or two tetrahedra (a, b, c, d) at it become (a, b, n, d), with the old number, (n, b, c, d) and (a, n, c, d).
  TopologyEdit insert_on_face(int a, int b, int c) { return divide(std::array{a, b, c}); }

  /// Divides (a, b, c, d) into (a, b, c, n), with the old number, (n, b, c, d), (a, n, c, d) and (a, b, n, d).
  TopologyEdit insert_in_tetrahedron(int tetrahedron) {
    detail::check_index("tetrahedron", tetrahedron, tetrahedron_count());
    return divide(corners(tetrahedron));
  }

  /// Gives some but not all of the tetrahedra at a vertex a copy of it as their corner. Faces at the vertex between those and the others open: each
  /// becomes two border triangles, first that of the copy.
  TopologyEdit split_vertex(int vertex, std::span<int const> tetrahedra) {
    detail::check_index("vertex", vertex, vertex_count());
    group_.assign(tetrahedra.begin(), tetrahedra.end());
    std::sort(group_.begin(), group_.end());
    for (std::size_t i = 0; i < group_.size(); ++i) {
      detail::check_index("tetrahedron", group_[i], tetrahedron_count());
      if (corner_of(group_[i], vertex) < 0)
        throw InvalidArgument(detail::message("split_vertex: tetrahedron ", group_[i], " is not at vertex ", vertex, "; list some of tetrahedra_at(",
                                              vertex, ")"));
      if (i > 0 && group_[i] == group_[i - 1]) throw InvalidArgument(detail::message("split_vertex: tetrahedron ", group_[i], " is listed twice"));
    }
    if (group_.empty() || group_.size() == at_[vertex].size())
      throw InvalidArgument(detail::message("split_vertex: ", group_.size(), " of the ", at_[vertex].size(), " tetrahedra at vertex ", vertex,
                                            " are to get the copy; it takes at least one, and not all"));
    TopologyEdit edit = begun(std::array{vertex});
    add_vertex();
    for (int const t : group_) change_corner(t, corner_of(t, vertex), edit.vertex);
    for (int const t : group_)
      for (int k = 0; k < 4; ++k) {
        int const beyond = at(t)[k];
        if (corners_[t][k] == edit.vertex) continue;
        if (beyond < 0)
          border_.replace_corner(~beyond, vertex, edit.vertex);
        else if (corner_of(beyond / 4, edit.vertex) < 0)
          add_border(t, k), add_border(beyond / 4, beyond % 4);
      }
    return ended(edit);
  }

  /// Takes the last operator back, and so on with those before it: numbers become what they were. Throws InvalidArgument where it can see that others
  /// came after it.
  void undo(TopologyEdit const& edit) {
    if (!is_last(edit))
      throw InvalidArgument(detail::message("undo: the edit that made vertex ", edit.vertex,
                                            " is not the last one of this topology; take back those after it first"));
    int const n = edit.vertex, parent = edit.parents().back();
    if (edit.is_copy())
      for (int triangle = edit.end_triangle - 2; triangle >= edit.first_triangle; triangle -= 2) {
        auto const [t, k] = border_face(triangle);
        auto const [u, l] = border_face(triangle + 1);
        join(t, k, u, l);
      }
    else
      for (int const t : at_[n])
        for (std::size_t j = 0; t < edit.first_tetrahedron && j + 1 < edit.parents().size(); ++j) {
          int const k = corner_of(t, edit.parent[j]);
          take_link(t, neighbour(t, k), k);
        }
    while (border_.triangle_count() > edit.first_triangle) border_.pop_triangle(), place_.pop_back();
    while (tetrahedron_count() > edit.first_tetrahedron) drop();
    while (!at_[n].empty()) change_corner(at_[n].front(), corner_of(at_[n].front(), n), parent);
    while (!border_.triangles_at(n).empty()) border_.replace_corner(border_.triangles_at(n).front(), n, parent);
    pop_vertex();
  }

  // --- single elements ------------------------------------------------------------------------------------------------
  // Faces that come to lie on each other are joined, others become border. A border triangle that goes leaves its number to the last one.
  void add_vertex() { at_.add_list(), border_.add_vertex(); }
  /// Takes the last vertex away; no tetrahedron may hold it.
  void pop_vertex() noexcept { at_.pop_list(), border_.pop_vertex(); }

  int add_tetrahedron(Corners const& corners) {
    require_sound(corners, -1);
    append(corners);
    attach(tetrahedron_count() - 1);
    return tetrahedron_count() - 1;
  }
  /// Takes the last tetrahedron away; its vertices stay.
  void pop_tetrahedron() {
    detach(tetrahedron_count() - 1);
    drop();
  }
  /// Takes any tetrahedron away: the last one gets its number. Its vertices stay.
  TetrahedronRemoval remove_tetrahedron(int tetrahedron) {
    detail::check_index("tetrahedron", tetrahedron, tetrahedron_count());
    int const t = tetrahedron, last = tetrahedron_count() - 1;
    TetrahedronRemoval removal{.tetrahedron = t, .last = last, .corners = corners(t)};
    Beyond const beyond = at(t);
    for (int k = 0; k < 4; ++k)
      if (beyond[k] >= 0) {
        add_border(beyond[k] / 4, beyond[k] % 4);
        removal.opened_triangles[removal.opened_count++] = face(beyond[k] / 4, beyond[k] % 4);
      }
    for (int k = 0; k < 4; ++k)
      if (beyond[k] < 0) {
        removal.gone_triangles[removal.gone_count++] = ~at(t)[k];
        remove_border(~at(t)[k]);
      }
    for (int const v : removal.corners) at_.remove(v, t);
    if (t != last) {
      Corners const c = corners(last);
      for (int const v : c) at_.rename(v, last, t);
      corners_[t] = Matrix<int, 4, 1>(c[0], c[1], c[2], c[3]);
      for (int k = 0; k < 4; ++k) take_link(t, last, k);
    }
    corners_.pop_back(), beyond_.pop_back();
    return removal;
  }
  void set_tetrahedron(int tetrahedron, Corners const& corners) {
    detail::check_index("tetrahedron", tetrahedron, tetrahedron_count());
    require_sound(corners, tetrahedron);
    detach(tetrahedron);
    for (int const v : this->corners(tetrahedron)) at_.remove(v, tetrahedron);
    for (int k = 0; k < 4; ++k) at_.add(corners_[tetrahedron][k] = corners[static_cast<std::size_t>(k)], tetrahedron, k);
    attach(tetrahedron);
  }
  /// Gives a tetrahedron another vertex in the place of one that it holds.
  void replace_corner(int tetrahedron, int before, int now) {
    detail::check_index("tetrahedron", tetrahedron, tetrahedron_count());
    int const k = corner_of(tetrahedron, before);
    if (k < 0) throw InvalidArgument(detail::message("replace_corner: vertex ", before, " is no corner of tetrahedron ", tetrahedron));
    Corners corners = this->corners(tetrahedron);
    corners[static_cast<std::size_t>(k)] = now;
    set_tetrahedron(tetrahedron, corners);
  }

  /// Room for so many vertices, tetrahedra and border triangles, so that edits up to there do not allocate. The lists at vertices get four times the
  /// room that they need at once, since they grow by doubling.
  void reserve(int vertices, int tetrahedra, int triangles) {
    corners_.reserve_and_prefault(tetrahedra), reserve_and_prefault(beyond_, static_cast<std::size_t>(tetrahedra)), reserve_and_prefault(place_, static_cast<std::size_t>(triangles));
    at_.reserve(vertices, 8 * vertices + 16 * tetrahedra);
    border_.reserve(vertices, triangles);
    group_.reserve(static_cast<std::size_t>(tetrahedra));
  }

 private:
  /// What forbids a tetrahedron of these corners, in the place of one or, with −1, beside all; empty: nothing.
  std::string fault(Corners const& c, int replaced) const {
    for (std::size_t k = 0; k < 4; ++k) {
      if (c[k] < 0 || c[k] >= vertex_count()) return detail::message("it names vertex ", c[k], " but there are ", vertex_count(), " vertices");
      for (std::size_t l = 0; l < k; ++l)
        if (c[k] == c[l]) return detail::message("it has vertex ", c[k], " twice");
    }
    for (int k = 0; k < 4; ++k) {
      std::size_t const i = k == 0 ? 1 : 0, j = static_cast<std::size_t>(turn[k][i]), l = 6 - static_cast<std::size_t>(k) - i - j;
      if (int const t = tetrahedron_with_face(c[i], c[j], c[l]); t >= 0 && t != replaced)
        return detail::message("its face ", c[i], " ", c[j], " ", c[l], " belongs to tetrahedron ", t, " on the same side");
      if (int const t = tetrahedron_with_face(c[i], c[l], c[j]); t >= 0 && t != replaced && corner_of(t, c[static_cast<std::size_t>(k)]) >= 0)
        return detail::message("tetrahedron ", t, " has the same four corners");
    }
    return {};
  }
  void require_sound(Corners const& c, int replaced) const {
    if (auto const wrong = fault(c, replaced); !wrong.empty())
      throw InvalidArgument(detail::message("a tetrahedron of the vertices ", c[0], " ", c[1], " ", c[2], " ", c[3], " can not be: ", wrong));
  }

  // --- parts of edits -------------------------------------------------------------------------------------------------
  template <std::size_t N>
  TopologyEdit begun(std::array<int, N> const& parents) const noexcept {
    TopologyEdit edit;
    edit.vertex = vertex_count(), edit.parent_count = static_cast<int>(N);
    std::copy(parents.begin(), parents.end(), edit.parent.begin());
    edit.first_tetrahedron = tetrahedron_count(), edit.first_triangle = border_.triangle_count();
    return edit;
  }
  TopologyEdit ended(TopologyEdit edit) const noexcept {
    edit.end_tetrahedron = tetrahedron_count(), edit.end_triangle = border_.triangle_count();
    return edit;
  }

  /// All tetrahedra that hold these vertices: each becomes N of them, in which the new vertex stands for one parent after the other. The old number
  /// stays where it stands for the last. Corners keep their places, so face k of a part lies on, or beside, face k of the whole.
  template <std::size_t N>
  TopologyEdit divide(std::array<int, N> const& parents) {
    for (std::size_t j = 0; j < N; ++j) {
      detail::check_index("vertex", parents[j], vertex_count());
      if (std::find(parents.begin(), parents.begin() + static_cast<std::ptrdiff_t>(j), parents[j]) != parents.begin() + static_cast<std::ptrdiff_t>(j))
        throw InvalidArgument(detail::message("vertex ", parents[j], " is named twice; an edge or face has distinct ends"));
    }
    auto const here = at_[parents[0]];
    if (std::none_of(here.begin(), here.end(), [&](int t) { return holds(t, parents); }))
      throw InvalidArgument(detail::message("no tetrahedron holds the ", N == 2 ? "edge" : "face", " of the vertices ", parents[0], " ", parents[1],
                                            N == 3 ? detail::message(" ", parents[N - 1]) : ""));
    TopologyEdit const edit = begun(parents);
    add_vertex();
    int const n = edit.vertex;
    for (std::size_t i = 0, there = here.size(); i < there; ++i) {   // of at_[parents[0]] only the end changes
      int const t = at_[parents[0]][i], child = tetrahedron_count();
      if (!holds(t, parents)) continue;
      std::array<int, N> k;
      for (std::size_t j = 0; j < N; ++j) k[j] = corner_of(t, parents[j]);
      for (std::size_t j = 0; j + 1 < N; ++j) {
        Corners c = corners(t);
        c[static_cast<std::size_t>(k[j])] = n;
        append(c);
      }
      change_corner(t, k[N - 1], n);
      for (int j = 0; j + 1 < static_cast<int>(N); ++j) {
        int const kj = k[static_cast<std::size_t>(j)];
        take_link(child + j, t, kj);
        join(t, kj, child + j, k[N - 1]);
        for (int l = 0; l < j; ++l) join(child + l, kj, child + j, k[static_cast<std::size_t>(l)]);
      }
    }
    for (int const t : at_[n]) {   // faces that were divided
      if (t >= edit.first_tetrahedron) continue;
      for (int k = 0; k < 4; ++k) {
        int const v = corners_[t][k], beyond = at(t)[k];
        if (v == n || std::find(parents.begin(), parents.end(), v) != parents.end()) continue;
        if (beyond < 0) border_.replace_corner(~beyond, parents[N - 1], n);
        for (std::size_t j = 0; j + 1 < N; ++j) {
          int const child = neighbour(t, corner_of(t, parents[j]));
          if (beyond < 0)
            add_border(child, k);
          else
            at(child)[k] = 4 * neighbour(beyond / 4, corner_of(beyond / 4, parents[j])) + beyond % 4;
        }
      }
    }
    return ended(edit);
  }

  bool is_last(TopologyEdit const& edit) const noexcept {
    int const n = edit.vertex, appended = edit.end_tetrahedron - edit.first_tetrahedron, opened = edit.end_triangle - edit.first_triangle;
    if (n < 0 || n + 1 != vertex_count() || edit.parent_count < 1 || edit.parent_count > 4) return false;
    if (edit.end_tetrahedron != tetrahedron_count() || edit.end_triangle != border_.triangle_count() || appended < 0 || opened < 0) return false;
    for (int const parent : edit.parents())
      if (parent < 0 || parent >= n) return false;
    int replaced = 0;
    for (int const t : at_[n]) {
      if (t >= edit.first_tetrahedron) continue;
      ++replaced;
      for (int const parent : edit.parents().first(edit.parents().size() - 1))
        if (int const k = corner_of(t, parent); k < 0 || neighbour(t, k) < edit.first_tetrahedron) return false;
      if (corner_of(t, edit.parents().back()) >= 0) return false;
    }
    if (replaced == 0 || appended != replaced * (edit.parent_count - 1) || static_cast<int>(at_[n].size()) != replaced + appended) return false;
    if (edit.is_copy() && opened % 2 != 0) return false;
    for (int triangle = edit.first_triangle; edit.is_copy() && triangle < edit.end_triangle; triangle += 2) {
      Triangle copied = border_.corners(triangle);
      std::replace(copied.begin(), copied.end(), n, edit.parent[0]);
      auto const [t, k] = border_face(triangle);
      auto const [u, l] = border_face(triangle + 1);
      if (corner_of(t, n) < 0 || place_of(reversed(copied)) != 4 * u + l) return false;
    }
    return true;
  }

  void change_corner(int t, int k, int now) {
    at_.remove(corners_[t][k], t);
    corners_[t][k] = now;
    at_.add(now, t, k);
  }

  /// Joins the faces of a tetrahedron that is in the lists to those that lie on them.
  void attach(int t) {
    for (int k = 0; k < 4; ++k)
      if (int const beyond = place_of(reversed(face(t, k))); beyond < 0)
        add_border(t, k);
      else
        remove_border(~at(beyond / 4)[beyond % 4]), join(t, k, beyond / 4, beyond % 4);
  }
  void detach(int t) {
    for (int k = 0; k < 4; ++k)
      if (int const beyond = at(t)[k]; beyond < 0)
        remove_border(~beyond);
      else
        add_border(beyond / 4, beyond % 4);
  }

  std::vector<int> group_;   // that a split gives the copy to
};

}  // namespace palpate
