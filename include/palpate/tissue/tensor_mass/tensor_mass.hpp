// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/material/linear_elastic.hpp>
#include <palpate/mesh/tetrahedral_mesh.hpp>
#include <palpate/tissue/edit_log.hpp>
#include <palpate/tissue/finite_elements.hpp>
#include <palpate/tissue/tensor_mass/tensor_assembly.hpp>
#include <palpate/tissue/tensor_mass/tensor_rows.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

namespace palpate {

/// What a tensor-mass body is made of.
template <RealScalar Scalar>
struct TensorMassOptions {
  Scalar density{};   ///< kg/m³
  LinearElastic<Scalar> material{};
  RayleighDamping<Scalar> damping{};
  /// ε: edges are (1 − ε) × as long at rest as in the mesh. 0 ≤ ε < 1.
  Scalar prestrain = 0;
};

/// An elastic solid of tensors at its vertices and edges: f_i = −K_ii u_i − Σ_j K_ij u_j with u the displacements and j the neighbours of i. It is linear
/// elasticity of linear tetrahedra, added up once: a step reads each pair of neighbours instead of each tetrahedron, and a cut adds up anew at the
/// vertices of the tetrahedra that it touches.
///
///   TensorMass tissue(make_block<double>(21, 5, 5, 0.0025), {.density = 1060.0, .material = {.young = 2e5, .poisson = 0.4}});
///   tissue.nail(0);
///   SoftBody body(std::move(tissue), BackwardEuler{});
///
/// Tensors    of a tetrahedron of volume V and gradients g: K_ab = V (λ g_a g_bᵀ + μ g_b g_aᵀ + μ (g_a · g_b) 1).
/// Damping, cuts, masses, errors: as FiniteElements, from which it is made.
/// Limits     linear: a turned body is strained, see LinearElasticLaw. No nodal pressure.
/// Cost       about seven tensors a vertex, nine numbers each, in each direction.
/// Source     \cite cotin2000.
template <RealScalar Scalar>
class TensorMass : public FiniteElements<Scalar, LinearElastic<Scalar>> {
  using Base = FiniteElements<Scalar, LinearElastic<Scalar>>;

 public:
  using Options = TensorMassOptions<Scalar>;
  using Assembly = TensorAssembly<Scalar>;
  using typename Base::Element;

  TensorMass(TetrahedralMesh<Scalar> const& mesh, Options const& options)
      : Base(mesh, {.density = options.density, .material = options.material, .damping = options.damping, .prestrain = options.prestrain}) {
    follow_elements();
  }

  /// Row i: K_ii, then K_ij of its neighbours by number [N/m].
  detail::TensorRows<Scalar> const& rows() const noexcept { return rows_; }
  std::size_t tensors() const noexcept { return tensors_; }
  /// Which rows have changed, for its assembly.
  EditLog const& row_edits() const noexcept { return row_log_; }
  /// Where the tensors pull a particle to: its rest position, with pre-strain nearer to the origin.
  Vector3<Scalar> unstrained_position(int i) const noexcept { return (1 - this->link_prestrain()) * this->rest_position(i); }
  /// Of a tetrahedron of mean size, about [m].
  Scalar edge_length() const noexcept { return edge_length_; }

  void set_material(std::span<int const> some, LinearElastic<Scalar> const& material, Scalar density) {
    Base::set_material(some, material, density);
    follow_elements();
  }
  void set_material(std::span<int const> some, LinearElastic<Scalar> const& material) {
    Base::set_material(some, material);
    follow_elements();
  }
  void set_mass(int i, Scalar mass) {
    Base::set_mass(i, mass);
    row_log_.forget_all();
  }
  TensorMass part(std::span<int const> particles) const { return TensorMass(Base::part(particles)); }
  void finish_edits() {
    Base::finish_edits();
    follow_elements();
  }
  template <class Moved>
  void even_mass(int particle, Moved const& moved) {
    bool const followed = seen_ == this->edits().end();
    Base::even_mass(particle, [&](int from, int to, Scalar share) {
      row_log_.add(from), row_log_.add(to);
      moved(from, to, share);
    });
    if (followed) seen_ = this->edits().end();   // rows are what they were
  }
  void reserve(int particles, int triangles) {
    Base::reserve(particles, triangles);
    std::size_t const more = at(std::max(0, particles - this->size()));
    rows_.reserve(at(this->size()) + more, 2 * tensors_ + 60 * more);
    row_log_.reserve(2 * at(this->size()) + 22 * more), changed_.reserve(100 * more), columns_.reserve(256), values_.reserve(9 * 256);
  }

  void assemble(std::span<int const> moving, Assembly& assembly) const { assembly.build(*this, moving); }
  void follow_edits(std::span<int const> moving, Assembly& assembly) const { assembly.follow(*this, moving); }

