// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/collision/detail/box.hpp>
#include <palpate/core/huge_page_vector.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/core/reserve_and_prefault.hpp>
#include <palpate/core/simd.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <span>
#include <utility>
#include <vector>

namespace palpate::detail {

/// The bounding volume hierarchy behind `SurfaceTree`: nodes of four boxes, each of another node or of a leaf of a few triangles. The build halves
/// along the longest side; an edit changes one leaf and the boxes above it. Where that would go deeper than `depth_limit`, the tree is built
/// anew. What may throw (memory) happens before anything changes.
/// Invariant  every node but the root has at least two children, and every leaf a triangle: there are at most as many of either as triangles
///            (and one root).
/// Limits     indices are not checked here.
template <RealScalar Scalar>
class BoxTree {
 public:
  using Points = Eigen::Ref<Matrix3X<Scalar> const, 0, Eigen::OuterStride<>>;
  using Triangles = Eigen::Ref<Matrix<int, 3, Dynamic> const>;
  using Corners = std::array<int, 3>;

  static constexpr int depth_limit = 32;   // levels of nodes; the build needs at most 16 for 2³¹ triangles

  int size() const noexcept { return static_cast<int>(places_.size()); }
  Corners const& corners(int triangle) const noexcept {
    auto const [leaf, at] = places_[std::size_t(triangle)];
    return leaves_[leaf].corners[at];
  }

  void build(Points const& points, Triangles const& triangles) {
    *this = BoxTree();
    places_.resize(std::size_t(triangles.cols()));
    for (int t = 0; t < size(); ++t) items_.push_back({{triangles(0, t), triangles(1, t), triangles(2, t)}, t});
    leaves_.reserve(places_.size() / 2 + 1);
    nodes_.reserve(places_.size() / 4 + 1);
    build_node(points, root, items_);
    items_.clear();   // or each copy would have them
    refit(points);
  }

  void reserve(int triangles) {
    std::size_t const count = std::size_t(std::max(triangles, 1));
    std::size_t const growth = count - std::min(count, places_.size());
    reserve_and_prefault(places_, count);
    reserve_and_prefault(leaves_, count, growth / 2);
    reserve_and_prefault(nodes_, count, growth / 4);
    items_.reserve(std::max<std::size_t>(count, capacity + 1));
  }

  void refit(Points const& points) noexcept {
    if (size() > 0) refit_node(points, root);
  }
  void refit_leaf_of(Points const& points, int triangle) noexcept { refit_leaf(points, places_[std::size_t(triangle)].leaf); }

  int add(Points const& points, Corners const& corners, int sibling) {
    if (nodes_.empty()) *this = BoxTree();   // moved from
    reserve_one(points, sibling);
    int const triangle = size();
    places_.push_back({});
    int leaf = 0;
    if (triangle == 0)
      attach(root, 0, ~(leaf = leaves_.take()));
    else
      leaf = places_[std::size_t(sibling)].leaf;
    if (leaves_[leaf].count == capacity) {
      split(points, leaf, {corners, triangle});
    } else {
      append(leaf, {corners, triangle});
      refit_leaf(points, leaf);
    }
    return triangle;
  }

  /// Without a look at the points: the box has to stay, or the leaf to be fitted next.
  void relabel(int triangle, Corners const& corners) noexcept {
    auto const [leaf, at] = places_[std::size_t(triangle)];
    leaves_[leaf].corners[at] = corners;
  }

  void remove(Points const& points, int triangle) noexcept {
    auto const [leaf, at] = places_[std::size_t(triangle)];
    Leaf& from = leaves_[leaf];
    int const last = --from.count;
    places_[std::size_t(from.triangle[last])].at = at;
    from.corners[at] = from.corners[last];
    from.triangle[at] = from.triangle[last];
    if (last > 0) {
      refit_leaf(points, leaf);
    } else {
      auto const [node, slot] = from.link;
      nodes_[node].child[slot] = none;
      store(node, slot, {});
      leaves_.give_back(leaf);
      collapse(node);
    }
    Place const moved = places_.back();   // the triangle with the highest index takes the free one
    places_.pop_back();
    if (triangle == size()) return;
    places_[std::size_t(triangle)] = moved;
    leaves_[moved.leaf].triangle[moved.at] = triangle;
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
        Node const& node = nodes_[child];
        Lanes squared{};
#pragma GCC unroll 3
        for (int k = 0; k < 3; ++k) {
          Lanes const at{query[k], query[k], query[k], query[k]};
          Lanes low, high;
          simd::load(low, node.low[k]), simd::load(high, node.high[k]);
          Lanes outside = low - at;
          simd::raise_to(outside, Lanes(at - high));
          simd::raise_to(outside, Scalar(0));
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
        Leaf const& leaf = leaves_[~child];
        for (int i = 0; i < leaf.count; ++i) visit(leaf.corners[i].data(), leaf.triangle[i]);
      }
      do {
        if (waiting == 0) return;
        --waiting;
      } while (!(stack[waiting].bound <= limit));
      child = stack[waiting].child;
    }
  }

