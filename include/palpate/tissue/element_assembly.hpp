// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/serial.hpp>
#include <palpate/tissue/assembled_particles.hpp>
#include <palpate/tissue/column_force.hpp>
#include <palpate/tissue/element.hpp>

#include <algorithm>
#include <array>
#include <concepts>
#include <cstddef>
#include <span>
#include <tuple>
#include <type_traits>
#include <vector>

namespace palpate {

/// The elements that act on a chosen set of particles, their forces and their tangent.
/// Order      kind by kind; within a kind by the first chosen particle that is a node. A particle's force is summed in that order, however many blocks
///            there are.
/// Shapes     positions, velocities, forces: 3 × particles().size(), one column per local particle, or 4 × with the fourth row 0.
/// Cost       O(elements). Only build(), and linearise() for a larger set than before, allocate.
template <RealScalar Scalar, Element<Scalar>... Elements>
class ElementAssembly : public AssembledParticles<Scalar> {
  using Base = AssembledParticles<Scalar>;
  using typename Base::ConstPadded, typename Base::Padded;
  using Base::at, Base::first_of, Base::inverse_mass;

 public:
  using Base::blocks, Base::moving, Base::particles;

  /// f += internal forces at (x, v) in the first `moving()` columns; the border's columns are overwritten with partial sums.
  template <class X, class V, class F>
  void add_forces(X const& x, V const& v, F& f) const noexcept {
    add_forces(-1, x, v, f);
  }

  /// inverse mass · (internal force at (x, v) + pushes) + gravity of the `moving()` particles [m/s²]; see MassSpringAssembly for the arguments. `before` is
  /// called for all of them first, `after_of(block)` when all forces are known.
  template <class Run, std::size_t Count, class Before, class AfterOf>
  void accelerate(Scalar const* x, Scalar const* v, Vector3<Scalar> const& gravity, std::span<ColumnForce<Scalar> const> pushes, Scalar* force,
                  Run const& run, std::array<Scalar const*, Count> const& /*columns*/, Before const& before, AfterOf const& after_of) const {
    Padded f(force, 4, this->force_columns());
    ConstPadded const positions(x, 4, f.cols()), velocities(v, 4, f.cols());
    run(blocks(), [&](int b) { before(first_of(b), first_of(b + 1)); });
    if constexpr (std::same_as<Run, Serial>)
      add_forces(-1, positions, velocities, f);   // the same sums, and an element at a seam is computed once
    else
      run(blocks(), [&](int b) { add_forces(blocks() > 1 ? b : -1, positions, velocities, f); });
    this->accelerate_by(f, gravity, pushes, run, after_of);
  }

  /// Takes the tangent of every element at x, positive semidefinite, for the two below.
  template <class X>
  void linearise(X const& x, Scalar const* /*inverse_mass*/) {
    for_each_kind(*this, [&]<class E>(Kind<E>& kind) {
      kind.tangents.reserve(kind.elements.capacity());
      kind.tangents.clear();
      for (std::size_t e = 0; e < kind.elements.size(); ++e) {
        auto const here = gather(x, kind.nodes[e]);
        auto& tangent = kind.tangents.emplace_back(detail::semidefinite_stiffness(kind.elements[e], here));
        if constexpr (HasElementDamping<E, Scalar>) tangent.damping = kind.elements[e].damping(here);
      }
    });
  }
  /// out = (mass M + damping C + stiffness K) d, and the diagonal of that matrix: 4 × particles().size(), contiguous, the fourth row 0; d is zero in the
  /// border's columns, out's border columns are overwritten with partial sums.
  void multiply_tangent(Scalar mass, Scalar damping, Scalar stiffness, Scalar const* d, Scalar* out) const noexcept {
    this->multiply_mass(mass, d, out);
    add_tangent_product(damping, stiffness, d, out);
  }
  void tangent_diagonal(Scalar mass, Scalar damping, Scalar stiffness, Scalar* out) const noexcept {
    this->mass_diagonal(mass, out);
    add_tangent_diagonal(damping, stiffness, out);
  }

