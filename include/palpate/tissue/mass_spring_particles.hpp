// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/columns.hpp>
#include <palpate/core/huge_page_vector.hpp>
#include <palpate/core/reserve_and_prefault.hpp>
#include <palpate/mesh/surface_topology.hpp>
#include <palpate/mesh/tetrahedral_topology.hpp>
#include <palpate/tissue/cut_solid.hpp>
#include <palpate/tissue/link_set.hpp>
#include <palpate/tissue/mass_exchange.hpp>
#include <palpate/tissue/mass_spring_options.hpp>
#include <palpate/tissue/spring_elements.hpp>

#include <algorithm>
#include <array>
#include <cstddef>

namespace palpate {

/// The particles and links of mass-spring tissue, and what a cut of a surface and one of a solid have in common.
/// A new particle takes mass and home spring from its parents by barycentric weight, so Σm, Σm X and the home totals stay.
/// How much is what lumping anew would give it: μ = min_i(m_i A/A_i), A the size (area or volume) of the elements it divides, A_i that around
/// parent i. Copies share mass and home spring by the size around each.
/// An element's share of an edge's link is κ A/(L² k), κ the mean of k_e L_e²/A over its parent's edges: under a uniform isotropic
/// stretch the energy of the pieces is that of the parent, and a lip keeps only its own side.
/// Source     \cite zheng2006 ch. 3.
template <RealScalar Scalar, class Law>
class MassSpringParticles {
 public:
  using LinkType = Link<Scalar, Law>;

  int size() const noexcept { return rest_.size(); }
  auto rest_positions() const noexcept { return rest_.view(); }
  Vector3<Scalar> rest_position(int i) const noexcept { return rest_[i]; }
  Scalar mass(int i) const noexcept { return mass_[at(i)]; }
  HomeSpring<Scalar> home(int i) const noexcept { return home_[at(i)]; }
  bool nailed(int i) const noexcept { return nailed_[at(i)] != 0; }
  LinkSet<Scalar, Law> const& links() const noexcept { return links_; }
  /// The triangles of a surface-built body; else the border of solid().
  SurfaceTopology const& surface() const noexcept { return cuttable() ? surface_ : solid().border(); }
  /// The tetrahedra of a body built from a volume; else there are none.
  TetrahedralTopology const& solid() const noexcept { return solid_.topology(); }
  /// Whether it is a surface that can be cut: false for a body built from a volume, whose tetrahedra can.
  bool cuttable() const noexcept { return solid().tetrahedron_count() == 0; }

  /// Particles that cuts made of one, at one place undeformed, form a ring: the one after i, or i where there is no other.
  int next_copy(int i) const noexcept { return exchange_.next_copy(i); }

  /// Counts the edits that changed masses, springs or nails: what was derived from them before is void.
  std::size_t revision() const noexcept { return revision_; }

  /// The home springs and links as elements, see ElementSums: visit(nodes, element). A link's weight and law stay where they are.
  template <class Visit>
  void for_each_element(Visit visit) const {
    for (int i = 0; i < size(); ++i) visit(std::array{i}, anchor(i));
    for (int l = 0; l < links_.size(); ++l) visit(std::array{links_[l].a, links_[l].b}, spring(l));
  }
  /// Those at one particle, which is their first node.
  template <class Visit>
  void for_each_element_at(int i, Visit visit) const {
    visit(std::array{i}, anchor(i));
    auto const others = links_.neighbours(i);
    auto other = others.begin();
    for (int const l : links_.at(i)) visit(std::array{i, *other++}, spring(l));
  }

 protected:
  static std::size_t at(int i) noexcept { return static_cast<std::size_t>(i); }
  AnchorSpring<Scalar> anchor(int i) const noexcept { return {rest_[i], home_[at(i)]}; }
  LinkSpring<Scalar, Law const&> spring(int link) const noexcept { return {links_[link].rest_length, links_[link].weight, links_[link].law}; }
  Scalar undeformed_length(int a, int b) const noexcept { return (rest_[a] - rest_[b]).norm(); }

