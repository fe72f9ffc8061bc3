// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace palpate {

/// A value for each of some indices out of many, such as the particles that a search has come to. clear() and a look-up cost nothing that grows with how many there
/// are. A reference is good until the next value that is new.
template <class Value, class Index = int>
class SparseTable {
 public:
  void clear() noexcept {
    used_ = 0;
    if (++round_ != 0) return;
    for (Entry& entry : entries_) entry.round = 0;
    round_ = 1;
  }

  /// Of an index that has none yet a new one, Value{}.
  Value& operator[](Index index) {
    if (2 * used_ >= entries_.size()) grow();
    Entry& entry = entries_[place(index)];
    if (entry.round != round_) entry = {round_, index, Value{}}, ++used_;
    return entry.value;
  }
  /// Null where an index has none.
  Value const* find(Index index) const noexcept {
    if (used_ == 0) return nullptr;
    Entry const& entry = entries_[place(index)];
    return entry.round == round_ ? &entry.value : nullptr;
  }

 private:
  struct Entry {
    unsigned round = 0;
    Index index{};
    Value value;
  };

  /// By the upper bits of a product with 2⁶⁴ over the golden ratio: the lower ones are alike for indices that are a power of two apart, as on a regular mesh.
  std::size_t place(Index index) const noexcept {
    std::size_t const mask = entries_.size() - 1;
    std::size_t i = static_cast<std::size_t>((static_cast<std::uint64_t>(index) * 0x9e3779b97f4a7c15u) >> unused_bits_);
    while (entries_[i].round == round_ && entries_[i].index != index) i = (i + 1) & mask;
    return i;
  }

  void grow() {
    std::vector<Entry> old(std::max<std::size_t>(64, 2 * entries_.size()));
    old.swap(entries_);
    unused_bits_ = 65 - static_cast<int>(std::bit_width(entries_.size()));
    for (Entry const& entry : old)
      if (entry.round == round_) entries_[place(entry.index)] = entry;
  }

  std::vector<Entry> entries_;   // a power of two
  int unused_bits_ = 63;
  std::size_t used_ = 0;
  unsigned round_ = 1;
};

}  // namespace palpate