  /// Calls visit(corner indices, triangle) for all triangles in leaves whose boxes, and those above them, are accepted(box).
  template <class Accepted, class Visit>
  void visit_where(Accepted&& accepted, Visit&& visit) const {
    int stack[(width - 1) * depth_limit + 1];
    int waiting = 0;
    stack[waiting++] = root;
    while (waiting > 0) {
      int const child = stack[--waiting];
      if (child >= 0) {
        Node const& node = nodes_[child];
        for (int slot = 0; slot < width; ++slot)
          if (node.child[slot] != none && accepted(node.box(slot))) stack[waiting++] = node.child[slot];
      } else {
        Leaf const& leaf = leaves_[~child];
        for (int i = 0; i < leaf.count; ++i) visit(leaf.corners[i].data(), leaf.triangle[i]);
      }
    }
  }

  /// Calls visit(triangle, other's triangle) for all pairs whose boxes overlap or touch.
  template <class Visit>
  void overlaps(Points const& points, BoxTree const& other, Points const& others_points, Visit&& visit) const {
    auto const within = [&](Leaf const& mine, Leaf const& theirs) {
      for (int i = 0; i < mine.count; ++i)
        for (int j = 0; j < theirs.count; ++j)
          if (triangle_box(points, mine.corners[i]).overlaps(triangle_box(others_points, theirs.corners[j])))
            visit(mine.triangle[i], theirs.triangle[j]);
    };
    if (size() > 0 && other.size() > 0) overlaps(root, nodes_[root].box(), other, root, other.nodes_[root].box(), within);
  }

  /// An upper bound of the distance from the query to any vertex.
  Scalar farthest(Vector3<Scalar> const& query) const noexcept {
    Box<Scalar> const all = nodes_[root].box();
    Vector3<Scalar> farthest;
    for (int k = 0; k < 3; ++k) farthest[k] = std::max(query[k] - all.low[k], all.high[k] - query[k]);
    return farthest.norm();
  }

  int depth() const noexcept {
    int deepest = 0;
    for (Place const& place : places_) deepest = std::max(deepest, level(leaves_[place.leaf].link.node));
    return deepest;
  }

  bool matches(Points const& points, Triangles const& triangles) const {
    if (triangles.cols() != size()) return false;
    bool good = true;
    for (Place const& place : places_) {   // from each leaf up
      Link link = leaves_[place.leaf].link;
      Box<Scalar> box = leaf_box(points, leaves_[place.leaf]);
      for (int child = ~place.leaf; good && child != root; child = std::exchange(link, nodes_[link.node].link).node) {
        Node const& node = nodes_[link.node];
        good = node.child[link.slot] == child && node.box(link.slot) == box && (link.node == root || node.children() > 1);
        box = node.box();
      }
    }
    int found = 0;
    if (size() > 0)
      search(Vector3<Scalar>::Zero(), std::numeric_limits<Scalar>::infinity(), [&](int const* corner, int t) {
        ++found;
        good = good && t < size() && corner == corners(t).data() && triangles.col(t) == Eigen::Map<Matrix<int, 3, 1> const>(corner);
      });
    return good && found == size();
  }

 private:
  using Lanes = simd::Pack<Scalar, 4>;

  static constexpr int width = 4;        // children of a node
  static constexpr int capacity = 6;     // triangles of a leaf
  static constexpr int built_leaf = 4;   // after the build: room for edits
  static constexpr int root = 0;
  static constexpr int none = std::numeric_limits<int>::min();   // no child; a node is ≥ 0, a leaf ~(its index)

  struct Link {   // to the parent
    int node = root, slot = 0;
  };

  struct Node {
    static constexpr Scalar far = std::numeric_limits<Scalar>::infinity();
    alignas(4 * sizeof(Scalar)) Scalar low[3][width] = {{far, far, far, far}, {far, far, far, far}, {far, far, far, far}};
    alignas(4 * sizeof(Scalar)) Scalar high[3][width] = {{-far, -far, -far, -far}, {-far, -far, -far, -far}, {-far, -far, -far, -far}};
    int child[width] = {none, none, none, none};
    Link link;

