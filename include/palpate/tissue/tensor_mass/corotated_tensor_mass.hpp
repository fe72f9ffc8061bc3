// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/growing_lists.hpp>
#include <palpate/core/simd.hpp>
#include <palpate/core/tensor3.hpp>
#include <palpate/material/corotational.hpp>
#include <palpate/mesh/tetrahedral_mesh.hpp>
#include <palpate/tissue/finite_elements.hpp>
#include <palpate/tissue/tensor_mass/tensor_mass.hpp>
#include <palpate/tissue/tensor_mass/tensor_rows.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <span>
#include <utility>
#include <vector>

namespace palpate {

/// The turned tensors that act on a chosen set of particles: forces and energy are those of SolidAssembly, the tangent is in rows.
/// Cost       linearise() O(tetrahedra), a product O(tensors); follow() that of what was edited, and of all where the border is not empty.
template <RealScalar Scalar>
class TurnedTensorAssembly : public FiniteElements<Scalar, Corotational<Scalar>>::Assembly {
  using Base = typename FiniteElements<Scalar, Corotational<Scalar>>::Assembly;
  using Column = simd::Pack<Scalar, 4>;

 public:
  static constexpr bool fast_tangent = false;   // what the stable step is found with has the change of rotations as well
  using Base::moving, Base::particles;

  /// Turns the tensors of every tetrahedron at x and adds them up, for the two below.
  template <class X>
  void linearise(X const& x, Scalar const* /*inverse_mass*/) {
    for (std::size_t e = 0; e < elements_.size(); ++e) turn(x.data(), elements_[e], turned_.data() + 16 * e);
    for (int i = 0; i < moving(); ++i) add_up(i);
    rows_.round(true);
  }
  void multiply_tangent(Scalar mass, Scalar damping, Scalar stiffness, Scalar const* d, Scalar* out) const noexcept {
    this->multiply_mass(mass + damping * damping_.alpha, d, out);
    Scalar const factor = stiffness + damping * damping_.beta;
    auto const column_of = [d](int j) {
      Column one;
      simd::load(one, d + 4 * static_cast<std::ptrdiff_t>(j));
      return one;
    };
    for (int i = 0; factor != 0 && i < moving(); ++i) {
      Column const product = factor * rows_.product(i, moving(), column_of);
      for (int c = 0; c < 3; ++c) out[4 * i + c] += product[c];
    }
  }
  void multiply_tangent(Scalar mass, Scalar damping, Scalar stiffness, float const* d, float* out) const noexcept
    requires detail::has_float_rows<Scalar>
  {
    this->multiply_mass(mass + damping * damping_.alpha, d, out);
    rows_.add_product(static_cast<float>(stiffness + damping * damping_.beta), d, out);
  }
  void tangent_diagonal(Scalar mass, Scalar damping, Scalar stiffness, Scalar* out) const noexcept {
    this->mass_diagonal(mass + damping * damping_.alpha, out);
    for (int i = 0; i < moving(); ++i)
      for (int c = 0; c < 3; ++c) out[4 * i + c] += (stiffness + damping * damping_.beta) * rows_.values(i)[4 * c];
  }

  template <class Tissue>
  void build(Tissue const& tissue, std::span<int const> chosen) {
    Base::build(tissue, chosen);
    gather(tissue);
  }
  template <class Tissue>
  void follow(Tissue const& tissue, std::span<int const> chosen) {
    int const known = static_cast<int>(elements_.size()), count = tissue.tetrahedra();
    bool const can_follow =
        static_cast<int>(particles().size()) == moving() && tissue.edits().knows(seen_) && count >= known && this->can_grow_to(chosen);
    Base::follow(tissue, chosen);
    if (!can_follow || static_cast<int>(particles().size()) > moving()) return gather(tissue);
    changed_.clear();
    auto const note = [this](int e) { changed_.insert(changed_.end(), elements_[at(e)].nodes.begin(), elements_[at(e)].nodes.end()); };
    resize(at(count));
    for (int const e : tissue.edits().since(seen_)) {
      if (e < known) note(e);   // where it was
      if (e < count) take(tissue, e), note(e);
    }
    for (int e = known; e < count; ++e) take(tissue, e), note(e);
    for (int i = rows_.size(); i < moving(); ++i) changed_.push_back(i);
    std::sort(changed_.begin(), changed_.end());
    changed_.erase(std::unique(changed_.begin(), changed_.end()), changed_.end());
    for (int const i : changed_)
      if (i >= 0) take_row(tissue, i);
    damping_ = tissue.damping(), seen_ = tissue.edits().end();
  }
  void take(typename Base::Layout const& layout) {
    Base::take(layout);
    seen_ = std::numeric_limits<std::size_t>::max();
  }
  template <class Tissue>
  void reserve(Tissue const& tissue, int count, int triangles) {
    Base::reserve(tissue, count, triangles);
    std::size_t const more = at(std::max(0, count - tissue.size())), elements = at(tissue.tetrahedra()) + 6 * more;
    elements_.reserve(elements), turned_.reserve(16 * elements), changed_.reserve(100 * more);
    columns_.reserve(256), sums_.reserve(12 * 256), entries_.reserve(600);
    rows_.reserve(at(count), 20 * at(tissue.size()) + 60 * more);
  }

