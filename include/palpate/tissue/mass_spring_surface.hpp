// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/tissue/mass_spring_particles.hpp>

#include <array>
#include <cstddef>
#include <span>

namespace palpate {

/// How mass-spring tissue that was built from a surface follows a cut.
/// Invariant  a link exists where triangles share an edge with a weight above zero, the sum of their shares.
/// Cost       every edit is O(triangles at the particles it touches).
template <RealScalar Scalar, class Law>
class MassSpringSurface : public MassSpringParticles<Scalar, Law> {
  using Particles = MassSpringParticles<Scalar, Law>;

 public:
  using Corners = SurfaceTopology::Corners;
  using Particles::cuttable, Particles::home, Particles::mass, Particles::nailed, Particles::size, Particles::surface;

  /// Rest area of a triangle [m²].
  Scalar triangle_area(int t) const noexcept { return cuttable() ? elements_[at(t)].area : measured_area(t); }
  /// Rest area of the triangles that meet at a particle [m²].
  Scalar area_around(int i) const noexcept {
    Scalar sum = 0;
    for (int const t : surface().triangles_at(i)) sum += triangle_area(t);
    return sum;
  }

  /// Divides triangle t = (a, b, c) at barycentric weights w > 0 into t = (a, b, n), (b, c, n), (c, a, n). Returns n.
  int insert_in_triangle(int t, Vector3<Scalar> const& w) {
    Corners const c = surface_.corners(t);
    Scalar const area = triangle_area(t);
    Scalar const modulus = link_modulus(t, area);
    Law const law = links_[links_.find(c[0], c[1])].law;
    int const n = add_vertex(w[0] * rest_[c[0]] + w[1] * rest_[c[1]] + w[2] * rest_[c[2]],
                             nailed(c[0]) && nailed(c[1]) && nailed(c[2]));
    this->template take_mass<3>(n, c, {w[0], w[1], w[2]}, area, [this](int i) { return area_around(i); });
    surface_.set_triangle(t, {c[0], c[1], n});
    for (Corners const& child : {Corners{c[1], c[2], n}, Corners{c[2], c[0], n}}) add_triangle(child);
    for (int const child : {t, last_triangle() - 1, last_triangle()}) share_links(child, modulus, law);
    return n;
  }

  /// Divides the edge a–b at X_a + s (X_b − X_a), 0 < s < 1, and the triangles at it: (a, b, c) becomes (a, n, c) and (n, b, c),
  /// the one on the other side (b, a, d) becomes (n, a, d) and (b, n, d). Returns n.
  int insert_on_edge(int a, int b, Scalar s) {
    int const left = surface_.triangle_with_edge(a, b);
    int const right = surface_.triangle_with_edge(b, a);
    int const divided = links_.find(a, b);
    Law const law = links_[divided].law;
    Scalar const left_area = left < 0 ? 0 : triangle_area(left), right_area = right < 0 ? 0 : triangle_area(right);
    Scalar const left_modulus = left < 0 ? 0 : link_modulus(left, left_area);
    Scalar const right_modulus = right < 0 ? 0 : link_modulus(right, right_area);
    int const n = add_vertex((1 - s) * rest_[a] + s * rest_[b], nailed(a) && nailed(b));
    this->template take_mass<2>(n, {a, b}, {1 - s, s}, left_area + right_area, [this](int i) { return area_around(i); });
    Division const division{{a, b}, n, {undeformed_length(a, n), undeformed_length(n, b)}, law};
    links_.change_end(divided, b, n);   // it is the first half from now on
    links_[divided].rest_length = (1 - prestrain_) * division.lengths[0];
    links_[divided].weight = 0;         // until its triangles have their shares
    std::array<Scalar, 2> half_shares{};
    if (left >= 0) {
      int const c = third(left, a, b);
      surface_.set_triangle(left, {a, n, c});
      add_triangle({n, b, c});
      share_halves(division, {left, last_triangle()}, c, true, left_modulus, half_shares);
    }
    if (right >= 0) {
      int const d = third(right, b, a);
      surface_.set_triangle(right, {n, a, d});
      add_triangle({b, n, d});
      share_halves(division, {right, last_triangle()}, d, false, right_modulus, half_shares);
    }
    return n;
  }

  /// Gives `triangles`, all at p, a copy of p as their corner; mass and home spring are shared by area. Returns the copy.
  int split_particle(int p, std::span<int const> triangles) {
    int const n = add_vertex(rest_[p], nailed(p));
    exchange_.set_copy_of(p);
    for (int const t : triangles) surface_.replace_corner(t, p, n);
    for (int const t : triangles) {
      Corners const c = surface_.corners(t);
      int const k = surface_.corner_of(t, n);
      part_link(p, n, c[at((k + 1) % 3)], t, k, true);
      part_link(p, n, c[at((k + 2) % 3)], t, (k + 2) % 3, false);
    }
    balance_copies(p, n);
    return n;
  }

