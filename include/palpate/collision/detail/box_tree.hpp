// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <tuple>
#include <utility>
#include <vector>

namespace palpate::detail {

/// An axis-aligned box. Made empty; a coordinate that is not a number does not extend it.
template <RealScalar Scalar>
struct Box {
  Vector3<Scalar> low = Vector3<Scalar>::Constant(std::numeric_limits<Scalar>::infinity());
  Vector3<Scalar> high = Vector3<Scalar>::Constant(-std::numeric_limits<Scalar>::infinity());

  template <class Point>
  void add(Point const& point) noexcept {
    for (int k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], point[k]);   // in this order NaN loses
      high[k] = std::max(high[k], point[k]);
    }
  }
  void add(Box const& other) noexcept {
    low = low.cwiseMin(other.low);
    high = high.cwiseMax(other.high);
  }
  Scalar perimeter() const noexcept { return (high - low).cwiseMax(Scalar(0)).sum(); }
};

/// The storage behind `SurfaceTree`: nodes of four boxes, leaves of a few triangles, and the edits that keep both in order.
///
/// A child of a node is another node or a leaf. A leaf is a block of up to `capacity` triangles with their corners, so that a query
/// reads them in one piece; a leaf that may not be split, because it would lie deeper than `depth_limit`, is a chain of blocks.
/// Invariant  every node but the root has at least two children; every block holds at least one triangle; in a chain all but the first
///            are full. So there are at most as many blocks, and as many nodes, as triangles (and one root): `reserve` can promise.
/// Limits     indices are not checked here. What may throw (memory) happens before anything changes.
template <RealScalar Scalar>
class BoxTree {
 public:
  using Points = Eigen::Ref<Matrix3X<Scalar> const, 0, Eigen::OuterStride<>>;
  using Corners = std::array<int, 3>;

  static constexpr int width = 4;          // children per node
  static constexpr int capacity = 8;       // triangles per block
  static constexpr int built_leaf = 4;     // triangles per leaf after the build: room for edits
  static constexpr int depth_limit = 32;   // nodes between root and leaf; the build needs at most 16 for 2³¹ triangles

  int size() const noexcept { return static_cast<int>(place_.size()); }

  Corners corners(int triangle) const noexcept {
    auto const place = place_[std::size_t(triangle)];
    return blocks_[place / capacity].corners[place % capacity];
  }

  void build(Points const& points, Eigen::Ref<Matrix<int, 3, Dynamic> const> const& triangles) {
    *this = BoxTree();
    int const count = static_cast<int>(triangles.cols());
    if (count == 0) return;
    place_.resize(std::size_t(count));
    blocks_.reserve(std::size_t(count) / 2 + 1);
    nodes_.reserve(std::size_t(count) / 4 + 1);
    Builder builder{triangles, Matrix3X<Scalar>(3, count), std::vector<int>(std::size_t(count))};
    for (int t = 0; t < count; ++t) {
      builder.order[std::size_t(t)] = t;
      builder.centres.col(t) = (points.col(triangles(0, t)) + points.col(triangles(1, t)) + points.col(triangles(2, t))) / 3;
    }
    build_node(builder, root, 0, count);
    refit(points);
  }

  void reserve(int triangles) {
    std::size_t const count = std::size_t(std::max(triangles, 0));
    place_.reserve(count);
    blocks_.reserve(count);
    nodes_.reserve(std::max<std::size_t>(count, 1));
  }

  void refit(Points const& points) noexcept {
    if (size() > 0) refit_node(points, root);
  }

  void refit_leaf_of(Points const& points, int triangle) noexcept {
    Block const& block = blocks_[place_[std::size_t(triangle)] / capacity];
    refit_child(points, block.node, block.slot);
  }

  int add(Points const& points, Corners const& corners, int sibling) {
    grow();
    int const triangle = size();
    place_.push_back(0);
    int node = root, slot = 0;
    if (sibling >= 0) {
      Block const& block = blocks_[place_[std::size_t(sibling)] / capacity];
      node = block.node;
      slot = block.slot;
    } else {
      std::tie(node, slot) = best_leaf(points, corners);
    }
    if (nodes_[std::size_t(node)].child[slot] == none) attach(node, slot, ~take_block());
    insert(points, node, slot, triangle, corners);
    return triangle;
  }

  void replace(Points const& points, int triangle, Corners const& corners) noexcept {
    auto const place = place_[std::size_t(triangle)];
    blocks_[place / capacity].corners[place % capacity] = corners;
    refit_leaf_of(points, triangle);
  }

