// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/columns.hpp>
#include <palpate/core/error.hpp>
#include <palpate/core/huge_page_vector.hpp>
#include <palpate/core/index_lists.hpp>
#include <palpate/mesh/boundary.hpp>
#include <palpate/mesh/surface_topology.hpp>
#include <palpate/mesh/tetrahedral_mesh.hpp>
#include <palpate/mesh/triangle_mesh.hpp>
#include <palpate/mesh/validation.hpp>
#include <palpate/tissue/concept.hpp>
#include <palpate/tissue/element.hpp>
#include <palpate/tissue/element_assembly.hpp>
#include <palpate/tissue/element_sums.hpp>
#include <palpate/tissue/lumped_mass.hpp>
#include <palpate/tissue/whole_pieces.hpp>

#include <algorithm>
#include <array>
#include <concepts>
#include <cstddef>
#include <span>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

namespace palpate {

/// Elements of one kind, and the particles that each joins.
template <class E>
struct ElementList {
  HugePageVector<std::array<int, static_cast<std::size_t>(E::nodes)>> nodes;
  HugePageVector<E> elements;

  int size() const noexcept { return static_cast<int>(elements.size()); }
};

namespace detail {

/// In the place of what is no Element: the compiler has said so, and then says no more.
template <RealScalar Scalar, int N>
struct StandInElement {
  static constexpr int nodes = N;
  Scalar energy(NodeColumns<Scalar, N> const& x) const;
  NodeColumns<Scalar, N> force(NodeColumns<Scalar, N> const& x) const;
  NodeMatrix<Scalar, N> stiffness(NodeColumns<Scalar, N> const& x) const;
};

}  // namespace detail

/// One element for each column of `indices`, which holds as many particles as the element has nodes: make(X) makes it from their rest positions [m].
///   make_elements(mesh.points, mesh.tetrahedra, [](auto const& rest) { return MyTetrahedron(rest, 3000.0, 0.3); })
template <class Points, class Indices, class Make>
auto make_elements(Eigen::MatrixBase<Points> const& points, Eigen::MatrixBase<Indices> const& indices, Make&& make) {
  constexpr int nodes = Indices::RowsAtCompileTime;
  using Columns = NodeColumns<typename Points::Scalar, nodes>;
  using E = std::remove_cvref_t<std::invoke_result_t<Make&, Columns const&>>;
  static_assert(sizeof(detail::ElementSentences<E, typename Points::Scalar>) > 0);
  if constexpr (!Element<E, typename Points::Scalar>) {
    return ElementList<detail::StandInElement<typename Points::Scalar, nodes>>{};
  } else {
    static_assert(E::nodes == nodes, "make_elements: the columns of indices hold another number of particles than the element has nodes.");
    ElementList<E> list;
    for (Eigen::Index c = 0; c < indices.cols(); ++c) {
      Columns rest;
      auto& own = list.nodes.emplace_back();
      for (int k = 0; k < nodes; ++k) {
        own[static_cast<std::size_t>(k)] = indices(k, c);
        detail::check_index("particle", indices(k, c), static_cast<int>(points.cols()));
        rest.col(k) = points.col(indices(k, c));
      }
      list.elements.push_back(make(std::as_const(rest)));
    }
    return list;
  }
}
/// One element of one node for each particle.
template <class Points, class Make>
auto make_elements(Eigen::MatrixBase<Points> const& points, Make&& make) {
  return make_elements(points, Matrix<int, 1, Dynamic>::LinSpaced(points.cols(), 0, static_cast<int>(points.cols()) - 1), std::forward<Make>(make));
}

/// Tissue of elements: what a TissueModel has to have, from what its elements answer.
///
///   auto const mesh = make_block<double>(5, 5, 5, 0.01);
///   ElementTissue tissue(mesh, {.total = 0.1}, make_elements(mesh.points, mesh.tetrahedra, [](auto const& rest) { return MyTetrahedron(rest); }));
///   SoftBody body(std::move(tissue), BackwardEuler{}, WholeBody{});
///
/// Forces, energy, products, row bounds, tangent for implicit integrators, zone, statics and cores follow; see Element for what an element states.
/// Units      kg, m, N.
/// Shapes     columns are particles, in the order of the mesh; its triangles, or the faces of its tetrahedra, are what a tool touches.
/// Masses     those given, or without them what the elements weigh (HasElementMass).
/// Neighbours particles that share an element or a triangle.
/// Invariant  masses > 0; each element joins different particles of the mesh.
/// Cost       see ElementSums and ElementAssembly.
/// Limits     its surface is not cut.
template <RealScalar S, Element<S>... Elements>
class ElementTissue : public ElementSums<ElementTissue<S, Elements...>, S> {
  using Sums = ElementSums<ElementTissue, S>;

