// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/mesh/edges.hpp>
#include <palpate/mesh/measures.hpp>
#include <palpate/mesh/tetrahedral_mesh.hpp>
#include <palpate/mesh/triangle_mesh.hpp>
#include <palpate/mesh/validation.hpp>
#include <palpate/tissue/concept.hpp>
#include <palpate/tissue/element_sums.hpp>
#include <palpate/tissue/linear_spring.hpp>
#include <palpate/tissue/lumped_mass.hpp>
#include <palpate/tissue/mass_spring_assembly.hpp>
#include <palpate/tissue/mass_spring_solid.hpp>
#include <palpate/tissue/whole_pieces.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <initializer_list>
#include <span>
#include <type_traits>
#include <vector>

namespace palpate {

/// Mass-spring tissue: every vertex a particle, every edge a link spring with a damper, and a home spring with a damper that
/// holds each particle at its rest position X (the rigid kernel of an organ).
///   m_i a_i = −Σ_j w_ij (T(|d_ij| − L_ij) + c_ij (v_i − v_j)·n_ij) n_ij − k_i (x_i − X_i) − c_i v_i + f_i
///   d_ij = x_i − x_j,  n_ij = d_ij/|d_ij|,  T the link's law, w_ij its weight (1 until a cut shares it)
/// Units      m [kg], k [N/m], c [N·s/m], x, L [m], f [N].
/// Shapes     positions, velocities, forces: 3 × size(), one column per particle, in the order of the mesh.
/// Source     \cite zheng2006 eq. 5-9 … 5-11.
/// Cost       forces O(links); an Assembly holds those of a chosen set of particles.
/// Invariant  masses > 0, rest lengths > 0, link stiffness > 0, other coefficients ≥ 0.
///            One link lies on each edge of the mesh: a link's weight is the sum of the shares of the triangles (of a volume: the
///            tetrahedra) at the edge, A_T / ΣA_T (V_T / ΣV_T) each at first.
/// Limits     |d| = 0 has no direction: no force.
template <RealScalar S, class SpringType = LinearSpring<S>>
class MassSpring : public MassSpringSolid<S, SpringType>, public ElementSums<MassSpring<S, SpringType>, S> {
  using Elements = MassSpringSolid<S, SpringType>;

 public:
  using Scalar = S;
  using Law = SpringType;
  using Options = MassSpringOptions<Scalar, Law>;
  using Assembly = MassSpringAssembly<Scalar, Law>;
  using LinkType = Link<Scalar, Law>;
  using Elements::cuttable, Elements::home, Elements::nailed, Elements::size, Elements::solid, Elements::surface;

  /// Springs on the edges of a surface. Throws InvalidMesh or InvalidArgument and says which value is wrong.
  MassSpring(TriangleMesh<Scalar> const& mesh, Options const& options) {
    require_valid(mesh);
    rest_ = Columns<Scalar, 3>(mesh.points);
    surface_ = SurfaceTopology(size(), mesh.triangles);
    start(options);
    add_links(edges(mesh), options.link);
    elements_.resize(at(surface_.triangle_count()));
    for (int t = 0; t < surface_.triangle_count(); ++t) elements_[at(t)].area = Elements::measured_area(t);
    for (int t = 0; t < surface_.triangle_count(); ++t)
      for (int k = 0; k < 3; ++k) {
        auto const corners = surface_.corners(t);
        int const twin = surface_.triangle_with_edge(corners[at((k + 1) % 3)], corners[at(k)]);
        Scalar const area = Elements::triangle_area(t);
        elements_[at(t)].share[at(k)] = twin < 0 ? Scalar(1) : area / (area + Elements::triangle_area(twin));
      }
    take_masses(lumped_masses(mesh, options.mass));
  }

  /// Springs on the edges of a volume, whose tetrahedra are kept in solid(): what VolumeCutter cuts.
  MassSpring(TetrahedralMesh<Scalar> const& mesh, Options const& options) {
    require_valid(mesh);
    rest_ = Columns<Scalar, 3>(mesh.points);
    solid_ = CutSolid(size(), mesh.tetrahedra);
    start(options);
    add_links(edges(mesh), options.link);
    Elements::share_by_volume();
    take_masses(lumped_masses(mesh, options.mass));
  }

  Scalar total_mass() const noexcept {
    Scalar sum = 0;
    for (Scalar const m : mass_) sum += m;
    return sum;
  }
  void set_mass(int i, Scalar mass) {
    detail::check_index("particle", i, size());
    detail::require_positive("particle mass", mass, "kg");
    mass_[at(i)] = mass;
    note_rate(i);
    ++revision_;
  }

