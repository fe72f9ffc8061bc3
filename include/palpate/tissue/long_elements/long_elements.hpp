// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/columns.hpp>
#include <palpate/core/error.hpp>
#include <palpate/core/matrix.hpp>
#include <palpate/mesh/triangle_mesh.hpp>
#include <palpate/tissue/long_elements/columns_through.hpp>
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
  Scalar density = 1000;               ///< of the fluid [kg/m³]
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
///            from the skin, logarithmic strain (a column never vanishes), the time law K e + τ K ė of a step.
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
    for (int axis = 0; axis < 3; ++axis) {
      auto& of_axis = grids_[at(axis)] = detail::columns_through(mesh, axis, static_cast<double>(options.spacing));
      first_[at(axis) + 1] = first_[at(axis)] + static_cast<int>(of_axis.columns.size());
      for (auto const& column : of_axis.columns) length_.push_back(std::max(static_cast<Scalar>(column.length()), Scalar(1e-3) * options.spacing));
    }
    auto const n = static_cast<Eigen::Index>(length_.size());
    e_ = Numbers::Zero(n);
    load_.resize(size());
    auto const [low, high] = low_and_high(mesh.points);
    centre_ = (low + high) / 2;
    volume_ = measure(nullptr, nullptr);
    prepare();
  }

  Options const& options() const noexcept { return options_; }
  int columns() const noexcept { return static_cast<int>(length_.size()); }
  /// How much longer a column is than at rest [m]; those along x come first, then y and z.
  Scalar elongation(int column) const { return (detail::check_index("column", column, columns()), e_[column]); }
  Scalar column_length(int column) const { return (detail::check_index("column", column, columns()), length_[at(column)]); }   // m, at rest
  Scalar column_area(int column) const { return (detail::check_index("column", column, columns()), area_[at(column)]); }       // m²
  /// Vertices with no column near in one direction at least, along which they stay.
  int uncovered() const noexcept { return uncovered_; }

  Scalar volume() const noexcept { return static_cast<Scalar>(measure(nullptr, nullptr)); }   // m³, inside the skin
  Scalar kept_volume() const noexcept { return static_cast<Scalar>(volume_); }
  /// Pumps fluid in or out, over the next steps.
  void set_kept_volume(Scalar volume) {
    if (!(volume > 0) || !std::isfinite(volume))
      throw InvalidArgument(detail::message("a volume of ", volume, " m³ to keep; give one that is finite and positive"));
    volume_ = static_cast<double>(volume), is_measured_ = false;
  }
  /// Of the fluid at a place, above the atmosphere's [Pa].
  Scalar pressure_at(Vector const& place) const noexcept { return pressure_ + options_.density * gravity_.dot(place - centre_); }
  Vector const& gravity() const noexcept { return gravity_; }
  void set_gravity(Vector const& gravity) {
    if (!is_finite(gravity))
      throw InvalidArgument(detail::message("gravity is (", gravity[0], ", ", gravity[1], ", ", gravity[2], ") m/s²; it must be finite"));
    gravity_ = gravity, is_measured_ = false;
  }
  /// Of columns and surface tension [J].
  Scalar elastic_energy() const {
    Scalar sum = e_.dot(tension_ * e_) / 2;
    for (int i = 0; i < columns(); ++i) {
      Scalar const strain = std::log1p(e_[i] / length_[at(i)]);
      sum += modulus() * area_[at(i)] * length_[at(i)] * strain * strain / 2;
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
    is_loaded_ = true;
  }
  Report step(Scalar h) {
    this->check_step(h);
    prepare();
    Report report{.moving = size()};
    if (is_loaded_) pulled_.noalias() = weights_.transpose() * load_.view().reshaped(), factor_.solve(pulled_);
    for (int k = 0; h > 0 && k < options_.iterations && !report.diverged; ++k) advance(h, share_of(h), report);
    clear_loads();
    return report;
  }
  /// Moves all to where they would come to rest if the forces applied so far stayed, and consumes these. Allocates.
  Report solve_statics(int most = 500) {
    prepare();
    Report report{.moving = size()};
    Numbers const pull = weights_.transpose() * load_.view().reshaped();
    constexpr Scalar exact = std::max(Scalar(1e-13), 20 * std::numeric_limits<Scalar>::epsilon());
    for (int k = 0; k < most && !report.diverged && !report.at_rest; ++k) {
      if (!factorise(stiffness_now())) break;
      is_measured_ = false;
      pulled_ = pull;
      factor_.solve(pulled_);
      Scalar const moved = advance(0, Scalar(1), report);
      report.at_rest = moved <= exact * this->home_diagonal() && std::abs(report.volume_error) <= exact;
    }
    for (int i = 0; i < size(); ++i) this->displace(i, Vector(this->displacement(i)), Vector::Zero());
    factorise(stiffness_), is_measured_ = false;
    clear_loads();
    return report;
  }

  /// The change of velocity over h [m/s²] to the mean of the next step of h seconds, without the forces applied so far.
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
    this->restore_skin(state.skin);
    e_ = state.elongations, gravity_ = state.gravity, pressure_ = state.pressure, volume_ = state.volume, is_loaded_ = state.is_loaded;
    load_ = Columns<Scalar, 3>(state.load);
    is_prepared_ = false;
    prepare();
    moved_.noalias() = weights_ * e_;
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

  Scalar modulus() const noexcept { return options_.young * 2 / 3; }
  void clear_loads() noexcept {
    load_.view().setZero();
    pulled_.setZero(), is_loaded_ = false;
  }
  /// Of the way to where all would come to rest, how much is gone in h seconds: less where columns have become stiffer.
  Scalar share_of(Scalar h) const noexcept { return h / (h + options_.return_time) / stiffer_; }

  /// V and where wanted its gradient ∂V/∂x and what gravity does to the skin [N], 3 × size().
  double measure(Numbers* gradient, Numbers* weight) const noexcept {
    auto const x = this->positions();
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
    now_volume_ = measure(&gradient_, &heavy_);
    a_.noalias() = weights_.transpose() * gradient_;
    y_.noalias() = weights_.transpose() * heavy_;
    if (options_.surface_tension > 0) y_.noalias() -= tension_ * e_;
    stiffer_ = 1;
    for (int i = 0; i < columns(); ++i) {
      if (fixed_[at(i)] != 0) {
        y_[i] = -e_[i];
        continue;
      }
      Scalar const stretch = 1 + e_[i] / length_[at(i)], strain = std::log(stretch);
      y_[i] -= modulus() * area_[at(i)] * strain / stretch;
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
  void free_move(Scalar h) const noexcept {
    look();
    if (free_step_ == h) return;
    Scalar const share = share_of(h);
    free_ = share * (y_ + pressure_for(y_, share) * z_);
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
      if (Scalar const now = length_[at(i)] + e_[i]; -change_[i] * most > now / 2) most = now / (-2 * change_[i]);
    change_ *= most;
    moved_.noalias() = weights_ * change_;
    is_measured_ = false;
    Scalar const farthest = moved_.size() > 0 ? moved_.template lpNorm<Eigen::Infinity>() : Scalar(0);
    if (!std::isfinite(pressure) || !std::isfinite(moved_.sum()) || !(farthest < 1000 * this->home_diagonal())) {
      report.diverged = true;
      return 0;
    }
    e_ += change_, pressure_ = pressure;
    moved_.noalias() = weights_ * e_;
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
    for (int k = weights_.outerIndexPtr()[row]; k < weights_.outerIndexPtr()[row + 1]; ++k) visit(weights_.innerIndexPtr()[k], weights_.valuePtr()[k]);
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
  bool is_end_nailed(detail::LineCrossing const& end) const {
    auto const corners = this->tissue().surface().corners(end.triangle);
    return std::all_of(corners.begin(), corners.end(), [this](int c) { return this->tissue().nailed(c); });
  }
  static double distance(detail::SurfaceColumn const& column, double place) noexcept {
    return std::max({column.low.place - place, place - column.high.place, 0.0});
  }

  /// Of the columns of a line the nearest to a place on it, −1 where none is within `reach`.
  static int nearest_column(detail::SurfaceColumns const& grid, int line, double place, double reach) {
    int found = -1;
    for (int k = grid.first[at(line)]; k < grid.first[at(line) + 1]; ++k)
      if (double const away = distance(grid.columns[at(k)], place); away <= reach) reach = away, found = k;
    return found;
  }
  /// visit(column of the axis, weight) for those that a point follows; false if none.
  template <class Visit>
  static bool follow(detail::SurfaceColumns const& grid, Vector3<double> const& point, Visit const& visit) {
    double const place = point[grid.axis], reach = 3 * std::max(grid.width[0], grid.width[1]);
    double sum = 0;
    grid.for_lines_round(point, [&](int line, double weight) { sum += nearest_column(grid, line, place, reach) >= 0 ? weight : 0; });
    if (sum > 0) {
      grid.for_lines_round(point, [&](int line, double weight) {
        if (int const k = nearest_column(grid, line, place, reach); k >= 0) visit(k, weight / sum);
      });
      return true;
    }
    int best = -1;   // beside the grid's cells round it: the nearest within reach
    double nearest = reach * reach;
    for (std::size_t k = 0; k < grid.columns.size(); ++k) {
      auto const& column = grid.columns[k];
      std::array<int, 2> const cell{column.line % grid.cells[0], column.line / grid.cells[0]};
      double squared = distance(column, place) * distance(column, place);
      for (std::size_t s = 0; s < 2; ++s) {
        double const off = grid.low[s] + (cell[s] + 0.5) * grid.width[s] - point[grid.across(static_cast<int>(s))];
        squared += off * off;
      }
      if (squared < nearest) nearest = squared, best = static_cast<int>(k);
    }
    if (best >= 0) visit(best, 1.0);
    return best >= 0;
  }

  void prepare() {
    if (is_prepared_) return;
    int const n = columns();
    low_share_.assign(at(n), Scalar(0.5)), fixed_.assign(at(n), 0), area_.assign(at(n), Scalar(0));
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (std::size_t k = 0; k < grids_[axis].columns.size(); ++k) {
        auto const& column = grids_[axis].columns[k];
        bool const low = is_end_nailed(column.low), high = is_end_nailed(column.high);
        std::size_t const i = at(first_[axis]) + k;
        if (low != high) low_share_[i] = low ? Scalar(0) : Scalar(1);
        fixed_[i] = low && high;
      }
    std::vector<Eigen::Triplet<Scalar>> entries;
    uncovered_ = 0;
    for (int v = 0; v < size(); ++v) {
      Vector3<double> const point = Vector(this->reference_position(v)).template cast<double>();
      bool is_covered = true;
      for (int axis = 0; axis < 3; ++axis) {
        auto const& grid = grids_[at(axis)];
        is_covered &= follow(grid, point, [&](int k, double weight) {
          int const i = first_[at(axis)] + k;
          if (this->tissue().nailed(v) || fixed_[at(i)] != 0) return;
          auto const& column = grid.columns[at(k)];
          double const along = std::clamp((point[axis] - column.low.place) / std::max(column.length(), 1e-12), 0.0, 1.0);
          entries.emplace_back(3 * v + axis, i, static_cast<Scalar>(weight * (along - static_cast<double>(low_share_[at(i)]))));
        });
      }
      uncovered_ += is_covered ? 0 : 1;
    }
    weights_.resize(3 * size(), n);
    weights_.setFromTriplets(entries.begin(), entries.end());
    weights_.makeCompressed();
    for (Numbers* numbers : {&a_, &y_, &z_, &free_, &change_, &pulled_}) *numbers = Numbers::Zero(n);
    for (Numbers* numbers : {&gradient_, &heavy_, &moved_}) *numbers = Numbers::Zero(3 * size());
    for (Numbers& response : responses_) response = Numbers::Zero(n);
    response_of_.fill(-1);
    find_areas();
    find_tension();
    stiffness_ = stiffness_at(Numbers::Zero(n));
    if (!factorise(stiffness_))
      throw InvalidArgument("LongElements: the stiffness of the columns is not positive definite; give a larger spacing or Young's modulus");
    is_prepared_ = true, is_measured_ = false;
  }
  /// What of the skin at rest each column carries.
  void find_areas() {
    Numbers gradient = Numbers::Zero(3 * size());
    for (int t = 0; t < this->tissue().surface().triangle_count(); ++t) {
      auto const corner = this->tissue().surface().corners(t);
      Vector const a = this->reference_position(corner[0]), b = this->reference_position(corner[1]), c = this->reference_position(corner[2]);
      for (int const k : corner) gradient.template segment<3>(3 * k) += Vector(b - a).cross(Vector(c - a)) / 6;
    }
    Numbers const carried = weights_.transpose() * gradient;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      Scalar const least = Scalar(1e-3 * grids_[axis].width[0] * grids_[axis].width[1]);
      for (int i = first_[axis]; i < first_[axis + 1]; ++i) area_[at(i)] = std::max(std::abs(carried[i]), least);
    }
  }
  /// σ (w_i − w_j)² / 2 of the ends of columns that are side by side.
  void find_tension() {
    std::vector<Eigen::Triplet<Scalar>> entries;
    for (std::size_t axis = 0; axis < 3 && options_.surface_tension > 0; ++axis) {
      auto const& grid = grids_[axis];
      int const wide = grid.cells[0], high = grid.cells[1];
      auto const join = [&](int line, int other, Scalar sigma) {
        for (int m = grid.first[at(line)]; m < grid.first[at(line) + 1]; ++m)
          for (int k = grid.first[at(other)]; k < grid.first[at(other) + 1]; ++k) {
            auto const &one = grid.columns[at(m)], &two = grid.columns[at(k)];
            if (one.high.place < two.low.place || two.high.place < one.low.place) continue;
            int const i = first_[axis] + m, j = first_[axis] + k;
            for (Scalar const end : {Scalar(0), Scalar(1)}) {
              Scalar const wi = fixed_[at(i)] != 0 ? Scalar(0) : end - low_share_[at(i)], wj = fixed_[at(j)] != 0 ? Scalar(0) : end - low_share_[at(j)];
              entries.emplace_back(i, i, sigma * wi * wi), entries.emplace_back(j, j, sigma * wj * wj);
              entries.emplace_back(i, j, -sigma * wi * wj), entries.emplace_back(j, i, -sigma * wi * wj);
            }
          }
      };
      auto const over = static_cast<Scalar>(grid.width[1] / grid.width[0]);
      for (int b = 0; b < high; ++b)
        for (int a = 0; a < wide; ++a) {
          if (a + 1 < wide) join(b * wide + a, b * wide + a + 1, options_.surface_tension * over);
          if (b + 1 < high) join(b * wide + a, (b + 1) * wide + a, options_.surface_tension / over);
        }
    }
    tension_.resize(columns(), columns());
    tension_.setFromTriplets(entries.begin(), entries.end());
  }
  Sparse stiffness_at(Numbers const& e) const {
    std::vector<Eigen::Triplet<Scalar>> diagonal;
    for (int i = 0; i < columns(); ++i) {
      Scalar const stretch = 1 + e[i] / length_[at(i)], own = (1 - std::log(stretch)) / (stretch * stretch);
      diagonal.emplace_back(i, i, fixed_[at(i)] != 0 ? Scalar(1) : modulus() * area_[at(i)] / length_[at(i)] * std::max(own, Scalar(0.1)));
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
  std::array<detail::SurfaceColumns, 3> grids_;
  std::array<int, 4> first_{};                       // column along each axis
  std::vector<Scalar> length_, area_, low_share_;    // of each column: m, m², of its elongation what its low end goes
  std::vector<char> fixed_;                          // both ends are nailed
  int uncovered_ = 0;
  Eigen::SparseMatrix<Scalar, Eigen::RowMajor> weights_;   // W: u = W e, rows 3 v + axis
  Sparse tension_, stiffness_;                       // N/m; of the rest shape, the lower half
  detail::FactoredMatrix<Scalar> factor_;
  Numbers e_, pulled_, change_, moved_;              // m; K⁻¹ of the applied forces; while a step is taken
  Columns<Scalar, 3> load_;                          // N
  Vector gravity_ = Vector::Zero(), centre_ = Vector::Zero();
  Scalar pressure_ = 0;                              // at the centre [Pa]
  double volume_ = 0;                                // to keep [m³]
  bool is_prepared_ = false, is_loaded_ = false;
  mutable bool is_measured_ = false;
  mutable double now_volume_ = 0;
  mutable Numbers gradient_, heavy_, a_, y_, z_, free_;
  mutable Scalar stiffer_ = 1, free_step_ = 0;
  mutable std::array<Numbers, 16> responses_;
  mutable std::array<int, 16> response_of_{};
  mutable std::size_t next_response_ = 0;
};

template <RealScalar Scalar>
LongElements(TriangleMesh<Scalar> const&, LongElementsOptions<Scalar> const&) -> LongElements<Scalar>;

template <RealScalar Scalar>
void LongElementsOptions<Scalar>::validate() const {
  auto const check = [](bool is_good, char const* what, Scalar value, char const* unit, char const* wanted) {
    if (!is_good || !std::isfinite(value))
      throw InvalidArgument(detail::message("LongElements: ", what, " is ", value, " ", unit, "; give ", wanted, ", finite"));
  };
  auto const positive = [&](char const* what, Scalar value, char const* unit) { check(value > 0, what, value, unit, "a positive number"); };
  auto const not_negative = [&](char const* what, Scalar value, char const* unit) { check(value >= 0, what, value, unit, "0 or a positive number"); };
  positive("spacing", spacing, "m"), positive("young", young, "Pa"), not_negative("surface_tension", surface_tension, "N/m");
  not_negative("density", density, "kg/m³"), not_negative("return_time", return_time, "s");
  if (iterations < 1) throw InvalidArgument(detail::message("LongElements: iterations is ", iterations, "; a step takes one at least"));
}

}  // namespace palpate
