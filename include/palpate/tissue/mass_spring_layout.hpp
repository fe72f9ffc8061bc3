// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/huge_page_vector.hpp>
#include <palpate/core/simd.hpp>
#include <palpate/tissue/mass_spring_options.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstring>
#include <span>
#include <type_traits>
#include <vector>

namespace palpate {

/// Memory layout of the springs on a chosen set of particles, in the order in which the force loop reads them.
/// Particles 0 … moving−1 are the chosen ones. After them comes the border: particles that only hold an end of a spring.
/// Each link is stored once, with its lower end. A link between two border particles is left out.
/// Row, group  `width` particles form a group, and a row holds one link of each. Positions, velocities and forces of the group stay in
/// registers for all of its rows. Groups are made of particles of a part with equally many links, so that few places in a row are empty.
/// An empty place is a link from its particle to itself, without force.
/// Part        32 consecutive particles, with the groups they own. After a part, no link of its block acts on its particles. It is small,
///             so that prefetched data arrive in time.
/// Block       consecutive parts: an eighth of the particles, but 4,096 or more. Links that leave a block come after all blocks, and the
///             parts they act on are open until then. So blocks can be computed in sequence or in parallel, with the same result.
/// Law, weight, coefficients   stored for each link or particle, or once where all are the same.
template <RealScalar Scalar, SpringLaw<Scalar> Law>
class MassSpringLayout {
 public:
  /// Links of a row: as many numbers as a register holds.
  static constexpr int width = simd::row_width<Scalar>;

  /// A link of each of a group's particles.
  struct Row {
    std::array<Scalar, width> rest_length;   // m
    std::array<int, width> other;            // 4 × the upper ends: where their columns begin
  };
  using Laws = std::array<Law, width>;   // of a row
  using Weights = std::array<Scalar, width>;
  struct Group {
    std::array<int, width> own;   // 4 × the lower ends
    int rows;
  };
  struct Part {
    int first, end;               // its particles
    int first_group, end_group;   // and theirs
    int first_row;
    int reach;      // one past the last particle of the block that its links, or those of parts before, act on
    bool is_open;   // a link that leaves its block acts on it
  };
  struct Block {
    int first_part, end_part;
  };
  /// How a particle answers to what acts on it alone.
  struct Coefficients {
    Scalar stiffness, damping;   // of its home spring, N/m, N·s/m
    Scalar inverse_mass;         // 1/kg
  };

  static constexpr int max_rows = 8;   // of a group

  std::span<int const> particles() const noexcept { return particles_; }   // local particle → particle of the body
  int moving() const noexcept { return moving_; }
  std::span<std::array<Scalar, 4> const> rest() const noexcept { return rest_; }   // m, the fourth number 0
  bool has_one_coefficients() const noexcept { return has_one_coefficients_; }
  Coefficients const& coefficients(int i) const noexcept { return coefficients_[has_one_coefficients_ ? 0 : at(i)]; }
  std::span<Block const> blocks() const noexcept { return blocks_; }
  std::span<Part const> parts() const noexcept { return parts_; }
  std::span<Group const> groups() const noexcept { return groups_; }
  std::span<Row const> rows() const noexcept { return rows_; }
  /// Columns of forces that a walk through a block needs at once, a few times over, so that they need not be moved along with every part; 0: its
  /// particles' own columns are as good.
  int window() const noexcept { return window_; }
  /// Where the groups of links that leave a block begin, and their rows.
  int first_leaving_group() const noexcept { return first_leaving_group_; }
  int first_leaving_row() const noexcept { return first_leaving_row_; }
  bool has_one_law() const noexcept { return has_one_law_; }
  Laws const& laws(std::ptrdiff_t row) const noexcept { return laws_[has_one_law_ ? 0 : static_cast<std::size_t>(row)]; }
  bool weights_are_one() const noexcept { return weights_are_one_; }
  Weights const& weights(std::ptrdiff_t row) const noexcept { return weights_[weights_are_one_ ? 0 : static_cast<std::size_t>(row)]; }

  /// What there is room for.
  std::size_t particle_capacity() const noexcept { return rest_.capacity(); }
  std::size_t group_capacity() const noexcept { return groups_.capacity(); }
  std::size_t row_capacity() const noexcept { return rows_.capacity(); }