  /// Shares the mass and the home spring of two copies of one particle anew, by the area around each.
  void balance_copies(int p, int copy) {
    this->share_between(p, copy, area_around(p), area_around(copy));
  }

  /// Undoes a split: the last particle's triangles, mass and home spring go to p.
  void merge_last_particle(int p) {
    int const last = size() - 1;
    while (!surface_.triangles_at(last).empty()) change_corner(surface_.triangles_at(last).front(), last, p);
    mass_[at(p)] += mass(last);
    home_[at(p)].stiffness += home(last).stiffness, home_[at(p)].damping += home(last).damping;
    this->pop_particle(), surface_.pop_vertex();
  }

  /// Gives triangle t the corner `now` instead of `before`, both at the same place; its links follow, masses stay.
  void change_corner(int t, int before, int now) {
    Corners corners = surface_.corners(t);
    int const k = surface_.corner_of(t, before);
    corners[at(k)] = now;
    surface_.set_triangle(t, corners);
    // On the side of t the old edges have no triangle left, and the new ones have t.
    int const ahead = corners[at((k + 1) % 3)], behind = corners[at((k + 2) % 3)];
    hand_over_link(before, now, ahead, elements_[at(t)].share[at(k)], share_on(ahead, before), share_on(ahead, now));
    hand_over_link(before, now, behind, elements_[at(t)].share[at((k + 2) % 3)], share_on(before, behind), share_on(now, behind));
  }

  /// Lets a particle rest elsewhere. Its links get the rest lengths of the new undeformed shape; stiffness, shares and masses stay.
  void move_rest(int p, Vector3<Scalar> const& rest) noexcept {
    rest_[p] = rest;
    measure_around(p);
    for (int const l : links_.at(p)) links_[l].rest_length = (1 - prestrain_) * undeformed_length(links_[l].a, links_[l].b);
    ++revision_;
  }

  /// Room for this many particles and triangles, so that edits up to there do not allocate.
  void reserve(int particles, int triangles) {
    this->reserve_particles(particles, 3 * triangles);
    reserve_and_prefault(elements_, at(triangles));
    surface_.reserve(particles, triangles);
  }

 protected:
  /// What a triangle brings to its links.
  struct Element {
    std::array<Scalar, 3> share{};   // of the link between its corners k and k + 1
    Scalar area = 0;                 // m², undeformed
  };

  using Particles::at, Particles::exchange_, Particles::home_, Particles::links_, Particles::mass_, Particles::prestrain_, Particles::rest_,
      Particles::revision_, Particles::share_of, Particles::surface_, Particles::undeformed_length, Particles::weigh_link;

  int last_triangle() const noexcept { return surface_.triangle_count() - 1; }

  int third(int t, int a, int b) const noexcept {
    Corners const c = surface_.corners(t);
    return c[0] != a && c[0] != b ? c[0] : c[1] != a && c[1] != b ? c[1] : c[2];
  }

  Scalar measured_area(int t) const noexcept {
    Corners const c = surface().corners(t);
    Vector3<Scalar> const a = rest_[c[1]] - rest_[c[0]];
    Vector3<Scalar> const b = rest_[c[2]] - rest_[c[0]];
    return a.cross(b).norm() / 2;
  }
  void measure_around(int particle) noexcept {
    for (int const t : surface().triangles_at(particle)) elements_[at(t)].area = measured_area(t);
  }

  int add_vertex(Vector3<Scalar> const& rest, bool is_nailed) {
    surface_.add_vertex();
    return this->add_particle(rest, is_nailed);
  }
  int add_triangle(Corners const& corners) {
    elements_.emplace_back();
    return surface_.add_triangle(corners);
  }

  /// κ [N/m]: the mean over the triangle's edges of share · k L²/A.
  Scalar link_modulus(int t, Scalar area) const {
    Corners const c = surface_.corners(t);
    Scalar sum = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      int const l = links_.find(c[k], c[(k + 1) % 3]);
      if (l >= 0) sum += this->stretch(l, elements_[at(t)].share[k]);
    }
    return sum / (3 * area);
  }

  /// Sets a divided triangle's shares from its parent's modulus and brings its three links up to date.
  void share_links(int t, Scalar modulus, Law const& law) {
    Corners const c = surface_.corners(t);
    Scalar const area = elements_[at(t)].area = measured_area(t);
    for (std::size_t k = 0; k < 3; ++k) {
      int const a = c[k], b = c[(k + 1) % 3];
      int const l = links_.find(a, b);
      Scalar const share = share_of(modulus, area, undeformed_length(a, b), l < 0 ? law : links_[l].law);
      elements_[at(t)].share[k] = share;
      weigh_link(l, a, b, share + share_on(b, a), law);
    }
  }

