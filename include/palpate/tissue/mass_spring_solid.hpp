// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/tissue/mass_spring_surface.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>

namespace palpate {

/// How mass-spring tissue that was built from tetrahedra follows a cut.
/// Invariant  a link lies on each edge of the tetrahedra; its weight is the sum of the shares of those round it, V/ΣV each as the body is built.
/// Errors     InvalidArgument for tissue built from a surface; else those of TetrahedralTopology. Nothing has changed then.
/// Cost       every edit is O(tetrahedra at the particles it touches).
template <RealScalar Scalar, class Law>
class MassSpringSolid : public MassSpringSurface<Scalar, Law> {
  using Surface = MassSpringSurface<Scalar, Law>;

 public:
  using Surface::cuttable, Surface::nailed, Surface::size, Surface::solid;

  /// solid(), of tissue that has one.
  TetrahedralTopology const& topology() const {
    if (cuttable()) throw InvalidArgument("this body is built from a surface and has no tetrahedra; ProgressiveCutter and SeparatingCutter cut it");
    return solid();
  }
  /// Whether a border triangle was inside before a cut.
  bool is_wound(int triangle) const noexcept { return !cuttable() && solid_.is_wound(triangle); }
  /// Whether face k of a tetrahedron is cut and not open: no vertex of it has split yet.
  bool is_cut(int tetrahedron, int k) const noexcept { return !cuttable() && solid_.is_cut(tetrahedron, k); }
  /// Marks an inner face so, seen from both sides.
  void mark_cut(int tetrahedron, int k) noexcept {
    if (!cuttable()) solid_.mark_cut(tetrahedron, k);
  }

  /// Divides the edge a–b at X_a + s (X_b − X_a), 0 < s < 1, and each tetrahedron round it in two. New links get the law of the one on the edge.
  TopologyEdit divide_edge(int a, int b, Scalar s) {
    if (!(s > 0 && s < 1)) throw InvalidArgument(detail::message("divide_edge: s is ", s, "; it must be between 0 and 1, ends excluded"));
    topology();
    TopologyEdit const edit = solid_.insert_on_edge(a, b);
    Scalar divided = 0;
    for (int t = edit.first_tetrahedron; t < edit.end_tetrahedron; ++t) {
      shares_.push_back(Shares(of(solid_.whole_of(t, b))));
      divided += of(t).volume;
    }
    int const n = this->add_particle((1 - s) * rest_[a] + s * rest_[b], nailed(a) && nailed(b));
    this->template take_mass<2>(n, {a, b}, {1 - s, s}, divided, [this](int i) { return volume_around(i); });
    int const half = links_.find(a, b);
    Law const law = links_[half].law;
    for (int t = edit.first_tetrahedron; t < edit.end_tetrahedron; ++t) {
      int const whole = solid_.whole_of(t, b);
      auto corners = solid().corners(whole);
      std::replace(corners.begin(), corners.end(), n, b);
      Scalar const modulus = modulus_of(of(whole), corners);
      share_part(t, modulus, law), share_part(whole, modulus, law);
    }
    links_.change_end(half, b, n);
    links_[half].rest_length = (1 - prestrain_) * undeformed_length(a, n);
    auto const weigh = [&](int i, int j) { weigh_link(links_.find(i, j), i, j, weight_between(i, j), law); };
    weigh(n, a), weigh(n, b);
    solid().for_each_neighbour(n, [&](int i) {
      if (i != a && i != b) weigh(n, i), weigh(a, i), weigh(b, i);
    });
    for (int t = edit.first_tetrahedron; t < edit.end_tetrahedron; ++t) {   // the edge that lies opposite
      auto const c = solid().corners(t);
      for (auto const& [i, j] : pairs)
        if (c[i] != n && c[i] != b && c[j] != n && c[j] != b) weigh(c[i], c[j]);
    }
    return edit;
  }

  /// Gives some of the tetrahedra at a particle a copy of it as their corner, with their share of its mass, home spring and links. Faces between those
  /// and the others open; they are wounds.
  TopologyEdit split_vertex(int p, std::span<int const> some) {
    topology();
    TopologyEdit const edit = solid_.split_vertex(p, some);
    int const n = this->add_particle(rest_[p], nailed(p));
    exchange_.set_copy_of(p);
    solid().for_each_neighbour(n, [&](int i) {
      int const l = links_.find(p, i);
      if (Scalar const left = weight_between(p, i); left > 0) {
        weigh_link(l, p, i, left, {});
        weigh_link(-1, n, i, weight_between(n, i), Law(links_[l].law));
      } else {
        links_.change_end(l, p, n);
      }
    });
    this->share_between(p, n, volume_around(p), volume_around(n));
    return edit;
  }