  /// Gathers the springs of `tissue` that pull on the particles in `moving`. Allocates only when the set outgrows earlier ones.
  template <class Tissue>
  void build(Tissue const& tissue, std::span<int const> moving) {
    for (int const p : particles_)
      if (static_cast<std::size_t>(p) < local_.size()) local_[static_cast<std::size_t>(p)] = -1;
    local_.resize(static_cast<std::size_t>(tissue.size()), -1);
    particles_.assign(moving.begin(), moving.end());
    moving_ = static_cast<int>(moving.size());
    block_size_ = std::max(min_block_size, (moving_ / max_blocks / part_size + 1) * part_size);
    for (int i = 0; i < moving_; ++i) local_[at(moving[at(i)])] = i;

    rest_.clear(), coefficients_.clear(), blocks_.clear(), parts_.clear(), groups_.clear(), rows_.clear(), laws_.clear(), weights_.clear();
    inside_.clear(), leaving_.clear();
    for (int i = 0; i < moving_; ++i) {
      int const p = moving[at(i)];
      bool const is_split = moving_ > block_size_;
      int const block_end = is_split ? std::min(i / block_size_ * block_size_ + block_size_, moving_) : 0;
      for (int const l : tissue.links().at(p)) {
        auto const& link = tissue.links()[l];
        int const q = link.a == p ? link.b : link.a;
        int& j = local_[at(q)];
        if (j < 0) {
          j = static_cast<int>(particles_.size());
          particles_.push_back(q);
        }
        if (j > i) (is_split && j >= block_end ? leaving_ : inside_).links.push_back({l, j});
      }
      inside_.end_particle(), leaving_.end_particle();
      Vector3<Scalar> const rest = tissue.rest_position(p);
      auto const& home = tissue.home(p);
      rest_.push_back({rest[0], rest[1], rest[2], Scalar(0)});
      coefficients_.push_back({home.stiffness, home.damping, 1 / tissue.mass(p)});
    }
    for (int first = 0; first < moving_; first += part_size) add_part(tissue, first, std::min(first + part_size, moving_));
    add_leaving(tissue);
    find_what_is_one();
    find_window();
  }

  /// As many columns as the windows of all blocks take, at most.
  static int max_window_columns(int particles) noexcept { return particles > min_block_size ? particles / 2 + min_block_size / 2 + particles / max_blocks : 0; }

  void reserve(int particles, int links) {
    auto const n = static_cast<std::size_t>(particles), m = static_cast<std::size_t>(links);
    particles_.reserve(n), local_.reserve(n), rest_.reserve(n), coefficients_.reserve(n), groups_.reserve(n);
    rows_.reserve(m / 2 + 64), laws_.reserve(m / 2 + 64), weights_.reserve(m / 2 + 64);
    parts_.reserve(n / part_size + 1), blocks_.reserve(max_blocks);
    inside_.ends.reserve(n), leaving_.ends.reserve(n), inside_.links.reserve(m);
    if (particles > min_block_size) leaving_.links.reserve(m);
  }

 private:
  static constexpr int part_size = 32;
  static constexpr int max_blocks = 8, min_block_size = 4096;

  struct OwnLink {
    int link, other;
  };
  /// The links of each particle of which it is the lower end.
  struct Own {
    std::vector<OwnLink> links;
    std::vector<int> ends;   // of each particle's in `links`
    void clear() noexcept { links.clear(), ends.clear(); }
    void end_particle() { ends.push_back(static_cast<int>(links.size())); }
    int begin(int i) const noexcept { return i > 0 ? ends[at(i - 1)] : 0; }
    int count(int i) const noexcept { return ends[at(i)] - begin(i); }
  };

  static std::size_t at(int i) noexcept { return static_cast<std::size_t>(i); }

  template <class Tissue>
  void add_part(Tissue const& tissue, int first, int end) {
    bool const begins_block = first % block_size_ == 0;
    Part part{first, end, static_cast<int>(groups_.size()), 0, static_cast<int>(rows_.size()), begins_block ? end : std::max(end, parts_.back().reach), false};
    group(tissue, inside_, first, end);
    for (int k = inside_.begin(first); k < inside_.ends[at(end - 1)]; ++k)
      if (int const other = inside_.links[at(k)].other; other < moving_) part.reach = std::max(part.reach, other + 1);
    part.end_group = static_cast<int>(groups_.size());
    if (begins_block) blocks_.push_back({static_cast<int>(parts_.size()), 0});
    parts_.push_back(part);
    blocks_.back().end_part = static_cast<int>(parts_.size());
  }

