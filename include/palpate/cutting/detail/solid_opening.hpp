// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/sparse_table.hpp>
#include <palpate/mesh/tetrahedral_adjacency.hpp>

#include <algorithm>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

namespace palpate::detail {

/// Opens a cut in a solid: a vertex splits where the faces that are cut part the tetrahedra round it, and with it those faces open.
/// Where that would leave parts of the tissue that only touch along an edge, or only in a vertex, the vertex that came to the cut last waits, and another one if
/// that is not enough, until others there split as well. So each edge of the border has two triangles, unless the mesh came otherwise, and no tissue hangs on a
/// vertex. Cavities may still meet in one.
class SolidOpening {
 public:
  void clear() noexcept { candidates_.clear(), waiting_.clear(), held_.clear(); }
  /// Its faces may part what is round it now.
  void add(int vertex) { candidates_.push_back(vertex); }
  bool is_empty() const noexcept { return candidates_.empty(); }
  bool waits(int vertex) const { return std::binary_search(waiting_.begin(), waiting_.end(), vertex); }
  /// The edges, lower end first, that these wait for, ascending: were they parted in their middle, nothing would touch there.
  std::span<std::pair<int, int> const> held() const noexcept { return held_; }

  /// `order(v)`: of those that came to the cut, a later one has a larger number. Calls has_split(vertex, its copy, the first triangle of the border that is new).
  template <class Body, class Order, class HasSplit>
  void open(Body& body, Order const& order, HasSplit const& has_split) {
    auto const& solid = body.tissue().topology();
    find_partings(body);
    while (hold_back(body, order)) {}
    std::sort(held_.begin(), held_.end());
    held_.erase(std::unique(held_.begin(), held_.end()), held_.end());
    waiting_.clear();
    for (Parting const& parting : partings_) {
      if (!parting.splits) waiting_.push_back(parting.vertex);
      for (std::size_t first = parting.second, end; parting.splits && first < parting.end; first = end) {
        for (end = first + 1; end < parting.end && fan_[end] == fan_[first];) ++end;
        int const triangles = solid.border().triangle_count();
        has_split(parting.vertex, body.split_vertex(parting.vertex, std::span<int const>(tetrahedra_).subspan(first, end - first)), triangles);
      }
    }
    candidates_.clear();
  }

 private:
  /// A vertex whose tetrahedra the cut parts into fans.
  struct Parting {
    int vertex;
    std::size_t first, second, end;   // in `tetrahedra_`: the fan that keeps it, the others
    bool splits = true;
  };

  template <class Body>
  void find_partings(Body const& body) {
    auto const& solid = body.tissue().topology();
    auto const is_cut = [&](int t, int k) { return body.tissue().is_cut(t, k); };
    candidates_.insert(candidates_.end(), waiting_.begin(), waiting_.end());
    std::sort(candidates_.begin(), candidates_.end());
    partings_.clear(), tetrahedra_.clear(), fan_.clear(), places_.clear(), edges_.clear(), held_.clear();
    for (std::size_t next = 0; next < candidates_.size(); ++next) {
      int const v = candidates_[next];
      if (places_.find(v) != nullptr) continue;
      places_[v] = -1;
      solid.fans_at(v, fans_, is_cut);
      if (fans_.size() < 2) continue;
      std::size_t const first = tetrahedra_.size();
      for (int fan = 0; fan < fans_.size(); ++fan) {
        tetrahedra_.insert(tetrahedra_.end(), fans_[fan].begin(), fans_[fan].end());
        fan_.resize(tetrahedra_.size(), fan);
      }
      partings_.push_back({v, first, first + fans_[0].size(), tetrahedra_.size()});
      for (std::size_t n = first; n < tetrahedra_.size(); ++n)   // what opens with it may part another that an earlier stroke has left
        for (int k = 0, t = tetrahedra_[n]; k < 4; ++k)
          if (is_cut(t, k) && solid.neighbour(t, k) > t && solid.corner_of(t, v) != k)
            for (int const w : solid.face(t, k))
              if (places_.find(w) == nullptr) candidates_.push_back(w);
    }
    std::sort(partings_.begin(), partings_.end(), [](Parting const& a, Parting const& b) { return a.vertex < b.vertex; });
    for (std::size_t n = 0; n < partings_.size(); ++n) places_[partings_[n].vertex] = static_cast<int>(n);
    for (Parting const& parting : partings_)
      for (std::size_t n = parting.first; n < parting.end; ++n)
        for (int k = 0, t = tetrahedra_[n]; k < 4; ++k) {
          int const u = solid.neighbour(t, k);
          if (u < t || !parts(parting, t, u) || solid.corner_of(t, parting.vertex) == k) continue;
          auto const c = solid.face(t, k);
          for (std::size_t i = 0; i < 3; ++i) edges_.push_back(std::minmax(int{c[i]}, int{c[(i + 1) % 3]}));
        }
    std::sort(edges_.begin(), edges_.end());
    edges_.erase(std::unique(edges_.begin(), edges_.end()), edges_.end());
  }