  void remove(Points const& points, int triangle) noexcept {
    take_out(points, triangle);
    std::size_t const place = place_.back();   // the last triangle takes the free index
    if (triangle != size() - 1) {
      place_[std::size_t(triangle)] = place;
      blocks_[place / capacity].triangle[place % capacity] = triangle;
    }
    place_.pop_back();
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

 private:
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

  struct Block {
    Corners corners[capacity];
    int triangle[capacity];
    int count = 0;
    int next = -1;   // in the leaf's chain, or the next free block
    int node = root;
    int slot = 0;
  };

  struct Builder {
    Eigen::Ref<Matrix<int, 3, Dynamic> const> const& triangles;
    Matrix3X<Scalar> centres;
    std::vector<int> order;
  };

  // ---- build: halve twice along the longest side, for four children

  void build_node(Builder& builder, int node, int first, int last) {
    std::array<std::pair<int, int>, width> parts{std::pair{first, last}};
    int count = 1;
    for (int round = 0; round < 2; ++round)
      for (int i = 0, before = count; i < before; ++i)
        if (parts[std::size_t(i)].second - parts[std::size_t(i)].first > built_leaf) {
          auto& [begin, end] = parts[std::size_t(i)];
          int const middle = halve(builder, begin, end);
          parts[std::size_t(count++)] = {middle, end};
          end = middle;
        }
    for (int slot = 0; slot < count; ++slot) {
      auto const [begin, end] = parts[std::size_t(slot)];
      if (end - begin > built_leaf) {
        int const below = take_node();
        attach(node, slot, below);
        build_node(builder, below, begin, end);
        continue;
      }
      int const index = take_block();
      attach(node, slot, ~index);
      for (int i = begin; i < end; ++i) {
        int const t = builder.order[std::size_t(i)];
        append(index, t, {builder.triangles(0, t), builder.triangles(1, t), builder.triangles(2, t)});
      }
    }
  }

  static int halve(Builder& builder, int begin, int end) {
    Box<Scalar> box;
    for (int i = begin; i < end; ++i) box.add(builder.centres.col(builder.order[std::size_t(i)]));
    int axis = 0;
    (box.high - box.low).maxCoeff(&axis);
    int const half = (end - begin) / 2;
    int const middle = begin + (half + built_leaf - 1) / built_leaf * built_leaf;   // full leaves on the left
    auto const order = builder.order.begin();
    std::nth_element(order + begin, order + middle, order + end,
                     [&](int a, int b) { return builder.centres(axis, a) < builder.centres(axis, b); });
    return middle;
  }

  // ---- boxes

  Box<Scalar> leaf_box(Points const& points, int first_block) const noexcept {
    Box<Scalar> box;
    for (int index = first_block; index >= 0; index = blocks_[std::size_t(index)].next) {
      Block const& block = blocks_[std::size_t(index)];
      for (int i = 0; i < block.count; ++i)
        for (int const corner : block.corners[i]) box.add(points.col(corner));
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

  /// Memory for one more triangle, whatever it takes.
  void grow() {
    if (nodes_.empty()) *this = BoxTree();   // moved from
    auto const one_more = [](auto& list) {
      if (list.size() == list.capacity()) list.reserve(2 * list.size() + 1);
    };
    one_more(place_);
    one_more(blocks_);
    one_more(nodes_);
  }

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

  // ---- edits

  int level(int node) const noexcept {
    int above = 1;
    for (; node != root; node = nodes_[std::size_t(node)].parent) ++above;
    return above;
  }

  void insert(Points const& points, int node, int slot, int triangle, Corners const& corners) {
    int const head = ~nodes_[std::size_t(node)].child[slot];
    Block const& leaf = blocks_[std::size_t(head)];
    if (leaf.count < capacity) {
      append(head, triangle, corners);
      refit_child(points, node, slot);
    } else if (leaf.next < 0 && (nodes_[std::size_t(node)].free_slot() < width || level(node) < depth_limit)) {
      split(points, node, slot, triangle, corners);
    } else {   // as deep as the stack of a search allows: a longer list
      int const block = take_block();
      blocks_[std::size_t(block)].next = head;
      attach(node, slot, ~block);
      append(block, triangle, corners);
      refit_child(points, node, slot);
    }
  }

  /// A full leaf and one triangle more become two leaves, halved along the longest side.
  void split(Points const& points, int node, int slot, int triangle, Corners const& corners) {
    int const left = ~nodes_[std::size_t(node)].child[slot];
    int const right = take_block();
    Block const full = blocks_[std::size_t(left)];
    auto const corners_of = [&](int i) -> Corners const& { return i < capacity ? full.corners[i] : corners; };
    Vector3<Scalar> centres[capacity + 1];
    int order[capacity + 1];
    Box<Scalar> box;
    for (int i = 0; i <= capacity; ++i) {
      Corners const& corner = corners_of(i);
      centres[i] = points.col(corner[0]) + points.col(corner[1]) + points.col(corner[2]);
      box.add(centres[i]);
      order[i] = i;
    }
    int axis = 0;
    (box.high - box.low).maxCoeff(&axis);
    std::sort(order, order + capacity + 1, [&](int a, int b) { return centres[a][axis] < centres[b][axis]; });

    int right_node = node, right_slot = nodes_[std::size_t(node)].free_slot();
    int left_node = node, left_slot = slot;
    if (right_slot == width) {   // no room beside the old leaf: a node in its place holds both
      int const below = take_node();
      attach(node, slot, below);
      left_node = right_node = below;
      left_slot = 0;
      right_slot = 1;
    }
    blocks_[std::size_t(left)].count = 0;
    attach(left_node, left_slot, ~left);
    attach(right_node, right_slot, ~right);
    for (int i = 0; i <= capacity; ++i) {
      int const from = order[i];
      append(i <= capacity / 2 ? left : right, from < capacity ? full.triangle[from] : triangle, corners_of(from));
    }
    store(left_node, left_slot, leaf_box(points, left));
    store(right_node, right_slot, leaf_box(points, right));
    refit_above(left_node);
  }

  void take_out(Points const& points, int triangle) noexcept {
    std::size_t const place = place_[std::size_t(triangle)];
    int const node = blocks_[place / capacity].node, slot = blocks_[place / capacity].slot;
    int const head = ~nodes_[std::size_t(node)].child[slot];
    Block& leaf = blocks_[std::size_t(head)];
    int const last = --leaf.count;
    if (place != std::size_t(head) * capacity + std::size_t(last)) {
      blocks_[place / capacity].corners[place % capacity] = leaf.corners[last];
      blocks_[place / capacity].triangle[place % capacity] = leaf.triangle[last];
      place_[std::size_t(leaf.triangle[last])] = place;
    }
    if (leaf.count == 0) {
      int const rest = leaf.next;
      free_block(head);
      if (rest < 0) {
        detach(node, slot);
        refit_above(node);
        collapse(node);
        return;
      }
      attach(node, slot, ~rest);
    }
    refit_child(points, node, slot);
    merge(points, node, slot);
  }

  /// Two short leaves of one node become one, so that cutting back and forth does not litter the tree.
  void merge(Points const& points, int node, int slot) noexcept {
    int const from = ~nodes_[std::size_t(node)].child[slot];
    for (int other = 0; other < width; ++other) {
      int const child = nodes_[std::size_t(node)].child[other];
      if (other == slot || child == none || child >= 0) continue;
      Block const& a = blocks_[std::size_t(from)];
      Block const& b = blocks_[std::size_t(~child)];
      if (a.next >= 0 || b.next >= 0 || a.count + b.count > built_leaf) continue;
      for (int i = 0; i < a.count; ++i) append(~child, a.triangle[i], a.corners[i]);
      free_block(from);
      detach(node, slot);
      refit_child(points, node, other);
      refit_above(node);
      collapse(node);
      return;
    }
  }

  /// A node with one child gives it to its parent.
  void collapse(int node) noexcept {
    Node const& inner = nodes_[std::size_t(node)];
    if (node == root || inner.children() != 1) return;
    int const slot = static_cast<int>(std::find_if(inner.child, inner.child + width, [](int c) { return c != none; }) - inner.child);
    attach(inner.parent, inner.slot, inner.child[slot]);   // the parent's box of this slot is that of the one child already
    free_node(node);
  }

  /// Where a triangle without sibling goes: down the children whose boxes grow least.
  std::pair<int, int> best_leaf(Points const& points, Corners const& corners) const noexcept {
    Box<Scalar> box;
    for (int const corner : corners) box.add(points.col(corner));
    int index = root;
    while (true) {
      Node const& node = nodes_[std::size_t(index)];
      int best = 0;
      Scalar best_growth = std::numeric_limits<Scalar>::infinity();
      for (int slot = 0; slot < width; ++slot) {
        if (node.child[slot] == none) continue;
        Box<Scalar> grown = node.box(slot);
        Scalar const before = grown.perimeter();
        grown.add(box);
        Scalar const growth = grown.perimeter() - before;
        if (growth < best_growth || node.child[best] == none) {
          best_growth = growth;
          best = slot;
        }
      }
      if (node.child[best] < 0) return {index, best};   // a leaf, or nothing yet
      index = node.child[best];
    }
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

  std::vector<Node> nodes_ = std::vector<Node>(1);
  std::vector<Block> blocks_;
  std::vector<std::size_t> place_;   // of each triangle: block · capacity + position
  int free_node_ = -1, free_block_ = -1;
};

}  // namespace palpate::detail
