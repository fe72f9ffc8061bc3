// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>
#include <palpate/material/concept.hpp>
#include <palpate/material/viscoelastic.hpp>
#include <palpate/material/with_pressure.hpp>
#include <palpate/mesh/tetrahedral_mesh.hpp>
#include <palpate/tissue/cut_solid.hpp>
#include <palpate/tissue/edit_log.hpp>
#include <palpate/tissue/element_tissue.hpp>
#include <palpate/tissue/linear_tetrahedron.hpp>
#include <palpate/tissue/mass_exchange.hpp>
#include <palpate/tissue/pressure_stars.hpp>
#include <palpate/tissue/solid_assembly.hpp>
#include <palpate/tissue/star_neighbours.hpp>

#include <algorithm>
#include <array>
#include <concepts>
#include <cstddef>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

namespace palpate {

struct BackwardEuler;

/// What resists a change of volume.
enum class Pressure {
  element,   ///< each tetrahedron by itself: far too stiff near ν = ½
  nodal,     ///< the tetrahedra of a material round a node together, averaged nodal pressure: at most twice the cost
};

/// How implicit steps and statics multiply with the stiffness.
enum class Stiffness {
  matrix_free,   ///< tetrahedron by tetrahedron
  assembled,     ///< by the row of a sparse matrix: half the time of a product; each edit builds it anew. For whole bodies that are not cut; not with nodal pressure
};

/// What a solid is made of.
template <RealScalar Scalar, class M>
struct SolidOptions {
  Scalar density{};   ///< kg/m³
  M material{};
  RayleighDamping<Scalar> damping{};
  /// ε: edges are (1 − ε) × as long at rest as in the mesh, so that the tissue is in tension and a cut gapes. 0 ≤ ε < 1.
  Scalar prestrain = 0;
  Pressure pressure = Pressure::element;
  Stiffness stiffness = Stiffness::matrix_free;
};

namespace detail {

/// Stands where a choice of pressure would, of a material that has none, and says so where one is chosen.
template <class Scalar, class M>
struct NoPressure {
  NoPressure() = default;
  template <std::same_as<Pressure> Chosen>
  NoPressure(Chosen) {
    static_assert(sizeof(Chosen) == 0 || !MaterialLaw<typename LawOf<M>::type, Scalar>,
                  "palpate: the material has no bulk_modulus(), which nodal pressure computes with; declare in its law: Scalar "
                  "bulk_modulus() const, in Pa at small strain, or leave .pressure out: each tetrahedron then resists by itself.");
  }
};

}  // namespace detail

/// The same of a material that states no bulk modulus: each tetrahedron resists by itself, and there is nothing to choose.
template <RealScalar Scalar, class M>
  requires(!HasBulkModulus<typename detail::LawOf<M>::type, Scalar>)
struct SolidOptions<Scalar, M> {
  Scalar density{};
  M material{};
  RayleighDamping<Scalar> damping{};
  Scalar prestrain = 0;
  detail::NoPressure<Scalar, M> pressure{};
  Stiffness stiffness = Stiffness::matrix_free;
};

/// An elastic solid: linear tetrahedra of a material, total Lagrangian, their mass lumped at the nodes.
///
///   FiniteElements<double, StableNeoHookean<double>> tissue(make_block<double>(21, 5, 5, 0.0025, BlockPattern::alternating),
///                                                           {.density = 1060.0, .material = {.young = 2e5, .poisson = 0.45}, .pressure = Pressure::nodal});
///   tissue.nail(0);
///   SoftBody body(std::move(tissue), BackwardEuler{});
///
/// What a law of numbers or packs of numbers says (see MaterialLaw) is computed for as many elements at once as a register holds.
/// Nodal pressure   W = Σ_e V_e (ψ(F_e) − κ/2 (J_e − 1)²) + Σ_a V_a/4 κ/2 (J̄_a − 1)², J̄_a the mean over the volume V_a of the tetrahedra of one material
///            round node a, see PressureStars. Then particles that share such a star are neighbours: a ring of a zone is two edges wide.
/// Damping    Rayleigh's, see RayleighDamping.
/// Units      kg, m, N, Pa.
/// Errors     InvalidMesh: a tetrahedron that is flat, turned over or joins a vertex with itself. InvalidArgument: a density outside
///            10 … 100,000 kg/m³, damping below zero, pre-strain outside 0 … 1; what the material says of its numbers.
/// Cuts       divide_edge, split_vertex and remove_tetrahedron, after which finish_edits() has to be called once; faces that a cut has opened are is_wound().
///            A face may also be cut and not open, where no vertex of it has split: is_cut(t, k).
/// Limits     near ν = ½ linear tetrahedra without nodal pressure are far too stiff.
/// Source     \cite bonet1998 for nodal pressure.
template <RealScalar Scalar, class M>
class FiniteElements;
template <RealScalar Scalar, Material<Scalar> M>
class FiniteElements<Scalar, M> : public ElementTissue<Scalar, LinearTetrahedron<Scalar, typename detail::LawOf<M>::type>> {
  using Law = detail::LawOf<M>;
  using Base = ElementTissue<Scalar, LinearTetrahedron<Scalar, typename Law::type>>;
  using Columns = NodeColumns<Scalar, 4>;
  static constexpr bool can_average = HasBulkModulus<typename Law::type, Scalar>, remembers = HasFadedStress<typename Law::type>;