  template <class E>
  static constexpr int lists_of = (0 + ... + int{std::same_as<E, Elements>});
  static_assert(((lists_of<Elements> == 1) && ...), "ElementTissue: two lists of elements of one kind; put them into one.");

 public:
  using Scalar = S;
  class Assembly;

  /// Throws InvalidMesh, InvalidArgument or OutOfRange and says which value is wrong.
  ElementTissue(TriangleMesh<S> const& mesh, MassOptions<S> const& mass, ElementList<Elements>... lists)
      : ElementTissue(Start{}, mesh, &mass, std::move(lists)...) {}
  ElementTissue(TetrahedralMesh<S> const& mesh, MassOptions<S> const& mass, ElementList<Elements>... lists)
      : ElementTissue(Start{}, mesh, &mass, std::move(lists)...) {}
  /// With the mass of its elements.
  explicit ElementTissue(TriangleMesh<S> const& mesh, ElementList<Elements>... lists)
    requires(HasElementMass<Elements, S> || ...)
      : ElementTissue(Start{}, mesh, nullptr, std::move(lists)...) {}
  explicit ElementTissue(TetrahedralMesh<S> const& mesh, ElementList<Elements>... lists)
    requires(HasElementMass<Elements, S> || ...)
      : ElementTissue(Start{}, mesh, nullptr, std::move(lists)...) {}

  int size() const noexcept { return rest_.size(); }
  auto rest_positions() const noexcept { return rest_.view(); }
  Vector3<S> rest_position(int i) const noexcept { return rest_[i]; }
  S mass(int i) const noexcept { return mass_[at(i)]; }
  bool nailed(int i) const noexcept { return nailed_[at(i)] != 0; }
  SurfaceTopology const& surface() const noexcept { return surface_; }
  std::size_t revision() const noexcept { return revision_; }

  /// The elements of one kind.
  template <class E>
  ElementList<E> const& elements() const noexcept {
    return std::get<Kind<E>>(kinds_).list;
  }
  /// Those of one kind that particle i is a node of: their places in that list.
  template <class E>
  std::span<int const> elements_at(int i) const noexcept {
    return std::get<Kind<E>>(kinds_).at[i];
  }

  void set_mass(int i, S mass) {
    detail::check_index("particle", i, size());
    detail::require_positive("particle mass", mass, "kg");
    mass_[at(i)] = mass;
    ++revision_;
  }
  /// A nailed particle is fixed: it keeps its place whatever pulls on it.
  void nail(int i) { set_nailed(i, true); }
  void unnail(int i) { set_nailed(i, false); }
  void nail(std::vector<int> const& particles) {
    for (int const i : particles) detail::check_index("particle", i, size());
    for (int const i : particles) nail(i);
  }

  template <class Visit>
  void for_each_neighbour(int i, Visit visit) const {
    for (int const other : neighbours_[i]) visit(other);
  }
  template <class Visit>
  void for_each_element(Visit visit) const {
    for_each_kind([&](auto const& kind) {
      for (std::size_t e = 0; e < kind.list.elements.size(); ++e) visit(kind.list.nodes[e], kind.list.elements[e]);
    });
  }
  template <class Visit>
  void for_each_element_at(int i, Visit visit) const {
    for_each_kind([&](auto const& kind) {
      for (int const e : kind.at[i]) visit(kind.list.nodes[at(e)], kind.list.elements[at(e)]);
    });
  }

  void assemble(std::span<int const> moving, Assembly& assembly) const { assembly.build(*this, moving); }
  /// The tissue of these particles alone, in this order; see DivisibleTissue. Throws as WholePieces does.
  ElementTissue part(std::span<int const> particles) const {
    ElementTissue made = *this;
    made.keep(detail::WholePieces(particles, size()));
    return made;
  }
  /// Nothing to do: it does not grow.
  void reserve(int /*particles*/, int /*triangles*/) const noexcept {}

  using Sums::stiffness_bound, Sums::damping_bound;
  S stiffness_bound(int i) const noexcept { return stiffness_at_rest_[at(i)]; }
  S damping_bound(int i) const noexcept { return damping_at_rest_[at(i)]; }

 protected:
  static std::size_t at(int i) noexcept { return static_cast<std::size_t>(i); }

