// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/serial.hpp>
#include <palpate/core/simd.hpp>
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
/// Particles 0 … moving−1 are the chosen ones; after them comes the border: particles that are only a node of an element.
/// Order      kind by kind; within a kind by the first chosen particle that is a node. A particle's force is summed in that order, however many blocks
///            there are.
/// Block      chosen particles that follow each other, 2,048 or more; at most eight. Blocks can be walked at once: an element at the seam of two is
///            computed in both, and each takes the forces on its own particles.
/// Shapes     positions, velocities, forces: 3 × particles().size(), one column per local particle, or 4 × with the fourth row 0.
/// Cost       O(elements). Only build(), and linearise() for a larger set than before, allocate.
template <RealScalar Scalar, Element<Scalar>... Elements>
class ElementAssembly {
 public:
  /// Local particle → particle of the body.
  std::span<int const> particles() const noexcept { return particles_; }
  int moving() const noexcept { return static_cast<int>(inverse_mass_.size()); }

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
    Padded f(force, 4, static_cast<Eigen::Index>(particles_.size()));
    ConstPadded const positions(x, 4, f.cols()), velocities(v, 4, f.cols());
    run(blocks(), [&](int b) { before(first_of(b), first_of(b + 1)); });
    if constexpr (std::same_as<Run, Serial>)
      add_forces(-1, positions, velocities, f);   // the same sums, and an element at a seam is computed once
    else
      run(blocks(), [&](int b) { add_forces(blocks() > 1 ? b : -1, positions, velocities, f); });
    run(blocks(), [&](int b) {
      auto const after = after_of(b);
      auto push = std::lower_bound(pushes.begin(), pushes.end(), first_of(b), [](ColumnForce<Scalar> const& p, int i) { return p.column < i; });
      for (int i = first_of(b); i < first_of(b + 1); ++i) {
        Vector3<Scalar> sum = f.col(i).template head<3>();
        for (; push != pushes.end() && push->column == i; ++push) sum += push->force;
        f.col(i).setZero();
        sum = inverse_mass_[at(i)] * sum + gravity;
        after(i, simd::Pack<Scalar, 4>{sum[0], sum[1], sum[2], Scalar(0)});
      }
    });
    f.rightCols(f.cols() - moving()).setZero();
  }
  int force_columns() const noexcept { return static_cast<int>(particles_.size()); }
  static int max_force_columns(int particles) noexcept { return particles; }
  int blocks() const noexcept { return std::clamp(moving() / min_block_size, 1, max_blocks); }

  /// Takes the tangent of every element at x, positive semidefinite, for the two below.
  template <class X>
  void linearise(X const& x, Scalar const* /*inverse_mass*/) {
    for_each_kind(*this, [&]<class E>(Kind<E>& kind) {
      if constexpr (has_packed_tangent<E>) {
        static_assert(is_padded<X>);
        for (int b = 0; b < blocks(); ++b) kind.packs[at(b)].linearise(x.data());
        return;
      }
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
    ConstPadded const direction(d, 4, static_cast<Eigen::Index>(particles_.size()));
    Padded product(out, 4, direction.cols());
    for (int i = 0; i < moving(); ++i) product.col(i) = mass / inverse_mass_[at(i)] * direction.col(i);
    product.rightCols(product.cols() - moving()).setZero();
    add_tangent_product(damping, stiffness, d, out);
  }
  void tangent_diagonal(Scalar mass, Scalar damping, Scalar stiffness, Scalar* out) const noexcept {
    Padded diagonal(out, 4, static_cast<Eigen::Index>(particles_.size()));
    diagonal.setZero();
    for (int i = 0; i < moving(); ++i) diagonal.col(i).template head<3>().setConstant(mass / inverse_mass_[at(i)]);
    add_tangent_diagonal(damping, stiffness, out);
  }

  // --- beside another assembly of the same particles ------------------------------------------------------------------
  /// The same two without the mass, added to what is there.
  void add_tangent_product(Scalar damping, Scalar stiffness, Scalar const* d, Scalar* out) const noexcept {
    if (damping == 0 && stiffness == 0) return;
    ConstPadded const direction(d, 4, static_cast<Eigen::Index>(particles_.size()));
    Padded product(out, 4, direction.cols());
    for_each_kind(*this, [&]<class E>(Kind<E> const& kind) {
      if constexpr (has_packed_tangent<E>)
        for (int b = 0; b < blocks(); ++b) kind.packs[at(b)].add_product(stiffness, d, out, own(b));
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
    Padded diagonal(out, 4, static_cast<Eigen::Index>(particles_.size()));
    for_each_kind(*this, [&]<class E>(Kind<E> const& kind) {
      if constexpr (has_packed_tangent<E>)
        for (int b = 0; b < blocks(); ++b) kind.packs[at(b)].add_diagonal(stiffness, out, own(b));
      for (std::size_t e = 0; e < kind.tangents.size(); ++e)
        for (int k = 0; k < 3 * E::nodes; ++k)
          diagonal(k % 3, kind.nodes[e][at(k / 3)]) += stiffness * kind.tangents[e].stiffness(k, k) + damping * kind.tangents[e].damping(k, k);
    });
  }
  /// a_i += inverse mass · force of the elements at (x, v), for elements of one node: x, v and a with a fourth row of zeros.
  void add_acceleration(int i, Scalar const* x, Scalar const* v, Scalar* a) const noexcept
    requires((Elements::nodes == 1) && ...)
  {
    using Column = Eigen::Map<Vector3<Scalar> const>;
    for_each_kind(*this, [&](auto const& kind) {
      for (int e = i > 0 ? kind.ends[at(i - 1)] : 0; e < kind.ends[at(i)]; ++e)
        Eigen::Map<Vector3<Scalar>>(a) += inverse_mass_[at(i)] * detail::element_force(kind.elements[at(e)], Vector3<Scalar>(Column(x + 4 * i)), Vector3<Scalar>(Column(v + 4 * i)));
    });
  }

  /// Gathers the elements of `tissue` that act on the particles in `moving`; asks it for size(), mass(i) and for_each_element_at(i, visit), see ElementSums.
  template <class Tissue>
  void build(Tissue const& tissue, std::span<int const> moving) {
    for (int const p : particles_)
      if (at(p) < local_.size()) local_[at(p)] = -1;
    local_.resize(at(tissue.size()), -1);
    particles_.assign(moving.begin(), moving.end());
    inverse_mass_.clear();
    for_each_kind(*this, [](auto& kind) { kind.nodes.clear(), kind.elements.clear(), kind.ends.clear(); });
    for (std::size_t i = 0; i < moving.size(); ++i) local_[at(moving[i])] = static_cast<int>(i);
    for (int i = 0; i < static_cast<int>(moving.size()); ++i) {
      inverse_mass_.push_back(1 / tissue.mass(moving[at(i)]));
      tissue.for_each_element_at(moving[at(i)], [&]<class E>(auto nodes, E const& element) {
        bool is_first = true;
        for (int& node : nodes) {
          int& local = local_[at(node)];
          if (local < 0) local = static_cast<int>(particles_.size()), particles_.push_back(node);
          node = local;
          is_first = is_first && local >= i;
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
      fill_packs(kind);
    });
  }
  /// Memory for sets of up to so many particles and elements of each kind.
  void reserve(int particles, std::array<std::size_t, sizeof...(Elements)> const& elements) {
    particles_.reserve(at(particles)), local_.reserve(at(particles)), inverse_mass_.reserve(at(particles));
    auto count = elements.begin();
    for_each_kind(*this, [&]<class E>(Kind<E>& kind) {
      kind.nodes.reserve(*count), kind.elements.reserve(*count), kind.ends.reserve(at(particles));
      for (auto& some : kind.of_block)
        if (particles >= 2 * min_block_size) some.reserve(*count);
      if constexpr (HasElementPacks<E, Scalar>)
        for (auto& packs : kind.packs)
          if (&packs == kind.packs.data() || particles >= 2 * min_block_size) packs.reserve(at(particles), *count);
      ++count;
    });
  }

 private:
  static constexpr int min_block_size = 2048, max_blocks = 8;

  using Padded = Eigen::Map<Matrix<Scalar, 4, Dynamic>>;
  using ConstPadded = Eigen::Map<Matrix<Scalar, 4, Dynamic> const>;

  template <int Nodes>
  struct Tangent {
    NodeMatrix<Scalar, Nodes> stiffness;
    NodeMatrix<Scalar, Nodes> damping = NodeMatrix<Scalar, Nodes>::Zero();
    explicit Tangent(NodeMatrix<Scalar, Nodes> const& k) noexcept : stiffness(k) {}
  };
  template <class E>
  struct Packed {
    static constexpr bool has_tangent = false;
  };
  template <class E>
    requires HasElementPacks<E, Scalar>
  struct Packed<E> {
    static constexpr bool has_tangent = E::Packs::has_tangent;
    std::array<typename E::Packs, max_blocks> packs;   // the elements that act on particles of each block
  };
  template <class E>
  struct Kind : Packed<E> {
    std::vector<std::array<int, std::size_t{E::nodes}>> nodes;   // local
    std::vector<E> elements;
    std::vector<int> ends;                                       // of those whose first chosen particle is each of the moving ones
    std::vector<Tangent<E::nodes>> tangents;                     // since linearise()
    std::array<std::vector<int>, max_blocks> of_block;          // elements that act on particles of each block, where there are several
  };

  template <class E>
  static constexpr bool has_packed_tangent = Packed<E>::has_tangent;
  template <class X>
  static constexpr bool is_padded = int{std::remove_cvref_t<X>::OuterStrideAtCompileTime} == 4;

  static std::size_t at(int i) noexcept { return static_cast<std::size_t>(i); }
  /// Whether a particle is of a block; the border is of any where there is one block.
  struct Own {
    int first, count;
    bool operator()(int i) const noexcept { return static_cast<unsigned>(i - first) < static_cast<unsigned>(count); }
  };
  Own own(int block) const noexcept {
    if (blocks() == 1) return {0, static_cast<int>(particles_.size())};
    return {first_of(block), first_of(block + 1) - first_of(block)};
  }
  template <class E>
  void fill_packs(Kind<E>& kind) const {
    if constexpr (HasElementPacks<E, Scalar>) {
      int const particles = static_cast<int>(particles_.size());
      auto const fill = [&](int b, std::size_t count, auto const& which) {
        kind.packs[at(b)].fill(particles, kind.nodes, kind.elements, static_cast<int>(count), which);
      };
      if (blocks() == 1)
        fill(0, kind.nodes.size(), [](int k) { return k; });
      else
        for (int b = 0; b < blocks(); ++b) fill(b, kind.of_block[at(b)].size(), [&some = kind.of_block[at(b)]](int k) { return some[at(k)]; });
    }
  }
  int first_of(int block) const noexcept { return static_cast<int>(static_cast<long long>(moving()) * block / blocks()); }

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
      if constexpr (HasElementPacks<E, Scalar> && is_padded<X> && is_padded<F>) {
        for (int b = std::max(block, 0); b < (block < 0 ? blocks() : block + 1); ++b) kind.packs[at(b)].add_forces(x.data(), f.data(), own(b));
        return;
      }
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

  std::vector<int> particles_;
  std::vector<int> local_;   // particle of the body → local particle, −1 outside
  std::vector<Scalar> inverse_mass_;   // 1/kg, of the moving ones
  std::tuple<Kind<Elements>...> kinds_;
};

}  // namespace palpate
