// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/core/random.hpp>
#include <palpate/statics/concept.hpp>
#include <palpate/statics/detail/net_forces.hpp>

#include <algorithm>
#include <concepts>
#include <limits>
#include <span>
#include <utility>

namespace palpate::detail {

/// How finely the statics of an indentation are computed, by the digits of the scalar and the size of the body.
template <RealScalar Scalar>
struct IndentationAccuracy {
  static constexpr bool is_float = std::same_as<Scalar, float>;
  Scalar balance = 0;                                            ///< m, of the imbalance
  Scalar step = 0;                                               ///< m, of the differences that the tangent is taken by
  Scalar tangent = is_float ? Scalar(1e-3) : Scalar(1e-6);       ///< share of a load at which conjugate gradients stop
  Scalar logarithm = is_float ? Scalar(1e-2) : Scalar(1e-4);     ///< step of a coefficient's logarithm
  double force = is_float ? 1e-4 : 1e-8;                         ///< share of the largest force that is lost in rounding

  template <class Tissue>
  static IndentationAccuracy of(Tissue const& tissue) {
    Scalar sum = 0, offset = 0;
    int links = 0;
    for (int i = 0; i < tissue.size(); ++i) {
      Vector3<Scalar> const here = tissue.rest_position(i);
      offset = std::max(offset, here.cwiseAbs().maxCoeff());
      tissue.for_each_neighbour(i, [&](int j) {
        Vector3<Scalar> const there = tissue.rest_position(j);
        sum += (there - here).norm(), ++links;
      });
    }
    Scalar const edge = links > 0 ? sum / static_cast<Scalar>(links) : offset;
    IndentationAccuracy accuracy;
    accuracy.balance = std::max(Scalar(1e-7) * edge, 16 * std::numeric_limits<Scalar>::epsilon() * offset);
    accuracy.step = (is_float ? Scalar(5e-3) : Scalar(1e-5)) * edge;
    return accuracy;
  }
};

/// Tissue under a point indenter: the forces on its free particles and on the touched one, and how they answer to small displacements.
/// The tangent K is the exact one, by differences of the forces: what the tissue states may leave compressed links' softening out.
/// Shapes     columns: one for each free particle, the touched one last.
template <TissueModel Tissue>
class IndentedTissue {
 public:
  using Scalar = typename Tissue::Scalar;
  using Columns = Matrix3X<Scalar>;

  IndentedTissue(Tissue tissue, std::span<int const> particles, IndentationAccuracy<Scalar> const& accuracy)
      : tissue_(std::move(tissue)), accuracy_(accuracy), all_{.tissue = tissue_, .free = particles, .tolerance = accuracy.balance}, net_(all_) {}
  IndentedTissue(IndentedTissue const&) = delete;
  IndentedTissue& operator=(IndentedTissue const&) = delete;

  Tissue const& tissue() const noexcept { return tissue_; }

  /// What the springs do to the particles at x [N].
  Columns forces(Columns const& x) { return net_.at(x); }

  /// The largest imbalance at x [m], of the touched particle too where it is `free`.
  Scalar imbalance(Columns const& x, bool free) {
    Columns force = net_.at(x);
    if (!free) force.col(force.cols() - 1).setZero();
    Equilibrium<Scalar> found;
    net_.measure(force, found);
    return found.imbalance;
  }

  /// Moves the particles, the touched one only where it is `free`, to where they rest.
  template <class Solver>
  Equilibrium<Scalar> rest(Solver const& solver, Columns& x, bool free) const {
    StaticProblem<Tissue> const problem{.tissue = tissue_,
                                        .free = free ? all_.free : all_.free.first(all_.free.size() - 1),
                                        .tolerance = accuracy_.balance,
                                        .touched = all_.free.last(1)};
    return solver.solve(problem, x);
  }

  /// K p at x [N].
  Columns tangent_product(Columns const& x, Columns const& p) {
    Scalar const largest = p.cwiseAbs().maxCoeff();
    if (!(largest > 0)) return Columns::Zero(3, p.cols());
    Scalar const step = accuracy_.step / largest;
    shifted_ = x;
    for (int k = 0; k < net_.count(); ++k) shifted_.col(net_.particle(k)) -= step * p.col(k);
    Columns product = net_.at(shifted_);
    for (int k = 0; k < net_.count(); ++k) shifted_.col(net_.particle(k)) += 2 * step * p.col(k);
    product -= net_.at(shifted_);
    return product / (2 * step);
  }

  /// Solves K p = load at x by conjugate gradients from the p given; the touched particle keeps its column of p where it is not `free`.
  /// Returns false where K is not positive: what rests there is not stable, and p is not to be relied on.
  bool solve_tangent(Columns const& x, Columns const& load, bool free, Columns& p) {
    auto const still = [&](Columns& columns) {
      if (!free) columns.col(columns.cols() - 1).setZero();
    };
    auto const conditioned = [&](Columns const& r) {
      Columns z = r;
      for (int k = 0; k < net_.count(); ++k)
        if (net_.stiffness(k) > 0) z.col(k) /= net_.stiffness(k);
      return z;
    };
    Columns at_touched = Columns::Zero(3, p.cols()), r;
    if (!free) at_touched.col(p.cols() - 1) = p.col(p.cols() - 1);
    r = load - tangent_product(x, at_touched);
    still(r);
    Scalar const enough = accuracy_.tangent * accuracy_.tangent * r.cwiseProduct(conditioned(r)).sum();
    r = load - tangent_product(x, p);
    still(r);
    Columns z = conditioned(r), d = z;
    Scalar rz = r.cwiseProduct(z).sum();
    for (int count = 0; count < 10000 && rz > enough; ++count) {
      Columns kd = tangent_product(x, d);
      still(kd);
      Scalar const curvature = d.cwiseProduct(kd).sum();
      Scalar bound = 0;
      for (int k = 0; k < net_.count(); ++k) bound += net_.stiffness(k) * d.col(k).squaredNorm();
      if (!(curvature > 0)) return curvature > -accuracy_.tangent * bound;
      Scalar const step = rz / curvature;
      p += step * d;
      r -= step * kd;
      z = conditioned(r);
      Scalar const last = rz;
      rz = r.cwiseProduct(z).sum();
      d = z + rz / last * d;
    }
    return true;
  }

  /// Whether K is positive at x for the free particles, as far as conjugate gradients from a random load see: what is symmetric may balance on a
  /// saddle that no load of its symmetry tells.
  bool is_stable(Columns const& x) {
    Random random(Seed{1});
    Columns load(3, net_.count()), p = Columns::Zero(3, net_.count());
    for (Eigen::Index k = 0; k < load.cols(); ++k)
      for (int axis = 0; axis < 3; ++axis) load(axis, k) = net_.stiffness(static_cast<int>(k)) * random.uniform<Scalar>(-1, 1);
    return solve_tangent(x, load, false, p);
  }

 private:
  Tissue tissue_;
  IndentationAccuracy<Scalar> accuracy_;
  StaticProblem<Tissue> all_;
  NetForces<Tissue> net_;
  Columns shifted_;
};

}  // namespace palpate::detail