  /// An edge that was divided at n, how long its halves are, and the law of its link.
  struct Division {
    std::array<int, 2> ends;
    int n;
    std::array<Scalar, 2> lengths;
    Law law;
  };

  /// Gives the two halves of a triangle beside a divided edge their shares, from its modulus, and brings their links up to date: those of the
  /// halves of the edge, the one from n to the corner c that faced it, and the two outer ones. `half_shares` are those of the other side's halves
  /// of the edge, 0 where there is none yet, and then those of this side's.
  void share_halves(Division const& edge, std::array<int, 2> const& triangles, int c, bool is_left, Scalar modulus, std::array<Scalar, 2>& half_shares) {
    int const n = edge.n;
    Scalar const middle_length = undeformed_length(n, c);
    std::array<int, 2> outer_link;
    std::array<Scalar, 2> middle;
    for (std::size_t k = 0; k < 2; ++k) {
      int const t = triangles[k], end = edge.ends[k];
      bool const comes_to_end = is_left == (k == 0);   // the triangle is (half, middle, outer), its outer edge c → end; else (half, outer, middle)
      Scalar const area = measured_area(t), outer_length = undeformed_length(end, c);
      outer_link[k] = links_.find(end, c);
      Scalar const outer = share_of(modulus, area, outer_length, outer_link[k] < 0 ? edge.law : links_[outer_link[k]].law);
      Scalar const half = share_of(modulus, area, edge.lengths[k], edge.law);
      middle[k] = share_of(modulus, area, middle_length, edge.law);
      elements_[at(t)] = {comes_to_end ? std::array{half, middle[k], outer} : std::array{half, outer, middle[k]}, area};
    }
    for (std::size_t k = 0; k < 2; ++k) {
      int const t = triangles[k], end = edge.ends[k];
      bool const comes_to_end = is_left == (k == 0);
      Scalar const half = elements_[at(t)].share[0] + half_shares[k];
      if (comes_to_end)
        weigh_link(links_.find(n, end), end, n, half, edge.law);
      else
        weigh_link(links_.find(n, end), n, end, half, edge.law);
      half_shares[k] = elements_[at(t)].share[0];
      if (k == 0 && is_left) weigh_link(-1, n, c, middle[0] + middle[1], edge.law);
      if (comes_to_end)
        weigh_link(outer_link[k], c, end, elements_[at(t)].share[2] + share_on(end, c), edge.law);
      else
        weigh_link(outer_link[k], end, c, elements_[at(t)].share[1] + share_on(c, end), edge.law);
      if (k == 0 && !is_left) weigh_link(-1, c, n, middle[0] + middle[1], edge.law);
    }
  }

  /// What the triangle with the directed edge from → to adds to the weight of its link; 0 where there is none.
  Scalar share_on(int from, int to) const noexcept {
    int const t = surface_.triangle_with_edge(from, to);
    return t < 0 ? Scalar(0) : elements_[at(t)].share[at(surface_.corner_of(t, from))];
  }

  /// Triangles have gone from particle p to its copy, t among them: the link to `other`, on the edge of t that has its share in column k, follows.
  /// `ahead`: t goes from the copy to `other` there.
  void part_link(int p, int copy, int other, int t, int k, bool ahead) {
    int const beside = ahead ? surface_.triangle_with_edge(other, copy) : surface_.triangle_with_edge(copy, other);
    int const before = links_.find(p, other);
    Law const law = before < 0 ? Law{} : links_[before].law;
    if (beside < 0) {
      weigh_link(before, p, other, ahead ? share_on(other, p) : share_on(p, other), law);
      weigh_link(-1, copy, other, elements_[at(t)].share[at(k)], law);
      return;
    }
    if (before >= 0) links_.change_end(before, p, copy), ++revision_;   // between two triangles that have gone, and so the first of them is here
  }

  /// A triangle's corner goes from one particle to another: the links of both to `other` get the shares of the triangles on their sides.
  void hand_over_link(int before, int now, int other, Scalar share, Scalar left_before, Scalar beside_now) {
    int const l = links_.find(before, other);
    Law const law = l < 0 ? Law{} : links_[l].law;
    weigh_link(l, before, other, left_before, law);
    weigh_link(links_.find(now, other), now, other, share + beside_now, law);
  }

  HugePageVector<Element> elements_;   // of each triangle of a surface-built body
};

}  // namespace palpate
