// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/body/body_view.hpp>
#include <palpate/body/particle_order.hpp>
#include <palpate/body/truncation.hpp>
#include <palpate/region/concept.hpp>
#include <palpate/tissue/concept.hpp>

#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <limits>
#include <span>
#include <utility>
#include <vector>

namespace palpate {

/// The particles that a step computes: those that the region chooses, and those it leaves out again that have not relaxed.
/// A region that does not follow the touch is asked again only after an edit; one that does, at every step.
/// Relaxed     elastic force over stiffness, and speed over √(stiffness/mass), below the region's `relaxation` in mean edges; or so small
///             that a step does not show in the last digit of the coordinates, where float stops before.
/// Cost        O(chosen particles), O(body) while it is awake; nothing is allocated within what was reserved.
template <TissueModel Tissue, Region RegionType>
class MovingSet {
 public:
  using Scalar = typename Tissue::Scalar;
  using Vector = Vector3<Scalar>;
  using View = BodyView<Tissue>;

  /// What of it makes the body's future.
  struct State {
    std::vector<int> particles, border;
    bool awake, has_left;
    RegionType region;
    int steps_to_look;
    detail::ParticleOrder order;
  };

  /// Throws what the region's validate() throws, if it has one.
  explicit MovingSet(RegionType region) : given_(std::move(region)), region_(given_) {
    if constexpr (Validatable<RegionType>) region_.validate();
  }

  /// `mean_edge` and the body's distance from the origin, `offset` [m], say what counts as small.
  void set_scale(Scalar mean_edge, Scalar offset) noexcept { mean_edge_ = mean_edge, offset_ = offset; }
  /// Finds the order in which they are computed.
  void find_order(Tissue const& tissue) { order_.find(tissue); }
  detail::ParticleOrder const& order() const noexcept { return order_; }

  void reserve(int particle_count) {
    selection_.reserve(particle_count);
    border_.reserve(particle_count);
    for (auto* list : {&touched_, &last_touched_, &moving_, &next_, &by_number_}) list->reserve(2 * static_cast<std::size_t>(particle_count));
  }

  std::span<int const> particles() const noexcept { return moving_; }
  bool contains(int i) const noexcept { return selection_.contains(i); }
  /// The free particles beside them, which hold them.
  std::span<int const> border() const noexcept { return border_.particles(); }
  bool is_empty() const noexcept { return moving_.empty(); }

  /// The whole body moves until it has relaxed.
  void wake() noexcept { awake_ = true; }
  /// What was chosen is void: another particle can move now, or one less.
  void forget() noexcept { chosen_for_ = gathered_for_ = {}; }
  /// A particle goes on moving until it has relaxed.
  void add(int i) {
    moving_.push_back(i);
    forget();
  }
  /// Nothing moves, or all of the body.
  void restart(bool awake) noexcept {
    moving_.clear();
    border_.clear();
    region_ = given_;
    awake_ = awake;
    forget();
  }

  State save() const { return {moving_, {border().begin(), border().end()}, awake_, has_left_, region_, steps_to_look_, order_}; }
  void restore(State const& saved) {
    moving_ = saved.particles;
    border_.clear();
    for (int const i : saved.border) border_.add(i);
    awake_ = saved.awake, has_left_ = saved.has_left;
    region_ = saved.region;
    steps_to_look_ = saved.steps_to_look;
    order_ = saved.order;
    forget();
  }

  /// After an edit: particles that are gone are forgotten, those that it changed, and those beside them, go on.
  void follow_edits(Tissue const& tissue, std::span<int const> disturbed) {
    auto const is_gone = [&](int i) { return i >= tissue.size(); };
    std::erase_if(moving_, is_gone);
    if (!RegionType::follows_touch) return;
    for (int const i : disturbed) {
      if (is_gone(i)) continue;
      moving_.push_back(i);
      tissue.for_each_neighbour(i, [&](int neighbour) { moving_.push_back(neighbour); });
    }
  }

  /// Whether it was chosen for the body as it is: not where it was restored, and where other particles can move since.
  bool is_of(View const& body) const noexcept { return choice(body) == chosen_for_; }
  /// Whether what acts on them is gathered for the body as it is: where they were chosen for it, or a look ahead has asked since.
  bool is_gathered(View const& body) const noexcept { return is_of(body) || choice(body) == gathered_for_; }
  void set_gathered(View const& body) noexcept { gathered_for_ = choice(body); }
  /// Whether there is nothing to choose anew.
  bool is_chosen(View const& body) const noexcept { return !RegionType::follows_touch && is_of(body); }