 public:
  using Element = LinearTetrahedron<Scalar, typename Law::type>;
  using Options = SolidOptions<Scalar, M>;
  using Assembly = SolidAssembly<Scalar, typename Law::type>;
  using DefaultIntegrator = BackwardEuler;

  FiniteElements(TetrahedralMesh<Scalar> const& mesh, Options const& options)
      : Base(mesh, make_list(mesh, options)), damping_(options.damping), prestrain_(options.prestrain), assembles_(options.stiffness == Stiffness::assembled), group_(static_cast<std::size_t>(tetrahedra()), 0) {
    if constexpr (can_average) averages_ = options.pressure == Pressure::nodal;
    if constexpr (remembers) history_.resize(group_.size());
    solid_ = CutSolid(this->size(), mesh.tetrahedra);
    this->drop_surface();
    for (int i = 0; i < this->size(); ++i) exchange_.add_particle();
    find_stars();
  }

  TetrahedralTopology const& topology() const noexcept { return solid_.topology(); }
  SurfaceTopology const& surface() const noexcept { return topology().border(); }
  int tetrahedra() const noexcept { return list().size(); }
  ElementList<Element> const& list() const noexcept { return Base::template elements<Element>(); }
  std::span<int const> elements_at(int i) const noexcept { return Base::template elements_at<Element>(i); }
  /// Empty without nodal pressure.
  PressureStars<Scalar> const& stars() const noexcept { return stars_; }
  RayleighDamping<Scalar> const& damping() const noexcept { return damping_; }
  Scalar link_prestrain() const noexcept { return prestrain_; }
  bool assembles_stiffness() const noexcept { return assembles_; }
  /// Which tetrahedra have changed, for its assembly.
  EditLog const& edits() const noexcept { return log_; }

  void set_mass(int i, Scalar mass) {
    Base::set_mass(i, mass);
    is_reweighed_ = true;
    if (!is_edited_) fastest_ = 0;
    log_.forget_all();
  }
  /// These tetrahedra are of another material from now on, and weigh what it does. With nodal pressure they share it with each other, not with the rest.
  void set_material(std::span<int const> some, M const& material, Scalar density) {
    detail::require_density("the density", density);
    for (int const t : some) detail::check_index("tetrahedron", t, tetrahedra());
    give_material(some, material, [density](Element const&) { return density; });
  }
  /// The same; they weigh what they did.
  void set_material(std::span<int const> some, M const& material) {
    for (int const t : some) detail::check_index("tetrahedron", t, tetrahedra());
    Scalar const length = 1 - prestrain_;
    give_material(some, material, [length](Element const& element) { return element.density() * (length * length * length); });
  }

  /// The solid of these particles alone, in this order; see DivisibleTissue. Throws as WholePieces does.
  FiniteElements part(std::span<int const> particles) const {
    detail::WholePieces const pieces(particles, this->size());
    FiniteElements made = *this;
    made.group_.clear(), made.history_.clear(), made.log_.forget_all();
    for (std::size_t e = 0; e < group_.size(); ++e)
      if (pieces.hold(list().nodes[e])) {
        made.group_.push_back(group_[e]);
        if constexpr (remembers) made.history_.push_back(history_[e]);
      }
    made.keep(pieces);
    made.solid_ = solid_.part(pieces);
    made.exchange_ = exchange_.part(pieces.particles, pieces.now());
    made.find_stars();
    return made;
  }