 private:
  /// A tetrahedron: its nodes among particles(), the gradients of all four, V λ and V μ. Without nodes: it acts on none of them.
  struct Element {
    std::array<int, 4> nodes{-1, -1, -1, -1};
    Tensor3<Scalar> gradients;
    Scalar lambda = 0, mu = 0;
  };
  static constexpr std::size_t entry = 6;   // of a row, for each tetrahedron at its node: its number, which node, and where the tensors go
  static std::size_t at(int i) noexcept { return static_cast<std::size_t>(i); }

  static void turn(Scalar const* x, Element const& element, Scalar* turned) noexcept {
    if (element.nodes[0] < 0) return;
    auto const column = [x, &element](std::size_t k) { return x + 4 * static_cast<std::ptrdiff_t>(element.nodes[k]); };
    Scalar const *const o = column(0), *const a = column(1), *const b = column(2), *const c = column(3);
    Tensor3<Scalar> const edges{a[0] - o[0], a[1] - o[1], a[2] - o[2], b[0] - o[0], b[1] - o[1], b[2] - o[2], c[0] - o[0], c[1] - o[1], c[2] - o[2]};
    Tensor3<Scalar> const g = element.gradients * transpose(RotationOf<Scalar>(transpose(edges) * element.gradients).R);
    Column const first{g.xx, g.xy, g.xz, Scalar(0)}, second{g.yx, g.yy, g.yz, Scalar(0)}, third{g.zx, g.zy, g.zz, Scalar(0)};
    simd::store(turned, Column(-(first + second + third)));
    simd::store(turned + 4, first), simd::store(turned + 8, second), simd::store(turned + 12, third);
  }
  /// V (λ g_a g_bᵀ + μ g_b g_aᵀ + μ (g_a · g_b) 1) of each tetrahedron at i.
  void add_up(int i) noexcept {
    constexpr Scalar o = 0, l = 1;
    std::array<Column, 3> const axes{Column{l, o, o, o}, Column{o, l, o, o}, Column{o, o, l, o}};
    std::size_t const count = rows_.columns(i).size();
    std::fill_n(sums_.data(), 12 * count, Scalar(0));
    auto const all = entries_of_[i];
    for (std::size_t k = 0; k < all.size(); k += entry) {
      Element const& element = elements_[at(all[k])];
      Scalar const* const turned = turned_.data() + 16 * at(all[k]);
      Column own, g;
      simd::load(own, turned + 4 * all[k + 1]);
      for (std::size_t b = 0; b < 4; ++b) {
        simd::load(g, turned + 4 * b);
        Column const lambda = element.lambda * g, mu = element.mu * own;
        Scalar const both = mu[0] * g[0] + mu[1] * g[1] + mu[2] * g[2];
        Scalar* tensor = sums_.data() + 12 * all[k + 2 + b];
        for (std::size_t c = 0; c < 3; ++c, tensor += 4) {
          Column sum;
          simd::load(sum, tensor);
          simd::store(tensor, Column(sum + own * lambda[c] + g * mu[c] + both * axes[c]));
        }
      }
    }
    Scalar* const row = rows_.values(i);
    for (std::size_t c = 0; c < 3 * count; ++c) std::copy_n(sums_.data() + 4 * c, 3, row + 3 * c);
  }