  /// Only these stay. May throw half-way.
  void keep(detail::WholePieces const& part) {
    auto const take = [&](auto& values) {
      auto const whole = values;
      values.clear();
      for (int const i : part.particles) values.push_back(whole[at(i)]);
    };
    Columns<S, 3> rest;
    for (int const i : part.particles) rest.push_back(rest_[i]);
    rest_ = std::move(rest);
    take(mass_), take(nailed_), take(stiffness_at_rest_), take(damping_at_rest_);
    (keep_elements(std::get<Kind<Elements>>(kinds_), part), ...);
    if (surface_.vertex_count() > 0) surface_ = SurfaceTopology(size(), part.inside(surface_.triangles()));
    find_neighbours();
  }

  // --- edits: whoever makes them keeps the neighbours, calls take_bounds_of(i) for each node of an element that was edited, and counts the revision --------
  void add_particle(Vector3<S> const& rest, S mass, bool nailed) {
    rest_.push_back(rest), mass_.push_back(mass), nailed_.push_back(nailed ? 1 : 0);
    stiffness_at_rest_.push_back(0), damping_at_rest_.push_back(0);
    neighbours_.add_list();
    (std::get<Kind<Elements>>(kinds_).at.add_list(), ...);
  }
  /// Memory for so many particles and elements of a kind in all.
  template <class E>
  void reserve_edits(int particles, int elements) {
    auto& kind = std::get<Kind<E>>(kinds_);
    rest_.reserve_and_prefault(particles);
    neighbours_.reserve_for_growth(particles), kind.at.reserve_for_growth(particles);
    auto const of_each = [](auto& list, int count) { reserve_and_prefault(list, at(count)); };
    of_each(mass_, particles), of_each(nailed_, particles), of_each(stiffness_at_rest_, particles), of_each(damping_at_rest_, particles);
    of_each(kind.list.nodes, elements), of_each(kind.bounds, elements);
    HugePageVector<E>& all = kind.list.elements;   // the same, of what can only be copied
    std::size_t const before = all.size();
    if (before > 0) all.resize(std::max(before, at(elements)), E(all.front())), all.resize(before, E(all.front()));
  }
  void move_mass(int from, int to, S amount) noexcept { mass_[at(from)] -= amount, mass_[at(to)] += amount; }
  template <class E>
  void add_element(std::array<int, static_cast<std::size_t>(E::nodes)> const& nodes, E const& element) {
    auto& kind = std::get<Kind<E>>(kinds_);
    kind.list.nodes.push_back(nodes), kind.list.elements.push_back(element);
    for (std::size_t k = 0; k < nodes.size(); ++k) kind.at.add(nodes[k], kind.list.size() - 1, static_cast<int>(k));
    kind.bounds.emplace_back();
  }
  template <class E>
  void replace_element(int e, std::array<int, static_cast<std::size_t>(E::nodes)> const& nodes, E const& element) {
    auto& kind = std::get<Kind<E>>(kinds_);
    auto& own = kind.list.nodes[at(e)];
    for (std::size_t k = 0; k < nodes.size(); ++k) {
      if (own[k] == nodes[k]) continue;
      kind.at.remove(own[k], e), kind.at.add(nodes[k], e, static_cast<int>(k));
    }
    own = nodes, kind.list.elements[at(e)] = element;
    kind.bounds[at(e)] = {};
  }
  /// The last one of its kind gets the number.
  template <class E>
  void remove_element(int e) noexcept {
    auto& kind = std::get<Kind<E>>(kinds_);
    int const last = kind.list.size() - 1;
    for (int const i : kind.list.nodes[at(e)]) kind.at.remove(i, e);
    if (e != last) {
      for (int const i : kind.list.nodes[at(last)]) kind.at.rename(i, last, e);
      kind.list.nodes[at(e)] = kind.list.nodes[at(last)], kind.list.elements[at(e)] = kind.list.elements[at(last)];
      kind.bounds[at(e)] = kind.bounds[at(last)];
    }
    kind.list.nodes.pop_back(), kind.list.elements.pop_back(), kind.bounds.pop_back();
  }
  /// A particle that weighs so much less; 0: it is of no element any more, and stays where it is.
  void lighten(int i, S factor) noexcept {
    mass_[at(i)] *= factor;
    if (!(mass_[at(i)] > 0)) mass_[at(i)] = 0, nailed_[at(i)] = 1;
  }
  /// The same element, of which a particle is another one at the same place.
  template <class E>
  void rename_node(int e, int before, int now) {
    auto& kind = std::get<Kind<E>>(kinds_);
    auto& nodes = kind.list.nodes[at(e)];
    auto const node = std::find(nodes.begin(), nodes.end(), before);
    *node = now;
    kind.at.remove(before, e), kind.at.add(now, e, static_cast<int>(node - nodes.begin()));
  }
  void add_neighbour(int i, int other) { neighbours_.add(i, other, 0); }
  void remove_neighbour(int i, int other) noexcept { neighbours_.remove(i, other); }
  void rename_neighbour(int i, int before, int now) noexcept { neighbours_.rename(i, before, now); }
  void find_neighbours_of(int i) {
    std::vector<int>& found = found_neighbours_;
    found.clear();
    auto const add = [&](int j) {
      if (j != i && std::find(found.begin(), found.end(), j) == found.end()) found.push_back(j);
    };
    for_each_element_at(i, [&](auto const& nodes, auto const&) { std::for_each(nodes.begin(), nodes.end(), add); });
    for (int const t : i < surface_.vertex_count() ? surface_.triangles_at(i) : std::span<int const>())
      for (int const j : surface_.corners(t)) add(j);
    std::sort(found.begin(), found.end());
    neighbours_.clear_list(i);
    for (int const j : found) neighbours_.add(i, j, 0);
  }
  void take_bounds_of(int i) {
    stiffness_at_rest_[at(i)] = damping_at_rest_[at(i)] = 0;
    (take_bounds_of(i, std::get<Kind<Elements>>(kinds_)), ...);
  }
  void count_edit() noexcept { ++revision_; }
  /// For a tissue that keeps its surface itself.
  void drop_surface() { surface_ = SurfaceTopology(); }