    int free_slot() const noexcept { return static_cast<int>(std::find(child, child + width, none) - child); }
    int children() const noexcept { return width - static_cast<int>(std::count(child, child + width, none)); }
    Box<Scalar> box() const noexcept {
      Box<Scalar> all;
      for (int k = 0; k < 3; ++k) {
        all.low[k] = *std::min_element(low[k], low[k] + width);
        all.high[k] = *std::max_element(high[k], high[k] + width);
      }
      return all;
    }
    Box<Scalar> box(int i) const noexcept { return {{low[0][i], low[1][i], low[2][i]}, {high[0][i], high[1][i], high[2][i]}}; }
    void set_box(int i, Box<Scalar> const& box) noexcept {
      for (int k = 0; k < 3; ++k) {
        low[k][i] = box.low[k];
        high[k][i] = box.high[k];
      }
    }
  };

  struct alignas(64) Leaf {   // two cache lines; all that a refit of four triangles reads lies in the first
    int count = 0;
    Link link;
    Corners corners[capacity];
    int triangle[capacity];
  };

  struct Place {   // of a triangle
    int leaf = 0, at = 0;
  };

  struct Item {   // a triangle while it is built into leaves
    Corners corners;
    int triangle;
    Scalar key = 0;
  };

  /// Records that are taken and given back.
  template <class T>
  struct Pool : HugePageVector<T> {
    using HugePageVector<T>::HugePageVector;

    T& operator[](int i) noexcept { return this->begin()[i]; }
    T const& operator[](int i) const noexcept { return this->begin()[i]; }
    int take() {
      if (free < 0) {
        this->emplace_back();
        return static_cast<int>(this->size()) - 1;
      }
      int const taken = std::exchange(free, (*this)[free].link.node);
      (*this)[taken] = T();
      return taken;
    }
    void give_back(int i) noexcept { (*this)[i].link.node = std::exchange(free, i); }
    void clear() noexcept {
      HugePageVector<T>::clear();
      free = -1;
    }

    int free = -1;   // the rest of the list goes on in `link.node`
  };

  static Box<Scalar> triangle_box(Points const& points, Corners const& corners) noexcept {
    Box<Scalar> box;
    box.add(points.col(corners[0]), points.col(corners[1]), points.col(corners[2]));
    return box;
  }

  Box<Scalar> leaf_box(Points const& points, Leaf const& leaf) const noexcept {
    Box<Scalar> box;
    for (int i = 0; i < leaf.count; ++i) {
      Corners const& corner = leaf.corners[i];
      box.add(points.col(corner[0]), points.col(corner[1]), points.col(corner[2]));
    }
    return Box<Scalar>(box);   // a copy: the box itself is no place that the points may overlap, and stays in registers
  }

  Box<Scalar> refit_node(Points const& points, int index) noexcept {
    Node& node = nodes_[index];
    for (int slot = 0; slot < width; ++slot) {
      int const child = node.child[slot];
      if (child != none) node.set_box(slot, child >= 0 ? refit_node(points, child) : leaf_box(points, leaves_[~child]));
    }
    return node.box();
  }

  void refit_leaf(Points const& points, int leaf) noexcept {
    Link const link = leaves_[leaf].link;
    store(link.node, link.slot, leaf_box(points, leaves_[leaf]));
  }

  /// Gives a child its box, and fits those above until one does not change.
  void store(int node, int slot, Box<Scalar> const& box) noexcept {
    Node& here = nodes_[node];
    if (here.box(slot) == box) return;
    here.set_box(slot, box);
    if (node != root) store(here.link.node, here.link.slot, here.box());
  }

  /// The child's box is left to the caller.
  void attach(int node, int slot, int child) noexcept {
    nodes_[node].child[slot] = child;
    (child >= 0 ? nodes_[child].link : leaves_[~child].link) = {node, slot};
  }

  void append(int leaf, Item const& item) noexcept {
    Leaf& to = leaves_[leaf];
    to.corners[to.count] = item.corners;
    to.triangle[to.count] = item.triangle;
    places_[std::size_t(item.triangle)] = {leaf, to.count++};
  }

  // ---- build

  int build_child(Points const& points, std::span<Item> items) {
    if (items.size() > built_leaf) {
      int const node = nodes_.take();
      build_node(points, node, items);
      return node;
    }
    int const leaf = leaves_.take();
    for (Item const& item : items) append(leaf, item);
    return ~leaf;
  }

  /// Halves twice, for four children.
  void build_node(Points const& points, int node, std::span<Item> items) {
    int slot = 0;
    std::size_t const middle = halve(points, items);
    for (auto const& half : {items.first(middle), items.subspan(middle)}) {
      std::size_t const quarter = halve(points, half);
      for (auto const& part : {half.first(quarter), half.subspan(quarter)})
        if (!part.empty()) attach(node, slot++, build_child(points, part));
    }
  }

