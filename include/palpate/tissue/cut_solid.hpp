// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/mesh/tetrahedral_topology.hpp>
#include <palpate/tissue/whole_pieces.hpp>

#include <cstddef>
#include <span>
#include <vector>

namespace palpate {

/// The tetrahedra of a solid, and what cuts have made of their faces: what tissue of tetrahedra keeps so that it is a CuttableSolid.
///   wound   a border triangle that was inside before a cut
///   cut     an inner face that is cut and not open: no vertex of it has split yet
/// Cost, errors   those of TetrahedralTopology.
class CutSolid {
 public:
  CutSolid() = default;
  /// Uncut. Throws InvalidMesh.
  template <class Derived>
  CutSolid(int vertices, Eigen::MatrixBase<Derived> const& tetrahedra) : topology_(vertices, tetrahedra) {
    cut_.assign(at(topology_.tetrahedron_count()), 0), wound_.assign(at(topology_.border().triangle_count()), 0);
  }

  TetrahedralTopology const& topology() const noexcept { return topology_; }
  bool is_wound(int triangle) const noexcept { return wound_[at(triangle)] != 0; }
  /// Face k of a tetrahedron, the same seen from both sides.
  bool is_cut(int tetrahedron, int k) const noexcept { return (cut_[at(tetrahedron)] >> k & 1) != 0; }
  void mark_cut(int tetrahedron, int k) noexcept {
    int const other = topology_.neighbour(tetrahedron, k);
    if (other < 0) return;
    set(tetrahedron, k, true);
    for (int l = 0; l < 4; ++l)
      if (topology_.neighbour(other, l) == tetrahedron) set(other, l, true);
  }

  /// As TetrahedralTopology does it; the parts of a face are what the face was.
  TopologyEdit insert_on_edge(int a, int b) {
    TopologyEdit const edit = topology_.insert_on_edge(a, b);
    for (int t = edit.first_tetrahedron; t < edit.end_tetrahedron; ++t) {
      int const whole = whole_of(t, b);
      cut_.push_back(cut_[at(whole)]);
      set(t, topology_.corner_of(t, b), false), set(whole, topology_.corner_of(whole, a), false);   // between the two
    }
    for (int triangle = edit.first_triangle; triangle < edit.end_triangle; ++triangle) {
      auto const [t, k] = topology_.border_face(triangle);
      wound_.push_back(char{wound_[at(topology_.border_triangle(whole_of(t, b), k))]});
    }
    return edit;
  }
  /// The tetrahedron beside one that insert_on_edge(a, b) has added: both were one.
  int whole_of(int part, int b) const noexcept { return topology_.neighbour(part, topology_.corner_of(part, b)); }

  /// As TetrahedralTopology does it; what opens is a wound.
  TopologyEdit split_vertex(int p, std::span<int const> some) {
    TopologyEdit const edit = topology_.split_vertex(p, some);
    for (int triangle = edit.first_triangle; triangle < edit.end_triangle; ++triangle) {
      auto const [t, k] = topology_.border_face(triangle);
      set(t, k, false);
      wound_.push_back(1);
    }
    return edit;
  }

  /// As TetrahedralTopology does it; what opens is a wound.
  TetrahedronRemoval remove_tetrahedron(int tetrahedron) {
    for (int k = 0; k < 4; ++k)
      if (int const other = topology_.neighbour(tetrahedron, k); other >= 0)
        for (int l = 0; l < 4; ++l)
          if (topology_.neighbour(other, l) == tetrahedron) set(other, l, false);
    TetrahedronRemoval const removal = topology_.remove_tetrahedron(tetrahedron);
    cut_[at(tetrahedron)] = cut_.back(), cut_.pop_back();
    wound_.insert(wound_.end(), removal.opened_count, 1);
    for (int const triangle : removal.gone()) wound_[at(triangle)] = wound_.back(), wound_.pop_back();
    return removal;
  }

  /// That of some pieces, in their order of particles. Throws as WholePieces does.
  CutSolid part(detail::WholePieces const& pieces) const {
    CutSolid made(static_cast<int>(pieces.particles.size()), pieces.inside(topology_.tetrahedra()));
    for (int t = 0, e = 0; t < topology_.tetrahedron_count(); ++t) {
      if (pieces.now(topology_.corners(t)[0]) < 0) continue;
      made.cut_[at(e)] = cut_[at(t)];
      for (int k = 0; k < 4; ++k)
        if (int const triangle = made.topology_.border_triangle(e, k); triangle >= 0) made.wound_[at(triangle)] = wound_[at(topology_.border_triangle(t, k))];
      ++e;
    }
    return made;
  }

  /// Room for so many vertices, tetrahedra and border triangles.
  void reserve(int vertices, int tetrahedra, int triangles) {
    topology_.reserve(vertices, tetrahedra, triangles);
    cut_.reserve(at(tetrahedra)), wound_.reserve(at(triangles));
  }

 private:
  static std::size_t at(int i) noexcept { return static_cast<std::size_t>(i); }
  void set(int t, int k, bool is) noexcept {
    auto const bit = static_cast<unsigned char>(1 << k);
    cut_[at(t)] = static_cast<unsigned char>(is ? cut_[at(t)] | bit : cut_[at(t)] & ~bit);
  }

  TetrahedralTopology topology_;
  std::vector<unsigned char> cut_;   // of each tetrahedron: bit k for face k
  std::vector<char> wound_;          // of each border triangle
};

}  // namespace palpate