  /// Each element of a kind, for what it remembers.
  template <class E, class Visit>
  void visit_elements(Visit const& visit) {
    auto& list = std::get<Kind<E>>(kinds_).list;
    for (std::size_t e = 0; e < list.elements.size(); ++e) visit(list.elements[e], list.nodes[e], e);
  }
  /// change(nodes at rest, element) → what takes the place of each of these elements. What the tissue weighs changes with them.
  template <class E, class Change>
  void change_elements(std::span<int const> some, Change const& change) {
    auto& list = std::get<Kind<E>>(kinds_).list;
    for (int const e : some) {
      NodeColumns<S, E::nodes> rest;
      for (int k = 0; k < E::nodes; ++k) rest.col(k) = rest_[list.nodes[at(e)][at(k)]];
      list.elements[at(e)] = change(rest, list.elements[at(e)]);
    }
    if constexpr ((HasElementMass<Elements, S> || ...)) mass_ = mass_of_elements();
    take_bounds();
    ++revision_;
  }

 private:
  /// Row bounds at rest of each node of an element.
  struct Bound {
    S stiffness = -1, damping = 0;   // −1: not known
  };
  template <class E>
  using BoundsOf = std::array<Bound, static_cast<std::size_t>(E::nodes)>;

  template <class E>
  struct Kind {
    ElementList<E> list;
    IndexLists at;   // elements at each particle, each with which of its nodes that is
    HugePageVector<BoundsOf<E>> bounds;
  };

  template <class Visit>
  void for_each_kind(Visit visit) const {
    (visit(std::get<Kind<Elements>>(kinds_)), ...);
  }

  template <class E>
  void keep_elements(Kind<E>& kind, detail::WholePieces const& part) {
    ElementList<E> const whole = std::move(kind.list);
    kind.list = {};
    for (std::size_t e = 0; e < whole.elements.size(); ++e) {
      auto nodes = whole.nodes[e];
      if (!part.hold(nodes)) continue;
      for (int& node : nodes) node = part.now(node);
      kind.list.nodes.push_back(nodes), kind.list.elements.push_back(whole.elements[e]);
    }
    find_elements_at(kind);
    kind.bounds.assign(kind.list.elements.size(), {});
  }

  struct Start {};
  template <class Mesh>
  ElementTissue(Start, Mesh const& mesh, MassOptions<S> const* mass, ElementList<Elements>... lists) : kinds_{Kind<Elements>{std::move(lists), {}, {}}...} {
    require_valid(mesh);
    rest_ = Columns<S, 3>(mesh.points);
    nailed_.assign(at(size()), 0);
    if constexpr (std::same_as<Mesh, TriangleMesh<S>>)
      surface_ = SurfaceTopology(size(), mesh.triangles);
    else
      surface_ = SurfaceTopology(size(), palpate::surface(mesh).triangles);
    (find_elements_at(std::get<Kind<Elements>>(kinds_)), ...);
    find_neighbours();
    mass_ = mass != nullptr ? lumped_masses(mesh, *mass) : mass_of_elements();
    for (int i = 0; i < size(); ++i) {
      if (!(this->mass(i) > 0))
        throw InvalidArgument(detail::message("particle ", i, " weighs ", this->mass(i), " kg; give masses, or elements with a mass there"));
    }
    take_bounds();
  }