  template <class X, class V>
  Vector3<Scalar> internal_force(int i, X const& x, V const& v) const noexcept {
    Scalar const beta = this->damping().beta;
    Vector3<Scalar> force = -(this->damping().alpha * this->mass(i)) * v.col(i);
    for_row(i, [&](int j, auto const& tensor) {
      Vector3<Scalar> moved = x.col(j) - unstrained_position(j);
      if (beta != 0) moved += beta * v.col(j);
      force -= tensor * moved;
    });
    return force;
  }
  template <class X>
  Scalar potential_energy(X const& x) const {
    Scalar twice = 0;
    for (int i = 0; i < this->size(); ++i) {
      Vector3<Scalar> sum = Vector3<Scalar>::Zero();
      for_row(i, [&](int j, auto const& tensor) { sum += tensor * Vector3<Scalar>(x.col(j) - unstrained_position(j)); });
      twice += sum.dot(Vector3<Scalar>(x.col(i) - unstrained_position(i)));
    }
    return twice / 2;
  }
  template <class X, class D, class Y>
  void add_stiffness_product(X const& /*x*/, D const& d, Y& y) const noexcept {
    add_product(Scalar(1), d, y);
  }
  template <class X, class D, class Y>
  void add_damping_product(X const& /*x*/, D const& v, Y& y) const noexcept {
    if (this->damping().alpha != 0)
      for (int i = 0; i < this->size(); ++i) y.col(i) += this->damping().alpha * this->mass(i) * v.col(i);
    if (this->damping().beta != 0) add_product(this->damping().beta, v, y);
  }
  template <class X, class Visit>
  void for_each_stiffness_block(X const& /*x*/, Visit visit) const {
    for (int i = 0; i < this->size(); ++i) for_row(i, [&](int j, auto const& tensor) { visit(i, j, Matrix<Scalar, 3, 3>(tensor)); });
  }
  /// That at rest, wherever it is.
  using Base::stiffness_bound;
  template <class X>
  Scalar stiffness_bound(int i, X const& /*x*/) const noexcept {
    return Base::stiffness_bound(i);
  }

 private:
  static std::size_t at(int i) noexcept { return static_cast<std::size_t>(i); }

  explicit TensorMass(Base&& solid) : Base(std::move(solid)) { follow_elements(); }

  template <class Visit>
  void for_row(int i, Visit const& visit) const noexcept {
    auto const columns = rows_.columns(i);
    for (std::size_t k = 0; k < columns.size(); ++k) visit(columns[k], Eigen::Map<Matrix<Scalar, 3, 3> const>(rows_.values(i) + 9 * k));
  }
  template <class D, class Y>
  void add_product(Scalar factor, D const& d, Y& y) const noexcept {
    for (int i = 0; i < this->size(); ++i) {
      Vector3<Scalar> sum = Vector3<Scalar>::Zero();
      for_row(i, [&](int j, auto const& tensor) { sum += tensor * Vector3<Scalar>(d.col(j)); });
      y.col(i) += factor * sum;
    }
  }

  /// Adds up the rows of the vertices of what has changed, or of all.
  void follow_elements() {
    EditLog const& log = this->edits();
    if (!log.knows(seen_) || rows_.size() == 0) {
      changed_.resize(at(this->size()));
      std::iota(changed_.begin(), changed_.end(), 0);
      rows_.clear(), tensors_ = 0, row_log_.forget_all();
      Scalar volume = 0;
      for (Element const& element : this->list().elements) volume += element.volume();
      edge_length_ = std::cbrt(6 * volume / Scalar(this->tetrahedra()));
      for (int const i : changed_) add_up(i);
    } else {
      changed_.clear();
      auto const note = [this](int e) { changed_.insert(changed_.end(), this->list().nodes[at(e)].begin(), this->list().nodes[at(e)].end()); };
      for (int const e : log.since(seen_)) note(e);
      for (int e = known_; e < this->tetrahedra(); ++e) note(e);
      Base::keep_once(changed_);
      row_log_.trim(2 * at(this->size()));
      for (int const i : changed_) add_up(i), row_log_.add(i);
    }
    seen_ = log.end(), known_ = this->tetrahedra();
  }
  void add_up(int i) {
    columns_.clear();
    for (int const e : this->elements_at(i))
      for (int const j : this->list().nodes[at(e)])
        if (j != i) columns_.push_back(j);
    Base::keep_once(columns_);
    columns_.insert(columns_.begin(), i);
    values_.assign(9 * columns_.size(), Scalar(0));
    for (int const e : this->elements_at(i)) {
      Element const& element = this->list().elements[at(e)];
      auto const& nodes = this->list().nodes[at(e)];
      Tensor3<Scalar> const& g = element.gradients();
      std::array<Vector3<Scalar>, 4> gradient{Vector3<Scalar>{}, {g.xx, g.xy, g.xz}, {g.yx, g.yy, g.yz}, {g.zx, g.zy, g.zz}};
      gradient[0] = -(gradient[1] + gradient[2] + gradient[3]);
      Vector3<Scalar> const& own = gradient[static_cast<std::size_t>(std::find(nodes.begin(), nodes.end(), i) - nodes.begin())];
      Scalar const lambda = element.volume() * element.law().lambda, mu = element.volume() * element.law().mu;
      for (std::size_t b = 0; b < 4; ++b) {
        auto const place = nodes[b] == i ? columns_.begin() : std::lower_bound(columns_.begin() + 1, columns_.end(), nodes[b]);
        Eigen::Map<Matrix<Scalar, 3, 3>> tensor(values_.data() + 9 * (place - columns_.begin()));
        for (int c = 0; c < 3; ++c)
          for (int r = 0; r < 3; ++r) tensor(r, c) += lambda * own[r] * gradient[b][c] + mu * gradient[b][r] * own[c];
        tensor.diagonal().array() += mu * own.dot(gradient[b]);
      }
    }
    if (i < rows_.size()) tensors_ -= rows_.columns(i).size();
    rows_.set(i, columns_, values_.data());
    tensors_ += columns_.size();
  }

  detail::TensorRows<Scalar> rows_;
  std::size_t tensors_ = 0;
  Scalar edge_length_ = 0;
  EditLog row_log_;
  std::size_t seen_ = 0;   // of the edits of tetrahedra
  int known_ = 0;          // so many tetrahedra
  std::vector<int> changed_, columns_;   // while rows are added up
  std::vector<Scalar> values_;
};

template <RealScalar Scalar>
TensorMass(TetrahedralMesh<Scalar> const&, TensorMassOptions<Scalar> const&) -> TensorMass<Scalar>;

}  // namespace palpate
