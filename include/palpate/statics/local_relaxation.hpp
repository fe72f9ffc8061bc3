// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/random.hpp>
#include <palpate/statics/detail/net_forces.hpp>

#include <chrono>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

namespace palpate {

/// In which order a relaxation visits the free particles.
enum class VisitOrder {
  index,           ///< as they are numbered
  breadth_first,   ///< the touched ones, then their neighbours, then theirs: ring by ring
  random,          ///< shuffled anew for every sweep, from the seed
};

/// Moves one particle after the other towards its own balance, each seeing where the last one went (Gauss–Seidel):
///   x_i ← x_i + α F_i/k_i,   F_i the springs, nails and forces on particle i,   k_i = stiffness_bound(i)
/// It can stop at any time with something to show: give it `seconds` and it spends them. Breadth-first begins where the disturbance is:
/// in the problem's `touched`, or else where forces are applied, or else where the imbalance is largest. One sweep then carries a touch through
/// the body, where the order of indices carries it one ring against the numbering.
/// Converges for 0 < α < 2 where the row bounds hold: k_i is at least the largest eigenvalue of K_ii. Links count twice in k_i, so that
/// their optimum is above 1.
/// Units      α without unit, seconds [s].
/// Source     spec H2, H6. Erratum: the source prints the static condition as Σg − f = 0; its algorithm's Σg + f is right. α there is in m/N;
///            ours is divided by k_i, so that it needs no tuning.
/// Cost       O(links) a sweep; sweeps grow with the square of the body's diameter in edges. Allocates.
/// Limits     with a time limit the result depends on the machine; without one it is the same everywhere.
struct LocalRelaxation {
  VisitOrder order = VisitOrder::breadth_first;
  double relaxation = 1.8;   ///< α
  int sweeps = 100000;       ///< at most
  double seconds = std::numeric_limits<double>::infinity();   ///< at most
  Seed seed{1};

  template <TissueModel Tissue, RealScalar Scalar = typename Tissue::Scalar>
  Equilibrium<Scalar> solve(StaticProblem<Tissue> const& problem, Matrix3X<Scalar>& positions) const {
    struct Still {   // velocities of a body at rest, as a 3 × n expression
      static Vector3<Scalar> col(int) noexcept { return Vector3<Scalar>::Zero(); }
    };
    if (!(relaxation > 0 && relaxation < 2))
      throw InvalidArgument(detail::message("the relaxation factor is ", relaxation, "; it must be above 0 and below 2"));
    auto const start = std::chrono::steady_clock::now();
    Tissue const& tissue = problem.tissue;
    detail::NetForces<Tissue> net(problem);
    int const n = net.count();
    Matrix3X<Scalar> x = positions;
    std::vector<int> visits = visiting_order(problem, net, x);
    std::vector<Scalar> stiffness(visits.size());
    Random random(seed);
    Equilibrium<Scalar> result;
    Scalar last_largest = 0;
    bool out_of_time = false;
    for (;;) {
      net.measure(net.at(x), result);
      if (!std::isfinite(result.imbalance)) return result;
      if (result.converged || result.iterations >= sweeps || out_of_time) break;
      Scalar largest = 0;
      do {   // until a sweep finds balance: then all forces are measured at one place
        if (result.iterations % 16 == 0 || !(largest <= last_largest))
          for (int k = 0; k < n; ++k) stiffness[at(k)] = detail::stiffness_at(tissue, net.particle(k), x);
        last_largest = largest;
        largest = 0;
        if (order == VisitOrder::random)
          for (std::size_t k = visits.size(); k > 1; --k) std::swap(visits[k - 1], visits[static_cast<std::size_t>(random.below(k))]);
        for (std::size_t visit = 0; visit < visits.size() && !out_of_time; ++visit) {
          int const k = visits[visit], i = net.particle(k);
          Vector3<Scalar> const force = tissue.internal_force(i, x, Still{}) + problem.load(i);
          if (!(stiffness[at(k)] > 0)) continue;
          largest = detail::larger(largest, force.norm() / net.stiffness(k));
          x.col(i) += static_cast<Scalar>(relaxation) / stiffness[at(k)] * force;
          if (visit % 64 == 63 && std::isfinite(seconds)) out_of_time = elapsed(start) >= seconds;
        }
        ++result.iterations;
        if (std::isfinite(seconds)) out_of_time = out_of_time || elapsed(start) >= seconds;
      } while (largest > problem.tolerance && std::isfinite(largest) && result.iterations < sweeps && !out_of_time);
    }
    positions = x;
    return result;
  }

 private:
  /// Indices into the free particles, in the order of the first sweep.
  template <TissueModel Tissue, class Columns>
  std::vector<int> visiting_order(StaticProblem<Tissue> const& problem, detail::NetForces<Tissue>& net, Columns const& x) const {
    int const n = net.count();
    std::vector<int> visits;
    visits.reserve(at(n));
    if (order == VisitOrder::breadth_first) {
      std::vector<int> place(at(problem.tissue.size()), fixed), queue;
      for (int k = 0; k < n; ++k) place[at(net.particle(k))] = k;
      auto const reach = [&](int i) {
        if (place[at(i)] == seen) return;
        if (place[at(i)] != fixed) visits.push_back(place[at(i)]);
        place[at(i)] = seen;
        queue.push_back(i);
      };
      for (int const i : problem.touched) reach(i);
      if (queue.empty())
        for (int i = 0; i < static_cast<int>(problem.applied.cols()); ++i)
          if (!problem.applied.col(i).isZero(0)) reach(i);
      if (queue.empty() && n > 0) reach(net.particle(most_unbalanced(net, x)));
      for (std::size_t head = 0; head < queue.size(); ++head) problem.tissue.for_each_neighbour(queue[head], reach);
      for (int k = 0; k < n; ++k) reach(net.particle(k));   // pieces that nothing touches
    } else {
      for (int k = 0; k < n; ++k) visits.push_back(k);
    }
    return visits;
  }

  template <class Net, class Columns>
  static int most_unbalanced(Net& net, Columns const& x) {
    auto const force = net.at(x);
    int most = 0;
    for (int k = 1; k < net.count(); ++k)
      if (force.col(k).norm() * net.stiffness(most) > force.col(most).norm() * net.stiffness(k)) most = k;
    return most;
  }

  static double elapsed(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  }
  static std::size_t at(int k) noexcept { return static_cast<std::size_t>(k); }

  static constexpr int fixed = -1;
  static constexpr int seen = -2;
};

}  // namespace palpate