  void resize(std::size_t count) { elements_.resize(count), turned_.resize(16 * count); }
  template <class Tissue>
  void gather(Tissue const& tissue) {
    elements_.clear(), rows_.clear();
    resize(at(tissue.tetrahedra()));
    for (int i = 0; i < moving(); ++i)
      for (int const e : tissue.elements_at(particles()[at(i)])) take(tissue, e);
    for (int i = 0; i < moving(); ++i) take_row(tissue, i);
    damping_ = tissue.damping(), seen_ = tissue.edits().end();
  }
  template <class Tissue>
  void take(Tissue const& tissue, int e) {
    auto const& from = tissue.list().elements[at(e)];
    Element& to = elements_[at(e)];
    for (std::size_t k = 0; k < 4; ++k) to.nodes[k] = this->known(tissue.list().nodes[at(e)][k]);
    to.gradients = from.gradients(), to.lambda = from.volume() * from.law().lambda, to.mu = from.volume() * from.law().mu;
  }
  template <class Tissue>
  void take_row(Tissue const& tissue, int i) {
    auto const near = tissue.elements_at(particles()[at(i)]);
    columns_.clear(), entries_.clear();
    for (int const e : near)
      for (int const j : elements_[at(e)].nodes)
        if (j != i) columns_.push_back(j);
    std::sort(columns_.begin(), columns_.end());
    columns_.erase(std::unique(columns_.begin(), columns_.end()), columns_.end());
    columns_.insert(columns_.begin(), i);
    for (int const e : near) {
      auto const& nodes = elements_[at(e)].nodes;
      entries_.push_back(e), entries_.push_back(static_cast<int>(std::find(nodes.begin(), nodes.end(), i) - nodes.begin()));
      for (int const j : nodes)
        entries_.push_back(j == i ? 0 : static_cast<int>(std::lower_bound(columns_.begin() + 1, columns_.end(), j) - columns_.begin()));
    }
    sums_.resize(std::max(sums_.size(), 12 * columns_.size()));
    rows_.set(i, columns_, sums_.data());   // linearise() writes the tensors
    entries_of_.set(i, entries_);
  }

  std::vector<Element> elements_;   // by their numbers in the tissue
  std::vector<Scalar> turned_;      // four gradients each, with a zero behind each
  detail::TensorRows<Scalar> rows_;
  GrowingLists<int> entries_of_;
  RayleighDamping<Scalar> damping_;
  std::size_t seen_ = 0;   // of the tissue's edits
  std::vector<int> changed_, columns_, entries_;   // while rows are taken
  std::vector<Scalar> sums_;   // of a row, each column with a zero behind
};

/// TensorMass that may turn: the tensors of each tetrahedron are turned by its rotation R_e, that of F = R S, and added up at vertices and edges.
///   f_i = −Σ_e R_e Σ_j K_ij^e (R_eᵀ x_j − X_j),   K_ij = Σ_e R_e K_ij^e R_eᵀ
///
///   CorotatedTensorMass tissue(beam, {.density = 1060.0, .material = {.young = 2e5, .poisson = 0.4}});
///   SoftBody body(std::move(tissue), BackwardEuler{});
///
/// Tensors    K_ij, added up anew in each implicit step, is what it is solved with; positive semidefinite however the body is strained. The change of R_e is
///            left out: a second Newton iteration corrects that.
/// Balance    the forces of a tetrahedron have no sum and no moment, however its neighbours are turned: momentum and angular momentum are kept. One rotation
///            per vertex would spare adding up, but rows that are turned apart do not balance.
/// Energy     that of Corotational, whose gradient the forces are.
/// Damping, cuts, masses, errors: as FiniteElements.
/// Limits     small strain, large rotation. An explicit step costs that of FiniteElements. NodeSteps computes all nodes each time.
/// Source     \cite cotin2000; the turned tensors are the warped stiffness of \cite mueller2004.
template <RealScalar Scalar>
class CorotatedTensorMass : public FiniteElements<Scalar, Corotational<Scalar>> {
  using Base = FiniteElements<Scalar, Corotational<Scalar>>;

 public:
  using Options = TensorMassOptions<Scalar>;
  using Assembly = TurnedTensorAssembly<Scalar>;

  CorotatedTensorMass(TetrahedralMesh<Scalar> const& mesh, Options const& options)
      : Base(mesh, {.density = options.density,
                    .material = {.young = options.material.young, .poisson = options.material.poisson},
                    .damping = options.damping,
                    .prestrain = options.prestrain}) {}

  CorotatedTensorMass part(std::span<int const> particles) const { return CorotatedTensorMass(Base::part(particles)); }
  void assemble(std::span<int const> moving, Assembly& assembly) const { assembly.build(*this, moving); }
  void follow_edits(std::span<int const> moving, Assembly& assembly) const { assembly.follow(*this, moving); }

 private:
  explicit CorotatedTensorMass(Base&& solid) : Base(std::move(solid)) {}
};

template <RealScalar Scalar>
CorotatedTensorMass(TetrahedralMesh<Scalar> const&, TensorMassOptions<Scalar> const&) -> CorotatedTensorMass<Scalar>;

}  // namespace palpate