  // --- beside another assembly of the same particles ------------------------------------------------------------------
  /// The same two without the mass, added to what is there.
  void add_tangent_product(Scalar damping, Scalar stiffness, Scalar const* d, Scalar* out) const noexcept {
    if (damping == 0 && stiffness == 0) return;
    ConstPadded const direction(d, 4, this->force_columns());
    Padded product(out, 4, direction.cols());
    for_each_kind(*this, [&]<class E>(Kind<E> const& kind) {
      for (std::size_t e = 0; e < kind.tangents.size(); ++e) {
        auto const here = gather(direction, kind.nodes[e]);
        NodeColumns<Scalar, E::nodes> sum = NodeColumns<Scalar, E::nodes>::Zero();
        detail::add_product(sum, stiffness, kind.tangents[e].stiffness, here);
        if constexpr (HasElementDamping<E, Scalar>) detail::add_product(sum, damping, kind.tangents[e].damping, here);
        scatter(sum, kind.nodes[e], product);
      }
    });
  }
  void add_tangent_diagonal(Scalar damping, Scalar stiffness, Scalar* out) const noexcept {
    Padded diagonal(out, 4, this->force_columns());
    for_each_kind(*this, [&]<class E>(Kind<E> const& kind) {
      for (std::size_t e = 0; e < kind.tangents.size(); ++e)
        for (int k = 0; k < 3 * E::nodes; ++k)
          diagonal(k % 3, kind.nodes[e][at(k / 3)]) += stiffness * kind.tangents[e].stiffness(k, k) + damping * kind.tangents[e].damping(k, k);
    });
  }
  /// Their energy at x [J].
  Scalar energy(Scalar const* x) const noexcept {
    ConstPadded const positions(x, 4, this->force_columns());
    Scalar sum = 0;
    for_each_kind(*this, [&](auto const& kind) {
      for (std::size_t e = 0; e < kind.elements.size(); ++e) sum += kind.elements[e].energy(gather(positions, kind.nodes[e]));
    });
    return sum;
  }
  /// a_i += inverse mass · force of the elements at (x, v), for elements of one node: x, v and a with a fourth row of zeros.
  void add_acceleration(int i, Scalar const* x, Scalar const* v, Scalar* a) const noexcept
    requires((Elements::nodes == 1) && ...)
  {
    using Column = Eigen::Map<Vector3<Scalar> const>;
    for_each_kind(*this, [&](auto const& kind) {
      for (int e = i > 0 ? kind.ends[at(i - 1)] : 0; e < kind.ends[at(i)]; ++e)
        Eigen::Map<Vector3<Scalar>>(a) += inverse_mass(i) * detail::element_force(kind.elements[at(e)], Vector3<Scalar>(Column(x + 4 * i)), Vector3<Scalar>(Column(v + 4 * i)));
    });
  }

