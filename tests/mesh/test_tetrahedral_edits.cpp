// SPDX-License-Identifier: MIT
// Random edits of solids. Yardstick: a plain list of tetrahedra on which each operator is carried out by its definition, by a search of all; the law
// battery, which finds faces, border, edges and neighbours from the corners alone; volumes.
// PALPATE_TETRA_EDITS sets how many edits: 2,000 unless told, 100,000 before a release.
#include "catch.hpp"

#include <palpate/core/random.hpp>
#include <palpate/mesh/block.hpp>
#include <palpate/mesh/measures.hpp>
#include <palpate/mesh/sphere.hpp>
#include <palpate/mesh/tetrahedral_topology.hpp>
#include <palpate/testing/tetrahedral_topology.hpp>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

using namespace palpate;

namespace {

using Corners = std::array<int, 4>;
using Mesh = TetrahedralMesh<double>;

/// Ascending; the last two change places where that takes an odd permutation. Equal for the same tetrahedron in the same orientation.
Corners canonical(Corners c) {
  bool odd = false;
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t j = i + 1; j < 4; ++j) odd = odd != (c[i] > c[j]);
  std::sort(c.begin(), c.end());
  if (odd) std::swap(c[2], c[3]);
  return c;
}

/// A solid as a set of tetrahedra, and its operators by definition.
class PlainSolid {
 public:
  explicit PlainSolid(TetrahedralTopology const& topology) : tetrahedra_(of(topology)) {}

  static std::vector<Corners> of(TetrahedralTopology const& topology) {
    std::vector<Corners> all;
    for (int t = 0; t < topology.tetrahedron_count(); ++t) all.push_back(canonical(topology.corners(t)));
    std::sort(all.begin(), all.end());
    return all;
  }
  bool is(TetrahedralTopology const& topology) const { return tetrahedra_ == of(topology); }

  /// Each tetrahedron that holds all parents becomes as many, with the new vertex in the place of one of them.
  void insert(std::vector<int> const& parents, int vertex) {
    std::vector<Corners> all;
    for (Corners const& c : tetrahedra_) {
      bool const whole = std::all_of(parents.begin(), parents.end(), [&](int p) { return std::count(c.begin(), c.end(), p) == 1; });
      if (!whole) all.push_back(c);
      for (int const p : parents) {
        Corners part = c;
        std::replace(part.begin(), part.end(), p, vertex);
        if (whole) all.push_back(canonical(part));
      }
    }
    std::sort(all.begin(), all.end());
    tetrahedra_ = std::move(all);
  }
  void split(int parent, std::vector<Corners> const& group, int copy) {
    for (Corners& c : tetrahedra_)
      if (std::find(group.begin(), group.end(), c) != group.end()) {
        std::replace(c.begin(), c.end(), parent, copy);
        c = canonical(c);
      }
    std::sort(tetrahedra_.begin(), tetrahedra_.end());
  }

 private:
  std::vector<Corners> tetrahedra_;
};

Mesh solid_of(std::initializer_list<std::array<double, 3>> points, std::initializer_list<Corners> tetrahedra) {
  Mesh mesh{Matrix3X<double>(3, static_cast<Eigen::Index>(points.size())), Matrix<int, 4, Dynamic>(4, static_cast<Eigen::Index>(tetrahedra.size()))};
  Eigen::Index i = 0, t = 0;
  for (auto const& p : points) mesh.points.col(i++) << p[0], p[1], p[2];
  for (auto const& c : tetrahedra) mesh.tetrahedra.col(t++) << c[0], c[1], c[2], c[3];
  return mesh;
}

/// The triangles of a sphere, each with the centre.
Mesh ball(int frequency) {
  auto const skin = make_sphere<double>(1.0, frequency);
  Mesh mesh{Matrix3X<double>(3, skin.points.cols() + 1), Matrix<int, 4, Dynamic>(4, skin.triangles.cols())};
  mesh.points << skin.points, Vector3<double>::Zero();
  for (Eigen::Index t = 0; t < skin.triangles.cols(); ++t)
    mesh.tetrahedra.col(t) << static_cast<int>(skin.points.cols()), skin.triangles(0, t), skin.triangles(1, t), skin.triangles(2, t);
  return mesh;
}

std::vector<Mesh> zoo() {
  return {solid_of({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 1, 2, 3}}),
          solid_of({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}}, {{0, 1, 2, 3}, {4, 1, 3, 2}}),                // a common face
          solid_of({{0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {0, -1, 0}}, {{0, 1, 2, 3}, {0, 1, 4, 5}}),   // a common edge
          solid_of({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {-1, 0, 0}, {0, -1, 0}, {0, 0, -1}}, {{0, 1, 2, 3}, {0, 4, 6, 5}}),
          make_block<double>(3, 3, 3, 1.0),
          make_block<double>(3, 4, 3, 1.0, BlockPattern::alternating),
          ball(1),
          ball(2),
          make_block<double>(6, 5, 5, 1.0)};
}

/// One solid under edit, its points and what can be taken back.
class Edited {
 public:
  Edited(Mesh const& mesh, Random& random) : random_(random), topology_(mesh), plain_(topology_), points_(mesh.points), volume_(volume(mesh)) {}

  int size() const { return topology_.tetrahedron_count(); }