  void set_home(int i, HomeSpring<Scalar> const& spring) {
    detail::check_index("particle", i, size());
    require_valid_home(spring);
    home_[at(i)] = spring;
    note_rate(i);
    ++revision_;
  }

  /// Gives one link coefficients of its own. `links().find(a, b)` names the link of an edge.
  void set_link(int link, Law const& law) {
    detail::check_index("link", link, links_.size());
    detail::require_valid_law(law, links_[link].rest_length);
    links_[link].law = law;
    note_rate(links_[link].a), note_rate(links_[link].b);
    ++revision_;
  }
  Scalar link_prestrain() const noexcept { return prestrain_; }

  /// A nailed particle keeps its place whatever pulls on it.
  void nail(int i) {
    detail::check_index("particle", i, size());
    nailed_[at(i)] = 1;
    ++revision_;
  }
  void nail(std::vector<int> const& particles) {
    for (int const i : particles) detail::check_index("particle", i, size());
    for (int const i : particles) nail(i);
  }
  void unnail(int i) {
    detail::check_index("particle", i, size());
    nailed_[at(i)] = 0;
    ++revision_;
  }

  /// Lets a particle that a cut has left with little mass on stiff springs have some of those it lies between, and of its copies, so that the
  /// body's stable step stays: the bound of its stiffness is then at most four times as large beside its mass as the largest of the
  /// body as it was built. `moved(from, to, share)`: `to` has got this share of what it has now from `from`, and should take its velocity in
  /// that proportion.
  template <class Moved>
  void even_mass(int particle, Moved const& moved) {
    exchange_.relieve(*this, particle, 4 * fastest_, [&](int from, int to, Scalar amount) {
      mass_[at(from)] -= amount, mass_[at(to)] += amount;
      moved(from, to, amount / mass_[at(to)]);
      ++revision_;
    });
  }

  /// Whether the particles around have, or can lend, the mass that the pieces of an edge divided at s, and the links to the corners that face it, ask for
  /// at the rate that even_mass() keeps to; short pieces are stiff.
  bool has_mass_to_divide(int a, int b, Scalar s) const {
    int const left = surface_.triangle_with_edge(a, b), right = surface_.triangle_with_edge(b, a);
    return has_mass_to_divide(Vector3<Scalar>((1 - s) * rest_[a] + s * rest_[b]), {left, right},
                              {a, b, left < 0 ? -1 : Elements::third(left, a, b), right < 0 ? -1 : Elements::third(right, a, b)});
  }
  /// The same for a triangle divided at barycentric weights w.
  bool has_mass_to_divide(int t, Vector3<Scalar> const& w) const {
    auto const c = surface_.corners(t);
    return has_mass_to_divide(w[0] * rest_[c[0]] + w[1] * rest_[c[1]] + w[2] * rest_[c[2]], {t}, {c[0], c[1], c[2]});
  }

  /// The tissue of these particles alone, in this order: one or more whole pieces. Throws InvalidArgument where a link, triangle or tetrahedron leads
  /// out of them; then, and always, this tissue stays as it is.
  MassSpring part(std::span<int const> particles) const {
    return MassSpring(*this, detail::WholePieces(particles, size()));
  }

  template <class Visit>
  void for_each_neighbour(int i, Visit visit) const {
    for (int const other : links_.neighbours(i)) visit(other);
  }

  void assemble(std::span<int const> moving, Assembly& assembly) const { assembly.build(*this, moving); }

 private:
  MassSpring(MassSpring const& whole, detail::WholePieces const& part) {
    links_.reserve(static_cast<int>(part.particles.size()), whole.links_.size());
    for (int const i : part.particles) {
      rest_.push_back(whole.rest_[i]);
      mass_.push_back(whole.mass_[at(i)]), home_.push_back(whole.home_[at(i)]), nailed_.push_back(whole.nailed_[at(i)]);
      links_.add_particle();
    }
    for (int l = 0; l < whole.links_.size(); ++l) {
      LinkType link = whole.links_[l];
      if (!part.hold(std::array{link.a, link.b})) continue;
      link.a = part.now(link.a), link.b = part.now(link.b);
      links_.add(link);
    }
    if (whole.cuttable()) {
      surface_ = SurfaceTopology(size(), part.inside(whole.surface_.triangles()));
      for (int t = 0; t < whole.surface_.triangle_count(); ++t)
        if (part.now(whole.surface_.corners(t)[0]) >= 0) elements_.push_back(whole.elements_[at(t)]);
    } else {
      solid_ = whole.solid_.part(part);
      for (int t = 0; t < whole.solid().tetrahedron_count(); ++t)
        if (part.now(whole.solid().corners(t)[0]) >= 0) shares_.push_back(whole.shares_[at(t)]);
    }
    exchange_ = whole.exchange_.part(part.particles, part.now());
    prestrain_ = whole.prestrain_, revision_ = whole.revision_, fastest_ = whole.fastest_;
  }

