// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/core/random.hpp>
#include <palpate/statics/concept.hpp>
#include <palpate/statics/detail/net_forces.hpp>
#include <palpate/tissue/concept.hpp>

#include <Eigen/Core>

#include <algorithm>
#include <concepts>
#include <cstddef>
#include <limits>
#include <list>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

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

/// What an indentation needs to be computed, besides coefficients.
template <RealScalar Scalar>
struct IndentationScene {
  std::vector<int> particles;   ///< free ones, the touched one last
  Vector3<Scalar> direction;    ///< of the indenter, into the tissue
  IndentationAccuracy<Scalar> accuracy;
};

/// The force on an indenter at some depths as a function of the logarithms of the coefficients, with its derivatives.
///   F(d) = −u·f_c,   dF/dp = −Σ_i v_i·∂f_i/∂p + (K v)_c·∂X_c/∂p,   v = dx/dd: v_c = u, (K v)_i = 0 on the free particles
/// u the direction, f_i what the springs do to particle i, c the touched one, X_c where it rests undisturbed (it depends on the coefficients
/// under pre-tension only). One linear system a depth gives all derivatives: the adjoint of the balance. The force is taken as −Σ v_i·f_i, which
/// errs with the square of what is left out of balance.
template <class Build, class Solver>
class IndentationProblem {
 public:
  using Tissue = std::remove_cvref_t<std::invoke_result_t<Build const&, std::span<double const>>>;
  using Scalar = typename Tissue::Scalar;
  using Columns = Matrix3X<Scalar>;
  using Indented = IndentedTissue<Tissue>;

  /// What is kept from one set of coefficients to the next: where the search for balance begins.
  struct Rest {
    Columns x, v;
    bool is_known = false;
  };
  struct Memory {
    std::vector<Rest> rests;   ///< one for each depth
    Rest undisturbed;
    Eigen::MatrixXd response;   ///< 3 × coefficients, ∂X_c/∂p in its columns
    int static_solutions = 0;
    bool ask_stability = false;   ///< of every rest in the next computation
    bool stable = true;
  };

  IndentationProblem(Build const& build, Solver const& solver, IndentationScene<Scalar> const& scene, std::vector<double> depths, Memory& memory)
      : build_(build), solver_(solver), scene_(scene), depths_(std::move(depths)), memory_(memory) {
    memory_.rests.resize(depths_.size());
  }

  /// Forces at the depths [N], how they grow with the depth [N/m] and with the logarithms [N]. Throws Error where the coefficients are none or
  /// no rest is found.
  void forces(Eigen::VectorXd const& logarithms, Eigen::VectorXd& force, Eigen::VectorXd& stiffness, Eigen::MatrixXd& slope) const {
    auto const count = logarithms.size();
    auto const h = static_cast<double>(scene_.accuracy.logarithm);
    Indented tissue(build_with(logarithms), scene_.particles, scene_.accuracy);
    std::list<Indented> beside;   // above and below for each coefficient in turn
    for (Eigen::Index k = 0; k < count; ++k)
      for (double const side : {h, -h}) {
        Eigen::VectorXd shifted = logarithms;
        shifted[k] += side;
        beside.emplace_back(build_with(shifted), std::span<int const>(scene_.particles), scene_.accuracy);
      }
    auto const change = [&](Columns const& x, auto const& use) {   // ∂f/∂p at x
      auto side = beside.begin();
      for (Eigen::Index k = 0; k < count; ++k) {
        Columns difference = (side++)->forces(x);
        difference -= (side++)->forces(x);
        use(k, Columns(difference / static_cast<Scalar>(2 * h)));
      }
    };

    memory_.stable = true;
    settle(tissue, change, count);
    Columns const& home = memory_.undisturbed.x;
    int const touched = scene_.particles.back();
    force.resize(static_cast<Eigen::Index>(depths_.size())), stiffness.resize(force.size());
    slope.resize(force.size(), count);
    Rest const* before = nullptr;
    double depth_before = 0.0;
    for (std::size_t n = 0; n < depths_.size(); ++n) {
      Rest& rest = memory_.rests[n];
      Vector3<Scalar> const place = home.col(touched) + static_cast<Scalar>(depths_[n]) * scene_.direction;
      Columns path = before != nullptr ? before->x : home;
      if (before != nullptr) move(path, before->v, static_cast<Scalar>(depths_[n] - depth_before));
      path.col(touched) = place;
      press(tissue, rest, path, place, depths_[n]);

      Columns v = rest.v.cols() > 0 ? rest.v : Columns(Columns::Zero(3, columns()));
      v.col(columns() - 1) = scene_.direction;
      tissue.solve_tangent(rest.x, Columns::Zero(3, columns()), false, v);
      if (memory_.ask_stability && !tissue.is_stable(rest.x)) memory_.stable = false;
      rest.v = v;
      auto const row = static_cast<Eigen::Index>(n);
      force[row] = -static_cast<double>(v.cwiseProduct(tissue.forces(rest.x)).sum());
      Vector3<double> const pull = tissue.tangent_product(rest.x, v).col(columns() - 1).template cast<double>();
      stiffness[row] = pull.dot(scene_.direction.template cast<double>());
      change(rest.x, [&](Eigen::Index k, Columns const& df) {
        slope(row, k) = -static_cast<double>(v.cwiseProduct(df).sum()) + pull.dot(memory_.response.col(k));
      });
      before = &rest;
      depth_before = depths_[n];
    }
  }

