// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/columns.hpp>
#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/material/isotropic.hpp>
#include <palpate/mesh/triangle_mesh.hpp>
#include <palpate/tissue/long_elements/column_frame.hpp>
#include <palpate/tissue/long_elements/factored_matrix.hpp>
#include <palpate/tissue/skin_body.hpp>

#include <Eigen/Geometry>
#include <Eigen/SparseCore>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <utility>
#include <vector>

namespace palpate {

/// What a body of long elements is made of.
template <RealScalar Scalar>
struct LongElementsOptions {
  Scalar spacing{};                    ///< of columns that are next to each other, about [m]
  Scalar young{};                      ///< Young's modulus of the body [Pa]
  Scalar surface_tension = 0;          ///< N/m
  Scalar density = 1000;               ///< of the fluid [kg/m³]; 0: it has no weight
  Scalar return_time = Scalar(0.01);   ///< τ [s]: the columns' viscosity, as a share of their stiffness; 0: each step is at rest
  int iterations = 1;                  ///< of a step, each with lengths, areas and volume where the body is then
  void validate() const;
};

/// A closed skin filled with a fluid that does not give way, held by elastic columns in three directions: static, no masses. A body of its own, for a Simulator
/// and its tools as a SoftBody is.
///
///   LongElements body(make_organ<double>({.vertices = 2000}), {.spacing = 0.01, .young = 5000.0});
///   body.nail(0);
///   body.apply_force(body.nearest_vertex(tip), force);   // N, for the next step
///   body.step(1e-3);                                     // s
///
/// Columns    lines along x, y and z through the skin, one in each cell of a grid; a column of length L becomes e longer. Both ends move by e/2, or one
///            by all of e where the other end is nailed. What is beside a column moves as its place between the two ends says, weighted over the
///            four columns around: so each vertex follows columns of all three directions, u = W e.
/// Model      Σ a_i (2/3 E) L_i ln²(1 + e_i/L_i)/2 + σ/2 Σ (w_i − w_j)² is least under pressure, gravity and applied forces: w is how far the ends of two
///            columns next to each other have moved, a_i = ∂V/∂e_i the area that a column carries. The volume V inside the skin is kept: the
///            multiplier is the pressure. On the skin acts p + ρ g·x, exactly over each triangle, where it is now. 2/3: a block that is pressed along one
///            axis and widens along the two others has Young's modulus E.
/// Solution   bordered by one row for the pressure: K Δe − a p = r, a·Δe = V₀ − V, with a sparse factorisation K = L D Lᵀ by Eigen. step() keeps that of
///            the rest shape, made when nails change, and divides by what columns have become stiffer; solve_statics() makes it anew until nothing
///            changes.
/// Units      m, N, Pa, kg/m³, s. Pressures are above the atmosphere's.
/// Errors     InvalidArgument for options, InvalidMesh for a skin that is open, or turned inside out; OutOfRange for an index; the body stays as it was. A
///            step after which something is not finite is not taken: it reports that it diverged.
/// Source     \cite costa2001: P = P_atm + stress + ρ g h, equal over elements; volume; surface tension; one linear system. Ours: the factor 2/3, areas
///            from the skin, logarithmic strain (a column never vanishes), the time law K e + τ K ė of a step, and that a column longer than
///            twice its length pulls on along the tangent: ln λ/λ has a maximum at e, beyond which nothing would hold it.
/// Cost       a step O(triangles + numbers of the factor), three solutions. Only making the factorisation allocates: the constructor, and the first step
///            after nails.
/// Limits     the body as a whole neither moves nor turns: forces on it that do not balance are held by nothing that is shown. Columns shear freely but for
///            surface tension. What is thinner than the spacing may have no column: uncovered() counts vertices that then move less. Nothing is cut.
template <RealScalar ScalarType>
class LongElements : public SkinBody<ScalarType> {
  using Base = SkinBody<ScalarType>;

 public:
  using Scalar = ScalarType;
  using Vector = Vector3<Scalar>;
  using Options = LongElementsOptions<Scalar>;
  using Numbers = Matrix<Scalar, Dynamic, 1>;
  using Base::size;

  struct Report {
    bool diverged = false;       ///< the step was not taken, and its forces are dropped
    bool at_rest = false;        ///< of solve_statics(): nothing changes any more
    int moving = 0;              ///< vertices
    int iterations = 0;
    Scalar volume_error = 0;     ///< V/V₀ − 1 before the last iteration
    explicit operator bool() const noexcept { return !diverged; }
  };