  /// Gathers the elements of `tissue` that act on the particles in `chosen`; asks it for size(), mass(i) and for_each_element_at(i, visit), see ElementSums.
  template <class Tissue>
  void build(Tissue const& tissue, std::span<int const> chosen) {
    this->choose(tissue, chosen);
    for_each_kind(*this, [](auto& kind) { kind.nodes.clear(), kind.elements.clear(), kind.ends.clear(); });
    for (int i = 0; i < moving(); ++i) {
      tissue.for_each_element_at(chosen[at(i)], [&]<class E>(auto nodes, E const& element) {
        bool is_first = true;
        for (int& node : nodes) {
          node = this->local(node);
          is_first = is_first && node >= i;
        }
        if (!is_first) return;
        std::get<Kind<E>>(kinds_).nodes.push_back(nodes);
        std::get<Kind<E>>(kinds_).elements.push_back(element);
      });
      for_each_kind(*this, [](auto& kind) { kind.ends.push_back(static_cast<int>(kind.elements.size())); });
    }
    for_each_kind(*this, [&](auto& kind) {
      for (auto& some : kind.of_block) some.clear();
      for (int b = 0; blocks() > 1 && b < blocks(); ++b)
        for (std::size_t e = 0; e < kind.nodes.size(); ++e)
          if (std::any_of(kind.nodes[e].begin(), kind.nodes[e].end(), [&](int j) { return j >= first_of(b) && j < first_of(b + 1); }))
            kind.of_block[at(b)].push_back(static_cast<int>(e));
    });
  }
  /// Memory for sets of up to so many particles and elements of each kind.
  void reserve(int count, std::array<std::size_t, sizeof...(Elements)> const& elements) {
    Base::reserve(count);
    auto of_kind = elements.begin();
    for_each_kind(*this, [&]<class E>(Kind<E>& kind) {
      kind.nodes.reserve(*of_kind), kind.elements.reserve(*of_kind), kind.ends.reserve(at(count));
      for (auto& some : kind.of_block)
        if (count >= 2 * Base::min_block_size) some.reserve(*of_kind);
      ++of_kind;
    });
  }

 private:
  template <int Nodes>
  struct Tangent {
    NodeMatrix<Scalar, Nodes> stiffness;
    NodeMatrix<Scalar, Nodes> damping = NodeMatrix<Scalar, Nodes>::Zero();
    explicit Tangent(NodeMatrix<Scalar, Nodes> const& k) noexcept : stiffness(k) {}
  };
  template <class E>
  struct Kind {
    std::vector<std::array<int, std::size_t{E::nodes}>> nodes;   // local
    std::vector<E> elements;
    std::vector<int> ends;                                       // of those whose first chosen particle is each of the moving ones
    std::vector<Tangent<E::nodes>> tangents;                     // since linearise()
    std::array<std::vector<int>, std::size_t{Base::max_blocks}> of_block;   // elements that act on particles of each block, where there are several
  };

  template <class Self, class Visit>
  static void for_each_kind(Self& self, Visit visit) {
    (visit(std::get<Kind<Elements>>(self.kinds_)), ...);
  }
  template <class Columns, std::size_t N>
  static NodeColumns<Scalar, static_cast<int>(N)> gather(Columns const& columns, std::array<int, N> const& nodes) noexcept {
    NodeColumns<Scalar, static_cast<int>(N)> own;
    for (std::size_t k = 0; k < N; ++k) own.col(static_cast<int>(k)) = columns.col(nodes[k]).template head<3>();
    return own;
  }
  template <class Columns, std::size_t N>
  static void scatter(NodeColumns<Scalar, static_cast<int>(N)> const& own, std::array<int, N> const& nodes, Columns& columns) noexcept {
    for (std::size_t k = 0; k < N; ++k) columns.col(nodes[k]).template head<3>() += own.col(static_cast<int>(k));
  }

  /// To the particles of a block, or of all: −1.
  template <class X, class V, class F>
  void add_forces(int block, X const& x, V const& v, F& f) const noexcept {
    for_each_kind(*this, [&]<class E>(Kind<E> const& kind) {
      if (block < 0) {
        for (std::size_t e = 0; e < kind.elements.size(); ++e)
          scatter(detail::element_force(kind.elements[e], gather(x, kind.nodes[e]), gather(v, kind.nodes[e])), kind.nodes[e], f);
        return;
      }
      int const first = first_of(block), end = first_of(block + 1);
      for (int const e : kind.of_block[at(block)]) {
        auto const& nodes = kind.nodes[at(e)];
        auto const force = detail::element_force(kind.elements[at(e)], gather(x, nodes), gather(v, nodes));
        for (std::size_t k = 0; k < nodes.size(); ++k)
          if (nodes[k] >= first && nodes[k] < end) f.col(nodes[k]).template head<3>() += force.col(static_cast<int>(k));
      }
    });
  }

  std::tuple<Kind<Elements>...> kinds_;
};

}  // namespace palpate