 private:
  Eigen::Index columns() const noexcept { return static_cast<Eigen::Index>(scene_.particles.size()); }

  Tissue build_with(Eigen::VectorXd const& logarithms) const {
    Eigen::VectorXd const values = logarithms.array().exp();
    return build_(std::span<double const>(values.data(), static_cast<std::size_t>(values.size())));
  }

  void move(Columns& x, Columns const& v, Scalar by) const {
    for (Eigen::Index k = 0; k < v.cols(); ++k) x.col(scene_.particles[static_cast<std::size_t>(k)]) += by * v.col(k);
  }

  /// Where the body rests undisturbed, and how the touched particle's place there changes: it does under pre-tension.
  template <class Change>
  void settle(Indented& tissue, Change const& change, Eigen::Index count) const {
    Rest& home = memory_.undisturbed;
    if (!home.is_known) {
      Tissue const& matter = tissue.tissue();
      home.x.resize(3, matter.size());
      for (int i = 0; i < matter.size(); ++i) home.x.col(i) = matter.rest_position(i);
    }
    memory_.response = Eigen::MatrixXd::Zero(3, count);
    if (!home.is_known && tissue.imbalance(home.x, true) <= scene_.accuracy.balance) return;   // nothing pulls at rest, with any coefficients
    Columns x = home.x;
    ++memory_.static_solutions;
    auto const found = tissue.rest(solver_, x, true);
    if (!found.converged)
      throw Error(message("fit_stiffness: the body under its pre-tension does not settle; the largest imbalance is ", found.imbalance,
                          " m after ", found.iterations, " iterations; nail it, raise the home stiffness, or give the solver more iterations"));
    Columns rest_of_way = Columns::Zero(3, columns());   // depth counts from here: what the solver leaves out of balance would count too
    if (tissue.solve_tangent(x, tissue.forces(x), true, rest_of_way)) move(x, rest_of_way, Scalar(1));
    home.x = x, home.is_known = true;
    change(x, [&](Eigen::Index k, Columns const& df) {
      Columns shift = Columns::Zero(3, columns());
      tissue.solve_tangent(x, df, true, shift);
      memory_.response.col(k) = shift.col(columns() - 1).template cast<double>();
    });
  }

  /// Finds where the body rests with the touched particle at its place, from where it rested with the coefficients before, or from `path`.
  void press(Indented& tissue, Rest& rest, Columns& path, Vector3<Scalar> const& place, double depth) const {
    int const touched = scene_.particles.back();
    bool take_path = !rest.is_known;
    Columns x = path;
    if (!take_path) {
      x = rest.x;
      x.col(touched) = place;
      take_path = !(tissue.imbalance(x, false) <= tissue.imbalance(path, false));
      if (take_path) x = path;
    }
    if (!(tissue.imbalance(x, false) <= scene_.accuracy.balance)) {
      ++memory_.static_solutions;
      auto found = tissue.rest(solver_, x, false);
      if (!found.converged && !take_path) {
        ++memory_.static_solutions;
        x = path;
        found = tissue.rest(solver_, x, false);
      }
      if (!found.converged)
        throw Error(message("fit_stiffness: pressed ", depth, " m deep the body comes to no rest; the largest imbalance is ", found.imbalance,
                            " m after ", found.iterations,
                            " iterations; nail the body, raise the stiffness you begin with, or give the solver more iterations"));
    }
    rest.x = x;
    rest.is_known = true;
  }

  Build const& build_;
  Solver const& solver_;
  IndentationScene<Scalar> const& scene_;
  std::vector<double> depths_;
  Memory& memory_;
};

}  // namespace palpate::detail