  /// Orders triangles along the longest side, so that those before the returned place lie before the others; all, where they fit one leaf.
  static std::size_t halve(Points const& points, std::span<Item> items) {
    if (items.size() <= built_leaf) return items.size();
    auto const centre = [&](Item const& item) -> Vector3<Scalar> {
      return points.col(item.corners[0]) + points.col(item.corners[1]) + points.col(item.corners[2]);
    };
    Box<Scalar> box;
    for (Item const& item : items) box.add(centre(item));
    int axis = 0;
    (box.high - box.low).maxCoeff(&axis);
    for (Item& item : items) item.key = centre(item)[axis];
    std::size_t const middle = (items.size() / 2 + built_leaf - 1) / built_leaf * built_leaf;   // full leaves on the left
    std::nth_element(items.begin(), items.begin() + std::ptrdiff_t(middle), items.end(), [](Item const& a, Item const& b) { return a.key < b.key; });
    return middle;
  }

  // ---- edits

  /// Memory for one more triangle beside another, whatever it takes, and depth where it goes.
  void reserve_one(Points const& points, int sibling) {
    auto const one_more = [](auto& list) {
      if (list.size() == list.capacity()) list.reserve(2 * list.size() + 1);
    };
    one_more(places_);
    one_more(leaves_);
    one_more(nodes_);
    items_.reserve(capacity + 1);
    if (size() == 0 || level(leaves_[places_[std::size_t(sibling)].leaf].link.node) < depth_limit) return;
    items_.clear();
    for (int t = 0; t < size(); ++t) items_.push_back({corners(t), t});
    leaves_.reserve(places_.size() + 1);
    nodes_.reserve(places_.size() + 1);
    leaves_.clear();
    nodes_.clear();
    build_node(points, nodes_.take(), items_);
    refit(points);
  }

  int level(int node) const noexcept {
    int above = 1;
    for (; node != root; node = nodes_[node].link.node) ++above;
    return above;
  }

  /// A full leaf and one triangle more become two leaves.
  void split(Points const& points, int left, Item const& added) {
    items_.assign(1, added);
    for (int i = 0; i < capacity; ++i) items_.push_back({leaves_[left].corners[i], leaves_[left].triangle[i]});
    std::span<Item> const items = items_;
    auto [node, slot] = leaves_[left].link;
    std::size_t const middle = halve(points, items);
    int const right = ~build_child(points, items.subspan(middle));
    leaves_[left].count = 0;
    for (Item const& item : items.first(middle)) append(left, item);
    int other = nodes_[node].free_slot();
    if (other == width) {   // no room beside the old leaf: a node in its place holds both
      int const below = nodes_.take();
      attach(node, slot, below);
      attach(below, 0, ~left);
      node = below;
      slot = 0;
      other = 1;
    }
    attach(node, other, ~right);
    nodes_[node].set_box(slot, leaf_box(points, leaves_[left]));
    store(node, other, leaf_box(points, leaves_[right]));
  }

  /// A node with one child gives it to its parent, whose box is that of the child already.
  void collapse(int node) noexcept {
    if (node == root || nodes_[node].children() > 1) return;
    auto const [parent, slot] = nodes_[node].link;
    attach(parent, slot, *std::find_if(nodes_[node].child, nodes_[node].child + width, [](int child) { return child != none; }));
    nodes_.give_back(node);
  }

  // ---- whole trees

  /// Calls visit(leaf, other's leaf); of two boxes that overlap, the larger is opened.
  template <class Visit>
  void overlaps(int mine, Box<Scalar> const& box, BoxTree const& other, int theirs, Box<Scalar> const& its_box, Visit& visit) const {
    if (!box.overlaps(its_box)) return;
    if (mine < 0 && theirs < 0) return visit(leaves_[~mine], other.leaves_[~theirs]);
    bool const opens_mine = theirs < 0 || (mine >= 0 && box.perimeter() >= its_box.perimeter());
    Node const& node = opens_mine ? nodes_[mine] : other.nodes_[theirs];
    for (int slot = 0; slot < width; ++slot) {
      if (node.child[slot] == none) continue;
      if (opens_mine)
        overlaps(node.child[slot], node.box(slot), other, theirs, its_box, visit);
      else
        overlaps(mine, box, other, node.child[slot], node.box(slot), visit);
    }
  }

  Pool<Node> nodes_ = Pool<Node>(1);
  Pool<Leaf> leaves_;
  HugePageVector<Place> places_;   // of each triangle
  std::vector<Item> items_;     // while they are built into leaves
};

}  // namespace palpate::detail
