// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/reserve_and_prefault.hpp>

#include <cstddef>
#include <span>
#include <vector>

namespace palpate {

/// Which elements edits have changed, in their order, for assemblies that follow: each keeps the place up to which it has seen them. Elements that were
/// added are not in it; their numbers say so.
/// Cost       O(1) an edit, amortised. What is too long is forgotten; who has not seen that builds anew.
class EditLog {
 public:
  /// One past the last edit.
  std::size_t end() const noexcept { return forgotten_ + elements_.size(); }
  /// Whether everything from a place on is still known.
  bool knows(std::size_t from) const noexcept { return from >= forgotten_ && from <= end(); }
  std::span<int const> since(std::size_t from) const noexcept { return std::span(elements_).subspan(from - forgotten_); }

  void add(int element) { elements_.push_back(element); }
  /// Before the first edit of some: those up to here are forgotten where they are more than `most`. Who has seen them all misses nothing.
  void trim(std::size_t most) noexcept {
    if (elements_.size() > most) forgotten_ = end(), elements_.clear();
  }
  /// More has changed than can be told one by one.
  void forget_all() noexcept { forgotten_ = end() + 1, elements_.clear(); }
  void reserve(std::size_t edits) { reserve_and_prefault(elements_, edits); }

 private:
  std::vector<int> elements_;
  std::size_t forgotten_ = 0;
};

}  // namespace palpate