  // --- cuts -------------------------------------------------------------------------------------------------------------
  /// Whether a border triangle was inside before a cut.
  bool is_wound(int triangle) const noexcept { return solid_.is_wound(triangle); }
  /// Whether face k of a tetrahedron is cut and not open: no vertex of it has split yet.
  bool is_cut(int tetrahedron, int k) const noexcept { return solid_.is_cut(tetrahedron, k); }
  /// Marks an inner face so, seen from both sides.
  void mark_cut(int tetrahedron, int k) noexcept { solid_.mark_cut(tetrahedron, k); }

  template <class Visit>
  void for_each_joined(int i, Visit visit) const {
    Base::for_each_neighbour(i, visit);
  }

  /// Divides the edge a–b at X_a + s (X_b − X_a), 0 < s < 1, and each tetrahedron round it in two of its material. The new particle takes its mass from a
  /// and b, (1 − s) and s of it, so that mass, centre of mass and, at the mean velocity, momentum stay: as masses lumped anew would have it, where they are
  /// lumped. It is nailed where both are. Throws as TetrahedralTopology does, and for s outside.
  TopologyEdit divide_edge(int a, int b, Scalar s) {
    if (!(s > 0 && s < 1)) throw InvalidArgument(detail::message("divide_edge: s is ", s, "; it must be between 0 and 1, ends excluded"));
    begin_edit();
    TopologyEdit const edit = solid_.insert_on_edge(a, b);
    Scalar quarter = 0;
    for (int t = edit.first_tetrahedron; t < edit.end_tetrahedron; ++t) quarter += list().elements[at(solid_.whole_of(t, b))].mass() / 4;
    Scalar const mass = is_reweighed_ ? quarter * std::min(this->mass(a) / lumped_mass(a), this->mass(b) / lumped_mass(b)) : quarter;
    this->add_particle((1 - s) * this->rest_position(a) + s * this->rest_position(b), Scalar(0), this->nailed(a) && this->nailed(b));
    int const n = edit.vertex;
    exchange_.add_particle(), exchange_.set_parents(std::array{a, b}, std::array{1 - s, s});
    this->move_mass(a, n, (1 - s) * mass), this->move_mass(b, n, s * mass);
    for (int t = edit.first_tetrahedron; t < edit.end_tetrahedron; ++t) {
      int const whole = solid_.whole_of(t, b);
      Element const old = list().elements[at(whole)];
      this->template add_element<Element>(topology().corners(t), same_material(t, old));
      this->replace_element(whole, topology().corners(whole), same_material(whole, old));
      log_.add(whole);
      group_.push_back(group_[at(whole)]);
      if constexpr (remembers) history_.push_back(PronyHistory<Scalar>(history_[at(whole)]));
    }
    this->rename_neighbour(a, b, n), this->rename_neighbour(b, a, n);
    edited_.push_back(n);
    topology().for_each_neighbour(n, [&](int i) {
      this->add_neighbour(n, i), edited_.push_back(i);
      if (i != a && i != b) this->add_neighbour(i, n);
    });
    this->count_edit();
    return edit;
  }

  /// Gives some of the tetrahedra at a particle a copy of it as their corner, with their share of its mass. Faces between those and the others open; they
  /// are wounds. Throws as TetrahedralTopology does.
  TopologyEdit split_vertex(int p, std::span<int const> some) {
    begin_edit();
    TopologyEdit const edit = solid_.split_vertex(p, some);
    Scalar const all = lumped_mass(p);
    Scalar share = 0;
    for (int const t : some) share += list().elements[at(t)].mass() / 4;
    this->add_particle(this->rest_position(p), Scalar(0), this->nailed(p));
    exchange_.add_particle(), exchange_.set_copy_of(p);
    this->move_mass(p, edit.vertex, share / all * this->mass(p));
    for (int const t : topology().tetrahedra_at(edit.vertex)) this->template rename_node<Element>(t, p, edit.vertex), log_.add(t);
    auto const left = topology().tetrahedra_at(p);
    log_.add(left.front());   // p has another mass
    topology().for_each_neighbour(edit.vertex, [&](int i) {
      if (std::ranges::any_of(left, [&](int t) { return topology().corner_of(t, i) >= 0; }))
        this->add_neighbour(i, edit.vertex);
      else
        this->remove_neighbour(p, i), this->rename_neighbour(i, p, edit.vertex);
      this->add_neighbour(edit.vertex, i);
    });
    edited_.push_back(p), edited_.push_back(edit.vertex);   // of the others no tetrahedron has changed
    this->count_edit();
    return edit;
  }