  LongElements(TriangleMesh<Scalar> const& mesh, Options const& options) : Base(mesh, {.closed = true}), options_(options) {
    options.validate();
    frame_ = detail::ColumnFrame<Scalar>(mesh, options.spacing);
    e_ = Numbers::Zero(columns());
    load_.resize(size());
    auto const [low, high] = low_and_high(mesh.points);
    centre_ = (low + high) / 2;
    volume_ = measure(this->positions());
    prepare();
  }

  Options const& options() const noexcept { return options_; }
  int columns() const noexcept { return frame_.size(); }
  /// How much longer a column is than at rest [m]; those along x come first, then y and z.
  Scalar elongation(int column) const { return (detail::check_index("column", column, columns()), e_[column]); }
  Scalar column_length(int column) const { return (detail::check_index("column", column, columns()), frame_.length(column)); }   // m, at rest
  Scalar column_area(int column) const { return (detail::check_index("column", column, columns()), frame_.area(column)); }       // m²
  /// Vertices with no column near in one direction at least, along which they stay.
  int uncovered() const noexcept { return frame_.uncovered(); }

  Scalar volume() const noexcept { return static_cast<Scalar>(measure(this->positions())); }   // m³, inside the skin
  Scalar kept_volume() const noexcept { return static_cast<Scalar>(volume_); }
  /// Pumps fluid in or out, over the next steps.
  void set_kept_volume(Scalar volume) {
    detail::require_positive("the volume to keep", volume, "m³");
    volume_ = static_cast<double>(volume), is_measured_ = false;
  }
  /// Of the fluid at a place, above the atmosphere's [Pa].
  Scalar pressure_at(Vector const& place) const noexcept { return pressure_ + options_.density * gravity_.dot(place - centre_); }
  Vector const& gravity() const noexcept { return gravity_; }
  void set_gravity(Vector const& gravity) {
    detail::require_finite("gravity", gravity, "m/s²");
    gravity_ = gravity, is_measured_ = false;
  }
  /// Of columns and surface tension [J].
  Scalar elastic_energy() const {
    Scalar sum = e_.dot(tension_ * e_) / 2;
    for (int i = 0; i < columns(); ++i) {
      Scalar const longer = e_[i] / frame_.length(i), inside = std::min(longer, far - 1), beyond = longer - inside, strain = std::log1p(inside);
      sum += modulus() * frame_.area(i) * frame_.length(i) * (strain * strain / 2 + beyond * (strain + (1 - strain) * beyond / (2 * far)) / far);
    }
    return sum;
  }

  /// A nailed vertex stays where it rests, and so does the end of a column in a triangle that is held by its nails.
  void nail(int i) {
    this->check(i);
    this->mark_nailed(i);
    is_prepared_ = false;
  }

  /// Adds a force on the tissue [N]: constant over the next step, consumed by it.
  void apply_force(int i, Vector const& force) {
    this->check(i), this->check_force(i, force);
    load_[i] += force;
    is_loaded_ = true, is_pulled_ = false, free_step_ = 0;
  }
  Report step(Scalar h) {
    this->check_step(h);
    prepare();
    Report report{.moving = size()};
    pull();
    for (int k = 0; h > 0 && k < options_.iterations && !report.diverged; ++k) advance(h, share_of(h), report);
    clear_loads();
    return report;
  }
  /// Moves all to where they would come to rest if the forces applied so far stayed, and consumes these. Allocates.
  Report solve_statics(int most = 500) {
    prepare();
    Report report{.moving = size()};
    Numbers const forces = frame_.weights().transpose() * load_.view().reshaped();
    constexpr Scalar exact = std::max(Scalar(1e-13), 20 * std::numeric_limits<Scalar>::epsilon());
    for (int k = 0; k < most && !report.diverged && !report.at_rest; ++k) {
      if (!factorise(stiffness_now())) break;
      is_measured_ = false;
      pulled_ = forces;
      factor_.solve(pulled_);
      Scalar const moved = advance(0, Scalar(1), report);
      report.at_rest = moved <= exact * this->home_diagonal() && std::abs(report.volume_error) <= exact;
    }
    for (int i = 0; i < size(); ++i) this->displace(i, Vector(this->displacement(i)), Vector::Zero());
    factorise(stiffness_), is_measured_ = false;
    clear_loads();
    return report;
  }

