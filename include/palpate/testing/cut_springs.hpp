// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/matrix.hpp>
#include <palpate/tissue/concept.hpp>
#include <palpate/tissue/spring_law.hpp>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace palpate::testing {

/// What the springs of tissue are in all: no cut changes it. Of tissue without springs all is zero.
struct SpringSums {
  double stiffness = 0, damping = 0;   ///< of home springs, N/m, N·s/m
  double stretch = 0;                  ///< Σ weight · k L² [N m], twice the energy of a uniform stretch over its square; or Σ weight · k [N/m]

  template <class Tissue>
  static SpringSums of(Tissue const& tissue, bool with_lengths = true) {
    SpringSums sums;
    if constexpr (HasHomeSprings<Tissue>)
      for (int i = 0; i < tissue.size(); ++i)
        sums.stiffness += static_cast<double>(tissue.home(i).stiffness), sums.damping += static_cast<double>(tissue.home(i).damping);
    if constexpr (HasLinks<Tissue>)
      for (int l = 0; l < tissue.links().size(); ++l) {
        auto const& link = tissue.links()[l];
        double const length = with_lengths ? static_cast<double>((tissue.rest_position(link.a) - tissue.rest_position(link.b)).norm()) : 1.0;
        sums.stretch += static_cast<double>(link.weight * tangent_stiffness_of(link.law, typename Tissue::Scalar(0), link.rest_length)) * length * length;
      }
    return sums;
  }
};

/// Links join exactly the ends of these edges, each listed at both; their weights are positive, and rest lengths those of the undeformed shape, to a
/// tolerance [m]. report(parts...) is called for each that does not.
template <class Tissue, class Report>
void check_links(Tissue const& tissue, std::vector<std::pair<int, int>> edges, double tolerance, Report const& report) {
  if constexpr (HasLinks<Tissue>) {
    std::vector<std::pair<int, int>> links;
    auto const& all = tissue.links();
    for (int l = 0; l < all.size(); ++l) {
      auto const& link = all[l];
      links.push_back(std::minmax(int{link.a}, int{link.b}));
      if (!(link.weight > 0)) report("the link between ", link.a, " and ", link.b, " has the weight ", link.weight);
      auto const rest = (1 - tissue.link_prestrain()) * (tissue.rest_position(link.a) - tissue.rest_position(link.b)).norm();
      if (!(static_cast<double>(std::abs(link.rest_length - rest)) <= tolerance))
        report("the link between ", link.a, " and ", link.b, " has the rest length ", link.rest_length, " m instead of ", rest);
      auto const at = all.at(link.a), to = all.at(link.b);
      if (std::find(at.begin(), at.end(), l) == at.end() || std::find(to.begin(), to.end(), l) == to.end())
        report("the link between ", link.a, " and ", link.b, " is not listed at both");
    }
    std::sort(edges.begin(), edges.end());
    edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
    std::sort(links.begin(), links.end());
    if (std::adjacent_find(links.begin(), links.end()) != links.end()) report("two links join the same particles");
    for (auto const& e : edges)
      if (!std::binary_search(links.begin(), links.end(), e)) report("the edge between ", e.first, " and ", e.second, " has no link");
    for (auto const& l : links)
      if (!std::binary_search(edges.begin(), edges.end(), l)) report("the link between ", l.first, " and ", l.second, " lies on no edge");
  }
}

}  // namespace palpate::testing