  /// Takes a tetrahedron away with its share of its corners' masses; the last one gets its number. Faces where it had neighbours are wounds. A particle
  /// that no tetrahedron holds any more keeps its number: it weighs nothing and is nailed. Throws OutOfRange, and InvalidArgument for the only one.
  TetrahedronRemoval remove_tetrahedron(int tetrahedron) {
    detail::check_index("tetrahedron", tetrahedron, tetrahedra());
    if (tetrahedra() == 1) throw InvalidArgument("remove_tetrahedron: it is the only one; a solid has at least one tetrahedron");
    begin_edit();
    auto const corners = list().nodes[at(tetrahedron)];
    std::array<Scalar, 4> before;
    for (int k = 0; k < 4; ++k) before[at(k)] = lumped_mass(corners[at(k)]);
    TetrahedronRemoval const removal = solid_.remove_tetrahedron(tetrahedron);
    this->template remove_element<Element>(tetrahedron);
    group_[at(tetrahedron)] = group_.back(), group_.pop_back();
    if constexpr (remembers) history_[at(tetrahedron)] = history_.back(), history_.pop_back();
    for (int k = 0; k < 4; ++k) this->lighten(corners[at(k)], elements_at(corners[at(k)]).empty() ? Scalar(0) : lumped_mass(corners[at(k)]) / before[at(k)]);
    for (int const corner : corners) this->find_neighbours_of(corner);
    edited_.insert(edited_.end(), corners.begin(), corners.end());
    log_.forget_all();   // numbers have changed
    this->count_edit();
    return removal;
  }

  /// After edits, before anything else is asked: row bounds, and with nodal pressure stars.
  void finish_edits() {
    if (edited_.empty()) return;
    keep_once(edited_);
    if (stars_.empty())
      for (int const i : edited_) this->take_bounds_of(i);
    else if (log_.knows(starred_))
      follow_stars();
    else
      find_stars();
    edited_.clear();
  }

  /// Lets a particle that a cut has left with little mass for how stiff it is held have some of those it lies between, and of its copies; see MassSpring::even_mass.
  template <class Moved>
  void even_mass(int particle, Moved const& moved) {
    exchange_.relieve(*this, particle, 4 * fastest_, [&](int from, int to, Scalar amount) {
      this->move_mass(from, to, amount);
      moved(from, to, amount / this->mass(to));
      is_reweighed_ = true;
      bool const followed = starred_ == log_.end();
      log_.add(elements_at(from).front()), log_.add(elements_at(to).front());   // these have other masses, and stars are what they were
      if (followed) starred_ = log_.end();
      this->count_edit();
    });
  }

  /// Memory for a body that cuts have made so large.
  void reserve(int particles, int triangles) {
    int const more = particles - this->size();
    if (more <= 0) return;
    int const elements = tetrahedra() + 6 * more;
    solid_.reserve(particles, elements, triangles), exchange_.reserve(particles), log_.reserve(2 * at(elements) + 20 * at(more)), reserve_and_prefault(group_, at(elements));
    this->template reserve_edits<Element>(particles, elements);
    if constexpr (remembers) history_.reserve(at(elements));
    if (stars_.empty()) return;
    stars_.reserve(at(elements), at(more)), star_neighbours_.reserve(at(particles), at(elements)), found_.reserve(at(elements));
  }

  /// A step of h seconds has ended at x: what the tetrahedra remember is moved on, of all of them.
  template <class X>
  void remember(X const& x, Scalar h) noexcept
    requires remembers
  {
    PronyStep<Scalar> step(h);
    this->template visit_elements<Element>([&](Element& element, auto const& nodes, std::size_t e) {
      element.law().faded = history_[e].advance(element.law(), element.deformation_gradient(gather(nodes, x)), step);
    });
  }
  /// As if it had always been at rest.
  void forget() noexcept
    requires remembers
  {
    std::fill(history_.begin(), history_.end(), PronyHistory<Scalar>{});
    this->template visit_elements<Element>([](Element& element, auto const&, std::size_t) { element.law().faded = {}; });
  }

  void assemble(std::span<int const> moving, Assembly& assembly) const { assembly.build(*this, moving); }
  void follow_edits(std::span<int const> moving, Assembly& assembly) const { assembly.follow(*this, moving); }

