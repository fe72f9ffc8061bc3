// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/core/random.hpp>
#include <palpate/core/steady_seconds.hpp>
#include <palpate/core/visit_order.hpp>
#include <palpate/statics/detail/net_forces.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <vector>

namespace palpate {

/// Nonlinear Gauss–Seidel with over-relaxation: moves one particle after the other towards its own balance, each seeing the last update.
///   x_i ← x_i + α F_i/k_i,   F_i the springs, nails and forces on particle i,   k_i = stiffness_bound(i)
/// It can be interrupted at any time. With `seconds` it runs for that long, asking its clock every 64 visits. Breadth-first order starts
/// at the disturbance: the problem's `touched`, else where forces are applied, else where the imbalance is largest. A sweep ends at the
/// first ring whose imbalance is below a hundredth of the sweep's largest; every eighth sweep goes through the whole body.
/// Converges for 0 < α < 2 where the row bounds hold: k_i is at least the largest eigenvalue of K_ii.
/// Units      α without unit, seconds [s]; sweeps: visits over free particles.
/// Source     \cite haaland. Errata: the source prints the static condition as Σg − f = 0; its algorithm's Σg + f is right. Its α is in
///            m/N; ours is divided by k_i and needs no tuning. Breadth-first order alone saves one to three of tens to thousands of
///            sweeps; ending sweeps early is what saves (docs/statics.md).
/// Cost       O(links) a sweep; sweeps grow with the square of the body's diameter in edges. Allocates.
/// Limits     with a time limit the result depends on the machine; without one it is the same everywhere.
struct LocalRelaxation {
  VisitOrder order = VisitOrder::breadth_first;
  double relaxation = 1.8;   ///< α
  double sweeps = 100000;    ///< at most; may be a fraction
  double seconds = std::numeric_limits<double>::infinity();   ///< at most, by `clock`
  double (*clock)() = steady_seconds;                         ///< s, since any moment; not asked where there is no limit
  Seed seed{1};

  template <TissueModel Tissue, RealScalar Scalar = typename Tissue::Scalar>
  Equilibrium<Scalar> solve(StaticProblem<Tissue> const& problem, Matrix3X<Scalar>& positions) const {
    struct Still {   // velocities of a body at rest, as a 3 × n expression
      static Vector3<Scalar> col(int) noexcept { return Vector3<Scalar>::Zero(); }
    };
    if (!(relaxation > 0 && relaxation < 2))
      throw InvalidArgument(detail::message("the relaxation factor is ", relaxation, "; it must be above 0 and below 2"));
    detail::OptionCheck const require{"LocalRelaxation"};
    require(sweeps >= 0, ".sweeps", sweeps, "give the most that may be made, zero or more");
    require(seconds >= 0, ".seconds", seconds, " s", "give zero or more, infinity for no limit");
    bool const limited = std::isfinite(seconds);
    if (limited && clock == nullptr) throw InvalidArgument("LocalRelaxation: .seconds is a limit, and .clock is null; give a clock, or none for the steady one");
    double const start = limited ? clock() : 0.0;
    Tissue const& tissue = problem.tissue;
    detail::NetForces<Tissue> net(problem);
    std::size_t const n = at(net.count());
    Matrix3X<Scalar> x = positions;
    Visits visits = visiting_order(problem, net, x);
    std::vector<Scalar> stiffness(n);
    for (std::size_t k = 0; k < n; ++k) stiffness[k] = net.stiffness(static_cast<int>(k));
    Random random(seed);
    Equilibrium<Scalar> result;
    double const max_visits = sweeps * static_cast<double>(n);
    double visited = 0;
    Scalar largest = 0, last_largest = 0;
    bool spent = false, through = true;   // the last sweep went through the body
    for (int sweep = 0;; ++sweep) {
      if (through && largest <= problem.tolerance) {   // all forces measured at one place
        net.measure(net.at(x), result);
        if (!std::isfinite(result.imbalance)) return result;
        if (result.converged) break;
      }
      if (spent || visited >= max_visits) break;
      bool const weigh = sweep % 8 == 0 || !(largest <= last_largest);   // hardening links have another bound by now
      bool const to_the_end = order != VisitOrder::breadth_first || sweep % 8 == 7 || largest <= problem.tolerance;
      last_largest = largest;
      largest = 0;
      through = true;
      if (order == VisitOrder::random) shuffle(std::span(visits.order).first(n), random);
      std::size_t ring = 0;
      Scalar largest_in_ring = 0;
      for (std::size_t visit = 0; visit < n; ++visit) {
        int const k = visits.order[visit], i = net.particle(k);
        if (ring < visits.ring_ends.size() && visit == visits.ring_ends[ring]) {
          through = to_the_end || largest_in_ring > largest / 100;
          if (!through) break;
          largest_in_ring = 0;
          ++ring;
        }
        if (weigh) stiffness[at(k)] = detail::stiffness_at(tissue, i, x);
        if (!(stiffness[at(k)] > 0)) continue;
        Vector3<Scalar> const force = tissue.internal_force(i, x, Still{}) + problem.load(i);
        largest_in_ring = detail::larger(largest_in_ring, force.norm() / net.stiffness(k));
        largest = detail::larger(largest, largest_in_ring);
        x.col(i) += static_cast<Scalar>(relaxation) / stiffness[at(k)] * force;
        visited += 1;
        if (limited && visit % 64 == 63) spent = clock() - start >= seconds;
        if (spent || visited >= max_visits) break;
      }
      if (limited) spent = spent || clock() - start >= seconds;
      if (!std::isfinite(largest)) spent = true;
    }
    if (!result.converged) net.measure(net.at(x), result);
    result.iterations = static_cast<int>(std::ceil(visited / static_cast<double>(std::max<std::size_t>(1, n))));
    if (std::isfinite(result.imbalance)) positions = x;
    return result;
  }