  /// The place of a vertex that the cut parts, or −1.
  int place_of(int v) const noexcept {
    int const* const place = places_.find(v);
    return place == nullptr ? -1 : *place;
  }
  Parting& at(int n) noexcept { return partings_[static_cast<std::size_t>(n)]; }
  Parting const& at(int n) const noexcept { return partings_[static_cast<std::size_t>(n)]; }
  int fan_of(Parting const& parting, int t) const noexcept {
    std::size_t n = parting.first;
    while (n < parting.end && tetrahedra_[n] != t) ++n;
    return n < parting.end ? fan_[n] : -1;
  }
  bool parts(Parting const& parting, int t, int u) const noexcept {
    int const one = fan_of(parting, t), other = fan_of(parting, u);
    return one >= 0 && other >= 0 && one != other;
  }
  /// Which copy of a vertex a tetrahedron will have.
  int copy_of(int v, int t) const noexcept {
    int const n = place_of(v);
    return n >= 0 && at(n).splits ? fan_of(at(n), t) : 0;
  }
  /// Whether a face will be open.
  template <class Body>
  bool opens(Body const& body, int t, int k) const {
    auto const& solid = body.tissue().topology();
    int const u = solid.neighbour(t, k);
    if (u < 0) return true;
    if (!body.tissue().is_cut(t, k)) return false;
    auto const c = solid.face(t, k);
    return std::any_of(c.begin(), c.end(), [&](int v) { return copy_of(v, t) != copy_of(v, u); });
  }

  /// Lets vertices wait where something would only touch; returns whether any has to.
  template <class Body, class Order>
  bool hold_back(Body const& body, Order const& order) {
    auto const& solid = body.tissue().topology();
    bool holds = false;
    for (auto const& [a, b] : edges_)
      if (touches_along(body, a, b) && let_wait(body, order, a, b)) held_.emplace_back(a, b), holds = true;
    for (Parting const& parting : partings_) {
      if (parting.splits) continue;
      solid.fans_at(parting.vertex, fans_, [&](int t, int k) { return opens(body, t, k); });
      if (fans_.size() == 1) continue;
      solid.fans_at(parting.vertex, fans_);
      holds = (fans_.size() == 1 && let_wait(body, order, parting.vertex, -1)) || holds;
    }
    return holds;
  }

  /// Whether the tetrahedra round an edge will be parts that nothing but the edge joins; not if they are already.
  template <class Body>
  bool touches_along(Body const& body, int a, int b) {
    auto const& solid = body.tissue().topology();
    ring_.clear(), parts_.clear();
    solid.for_each_round(a, b, [&](int t) { ring_.push_back(t); });
    for (std::size_t n = 0; n < ring_.size(); ++n) {
      int const face = n > 0 ? face_to(solid, ring_[n - 1], ring_[n]) : -1;
      if (n > 0 && face < 0) return false;   // two fans
      if (n == 0 || opens(body, ring_[n - 1], face)) parts_.emplace_back(copy_of(a, ring_[n]), copy_of(b, ring_[n]));
    }
    if (parts_.size() < 2) return false;
    if (int const face = face_to(solid, ring_.back(), ring_.front()); face >= 0 && !opens(body, ring_.back(), face)) parts_.pop_back();   // it closes
    std::sort(parts_.begin(), parts_.end());
    return std::adjacent_find(parts_.begin(), parts_.end()) != parts_.end();
  }
  static int face_to(TetrahedralAdjacency const& solid, int t, int u) noexcept {
    for (int k = 0; k < 4; ++k)
      if (solid.neighbour(t, k) == u) return k;
    return -1;
  }

  /// The last of those that open a face at a vertex, or at the edge from it to another.
  template <class Body, class Order>
  bool let_wait(Body const& body, Order const& order, int a, int b) {
    auto const& solid = body.tissue().topology();
    int last = -1;
    for (int const t : solid.tetrahedra_at(a)) {
      if (b >= 0 && solid.corner_of(t, b) < 0) continue;
      for (int k = 0; k < 4; ++k) {
        int const u = solid.neighbour(t, k);
        if (u < 0 || solid.corner_of(t, a) == k || (b >= 0 && solid.corner_of(t, b) == k)) continue;
        for (int const v : solid.face(t, k)) {
          int const n = place_of(v);
          if (n < 0 || !at(n).splits || !parts(at(n), t, u)) continue;
          if (last < 0 || std::pair(order(v), v) > std::pair(order(at(last).vertex), at(last).vertex)) last = n;
        }
      }
    }
    if (last >= 0) at(last).splits = false;
    return last >= 0;
  }

  std::vector<int> candidates_, waiting_;   // the latter ascending
  std::vector<Parting> partings_;   // by ascending vertices
  SparseTable<int> places_;         // of a vertex that was looked at: that of its parting, or −1
  std::vector<int> tetrahedra_, fan_;   // of all partings, fan after fan
  std::vector<std::pair<int, int>> edges_, held_, parts_;
  std::vector<int> ring_;
  TetrahedronFans fans_;
};

}  // namespace palpate::detail