  /// The lowest J = det F at x, and of which tetrahedron: at 0 it is flat, below it is turned over.
  template <class X>
  detail::LowestDeterminant<Scalar> lowest_determinant(X const& x) const noexcept {
    detail::LowestDeterminant<Scalar> found;
    for (int e = 0; e < tetrahedra(); ++e)
      if (Scalar const J = volume(e, x) / list().elements[at(e)].volume(); !(J >= found.value)) found = {e, J};
    return found;
  }

  /// σ = P Fᵀ / J of a tetrahedron at x [Pa], symmetric; with nodal pressure that of the stars at its corners. Of one that is flat it is not finite.
  template <class X>
  Tensor3<Scalar> cauchy_stress(int t, X const& x) const {
    detail::check_index("tetrahedron", t, tetrahedra());
    Tensor3<Scalar> stress{};
    with_pressure(t, mean(t, x), [&](auto const& element) {
      Tensor3<Scalar> const F = element.deformation_gradient(gather(list().nodes[at(t)], x));
      stress = (1 / determinant(F, cofactor(F))) * (element.law().stress(F) * transpose(F));
    });
    return stress;
  }
  /// The elastic energy that a tetrahedron holds at x [J]; of a star's energy its share by volume: all together they are potential_energy(x).
  template <class X>
  Scalar strain_energy(int t, X const& x) const {
    detail::check_index("tetrahedron", t, tetrahedra());
    Scalar energy = 0;
    with_pressure(t, Scalar(0), [&](auto const& element) { energy = element.energy(gather(list().nodes[at(t)], x)); });
    if (!stars_.empty())
      for (int const s : stars_.at_corners(t)) {
        Scalar const p = pressure(s, x);
        energy += p * p / (8 * stars_.bulk_modulus(s)) * list().elements[at(t)].volume();
      }
    return energy;
  }

  // --- as ElementSums has them, with nodal pressure and damping ---------------------------------------------------------
  template <class Visit>
  void for_each_neighbour(int i, Visit visit) const {
    if (stars_.empty()) return Base::for_each_neighbour(i, visit);
    for (int const other : star_neighbours_.of(i)) visit(other);
  }
  template <class X, class V>
  Vector3<Scalar> internal_force(int i, X const& x, V const& v) const noexcept {
    Known pressures, rates;
    Vector3<Scalar> const drag = damping_.alpha * this->mass(i) * v.col(i);
    return detail::TetrahedronPacks<Scalar, typename Law::type>::force_at(
        i, elements_at(i), list(), x, v, damping_.beta, !stars_.empty(), [&](int e) { return mean(e, pressures, [&](int s) { return pressure(s, x); }); },
        [&](int e) { return mean(e, rates, [&](int s) { return pressure_change(s, x, v); }); }) - drag;
  }
  template <class X>
  Scalar potential_energy(X const& x) const {
    Scalar sum = 0;
    for (int e = 0; e < tetrahedra(); ++e)
      with_pressure(e, Scalar(0), [&](auto const& element) { sum += element.energy(gather(list().nodes[at(e)], x)); });
    for (int s = 0; s < stars_.size(); ++s) {
      Scalar const p = pressure(s, x);
      sum += p * p / (8 * stars_.bulk_modulus(s)) * stars_.volume(s);
    }
    return sum;
  }
  template <class X, class D, class Y>
  void add_stiffness_product(X const& x, D const& d, Y& y) const noexcept {
    add_product(Scalar(1), x, d, y);
  }
  template <class X, class D, class Y>
  void add_damping_product(X const& x, D const& v, Y& y) const noexcept {
    if (damping_.alpha != 0)
      for (int i = 0; i < this->size(); ++i) y.col(i) += damping_.alpha * this->mass(i) * v.col(i);
    if (damping_.beta != 0) add_product(damping_.beta, x, v, y);
  }
  template <class X, class Visit>
  void for_each_stiffness_block(X const& x, Visit visit) const {
    for (int e = 0; e < tetrahedra(); ++e) {
      auto const& nodes = list().nodes[at(e)];
      with_pressure(e, mean(e, x), [&](auto const& element) {
        auto const stiffness = element.semidefinite_stiffness(gather(nodes, x));
        for (int a = 0; a < 4; ++a)
          for (int b = 0; b < 4; ++b) visit(nodes[at(a)], nodes[at(b)], Matrix<Scalar, 3, 3>(stiffness.template block<3, 3>(3 * a, 3 * b)));
      });
    }
    for (int s = 0; s < stars_.size(); ++s) {
      Gradient const gradient(*this, s, x);
      for (int a = 0; a < gradient.count; ++a)
        for (int b = 0; b < gradient.count; ++b)
          visit(gradient.node[at(a)], gradient.node[at(b)], Matrix<Scalar, 3, 3>(stars_.stiffness(s) * gradient.of[at(a)] * gradient.of[at(b)].transpose()));
    }
  }
  Scalar stiffness_bound(int i) const noexcept { return stars_.empty() ? Base::stiffness_bound(i) : star_neighbours_.stiffness_bound(i); }
  /// Allocates with nodal pressure.
  template <class X>
  Scalar stiffness_bound(int i, X const& x) const {
    return bound_at(i, x, [](auto const& element, auto const& at_nodes) { return element.stiffness(at_nodes); });
  }
  Scalar damping_bound(int i) const noexcept { return damping_.alpha * this->mass(i) + damping_.beta * stiffness_bound(i); }
  /// Allocates with nodal pressure.
  template <class X>
  Scalar damping_bound(int i, X const& x) const {
    Scalar const of_mass = damping_.alpha * this->mass(i);
    if (!(damping_.beta > 0)) return of_mass;
    return of_mass + damping_.beta * bound_at(i, x, [](auto const& element, auto const& at_nodes) { return element.semidefinite_stiffness(at_nodes); });
  }