  void edit() {
    auto const what = random_.below(20);
    if (what < 5 && !history_.empty())
      undo();
    else if (what < 6)
      renew();
    else if (what < 10)
      split();
    else
      insert(what < 14 ? 2 : what < 17 ? 3 : 4);
  }

  /// Everything, from the list of tetrahedra alone.
  void check() const {
    REQUIRE(testing::to_text(testing::check_tetrahedral_topology(topology_, points_, volume_)) == "");
    REQUIRE(plain_.is(topology_));
  }

 private:
  struct Before {
    TopologyEdit edit;
    PlainSolid plain;
    Matrix<int, 4, Dynamic> tetrahedra;
    Matrix<int, 3, Dynamic> border;
  };

  int below(int count) { return static_cast<int>(random_.below(static_cast<std::uint64_t>(count))); }

  template <class Operator>
  void apply(Operator const& operate) {
    TetrahedralTopology const before = topology_;
    TopologyEdit const edit = operate();
    history_.push_back({edit, plain_, before.tetrahedra(), before.border().triangles()});
    REQUIRE(testing::to_text(testing::check_tetrahedral_edit(before, edit, topology_)) == "");
    Vector3<double> x = Vector3<double>::Zero();
    double sum = 0;
    for (int const p : edit.parents()) {
      double const weight = random_.uniform(0.5, 1.0);
      x += weight * points_.col(p), sum += weight;
    }
    points_.conservativeResize(3, edit.vertex + 1);
    points_.col(edit.vertex) = edit.is_copy() ? Vector3<double>(points_.col(edit.parent[0])) : Vector3<double>(x / sum);
  }

  void insert(int parents) {
    int const t = below(size());
    Corners c = topology_.corners(t);
    palpate::shuffle(std::span<int>(c), random_);
    apply([&] {
      return parents == 2   ? topology_.insert_on_edge(c[0], c[1])
             : parents == 3 ? topology_.insert_on_face(c[0], c[1], c[2])
                            : topology_.insert_in_tetrahedron(t);
    });
    plain_.insert({c.begin(), c.begin() + parents}, topology_.vertex_count() - 1);
  }

  /// Any tetrahedra at a vertex, or those on one side of a plane, or a fan.
  void split() {
    int const v = topology_.corners(below(size()))[static_cast<std::size_t>(below(4))];
    auto const here = topology_.tetrahedra_at(v);
    std::vector<int> group;
    topology_.fans_at(v, fans_);
    Vector3<double> const normal(random_.normal(), random_.normal(), random_.normal());
    bool const any = below(3) == 0;
    for (int const t : here) {
      Vector3<double> middle = Vector3<double>::Zero();
      for (int const w : topology_.corners(t)) middle += points_.col(w) / 4;
      if (any ? below(2) == 0 : normal.dot(middle - points_.col(v)) > 0) group.push_back(t);
    }
    if (fans_.size() > 1) group.assign(fans_[1].begin(), fans_[1].end());
    if (group.empty() || group.size() == here.size()) return;
    std::vector<Corners> corners;
    for (int const t : group) corners.push_back(canonical(topology_.corners(t)));
    apply([&] { return topology_.split_vertex(v, group); });
    plain_.split(v, corners, topology_.vertex_count() - 1);
  }

  void undo() {
    auto const& [edit, plain, tetrahedra, border] = history_.back();
    topology_.undo(edit);
    REQUIRE(topology_.tetrahedra() == tetrahedra);
    REQUIRE(topology_.border().triangles() == border);
    plain_ = plain;
    history_.pop_back();
    points_.conservativeResize(3, topology_.vertex_count());
  }

  /// A tetrahedron is turned, or taken away and put back: the solid is the same, its numbers are not, and earlier edits can not be taken back.
  void renew() {
    int const t = below(2) == 0 ? size() - 1 : below(size());
    Corners const c = topology_.corners(t);
    if (t == size() - 1) {
      topology_.pop_tetrahedron();
      REQUIRE(testing::to_text(testing::check_tetrahedral_topology(topology_)) == "");
      topology_.add_tetrahedron({c[1], c[2], c[0], c[3]});
    } else {
      topology_.set_tetrahedron(t, {c[3], c[2], c[1], c[0]});
    }
    history_.clear();
  }

  Random& random_;
  TetrahedralTopology topology_;
  PlainSolid plain_;
  Matrix3X<double> points_;
  double volume_;
  std::vector<Before> history_;
  TetrahedronFans fans_;
};

}  // namespace

TEST_CASE("random edits of solids leave what a search of all tetrahedra finds", "[topology]") {
  char const* const wanted = std::getenv("PALPATE_TETRA_EDITS");
  int const edits = wanted != nullptr ? std::atoi(wanted) : 2000;
  INFO(edits << " edits");
  Random random(Seed{20});
  auto const meshes = zoo();
  for (int done = 0; done < edits;)
    for (Mesh const& mesh : meshes) {
      Edited solid(mesh, random);
      solid.check();
      int const limit = solid.size() + 150;
      for (int k = 1; k <= 60 && done < edits && solid.size() < limit; ++k, ++done) {
        solid.edit();
        if (solid.size() < 200 || k % 5 == 0) solid.check();
      }
      solid.check();
    }
}
