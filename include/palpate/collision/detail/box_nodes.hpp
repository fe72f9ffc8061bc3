// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/collision/detail/box.hpp>
#include <palpate/core/large_vector.hpp>
#include <palpate/core/matrix.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

namespace palpate::detail {

/// Nodes of four boxes and leaves of a few triangles: the part of `BoxTree` that is searched and refitted, and its storage.
///
/// A child of a node is another node or a leaf. A leaf is a block of up to `capacity` triangles with their corners, so that a query
/// reads them in one piece; a leaf that may not be split, because it would lie deeper than `depth_limit`, is a chain of blocks.
/// Invariant  every node but the root has at least two children; every block holds at least one triangle; in a chain all but the first
///            are full. So there are at most as many blocks, and as many nodes, as triangles (and one root).
/// Limits     indices are not checked here.
template <RealScalar Scalar>
class BoxNodes {
 public:
  using Points = Eigen::Ref<Matrix3X<Scalar> const, 0, Eigen::OuterStride<>>;
  using Corners = std::array<int, 3>;

  static constexpr int width = 4;          // children per node
  static constexpr int capacity = 6;       // triangles per block
  static constexpr int depth_limit = 32;   // nodes between root and leaf; the build needs at most 16 for 2³¹ triangles

  int size() const noexcept { return static_cast<int>(place_.size()); }

  Corners corners(int triangle) const noexcept {
    auto const place = place_[std::size_t(triangle)];
    return blocks_[place / capacity].corners[place % capacity];
  }

  void refit(Points const& points) noexcept {
    if (size() > 0) refit_node(points, root);
  }

  void refit_leaf_of(Points const& points, int triangle) noexcept {
    Block const& block = blocks_[place_[std::size_t(triangle)] / capacity];
    refit_child(points, block.node, block.slot);
  }

  /// Calls visit(corner indices, triangle) for all triangles whose boxes are not farther than √limit from the query, nearer boxes
  /// first. `visit` may lower `limit`.
  template <class Visit>
  void search(Vector3<Scalar> const& query, Scalar const& limit, Visit&& visit) const noexcept {
    struct Waiting {
      Scalar bound;
      int child;
    };
    Waiting stack[(width - 1) * depth_limit + 1];
    int waiting = 0;
    int child = root;
    while (true) {
      if (child >= 0) {
        Node const& node = nodes_[std::size_t(child)];
        Lanes squared = Lanes::Zero();
        for (int k = 0; k < 3; ++k) {
          Lanes const outside = (node.low[k] - query[k]).max(query[k] - node.high[k]).max(Scalar(0));
          squared += outside * outside;
        }
        int const first = waiting;
        for (int slot = 0; slot < width; ++slot) {
          if (node.child[slot] == none || !(squared[slot] <= limit)) continue;
          int at = waiting++;
          for (; at > first && stack[at - 1].bound < squared[slot]; --at) stack[at] = stack[at - 1];
          stack[at] = {squared[slot], node.child[slot]};
        }
      } else {
        for (int index = ~child; index >= 0; index = blocks_[std::size_t(index)].next) {
          Block const& block = blocks_[std::size_t(index)];
          for (int i = 0; i < block.count; ++i) visit(block.corners[i].data(), block.triangle[i]);
        }
      }
      do {
        if (waiting == 0) return;
        --waiting;
      } while (!(stack[waiting].bound <= limit));
      child = stack[waiting].child;
    }
  }

  /// An upper bound of the distance from the query to any vertex.
  Scalar farthest(Vector3<Scalar> const& query) const noexcept {
    Node const& node = nodes_[root];
    Lanes squared = Lanes::Zero();
    for (int k = 0; k < 3; ++k) {
      Lanes const far = (query[k] - node.low[k]).max(node.high[k] - query[k]).max(Scalar(0));   // 0 for an empty slot
      squared += far * far;
    }
    return std::sqrt(squared.maxCoeff());
  }