 protected:
  static void keep_once(std::vector<int>& all) {
    std::sort(all.begin(), all.end());
    all.erase(std::unique(all.begin(), all.end()), all.end());
  }

 private:
  using Base::at;

  /// Σ_j of the norms of what stiffness_of(element, x) has in the row of particle i.
  template <class X, class StiffnessOf>
  Scalar bound_at(int i, X const& x, StiffnessOf const& stiffness_of) const {
    Scalar sum = 0;
    Known pressures, done;
    for (int const e : elements_at(i)) {
      auto const& nodes = list().nodes[at(e)];
      auto const add = [&](auto const& element) {
        auto const stiffness = stiffness_of(element, gather(nodes, x));
        for (int k = 0; k < 4; ++k)
          if (nodes[at(k)] == i) sum += detail::row_norm<Scalar, 12>(stiffness, k);
      };
      if (stars_.empty()) {
        add(list().elements[at(e)]);
        continue;
      }
      with_pressure(e, mean(e, pressures, [&](int s) { return pressure(s, x); }), add);
      for (int const s : stars_.at_corners(e)) done.of(s, [&](int star) { return sum += star_bound(star, i, x), Scalar(0); });
    }
    return sum;
  }

  static Element element(Columns const& rest, typename Law::type const& law, Scalar density, Scalar prestrain) {
    Scalar const length = 1 - prestrain;
    return Element(length * rest, law, density / (length * length * length));
  }
  static ElementList<Element> make_list(TetrahedralMesh<Scalar> const& mesh, Options const& options) {
    require_valid(mesh);
    auto const law = Law::of(options.material);
    detail::require_density("the density", options.density);
    detail::require_non_negative("the drag alpha", options.damping.alpha, "1/s");
    detail::require_non_negative("the damping beta", options.damping.beta, "s");
    if (!(options.prestrain >= 0 && options.prestrain < 1)) throw InvalidArgument(detail::message("the pre-strain is ", options.prestrain, "; give one from 0 to below 1"));
    return make_elements(mesh.points, mesh.tetrahedra, [&](auto const& rest) { return element(rest, law, options.density, options.prestrain); });
  }

  /// What is asked of the few stars round a particle, found once.
  struct Known {
    static constexpr int most = 64;
    std::array<int, std::size_t{most}> star;
    std::array<Scalar, std::size_t{most}> value;
    int count = 0;
    template <class Find>
    Scalar of(int s, Find const& find) {
      for (int k = 0; k < count; ++k)
        if (star[at(k)] == s) return value[at(k)];
      Scalar const found = find(s);
      if (count < most) star[at(count)] = s, value[at(count++)] = found;
      return found;
    }
  };
  /// V ∂J̄/∂x of a star, node by node; of more nodes than there is room for some come twice, which bounds and blocks allow.
  struct Gradient {
    std::vector<int> node;
    std::vector<Vector3<Scalar>> of;
    int count = 0;
    template <class X>
    Gradient(FiniteElements const& tissue, int star, X const& x) {
      for (int const e : tissue.stars_.elements(star)) {
        auto const& nodes = tissue.list().nodes[at(e)];
        Columns const grows = tissue.list().elements[at(e)].volume_gradient(gather(nodes, x));
        for (int k = 0; k < 4; ++k) {
          auto const place = std::find(node.begin(), node.end(), nodes[at(k)]);
          if (place == node.end())
            node.push_back(nodes[at(k)]), of.push_back(grows.col(k)), ++count;
          else
            of[static_cast<std::size_t>(place - node.begin())] += grows.col(k);
        }
      }
    }
  };

