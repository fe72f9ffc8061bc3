// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/fitting/detail/indentation_problem.hpp>
#include <palpate/fitting/indentation.hpp>
#include <palpate/mesh/normals.hpp>
#include <palpate/mesh/triangle_mesh.hpp>
#include <palpate/tissue/concept.hpp>

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <limits>
#include <span>
#include <utility>
#include <vector>

namespace palpate::detail {

/// At which depths the body is computed, and where the measurements lie among them.
class IndentationDepths {
 public:
  /// All that were measured, or, where those are more than `most`, so many from the least to the largest, evenly.
  IndentationDepths(std::span<IndentationPoint const> measured, int most) {
    for (IndentationPoint const& point : measured) depths_.push_back(point.depth);
    std::sort(depths_.begin(), depths_.end());
    depths_.erase(std::unique(depths_.begin(), depths_.end()), depths_.end());
    if (depths_.size() > static_cast<std::size_t>(most)) {
      double const first = depths_.front(), last = depths_.back();
      depths_.resize(static_cast<std::size_t>(most));
      for (int k = 0; k < most; ++k) depths_[static_cast<std::size_t>(k)] = first + (last - first) * k / (most - 1);
      depths_.back() = last;
    }
    for (IndentationPoint const& point : measured) {
      auto const above = std::upper_bound(depths_.begin(), depths_.end(), point.depth) - depths_.begin();
      auto const k = std::clamp<std::ptrdiff_t>(above - 1, 0, std::max<std::ptrdiff_t>(0, std::ssize(depths_) - 2));
      double const width = depths_.size() > 1 ? depths_[static_cast<std::size_t>(k + 1)] - depths_[static_cast<std::size_t>(k)] : 1.0;
      places_.push_back({static_cast<Eigen::Index>(k), width, (point.depth - depths_[static_cast<std::size_t>(k)]) / width});
    }
  }

  std::vector<double> const& depths() const noexcept { return depths_; }

  /// Forces at the measurements by Hermite's cubic between those at the depths, exact there; their derivatives by straight lines.
  void interpolate(Eigen::VectorXd const& force, Eigen::VectorXd const& stiffness, Eigen::MatrixXd const& slope, Eigen::VectorXd& r,
                   Eigen::MatrixXd& j) const {
    r.resize(static_cast<Eigen::Index>(places_.size())), j.resize(r.size(), slope.cols());
    for (Eigen::Index i = 0; i < r.size(); ++i) {
      auto const& [k, width, t] = places_[static_cast<std::size_t>(i)];
      Eigen::Index const next = std::min(k + 1, force.size() - 1);
      double const u = 1.0 - t;
      r[i] = u * u * ((1.0 + 2.0 * t) * force[k] + t * width * stiffness[k]) + t * t * ((1.0 + 2.0 * u) * force[next] - u * width * stiffness[next]);
      j.row(i) = u * slope.row(k) + t * slope.row(next);
    }
  }

 private:
  struct Place {
    Eigen::Index first;
    double width, share;   // of the interval, m; where in it, 0 … 1
  };
  std::vector<double> depths_;
  std::vector<Place> places_;
};

/// The residuals of measured forces as a ResidualProblem: coefficients that are none, or with which nothing rests, are no better than others.
template <class Problem>
class IndentationResiduals {
 public:
  IndentationResiduals(Problem const& problem, IndentationDepths const& depths, Eigen::VectorXd force, Eigen::VectorXd weight, double lost)
      : problem_(problem), depths_(depths), force_(std::move(force)), weight_(std::move(weight)), lost_(lost) {}

  Eigen::Index residual_count() const noexcept { return force_.size(); }

  /// Unweighted [N], and not cleared of what is lost in rounding. Throws Error.
  void differences(Eigen::VectorXd const& p, Eigen::VectorXd& r, Eigen::MatrixXd& j) const {
    Eigen::VectorXd force, stiffness;
    Eigen::MatrixXd slope;
    problem_.forces(p, force, stiffness, slope);
    depths_.interpolate(force, stiffness, slope, r, j);
    r -= force_;
  }

  /// What all forces together are of the measured ones, where their differences are r; no number above 0 where they have nothing to do with them.
  double share_of_measured(Eigen::VectorXd const& r) const {
    Eigen::VectorXd const model = (r + force_).cwiseProduct(weight_), measured = force_.cwiseProduct(weight_);
    return model.squaredNorm() / model.dot(measured);
  }

  bool is_computable(Eigen::VectorXd const& p) const {
    Eigen::VectorXd r(residual_count());
    Eigen::MatrixXd j(residual_count(), p.size());
    evaluate(p, r, j);
    return is_finite(r) && is_finite(j);
  }

  void evaluate(Eigen::VectorXd const& p, Eigen::VectorXd& r, Eigen::MatrixXd& j) const {
    try {
      differences(p, r, j);
    } catch (Error const&) {
      r.setConstant(std::numeric_limits<double>::quiet_NaN());
      return;
    }
    if (r.cwiseAbs().maxCoeff() <= lost_) r.setZero();   // else the search would go on in the rounding
    r.array() *= weight_.array();
    j.array().colwise() *= weight_.array();
  }