  int depth() const noexcept { return size() == 0 ? 0 : depth_below(root); }

  bool matches(Points const& points, Eigen::Ref<Matrix<int, 3, Dynamic> const> const& triangles) const {
    if (triangles.cols() != size()) return false;
    int found = 0;
    int const levels = size() == 0 ? 0 : depth_below(root);
    if (levels > depth_limit || !node_matches(points, triangles, root, found)) return false;
    return found == size();
  }

 protected:
  using Lanes = Eigen::Array<Scalar, width, 1>;

  static constexpr int root = 0;
  static constexpr int none = std::numeric_limits<int>::min();   // no child; a node is ≥ 0, a leaf ~(its first block)

  struct Node {
    Lanes low[3] = {empty_low(), empty_low(), empty_low()};
    Lanes high[3] = {-empty_low(), -empty_low(), -empty_low()};
    int child[width] = {none, none, none, none};
    int parent = -1;   // the next free node while this one is free
    int slot = 0;      // in the parent

    static Lanes empty_low() noexcept { return Lanes::Constant(std::numeric_limits<Scalar>::infinity()); }

    int children() const noexcept {
      return static_cast<int>(std::count_if(child, child + width, [](int c) { return c != none; }));
    }
    int free_slot() const noexcept { return static_cast<int>(std::find(child, child + width, none) - child); }
    Box<Scalar> box() const noexcept {
      Box<Scalar> all;
      for (int k = 0; k < 3; ++k) {
        all.low[k] = low[k].minCoeff();
        all.high[k] = high[k].maxCoeff();
      }
      return all;
    }
    Box<Scalar> box(int i) const noexcept {
      return {{low[0][i], low[1][i], low[2][i]}, {high[0][i], high[1][i], high[2][i]}};
    }
    void set_box(int i, Box<Scalar> const& box) noexcept {
      for (int k = 0; k < 3; ++k) {
        low[k][i] = box.low[k];
        high[k][i] = box.high[k];
      }
    }
  };

  struct alignas(64) Block {   // two cache lines; all that a refit of four triangles reads lies in the first
    int count = 0;
    int next = -1;   // in the leaf's chain, or the next free block
    int node = root;
    int slot = 0;
    Corners corners[capacity];
    int triangle[capacity];
  };

  Box<Scalar> leaf_box(Points const& points, int first_block) const noexcept {
    Box<Scalar> box;
    for (int index = first_block; index >= 0; index = blocks_[std::size_t(index)].next) {
      Block const& block = blocks_[std::size_t(index)];
      for (int i = 0; i < block.count; ++i) {
        Corners const& corner = block.corners[i];
        box.add(points.col(corner[0]), points.col(corner[1]), points.col(corner[2]));
      }
    }
    return box;
  }

  Box<Scalar> refit_node(Points const& points, int index) noexcept {
    Node& node = nodes_[std::size_t(index)];
    for (int slot = 0; slot < width; ++slot) {
      int const child = node.child[slot];
      if (child == none) continue;
      node.set_box(slot, child >= 0 ? refit_node(points, child) : leaf_box(points, ~child));
    }
    return node.box();
  }

  /// Fits one child's box, then those above until one does not change.
  void refit_child(Points const& points, int node, int slot) noexcept {
    int const child = nodes_[std::size_t(node)].child[slot];
    if (store(node, slot, child >= 0 ? nodes_[std::size_t(child)].box() : leaf_box(points, ~child))) refit_above(node);
  }

  void refit_above(int node) noexcept {
    while (node != root) {
      Node const& inner = nodes_[std::size_t(node)];
      if (!store(inner.parent, inner.slot, inner.box())) return;
      node = inner.parent;
    }
  }

  bool store(int node, int slot, Box<Scalar> const& box) noexcept {
    Box<Scalar> const before = nodes_[std::size_t(node)].box(slot);
    if (before.low == box.low && before.high == box.high) return false;
    nodes_[std::size_t(node)].set_box(slot, box);
    return true;
  }