  /// Row bounds at rest; of an element its matrices are found once for all of its nodes.
  void take_bounds() {
    (std::get<Kind<Elements>>(kinds_).bounds.assign(std::get<Kind<Elements>>(kinds_).list.elements.size(), {}), ...);
    stiffness_at_rest_.assign(at(size()), S(0)), damping_at_rest_ = stiffness_at_rest_;
    for (int i = 0; i < size(); ++i) take_bounds_of(i);
  }
  template <class E>
  void take_bounds_of(int i, Kind<E>& kind) {
    auto const here = kind.at[i], node = kind.at.keys(i);
    for (std::size_t n = 0; n < here.size(); ++n) {
      BoundsOf<E>& bounds = kind.bounds[at(here[n])];
      if (bounds[0].stiffness < 0) {
        auto const& nodes = kind.list.nodes[at(here[n])];
        NodeColumns<S, E::nodes> rest;
        for (int k = 0; k < E::nodes; ++k) rest.col(k) = rest_[nodes[at(k)]];
        detail::add_bounds_at_rest<E, S>(kind.list.elements[at(here[n])], rest, [&](int k, S stiffness, S damping) { bounds[at(k)] = {stiffness, damping}; });
      }
      Bound const& bound = bounds[at(node[n])];
      stiffness_at_rest_[at(i)] += bound.stiffness, damping_at_rest_[at(i)] += bound.damping;
    }
  }

  std::vector<S> mass_of_elements() const {
    std::vector<S> masses(at(size()), S(0));
    for_each_element([&]<class E>(auto const& nodes, E const& element) {
      if constexpr (HasElementMass<E, S>)
        for (int const i : nodes) masses[at(i)] += static_cast<S>(element.mass()) / S(E::nodes);
    });
    return masses;
  }

  template <class E>
  void find_elements_at(Kind<E>& kind) {
    if (kind.list.nodes.size() != kind.list.elements.size())
      throw InvalidArgument(detail::message("a list of ", kind.list.elements.size(), " elements says for ", kind.list.nodes.size(), " what they join"));
    kind.at = {};
    for (int i = 0; i < size(); ++i) kind.at.add_list();
    for (int e = 0; e < kind.list.size(); ++e) {
      auto nodes = kind.list.nodes[at(e)];
      for (std::size_t k = 0; k < nodes.size(); ++k) detail::check_index("particle", nodes[k], size()), kind.at.add(nodes[k], e, static_cast<int>(k));
      std::sort(nodes.begin(), nodes.end());
      if (std::adjacent_find(nodes.begin(), nodes.end()) != nodes.end()) throw InvalidArgument(detail::message("element ", e, " joins a particle with itself"));
    }
  }
  void find_neighbours() {
    neighbours_ = {};
    for (int i = 0; i < size(); ++i) neighbours_.add_list();
    for (int i = 0; i < size(); ++i) find_neighbours_of(i);
  }

  void set_nailed(int i, bool nailed) {
    detail::check_index("particle", i, size());
    nailed_[at(i)] = nailed || !(mass_[at(i)] > 0) ? 1 : 0;
    ++revision_;
  }

  Columns<S, 3> rest_;
  std::vector<S> mass_;
  std::vector<char> nailed_;
  SurfaceTopology surface_;
  std::tuple<Kind<Elements>...> kinds_;
  IndexLists neighbours_;
  std::vector<int> found_neighbours_;   // while they are found
  std::vector<S> stiffness_at_rest_, damping_at_rest_;   // row bounds, of each particle
  std::size_t revision_ = 0;
};

/// That of its elements.
template <RealScalar S, Element<S>... Elements>
class ElementTissue<S, Elements...>::Assembly : public ElementAssembly<S, Elements...> {
 public:
  /// Memory for all of the tissue.
  void reserve(ElementTissue const& tissue, int particles, int /*triangles*/) {
    ElementAssembly<S, Elements...>::reserve(particles, {tissue.elements<Elements>().elements.size()...});
  }
};

}  // namespace palpate