  int add_particle(Vector3<Scalar> const& rest, bool nailed) {
    rest_.push_back(rest);
    mass_.push_back(0);
    home_.push_back({});
    nailed_.push_back(nailed ? 1 : 0);
    links_.add_particle();
    exchange_.add_particle();
    return size() - 1;
  }
  void pop_particle() noexcept {
    rest_.pop_back(), mass_.pop_back(), home_.pop_back(), nailed_.pop_back();
    links_.pop_particle();
    exchange_.pop_particle();
  }
  void reserve_particles(int particles, int links) {
    auto const n = at(particles);
    rest_.reserve_and_prefault(particles), reserve_and_prefault(mass_, n), reserve_and_prefault(home_, n), reserve_and_prefault(nailed_, n), exchange_.reserve(particles);
    links_.reserve(particles, links);
  }

  /// What the new particle n weighs; around(i) is the size of the elements around particle i before they are divided.
  template <std::size_t Parents, class Around>
  void take_mass(int n, std::array<int, Parents> const& parents, std::array<Scalar, Parents> const& weights, Scalar divided, Around const& around) {
    Scalar taken = mass(parents[0]) * divided / around(parents[0]);
    for (std::size_t k = 1; k < Parents; ++k) taken = std::min(taken, mass(parents[k]) * divided / around(parents[k]));
    for (std::size_t k = 0; k < Parents; ++k) {
      int const p = parents[k];
      Scalar const part = weights[k] * taken / mass(p);
      home_[at(n)].stiffness += part * home(p).stiffness, home_[at(n)].damping += part * home(p).damping;
      home_[at(p)].stiffness -= part * home(p).stiffness, home_[at(p)].damping -= part * home(p).damping;
      mass_[at(p)] -= weights[k] * taken;
    }
    mass_[at(n)] = taken;
    exchange_.set_parents(parents, weights);
    ++revision_;
  }
  /// Shares the mass and the home spring of two copies of one particle anew, by the sizes around each.
  void share_between(int p, int copy, Scalar around, Scalar around_copy) {
    Scalar const part = std::clamp(around_copy / (around + around_copy), Scalar(1e-3), Scalar(1) - Scalar(1e-3));
    Scalar const m = mass(p) + mass(copy);
    HomeSpring<Scalar> const both{home(p).stiffness + home(copy).stiffness, home(p).damping + home(copy).damping};
    mass_[at(copy)] = part * m;
    home_[at(copy)] = {part * both.stiffness, part * both.damping};
    mass_[at(p)] = m - mass(copy);
    home_[at(p)] = {both.stiffness - home(copy).stiffness, both.damping - home(copy).damping};
    ++revision_;
  }

  /// share · k L² of a link [N m].
  Scalar stretch(int link, Scalar share) const {
    LinkType const& l = links_[link];
    Scalar const length = undeformed_length(l.a, l.b);
    return share * tangent_stiffness_of(l.law, Scalar(0), l.rest_length) * length * length;
  }
  /// κ A/(L² k), for a link that has this law.
  Scalar share_of(Scalar modulus, Scalar size, Scalar length, Law const& law) const {
    return modulus * size / (length * length * tangent_stiffness_of(law, Scalar(0), (1 - prestrain_) * length));
  }

  /// Makes a link between a and b, which was found or is −1, one of this weight: adds it (with `law`), weighs it, or takes it away.
  void weigh_link(int l, int a, int b, Scalar weight, Law const& law) {
    if (l >= 0 ? links_[l].weight == weight : !(weight > 0)) return;
    if (l >= 0 && weight > 0)
      links_[l].weight = weight;
    else if (l >= 0)
      links_.remove(l);
    else
      links_.add({a, b, (1 - prestrain_) * undeformed_length(a, b), weight, law});
    ++revision_;
  }

  Columns<Scalar, 3> rest_;
  HugePageVector<Scalar> mass_;
  HugePageVector<HomeSpring<Scalar>> home_;
  HugePageVector<char> nailed_;
  SurfaceTopology surface_;   // of a surface-built body
  CutSolid solid_;            // of a body built from a volume
  LinkSet<Scalar, Law> links_;
  MassExchange<Scalar> exchange_;
  Scalar prestrain_ = 0;
  std::size_t revision_ = 0;
};

}  // namespace palpate