 private:
  struct Visits {
    std::vector<int> order;                // indices into the free particles
    std::vector<std::size_t> ring_ends;    // breadth first: where in the order each ring ends
  };

  template <TissueModel Tissue, class Columns>
  Visits visiting_order(StaticProblem<Tissue> const& problem, detail::NetForces<Tissue>& net, Columns const& x) const {
    int const n = net.count();
    Visits visits;
    visits.order.reserve(at(n));
    if (order == VisitOrder::breadth_first) {
      std::vector<int> place(at(problem.tissue.size()), fixed), queue;
      for (int k = 0; k < n; ++k) place[at(net.particle(k))] = k;
      auto const reach = [&](int i) {
        if (place[at(i)] == seen) return;
        if (place[at(i)] != fixed) visits.order.push_back(place[at(i)]);
        place[at(i)] = seen;
        queue.push_back(i);
      };
      auto const end_ring = [&] {   // a ring of nailed and held particles has no visits
        if (visits.order.size() > (visits.ring_ends.empty() ? 0 : visits.ring_ends.back())) visits.ring_ends.push_back(visits.order.size());
      };
      for (int const i : problem.touched) reach(i);
      if (queue.empty())
        for (int i = 0; i < static_cast<int>(problem.applied.cols()); ++i)
          if (!is_zero(problem.applied.col(i))) reach(i);
      if (queue.empty() && n > 0) reach(net.particle(max_unbalanced(net, x)));
      for (std::size_t head = 0, end = queue.size(); head < queue.size(); ++head) {
        if (head == end) {
          end_ring();
          end = queue.size();
        }
        problem.tissue.for_each_neighbour(queue[head], reach);
      }
      end_ring();
      for (int k = 0; k < n; ++k) reach(net.particle(k));   // pieces that nothing touches
    } else {
      for (int k = 0; k < n; ++k) visits.order.push_back(k);
    }
    return visits;
  }

  template <class Net, class Columns>
  static int max_unbalanced(Net& net, Columns const& x) {
    auto const force = net.at(x);
    int most = 0;
    for (int k = 1; k < net.count(); ++k)
      if (force.col(k).norm() * net.stiffness(most) > force.col(most).norm() * net.stiffness(k)) most = k;
    return most;
  }

  static std::size_t at(int k) noexcept { return static_cast<std::size_t>(k); }

  static constexpr int fixed = -1;
  static constexpr int seen = -2;
};

}  // namespace palpate