  /// Finds the particles to compute; true where they are others than before. What stops loses its velocity in `state`, which is the
  /// body's own. `fresh`: no time has passed yet.
  bool choose(View const& body, ParticleState<Scalar>& state, bool fresh) {
    last_touched_.swap(touched_);
    touched_.clear();
    touched_.insert(touched_.end(), body.forced.begin(), body.forced.end());
    touched_.insert(touched_.end(), body.held.begin(), body.held.end());
    bool const adapts = [&] {
      if constexpr (AdaptsToError<RegionType>)
        return region_.adapts();
      else
        return false;
    }();
    if (touched_ == last_touched_ && !touched_.empty() && choice(body) == chosen_for_ && !awake_ && !has_left_ && !adapts) return false;
    selection_.clear();
    if constexpr (AdaptsToError<RegionType>)
      if (adapts) adapt(body);
    if (awake_)
      for (int i = 0; i < body.size(); ++i) selection_.add(i);
    region_.select(body.tissue, std::span<int const>(touched_), selection_);
    has_left_ = false;
    if (RegionType::follows_touch && !awake_) keep_moving(body, state);
    selection_.sort();
    next_.clear();
    bool relaxed = awake_ && RegionType::follows_touch;
    for (int const i : selection_.particles())
      if (body.is_free(i)) {
        next_.push_back(i);
        relaxed = relaxed && has_relaxed(body, i);
      }
    if (relaxed && !fresh) awake_ = false;
    Choice const now = choice(body);
    if (now == chosen_for_ && next_ == by_number_) return false;
    by_number_.assign(next_.begin(), next_.end());
    moving_.swap(next_);
    order_.sort(moving_);
    chosen_for_ = now;
    find_border(body);
    return true;
  }

 private:
  /// What the moving set was chosen for: while nothing of it changes, the set stays.
  struct Choice {
    std::size_t tissue_revision = static_cast<std::size_t>(-1);
    int particles = -1;
    bool operator==(Choice const&) const = default;
  };
  static Choice choice(View const& body) noexcept { return {body.revision, body.size()}; }

  /// Of the particles that moved so far and that the region leaves out, those go on that have not relaxed. Relaxed ones stop at home;
  /// elsewhere they may be held in balance by what is touched, so they stop all at once, when nothing is touched any more.
  void keep_moving(View const& body, ParticleState<Scalar>& state) {
    bool all_stop = touched_.empty();
    for (int const i : moving_) all_stop = all_stop && (!body.is_free(i) || has_relaxed(body, i));
    for (int const i : moving_) {
      if (selection_.contains(i) || !body.is_free(i)) continue;
      if (all_stop || (is_home(body, i) && has_relaxed(body, i))) {
        state.velocity[i].setZero();
        state.remembered[i].setZero();
      } else {
        selection_.add(i);
        has_left_ = true;
      }
    }
  }

  /// Lets the region follow what its border holds back. What has left it and still moves is no reason for fewer rings.
  void adapt(View const& body) {
    if (moving_.empty() || touched_.empty()) {
      if (moving_.empty()) region_ = given_;
      steps_to_look_ = 0;
      return;
    }
    if (awake_ || steps_to_look_-- > 0) return;
    Scalar const error = truncation_error(body, border_.particles()) / mean_edge_;
    steps_to_look_ = region_.adapt(static_cast<double>(error), !has_left_) ? 0 : 7;
  }

  void find_border(View const& body) {
    border_.clear();
    if (static_cast<int>(moving_.size()) == body.size()) return;
    for (int const i : moving_)
      body.tissue.for_each_neighbour(i, [&](int j) {
        if (!selection_.contains(j) && body.is_free(j)) border_.add(j);
      });
  }

  bool is_home(View const& body, int i) const noexcept {
    constexpr Scalar least = std::same_as<Scalar, float> ? Scalar(1e-3) : Scalar(0);
    Scalar const share = std::max(100 * static_cast<Scalar>(region_.relaxation), least);   // settle() leaves a remainder
    return (body.state.position[i] - body.state.home[i]).squaredNorm() < share * share * mean_edge_ * mean_edge_;
  }

  bool has_relaxed(View const& body, int i) const noexcept {
    Scalar const digit = 2 * std::numeric_limits<Scalar>::epsilon() * offset_;
    Scalar const crawl = body.last_step > 0 ? digit / body.last_step : Scalar(0);
    Scalar const tolerance = std::max(static_cast<Scalar>(region_.relaxation) * mean_edge_, 4 * digit);
    Scalar const stiffness = body.tissue.stiffness_bound(i);
    Scalar const mass = body.tissue.mass(i);
    if (!(body.state.velocity[i].norm() < std::max(std::sqrt(stiffness / mass) * tolerance, crawl))) return false;
    Vector const force = body.tissue.internal_force(i, body.state.position.view(), Still<Scalar>{}) + mass * body.gravity;
    return force.norm() < std::max(stiffness * tolerance, body.tissue.damping_bound(i) * crawl);
  }

  RegionType given_, region_;   // as the host wants it, and as it has adapted itself
  Selection selection_, border_;
  std::vector<int> touched_, last_touched_, moving_, next_, by_number_;   // the last: those that were chosen, ascending
  detail::ParticleOrder order_;
  Choice chosen_for_, gathered_for_;
  Scalar mean_edge_ = 0;   // m
  Scalar offset_ = 0;      // m
  int steps_to_look_ = 0;
  bool has_left_ = false;   // what the region leaves out goes on moving
  bool awake_ = false;
};

}  // namespace palpate