  /// The change of velocity over h [m/s²] to the mean of the next step of h seconds, with the forces applied so far.
  Vector predicted_acceleration(int i, Scalar h) const noexcept {
    if (!(h > 0) || this->tissue().nailed(i) || !is_prepared_) return Vector::Zero();
    free_move(h);
    Vector moved;
    for (int c = 0; c < 3; ++c) moved[c] = row_product(3 * i + c, free_);
    return (moved / h - this->velocities().col(i)) / h;
  }
  /// What a force on vertex j adds to that of i by the newton: 1/kg, of the three directions together, so that it is more than of any. See StatesMobility.
  Scalar mobility(int i, int j, Scalar h) const noexcept {
    if (!(h > 0) || !is_prepared_) return 0;
    look();
    Numbers const& moved = response_to(i);
    return share_of(h) / (h * h) * (row_product(3 * j, moved) + row_product(3 * j + 1, moved) + row_product(3 * j + 2, moved));
  }

  /// Everything that makes the body's future.
  struct State {
    typename Base::SkinState skin;
    Numbers elongations;
    Matrix3X<Scalar> velocities, load;
    Vector gravity;
    Scalar pressure;
    double volume;
    bool is_loaded;
  };
  State save() const { return {this->save_skin(), e_, this->velocities(), load_.view(), gravity_, pressure_, volume_, is_loaded_}; }
  void restore(State const& state) {
    this->require_own(state.skin);
    if (state.elongations.size() != e_.size())
      throw InvalidArgument(detail::message("LongElements: a state of ", state.elongations.size(), " columns can not be restored in a body of ", e_.size(), "; it is another body's"));
    this->restore_skin(state.skin);
    e_ = state.elongations, gravity_ = state.gravity, pressure_ = state.pressure, volume_ = state.volume, is_loaded_ = state.is_loaded;
    load_ = Columns<Scalar, 3>(state.load);
    is_prepared_ = false;
    prepare();
    moved_.noalias() = frame_.weights() * e_;
    for (int i = 0; i < size(); ++i) this->displace(i, moved_.template segment<3>(3 * i), state.velocities.col(i));
  }
  /// All at rest, no force waits. Nails, gravity and volume stay.
  void reset() noexcept {
    e_.setZero(), pressure_ = 0;
    clear_loads();
    for (int i = 0; i < size(); ++i) this->displace(i, Vector::Zero(), Vector::Zero());
    is_measured_ = false;
  }

 private:
  using Base::at;
  using Sparse = Eigen::SparseMatrix<Scalar>;

  static constexpr Scalar far = 2;   // a column that is longer than so many times its length pulls along the tangent: ln λ/λ has a maximum at e, beyond which nothing would hold it
  Scalar modulus() const noexcept { return options_.young * 2 / 3; }
  void clear_loads() noexcept {
    load_.view().setZero();
    pulled_.setZero(), is_loaded_ = false, free_step_ = 0;
  }
  /// Of the way to where all would come to rest, how much is gone in h seconds: less where columns have become stiffer.
  Scalar share_of(Scalar h) const noexcept { return h / (h + options_.return_time) / stiffer_; }

  /// V and where wanted its gradient ∂V/∂x and what gravity does to the skin [N], 3 × size().
  template <class X>
  double measure(X const& x, Numbers* gradient = nullptr, Numbers* weight = nullptr) const noexcept {
    double six_volumes = 0;
    if (gradient != nullptr) gradient->setZero(), weight->setZero();
    for (int t = 0; t < this->tissue().surface().triangle_count(); ++t) {
      auto const corner = this->tissue().surface().corners(t);
      Vector const a = x.col(corner[0]) - centre_, b = x.col(corner[1]) - centre_, c = x.col(corner[2]) - centre_;
      Vector3<double> const normal = Vector(b - a).template cast<double>().cross(Vector(c - a).template cast<double>());
      six_volumes += normal.dot(a.template cast<double>());
      if (gradient == nullptr) continue;
      Vector const sixth = (normal / 6).template cast<Scalar>();
      Scalar const heads[] = {gravity_.dot(a), gravity_.dot(b), gravity_.dot(c)}, all = heads[0] + heads[1] + heads[2];
      for (std::size_t k = 0; k < 3; ++k) {
        gradient->template segment<3>(3 * corner[k]) += sixth;
        weight->template segment<3>(3 * corner[k]) += options_.density / 4 * (all + heads[k]) * sixth;
      }
    }
    return six_volumes / 6;
  }

