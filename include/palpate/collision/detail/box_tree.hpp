// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/collision/detail/box.hpp>
#include <palpate/collision/detail/box_nodes.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/core/room.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

namespace palpate::detail {

/// The tree behind `SurfaceTree`: how it is built, and the edits that keep it in order. What may throw (memory) happens before
/// anything changes.
template <RealScalar Scalar>
class BoxTree : public BoxNodes<Scalar> {
  using Base = BoxNodes<Scalar>;
  using typename Base::Block;
  using typename Base::Node;

 public:
  using typename Base::Corners;
  using typename Base::Points;
  using Base::capacity;
  using Base::depth_limit;
  using Base::refit;
  using Base::refit_leaf_of;
  using Base::size;
  using Base::width;

  static constexpr int built_leaf = 4;   // triangles per leaf after the build: room for edits

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
    std::size_t const growth = count - std::min(count, place_.size());
    make_room(place_, count);
    make_room(blocks_, count, growth / 2);
    make_room(nodes_, std::max<std::size_t>(count, 1), growth / 4);
  }

  int add(Points const& points, Corners const& corners, int sibling) {
    grow();
    int const triangle = size();
    place_.push_back(0);
    auto const [node, slot] = sibling >= 0 ? leaf_of(sibling) : best_leaf(points, corners);
    if (nodes_[std::size_t(node)].child[slot] == none) attach(node, slot, ~take_block());
    insert(points, node, slot, triangle, corners);
    return triangle;
  }

  void replace(Points const& points, int triangle, Corners const& corners) noexcept {
    relabel(triangle, corners);
    refit_leaf_of(points, triangle);
  }

  /// Without a look at the points: the box has to stay, or the leaf to be fitted next.
  void relabel(int triangle, Corners const& corners) noexcept {
    auto const place = place_[std::size_t(triangle)];
    blocks_[place / capacity].corners[place % capacity] = corners;
  }

  /// The two together have the corners that the triangle had.
  int divide(Points const& points, int triangle, Corners const& first, Corners const& second) {
    grow();
    relabel(triangle, first);
    int const added = size();
    place_.push_back(0);
    auto const [node, slot] = leaf_of(triangle);
    int const head = ~nodes_[std::size_t(node)].child[slot];
    if (blocks_[std::size_t(head)].count == capacity) {
      insert(points, node, slot, added, second);   // fits the leaf of both
      return added;
    }
    append(head, added, second);
    Box<Scalar> box = nodes_[std::size_t(node)].box(slot);   // holds the corners that were there
    box.add(points.col(second[0]), points.col(second[1]), points.col(second[2]));
    if (store(node, slot, box)) refit_above(node);
    return added;
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

 private:
  using Base::append;
  using Base::attach;
  using Base::blocks_;
  using Base::detach;
  using Base::free_block;
  using Base::free_node;
  using Base::leaf_box;
  using Base::nodes_;
  using Base::none;
  using Base::place_;
  using Base::refit_above;
  using Base::refit_child;
  using Base::root;
  using Base::store;
  using Base::take_block;
  using Base::take_node;

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

  // ---- edits

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

  /// Node and slot of the leaf that holds a triangle.
  std::pair<int, int> leaf_of(int triangle) const noexcept {
    Block const& block = blocks_[place_[std::size_t(triangle)] / capacity];
    return {block.node, block.slot};
  }

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
};

}  // namespace palpate::detail