  using Elements::at;
  using Elements::elements_;
  using Elements::exchange_;
  using Elements::home_;
  using Elements::links_;
  using Elements::mass_;
  using Elements::nailed_;
  using Elements::prestrain_;
  using Elements::rest_;
  using Elements::revision_;
  using Elements::shares_;
  using Elements::solid_;
  using Elements::surface_;

  static void require_valid_home(HomeSpring<Scalar> const& spring) {
    detail::require_non_negative("home stiffness", spring.stiffness, "N/m");
    detail::require_non_negative("home damping", spring.damping, "N s/m");
  }

  void start(Options const& options) {
    prestrain_ = options.link_prestrain;
    require_valid_home(options.home);
    if (!(prestrain_ >= 0 && prestrain_ < 1))
      throw InvalidArgument(detail::message("link_prestrain is ", prestrain_, "; it must be at least 0 and below 1"));
    home_.assign(at(size()), options.home);
    nailed_.assign(at(size()), 0);
    links_.reserve(size(), 8 * size());
    exchange_.reserve(size());
    for (int i = 0; i < size(); ++i) links_.add_particle(), exchange_.add_particle();
  }

  void add_links(std::vector<std::array<int, 2>> const& edges, Law const& law) {
    for (auto const& [a, b] : edges) {
      Scalar const length = (1 - prestrain_) * Elements::undeformed_length(a, b);
      if (!(length > 0))
        throw InvalidMesh(detail::message("the edge between vertices ", a, " and ", b, " has no length; merge the two with repair()"));
      detail::require_valid_law(law, length);
      links_.add({a, b, length, Scalar(1), law});
    }
  }

  void take_masses(std::vector<Scalar> const& masses) {
    mass_.assign(masses.begin(), masses.end());
    for (int i = 0; i < size(); ++i) note_rate(i);
  }

  void note_rate(int i) noexcept { fastest_ = std::max(fastest_, this->stiffness_bound(i) / mass_[at(i)]); }

  /// Triangles divided at a point, that is how much stiffer all links become [N/m], beside what their corners can bear; −1 is none.
  bool has_mass_to_divide(Vector3<Scalar> const& point, std::initializer_list<int> triangles, std::initializer_list<int> corners) const {
    Scalar needed = 0, spare = 0;
    for (int const t : triangles) {
      if (t < 0) continue;
      auto const c = surface_.corners(t);
      Scalar const modulus = Elements::link_modulus(t, Elements::triangle_area(t));
      for (std::size_t k = 0; k < 3; ++k) {
        Vector3<Scalar> const a = rest_[c[k]] - point, b = rest_[c[(k + 1) % 3]] - point, along = b - a;
        Scalar const area = Vector3<Scalar>(a.cross(b)).norm() / 2;
        needed += modulus * area * (1 / a.squaredNorm() + 1 / b.squaredNorm() + 1 / along.squaredNorm());
        if (int const l = links_.find(c[k], c[(k + 1) % 3]); l >= 0) needed -= elements_[at(t)].share[k] * this->spring(l).stiffness_bound() / (2 * links_[l].weight);
      }
    }
    for (int const i : corners) {
      if (i < 0) continue;
      Scalar const bound = 4 * fastest_ * mass_[at(i)];
      spare += nailed(i) ? bound : std::min(Scalar(0.75) * bound, bound - this->stiffness_bound(i));
    }
    return 4 * needed <= spare;   // a link of stiffness k adds 2 k to the bounds of both its ends
  }

  Scalar fastest_ = 0;   // 1/s², the largest stiffness bound over mass that the host has asked for
};

/// A law that is none: what it lacks, in a sentence each, and nothing that could fail besides.
template <RealScalar S, class SpringType>
  requires(!SpringLaw<SpringType, S>)
class MassSpring<S, SpringType> : detail::SpringLawSentences<SpringType, S> {
 public:
  using Refused = void;
  using Scalar = S;
  using Options = MassSpringOptions<S, SpringType>;

  MassSpring(TriangleMesh<S> const&, Options const&) {}
  MassSpring(TetrahedralMesh<S> const&, Options const&) {}
};

}  // namespace palpate