  template <class Tissue>
  void add_leaving(Tissue const& tissue) {
    first_leaving_group_ = static_cast<int>(groups_.size());
    first_leaving_row_ = static_cast<int>(rows_.size());
    if (leaving_.links.empty()) return;
    for (auto const& part : parts_) group(tissue, leaving_, part.first, part.end);
    for (int i = 0; i < moving_; ++i)
      for (int k = leaving_.begin(i); k < leaving_.ends[at(i)]; ++k) {
        parts_[at(i / part_size)].is_open = true;
        if (int const other = leaving_.links[at(k)].other; other < moving_) parts_[at(other / part_size)].is_open = true;
      }
  }

  using Members = std::array<int, width>;

  /// Puts the particles first … last − 1 into groups, those with most links of their own first.
  template <class Tissue>
  void group(Tissue const& tissue, Own const& own, int first, int last) {
    int most = 0, count = 0;
    for (int i = first; i < last; ++i) most = std::max(most, own.count(i));
    Members members{};
    for (int links = most; links > 0; --links)
      for (int i = first; i < last; ++i) {
        if (own.count(i) != links) continue;
        members[at(count++)] = i;
        if (count < width) continue;
        add_group(tissue, own, members, width);
        count = 0;
      }
    if (count > 0) {
      for (int k = count; k < width; ++k) members[at(k)] = members[0];
      add_group(tissue, own, members, count);
    }
  }

  template <class Tissue>
  void add_group(Tissue const& tissue, Own const& own, Members const& members, int count) {
    int const most = own.count(members[0]);   // none has more
    for (int k = 0; k < most; ++k) {
      if (k % max_rows == 0) {
        Group& group = groups_.emplace_back();
        for (std::size_t m = 0; m < width; ++m) group.own[m] = 4 * members[m];
        group.rows = std::min(max_rows, most - k);
      }
      Row& row = rows_.emplace_back();
      Laws& laws = laws_.emplace_back();
      Weights& weights = weights_.emplace_back();
      for (int m = 0; m < width; ++m) {
        bool const is_link = m < count && k < own.count(members[at(m)]);
        OwnLink const& chosen = own.links[at(own.begin(members[is_link ? at(m) : 0]) + k)];
        auto const& link = tissue.links()[chosen.link];
        row.rest_length[at(m)] = link.rest_length;
        row.other[at(m)] = 4 * (is_link ? chosen.other : members[at(m)]);
        laws[at(m)] = link.law;
        weights[at(m)] = is_link ? link.weight : Scalar(1);   // whatever: it pulls nowhere
      }
    }
  }

  void find_window() noexcept {
    int reach = 0;
    for (Part const& part : parts_) reach = std::max(reach, part.reach - part.first);
    window_ = blocks_.size() > 1 && 3 * reach <= block_size_ / 2 ? 3 * reach : 0;
  }

  void find_what_is_one() {
    auto const differs = [](Coefficients const& a, Coefficients const& b) {
      return a.stiffness != b.stiffness || a.damping != b.damping || a.inverse_mass != b.inverse_mass;
    };
    has_one_coefficients_ = std::adjacent_find(coefficients_.begin(), coefficients_.end(), differs) == coefficients_.end();
    Weights ones;
    ones.fill(1);
    weights_are_one_ = std::all_of(weights_.begin(), weights_.end(), [&](Weights const& weights) { return weights == ones; });
    if (weights_are_one_) weights_.assign(1, ones);
    has_one_law_ = false;
    if constexpr (std::is_trivially_copyable_v<Law>) {
      if (laws_.empty()) return;
      Laws all;
      all.fill(laws_.front()[0]);
      for (Laws const& laws : laws_)
        if (std::memcmp(&laws, &all, sizeof(Laws)) != 0) return;
      laws_.resize(1);
      has_one_law_ = true;
    }
  }

  int moving_ = 0;
  int block_size_ = 0;
  int window_ = 0;
  int first_leaving_group_ = 0, first_leaving_row_ = 0;
  bool has_one_law_ = false, weights_are_one_ = false, has_one_coefficients_ = false;
  std::vector<int> particles_;
  std::vector<int> local_;   // particle of the body → local particle, −1 outside
  HugePageVector<std::array<Scalar, 4>> rest_;
  HugePageVector<Coefficients> coefficients_;   // of each moving particle
  std::vector<Block> blocks_;
  std::vector<Part> parts_;
  HugePageVector<Group> groups_;
  HugePageVector<Row> rows_;
  HugePageVector<Laws> laws_;         // of each row, or one for all
  HugePageVector<Weights> weights_;   // the same
  Own inside_, leaving_;     // links within a block, and those from it to a later one or to the border
};

}  // namespace palpate