  // ---- storage

  int take_node() {
    if (free_node_ < 0) {
      nodes_.emplace_back();
      return static_cast<int>(nodes_.size()) - 1;
    }
    return std::exchange(free_node_, std::exchange(nodes_[std::size_t(free_node_)], Node()).parent);
  }

  int take_block() {
    if (free_block_ < 0) {
      blocks_.emplace_back();
      return static_cast<int>(blocks_.size()) - 1;
    }
    return std::exchange(free_block_, std::exchange(blocks_[std::size_t(free_block_)], Block()).next);
  }

  void free_node(int node) noexcept {
    nodes_[std::size_t(node)] = Node();
    nodes_[std::size_t(node)].parent = std::exchange(free_node_, node);
  }

  void free_block(int block) noexcept { blocks_[std::size_t(block)].next = std::exchange(free_block_, block); }

  /// Hangs a node or a leaf into a slot. Its box is left to the caller.
  void attach(int node, int slot, int child) noexcept {
    nodes_[std::size_t(node)].child[slot] = child;
    if (child >= 0) {
      nodes_[std::size_t(child)].parent = node;
      nodes_[std::size_t(child)].slot = slot;
    } else {
      for (int index = ~child; index >= 0; index = blocks_[std::size_t(index)].next) {
        blocks_[std::size_t(index)].node = node;
        blocks_[std::size_t(index)].slot = slot;
      }
    }
  }

  void detach(int node, int slot) noexcept {
    nodes_[std::size_t(node)].child[slot] = none;
    nodes_[std::size_t(node)].set_box(slot, Box<Scalar>());
  }

  void append(int block, int triangle, Corners const& corners) noexcept {
    Block& to = blocks_[std::size_t(block)];
    to.corners[to.count] = corners;
    to.triangle[to.count] = triangle;
    place_[std::size_t(triangle)] = std::size_t(block) * capacity + std::size_t(to.count);
    ++to.count;
  }

  // ---- inspection

  int depth_below(int index) const noexcept {
    int deepest = 0;
    for (int const child : nodes_[std::size_t(index)].child)
      if (child >= 0) deepest = std::max(deepest, depth_below(child));
    return deepest + 1;
  }

  bool node_matches(Points const& points, Eigen::Ref<Matrix<int, 3, Dynamic> const> const& triangles, int index,
                    int& found) const {
    Node const& node = nodes_[std::size_t(index)];
    if (index != root && node.children() < 2) return false;
    for (int slot = 0; slot < width; ++slot) {
      int const child = node.child[slot];
      Box<Scalar> expected;
      if (child >= 0) {
        Node const& below = nodes_[std::size_t(child)];
        if (below.parent != index || below.slot != slot || !node_matches(points, triangles, child, found)) return false;
        expected = below.box();
      } else if (child != none) {
        for (int b = ~child; b >= 0; b = blocks_[std::size_t(b)].next) {
          Block const& block = blocks_[std::size_t(b)];
          if (block.node != index || block.slot != slot || block.count < 1 || (b != ~child && block.count < capacity)) return false;
          for (int i = 0; i < block.count; ++i, ++found) {
            int const t = block.triangle[i];
            if (t < 0 || t >= size() || place_[std::size_t(t)] != std::size_t(b) * capacity + std::size_t(i)) return false;
            for (int k = 0; k < 3; ++k)
              if (triangles(k, t) != block.corners[i][std::size_t(k)]) return false;
          }
        }
        expected = leaf_box(points, ~child);
      }
      Box<Scalar> const stored = node.box(slot);
      if (stored.low != expected.low || stored.high != expected.high) return false;
    }
    return true;
  }

  LargeVector<Node> nodes_ = LargeVector<Node>(1);
  LargeVector<Block> blocks_;
  LargeVector<std::size_t> place_;   // of each triangle: block · capacity + position
  int free_node_ = -1, free_block_ = -1;
};

}  // namespace palpate::detail