  template <class Visit>
  void for_each_joined(int i, Visit visit) const {
    for (int const other : links_.neighbours(i)) visit(other);
  }
  /// Nothing to do: all has followed.
  void finish_edits() const noexcept {}

  /// Room for this many particles and triangles of the surface, so that edits up to there do not allocate.
  void reserve(int particles, int triangles) {
    if (cuttable()) return Surface::reserve(particles, triangles);
    int const more = std::max(0, particles - size()), tetrahedra = solid().tetrahedron_count() + 6 * more;
    this->reserve_particles(particles, links_.size() + 8 * more);
    if (more == 0) return;
    shares_.reserve(at(tetrahedra)), solid_.reserve(particles, tetrahedra, triangles);
  }

 protected:
  /// What a tetrahedron brings to its links.
  struct Shares {
    std::array<Scalar, 6> share;   // of the link on edge k of `pairs`
    Scalar volume;                 // m³, undeformed
  };
  using Surface::at, Surface::exchange_, Surface::links_, Surface::prestrain_, Surface::rest_, Surface::solid_, Surface::undeformed_length, Surface::weigh_link;

  /// The shares of links that weigh 1 each.
  void share_by_volume() {
    HugePageVector<Scalar> round(at(links_.size()), Scalar(0));
    auto const each = [this](auto const& visit) {
      for (int t = 0; t < solid().tetrahedron_count(); ++t) {
        auto const c = solid().corners(t);
        for (std::size_t k = 0; k < pairs.size(); ++k) visit(of(t), k, at(links_.find(c[pairs[k][0]], c[pairs[k][1]])));
      }
    };
    for (int t = 0; t < solid().tetrahedron_count(); ++t) shares_.push_back({{}, measured_volume(t)});
    each([&](Shares const& own, std::size_t, std::size_t l) { round[l] += own.volume; });
    each([&](Shares& own, std::size_t k, std::size_t l) { own.share[k] = own.volume / round[l]; });
  }

  HugePageVector<Shares> shares_;   // of each tetrahedron

 private:
  static constexpr std::array<std::array<std::size_t, 2>, 6> pairs{{{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}}};

  Shares& of(int t) noexcept { return shares_[at(t)]; }
  Shares const& of(int t) const noexcept { return shares_[at(t)]; }

  Scalar measured_volume(int t) const noexcept {
    auto const c = solid().corners(t);
    Vector3<Scalar> const a = rest_[c[1]] - rest_[c[0]], b = rest_[c[2]] - rest_[c[0]], d = rest_[c[3]] - rest_[c[0]];
    return a.cross(b).dot(d) / 6;
  }
  Scalar volume_around(int i) const noexcept {
    Scalar sum = 0;
    for (int const t : solid().tetrahedra_at(i)) sum += of(t).volume;
    return sum;
  }
  /// The sum of the shares of an edge's link.
  Scalar weight_between(int a, int b) const noexcept {
    Scalar sum = 0;
    for (int const t : solid().tetrahedra_at(a)) {
      int const j = solid().corner_of(t, b);
      if (j < 0) continue;
      int const i = solid().corner_of(t, a), low = std::min(i, j), high = std::max(i, j);
      sum += of(t).share[at(low == 0 ? high - 1 : low + high)];
    }
    return sum;
  }
  /// κ [Pa]: the mean over the edges of share · k L²/V.
  Scalar modulus_of(Shares const& own, TetrahedralTopology::Corners const& c) const {
    Scalar sum = 0;
    for (std::size_t k = 0; k < pairs.size(); ++k) sum += this->stretch(links_.find(c[pairs[k][0]], c[pairs[k][1]]), own.share[k]);
    return sum / (6 * own.volume);
  }
  /// Sets a part's volume and shares from its parent's modulus, before the links follow.
  void share_part(int t, Scalar modulus, Law const& law) {
    auto const c = solid().corners(t);
    of(t).volume = measured_volume(t);
    for (std::size_t k = 0; k < pairs.size(); ++k) {
      int const a = c[pairs[k][0]], b = c[pairs[k][1]], l = links_.find(a, b);
      of(t).share[k] = this->share_of(modulus, of(t).volume, undeformed_length(a, b), l < 0 ? law : links_[l].law);
    }
  }
};

}  // namespace palpate