  template <class X>
  static Columns gather(std::array<int, 4> const& nodes, X const& x) noexcept {
    Columns all;
    for (int k = 0; k < 4; ++k) all.col(k) = x.col(nodes[at(k)]);
    return all;
  }
  template <class X>
  Scalar volume(int e, X const& x) const noexcept {
    return list().elements[at(e)].volume(gather(list().nodes[at(e)], x));
  }
  /// κ (J̄ − 1) of a star [Pa].
  template <class X>
  Scalar pressure(int s, X const& x) const noexcept {
    if (stars_.elements(s).empty()) return 0;
    Scalar sum = 0;
    for (int const e : stars_.elements(s)) sum += volume(e, x);
    return stars_.bulk_modulus(s) * (sum / stars_.volume(s) - 1);
  }
  /// Its change with a change d of x.
  template <class X, class D>
  Scalar pressure_change(int s, X const& x, D const& d) const noexcept {
    Scalar sum = 0;
    for (int const e : stars_.elements(s)) {
      auto const& nodes = list().nodes[at(e)];
      sum += list().elements[at(e)].volume_gradient(gather(nodes, x)).cwiseProduct(gather(nodes, d)).sum();
    }
    return stars_.bulk_modulus(s) / stars_.volume(s) * sum;
  }
  /// Of the stars at the corners of a tetrahedron.
  template <class Find>
  Scalar mean(int e, Known& known, Find const& find) const noexcept {
    if (stars_.empty()) return 0;
    Scalar sum = 0;
    for (int const s : stars_.at_corners(e)) sum += known.of(s, find);
    return sum / 4;
  }
  template <class X>
  Scalar mean(int e, X const& x) const noexcept {
    Known none;
    return mean(e, none, [&](int s) { return pressure(s, x); });
  }
  template <class Use>
  void with_pressure(int e, Scalar p, Use const& use) const {
    Element const& element = list().elements[at(e)];
    if constexpr (can_average) {
      if (!stars_.empty()) {
        use(element.with_law(WithPressure<Scalar, typename Law::type>{element.law(), element.law().bulk_modulus(), p}));
        return;
      }
    }
    use(element);
  }
  template <class X, class D, class Y>
  void add_product(Scalar factor, X const& x, D const& d, Y& y) const noexcept {
    for (int e = 0; e < tetrahedra(); ++e) {
      auto const& nodes = list().nodes[at(e)];
      Columns const here = gather(nodes, x);
      with_pressure(e, mean(e, x), [&](auto const& element) {
        Columns product = factor * element.stiffness_product(here, gather(nodes, d));
        if (!stars_.empty()) {
          Known none;
          product += factor * mean(e, none, [&](int s) { return pressure_change(s, x, d); }) * element.volume_gradient(here);
        }
        for (int k = 0; k < 4; ++k) y.col(nodes[at(k)]) += product.col(k);
      });
    }
  }
  /// Σ_j ‖K_ij‖ of what a star adds.
  template <class X>
  Scalar star_bound(int s, int i, X const& x) const {
    Gradient const gradient(*this, s, x);
    Scalar own = 0, all = 0;
    for (int k = 0; k < gradient.count; ++k) {
      Scalar const size = gradient.of[at(k)].norm();
      all += size;
      if (gradient.node[at(k)] == i) own = size;
    }
    return stars_.stiffness(s) * own * all;
  }