 private:
  Problem const& problem_;
  IndentationDepths const& depths_;
  Eigen::VectorXd force_, weight_;   // N, measured; without unit
  double lost_;                      // N
};

inline void require_usable(std::span<IndentationPoint const> measured, std::span<StiffnessGuess const> guesses) {
  if (guesses.empty()) throw InvalidArgument("fit_stiffness: there is no coefficient to find; name one, for example link.stiffness");
  for (StiffnessGuess const& guess : guesses)
    if (!(guess.value > 0.0) || !std::isfinite(guess.value))
      throw InvalidArgument(message("fit_stiffness: ", guess.name, " begins at ", guess.value, " ", guess.unit, "; begin above 0, or do not fit it"));
  bool presses = false;
  std::vector<double> depths;
  for (std::size_t i = 0; i < measured.size(); ++i) {
    IndentationPoint const& point = measured[i];
    if (!(point.depth > 0.0) || !std::isfinite(point.depth))
      throw InvalidArgument(message("fit_stiffness: measurement ", i, " is at a depth of ", point.depth,
                                    " m; give finite depths above 0 and leave out what is before contact"));
    if (!(point.force >= 0.0) || !std::isfinite(point.force))
      throw InvalidArgument(message("fit_stiffness: measurement ", i, " is a force of ", point.force,
                                    " N; give finite forces against the movement, 0 or more"));
    if (!(point.deviation > 0.0) || !std::isfinite(point.deviation))
      throw InvalidArgument(message("fit_stiffness: measurement ", i, " has a standard deviation of ", point.deviation,
                                    "; give finite ones above 0, or 1 to all"));
    presses = presses || point.force > 0.0;
    depths.push_back(point.depth);
  }
  std::sort(depths.begin(), depths.end());
  auto const different = std::unique(depths.begin(), depths.end()) - depths.begin();
  if (measured.size() <= guesses.size() || different < static_cast<std::ptrdiff_t>(guesses.size()))
    throw InvalidArgument(message("fit_stiffness: there are ", measured.size(), " measurements at ", different, " depths for ", guesses.size(),
                                  " coefficients; give more measurements than coefficients, at as many depths or more"));
  if (!presses) throw InvalidArgument("fit_stiffness: all forces are 0 N; give some with contact");
}

/// The touched particle, the direction, and which particles are free.
template <TissueModel Tissue, RealScalar Scalar = typename Tissue::Scalar>
IndentationScene<Scalar> indentation_scene(Tissue const& tissue, IndentationTest<Scalar> const& test) {
  int touched = test.particle;
  if (touched < 0) {
    if (!test.point || !test.point->allFinite())
      throw InvalidArgument("fit_stiffness: where the tissue is touched is not given; give .particle, or a finite .point near the surface");
    Scalar least = std::numeric_limits<Scalar>::infinity();
    auto const triangles = tissue.surface().triangles();
    for (Eigen::Index t = 0; t < triangles.cols(); ++t)
      for (int k = 0; k < 3; ++k) {
        Vector3<Scalar> const place = tissue.rest_position(triangles(k, t));
        if (Scalar const distance = (place - *test.point).squaredNorm(); distance < least) least = distance, touched = triangles(k, t);
      }
  }
  check_index("particle", touched, tissue.size());

  IndentationScene<Scalar> scene{.particles = {}, .direction = test.direction, .accuracy = IndentationAccuracy<Scalar>::of(tissue)};
  if (!is_finite(scene.direction))
    throw InvalidArgument("fit_stiffness: .direction is not finite; give the one that the indenter moves in, or none for the inward normal");
  if (scene.direction.cwiseAbs().maxCoeff() == 0) {
    TriangleMesh<Scalar> shape{Matrix<Scalar, 3, Dynamic>(3, tissue.size()), tissue.surface().triangles()};
    for (int i = 0; i < tissue.size(); ++i) shape.points.col(i) = tissue.rest_position(i);
    scene.direction = -vertex_normals(shape).col(touched);
    if (!(scene.direction.norm() > 0))
      throw InvalidArgument(message("fit_stiffness: particle ", touched, " has no normal, it is not on a smooth surface; give .direction"));
  }
  scene.direction /= scene.direction.cwiseAbs().maxCoeff();   // first, or the square of a small one would vanish
  scene.direction.normalize();

  std::vector<char> fast(static_cast<std::size_t>(tissue.size()), 0);
  for (int i = 0; i < tissue.size(); ++i) fast[static_cast<std::size_t>(i)] = tissue.nailed(i) ? 1 : 0;
  for (int const i : test.nailed) {
    check_index("particle", i, tissue.size());
    fast[static_cast<std::size_t>(i)] = 1;
  }
  if (fast[static_cast<std::size_t>(touched)] != 0)
    throw InvalidArgument(message("fit_stiffness: particle ", touched, " is nailed, pressing it moves nothing; touch another one"));
  for (int i = 0; i < tissue.size(); ++i)
    if (fast[static_cast<std::size_t>(i)] == 0 && i != touched) scene.particles.push_back(i);
  scene.particles.push_back(touched);
  return scene;
}

}  // namespace palpate::detail