  /// What the next step starts from, whatever forces there are: y = K⁻¹ r without pressure, z = K⁻¹ a.
  void look() const noexcept {
    if (is_measured_) return;
    now_volume_ = measure(this->positions(), &gradient_, &heavy_);
    a_.noalias() = frame_.weights().transpose() * gradient_;
    y_.noalias() = frame_.weights().transpose() * heavy_;
    if (options_.surface_tension > 0) y_.noalias() -= tension_ * e_;
    stiffer_ = 1;
    for (int i = 0; i < columns(); ++i) {
      if (frame_.is_fixed(i)) {
        y_[i] = -e_[i];
        continue;
      }
      Scalar const longer = 1 + e_[i] / frame_.length(i), stretch = std::min(longer, far), strain = std::log(stretch);
      y_[i] -= modulus() * frame_.area(i) * (strain + (longer - stretch) * (1 - strain) / stretch) / stretch;
      stiffer_ = std::max(stiffer_, (1 - strain) / (stretch * stretch));
    }
    z_ = a_;
    factor_.solve(y_), factor_.solve(z_);
    is_measured_ = true, free_step_ = 0;
  }
  Scalar pressure_for(Numbers const& y, Scalar share) const noexcept {
    Scalar const give = a_.dot(z_);
    return give > 0 ? (static_cast<Scalar>(volume_ - now_volume_) / share - a_.dot(y)) / give : Scalar(0);
  }
  /// K⁻¹ of the forces applied so far.
  void pull() const noexcept {
    if (std::exchange(is_pulled_, true) || !is_loaded_) return;
    pulled_.noalias() = frame_.weights().transpose() * load_.view().reshaped();
    factor_.solve(pulled_);
  }
  void free_move(Scalar h) const noexcept {
    look();
    if (free_step_ == h) return;
    Scalar const share = share_of(h);
    pull();
    free_ = y_ + pulled_;
    free_ = share * (free_ + pressure_for(free_, share) * z_);
    free_step_ = h;
  }

  /// One iteration; returns how far a vertex moved at most.
  Scalar advance(Scalar h, Scalar share, Report& report) noexcept {
    look();
    if (h > 0) share = share_of(h);
    report.volume_error = static_cast<Scalar>(now_volume_ / volume_ - 1);
    ++report.iterations;
    y_ += pulled_;
    Scalar const pressure = pressure_for(y_, share);
    change_ = share * (y_ + pressure * z_);
    Scalar most = 1;   // no column loses more than half its length at once
    for (int i = 0; i < columns(); ++i)
      if (Scalar const now = frame_.length(i) + e_[i]; -change_[i] * most > now / 2) most = now / (-2 * change_[i]);
    change_ *= most;
    moved_.noalias() = frame_.weights() * change_;
    is_measured_ = false;
    Scalar const farthest = moved_.size() > 0 ? moved_.template lpNorm<Eigen::Infinity>() : Scalar(0);
    if (!std::isfinite(pressure) || !std::isfinite(moved_.sum()) || !(farthest < 1000 * this->home_diagonal())) {
      report.diverged = true;
      return 0;
    }
    e_ += change_, pressure_ = pressure;
    moved_.noalias() = frame_.weights() * e_;
    for (int i = 0; i < size(); ++i) {
      auto const u = moved_.template segment<3>(3 * i);
      Vector const way = u - this->displacement(i);
      this->displace(i, u, h > 0 ? Vector(way / h) : Vector(Vector::Zero()));
    }
    return farthest;
  }