  Scalar lumped_mass(int i) const noexcept {
    Scalar sum = 0;
    for (int const e : elements_at(i)) sum += list().elements[at(e)].mass() / 4;
    return sum;
  }
  Element same_material(int t, Element const& old) const {
    Columns rest;
    for (int k = 0; k < 4; ++k) rest.col(k) = (1 - prestrain_) * this->rest_position(topology().corners(t)[at(k)]);
    return Element(rest, old.law(), old.density());
  }
  void begin_edit() noexcept {
    if (!edited_.empty()) return;
    log_.trim(2 * at(tetrahedra()));
    is_edited_ = true;
    if (fastest_ > 0) return;
    for (int i = 0; i < this->size(); ++i)
      if (!this->nailed(i)) fastest_ = std::max(fastest_, stiffness_bound(i) / this->mass(i));
  }

  template <class Density>
  void give_material(std::span<int const> some, M const& material, Density const& density) {
    auto const law = Law::of(material);
    int const group = 1 + *std::max_element(group_.begin(), group_.end());
    for (int const t : some) group_[static_cast<std::size_t>(t)] = group;
    if constexpr (remembers)
      for (int const t : some) history_[static_cast<std::size_t>(t)] = {};
    this->template change_elements<Element>(some, [&](auto const& rest, Element const& old) { return element(rest, law, density(old), prestrain_); });
    log_.forget_all();
    if (!is_edited_) fastest_ = 0;
    find_stars();
  }
  /// Whatever is remembered by now.
  static auto law_at_rest(typename Law::type const& law) noexcept {
    if constexpr (remembers)
      return law.tangent_law();
    else
      return law;
  }
  void find_stars() {
    stars_ = {}, star_neighbours_ = {}, starred_ = log_.end();
    follow_stars();
  }
  /// Stars of what was edited since they followed last, or is new, and what hangs on them.
  void follow_stars() {
    if constexpr (can_average) {
      if (!averages_) return;
      auto const edits = log_.since(starred_);
      std::vector<int>& some = found_;
      some.assign(edits.begin(), edits.end());
      for (int e = stars_.elements_known(); e < tetrahedra(); ++e) some.push_back(e);
      keep_once(some);
      starred_ = log_.end();
      auto const& all = list().elements;
      auto const at_particle = [this](int i) { return elements_at(i); };
      auto const changed = stars_.follow(
          some, list().nodes, at_particle, [&](int e) { return all[at(e)].volume(); }, [this](int e) { return group_[at(e)]; }, [&](int e) { return all[at(e)].law().bulk_modulus(); });
      auto const rest = this->rest_positions();
      Scalar const stretch = 1 / (1 - prestrain_), growth = stretch * stretch * stretch - 1;   // J − 1 at rest
      auto const block_norms = [&](int e) {
        auto const law = law_at_rest(all[at(e)].law());
        WithPressure<Scalar, std::remove_const_t<decltype(law)>> const pressed{law, law.bulk_modulus(), growth * law.bulk_modulus()};
        return detail::block_norms_at_rest(all[at(e)].with_law(pressed), gather(list().nodes[at(e)], rest));
      };
      star_neighbours_.follow(some, changed, stars_, list().nodes, this->size(), at_particle, block_norms,
                              [&](int e) { return all[at(e)].volume_gradient(gather(list().nodes[at(e)], rest)); });
    }
  }

  RayleighDamping<Scalar> damping_;
  Scalar prestrain_;
  bool assembles_;
  std::vector<PronyHistory<Scalar>> history_;   // of each tetrahedron, where the law remembers
  bool averages_ = false;
  std::vector<int> group_;   // of each tetrahedron: those of one share a material
  CutSolid solid_;
  MassExchange<Scalar> exchange_;
  bool is_edited_ = false;
  Scalar fastest_ = 0;   // 1/s², the largest stiffness bound over mass before the first edit; 0: not known
  bool is_reweighed_ = false;   // particles may have other masses than their tetrahedra give them
  std::vector<int> edited_;   // particles whose row bounds are to be found anew
  EditLog log_;
  PressureStars<Scalar> stars_;
  std::size_t starred_ = 0;   // of the edits: the stars have followed so far
  std::vector<int> found_;   // while they follow
  StarNeighbours<Scalar> star_neighbours_;
};

/// Of what is no material: what is wrong, in a sentence for each member, and nothing that could fail besides.
template <RealScalar Scalar, class M>
class FiniteElements : detail::MaterialSentences<M, Scalar> {
 public:
  using Refused = void;
  explicit FiniteElements(auto&&...) {}
};

template <RealScalar Scalar, class M>
FiniteElements(TetrahedralMesh<Scalar> const&, SolidOptions<Scalar, M> const&) -> FiniteElements<Scalar, M>;

}  // namespace palpate
