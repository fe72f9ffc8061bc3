// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/index_lists.hpp>
#include <palpate/core/huge_page_vector.hpp>
#include <palpate/tissue/spring_law.hpp>

#include <algorithm>
#include <cstddef>
#include <span>

namespace palpate {

/// A spring between two particles. Its force is `weight` × the law's: a cut leaves a lip only its own side's share.
template <RealScalar Scalar, SpringLaw<Scalar> Law>
struct Link {
  int a = 0;
  int b = 0;
  Scalar rest_length = 0;   // m
  Scalar weight = 1;
  Law law;
};

/// The links of a body and which of them end at each particle.
/// Invariant  at most one link joins two particles.
/// Cost       every query and edit is O(links at the particles). A removal moves the last link into the gap.
template <RealScalar Scalar, SpringLaw<Scalar> Law>
class LinkSet {
 public:
  using LinkType = Link<Scalar, Law>;

  int size() const noexcept { return static_cast<int>(links_.size()); }
  LinkType const& operator[](int link) const noexcept { return links_[static_cast<std::size_t>(link)]; }
  LinkType& operator[](int link) noexcept { return links_[static_cast<std::size_t>(link)]; }

  /// The links that end at a particle, in no particular order.
  std::span<int const> at(int particle) const noexcept { return at_[particle]; }

  /// Where they lead, in the same order.
  std::span<int const> neighbours(int particle) const noexcept { return at_.keys(particle); }

  /// The link between two particles, or −1.
  int find(int a, int b) const noexcept { return at_.find(a, b); }

  int add(LinkType const& link) {
    int const l = size();
    links_.push_back(link);
    at_.add(link.a, l, link.b);
    at_.add(link.b, l, link.a);
    return l;
  }

  void remove(int link) noexcept {
    LinkType const gone = (*this)[link];
    at_.remove(gone.a, link);
    at_.remove(gone.b, link);
    int const last = size() - 1;
    if (link != last) {
      LinkType const& moved = links_.back();
      at_.rename(moved.a, last, link);
      at_.rename(moved.b, last, link);
      (*this)[link] = moved;
    }
    links_.pop_back();
  }

  /// Gives a link the end `now` instead of `before`.
  void change_end(int link, int before, int now) {
    LinkType& l = (*this)[link];
    int const other = l.a == before ? l.b : l.a;
    (l.a == before ? l.a : l.b) = now;
    at_.remove(before, link);
    at_.add(now, link, other);
    at_.set_key(other, link, now);
  }

  void add_particle() { at_.add_list(); }
  void pop_particle() noexcept { at_.pop_list(); }

  /// Room for so many; what a cut grows into is touched, see reserve_and_prefault: some five links for each particle more.
  void reserve(int particles, int links) {
    std::size_t const links_growth = static_cast<std::size_t>(5 * std::max(0, particles - at_.size()));
    reserve_and_prefault(links_, static_cast<std::size_t>(links), links_growth);
    at_.reserve(particles, 16 * particles);
  }

 private:
  HugePageVector<LinkType> links_;
  IndexLists at_;   // links, each with its other end
};

}  // namespace palpate