  /// visit(column, weight) for a row of W.
  template <class Visit>
  void for_row(int row, Visit const& visit) const noexcept {
    for (int k = frame_.weights().outerIndexPtr()[row]; k < frame_.weights().outerIndexPtr()[row + 1]; ++k) visit(frame_.weights().innerIndexPtr()[k], frame_.weights().valuePtr()[k]);
  }
  Scalar row_product(int row, Numbers const& x) const noexcept {
    Scalar sum = 0;
    for_row(row, [&](int column, Scalar weight) { sum += weight * x[column]; });
    return sum;
  }
  /// How the columns give way to a force of 1 N in all three directions on a vertex; the last ones are remembered.
  Numbers const& response_to(int i) const noexcept {
    for (std::size_t k = 0; k < responses_.size(); ++k)
      if (response_of_[k] == i) return responses_[k];
    std::size_t const k = next_response_++ % responses_.size();
    response_of_[k] = i;
    responses_[k].setZero();
    for (int c = 0; c < 3; ++c) for_row(3 * i + c, [&](int column, Scalar weight) { responses_[k][column] += weight; });
    factor_.solve(responses_[k]);
    return responses_[k];
  }

  // --- once, and after nails --------------------------------------------------------------------------------------------
  void prepare() {
    if (is_prepared_) return;
    int const n = columns();
    frame_.hold(this->tissue().surface(), this->rest_positions(), [this](int i) { return this->tissue().nailed(i); });
    for (Numbers* numbers : {&a_, &y_, &z_, &free_, &change_, &pulled_}) *numbers = Numbers::Zero(n);
    for (Numbers* numbers : {&gradient_, &heavy_, &moved_}) *numbers = Numbers::Zero(3 * size());
    for (Numbers& response : responses_) response = Numbers::Zero(n);
    measure(this->rest_positions(), &gradient_, &heavy_);
    frame_.take_areas(gradient_);
    tension_ = frame_.tension(options_.surface_tension);
    stiffness_ = stiffness_at(Numbers::Zero(n));
    if (!factorise(stiffness_))
      throw InvalidArgument("LongElements: the stiffness of the columns is not positive definite; give a larger spacing or Young's modulus");
    is_prepared_ = true, is_measured_ = is_pulled_ = false;
  }
  Sparse stiffness_at(Numbers const& e) const {
    std::vector<Eigen::Triplet<Scalar>> diagonal;
    for (int i = 0; i < columns(); ++i) {
      Scalar const stretch = 1 + e[i] / frame_.length(i), own = (1 - std::log(stretch)) / (stretch * stretch);
      diagonal.emplace_back(i, i, frame_.is_fixed(i) ? Scalar(1) : modulus() * frame_.area(i) / frame_.length(i) * std::max(own, Scalar(0.1)));
    }
    Sparse made(columns(), columns());
    made.setFromTriplets(diagonal.begin(), diagonal.end());
    made += tension_;
    return made.template triangularView<Eigen::Lower>();
  }
  Sparse stiffness_now() const { return stiffness_at(e_); }
  bool factorise(Sparse const& lower) {
    response_of_.fill(-1);
    return factor_.factorise(lower);
  }

  Options options_;
  detail::ColumnFrame<Scalar> frame_;
  Sparse tension_, stiffness_;                       // N/m; of the rest shape, the lower half
  detail::FactoredMatrix<Scalar> factor_;
  Numbers e_, change_, moved_;                       // m; while a step is taken
  Columns<Scalar, 3> load_;                          // N
  Vector gravity_ = Vector::Zero(), centre_ = Vector::Zero();
  Scalar pressure_ = 0;                              // at the centre [Pa]
  double volume_ = 0;                                // to keep [m³]
  bool is_prepared_ = false, is_loaded_ = false;
  mutable bool is_measured_ = false, is_pulled_ = false;
  mutable double now_volume_ = 0;
  mutable Numbers gradient_, heavy_, a_, y_, z_, pulled_, free_;
  mutable Scalar stiffer_ = 1, free_step_ = 0;
  mutable std::array<Numbers, 64> responses_;
  mutable std::array<int, 64> response_of_{};
  mutable std::size_t next_response_ = 0;
};

template <RealScalar Scalar>
LongElements(TriangleMesh<Scalar> const&, LongElementsOptions<Scalar> const&) -> LongElements<Scalar>;

template <RealScalar Scalar>
void LongElementsOptions<Scalar>::validate() const {
  detail::require_positive("LongElements: spacing", spacing, "m"), detail::require_young("LongElements: young", young);
  detail::require_non_negative("LongElements: surface_tension", surface_tension, "N/m");
  if (density != 0) detail::require_density("LongElements: density", density);
  detail::require_non_negative("LongElements: return_time", return_time, "s");
  if (iterations < 1) throw InvalidArgument(detail::message("LongElements: iterations is ", iterations, "; a step takes one at least"));
}

}  // namespace palpate
