// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/contact/body_contact.hpp>
#include <palpate/contact/contact_options.hpp>
#include <palpate/contact/self_contact.hpp>
#include <palpate/core/error.hpp>

#include <algorithm>
#include <any>
#include <cstddef>
#include <memory>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

namespace palpate::detail {

/// Which bodies of a scene touch each other, or themselves, in the order in which that was said. A pair that is not named costs nothing, in compiling either.
template <class... Bodies>
class SceneContacts {
  using All = std::tuple<Bodies...>;
  template <std::size_t I>
  using Body = std::tuple_element_t<I, All>;

 public:
  using Scalar = typename Body<0>::Scalar;

  template <std::size_t I, std::size_t J>
  using Options = std::conditional_t<I == J, SelfContactOptions<Scalar>, BodyContactOptions<Scalar>>;

  /// Two of them, by their places, or one and itself.
  class Pair {
   public:
    Pair(std::size_t its_first, std::size_t its_second) : first(its_first), second(its_second) {}
    virtual ~Pair() = default;
    virtual std::unique_ptr<Pair> copy() const = 0;
    virtual void expect(All& bodies) = 0;
    virtual void apply(All& bodies, Scalar h) = 0;
    virtual void part(All const& bodies) = 0;   // they are far from each other, or one was taken out: nothing sticks
    virtual std::any save() const = 0;
    virtual void restore(std::any const& state, All const& bodies) = 0;

    std::size_t first, second;
  };

  SceneContacts() = default;
  SceneContacts(SceneContacts const& other) {
    for (auto const& pair : other.pairs_) pairs_.push_back(pair->copy());
  }
  SceneContacts(SceneContacts&&) noexcept = default;
  SceneContacts& operator=(SceneContacts other) noexcept {
    pairs_.swap(other.pairs_);
    return *this;
  }
  ~SceneContacts() = default;

  template <std::size_t I, std::size_t J>
  auto& add(All const& bodies, Options<I, J> const& options) {
    for (auto const& pair : pairs_)
      if (std::minmax(pair->first, pair->second) == std::minmax(I, J))
        throw InvalidArgument(message("Scene: bodies ", I, " and ", J, " touch each other already; contact<", pair->first, ", ", pair->second, ">() is theirs"));
    auto made = std::make_unique<Of<I, J>>(bodies, options);
    auto& contact = made->contact;
    pairs_.push_back(std::move(made));
    return contact;
  }
  template <std::size_t I, std::size_t J>
  auto& get() const {
    for (auto const& pair : pairs_) {
      if (pair->first == I && pair->second == J) return static_cast<Of<I, J>&>(*pair).contact;
      if (pair->first == J && pair->second == I) throw InvalidArgument(message("Scene: the contact of bodies ", I, " and ", J, " is contact<", J, ", ", I, ">()"));
    }
    throw InvalidArgument(message("Scene: nobody said that bodies ", I, " and ", J, " touch each other; touch<", I, ", ", J, ">() does"));
  }
  auto const& pairs() const noexcept { return pairs_; }

  struct PairState {
    std::size_t first, second;
    std::any contact;
  };
  using State = std::vector<PairState>;
  State save() const {
    State state;
    for (auto const& pair : pairs_) state.push_back({pair->first, pair->second, pair->save()});
    return state;
  }
  /// Throws where a state is not of these contacts, or of the first of them.
  void check(State const& state) const {
    for (std::size_t k = 0; k < state.size(); ++k)
      if (k >= pairs_.size() || pairs_[k]->first != state[k].first || pairs_[k]->second != state[k].second)
        throw InvalidArgument(message("Scene: the state is of a scene whose contact ", k, " is of bodies ", state[k].first, " and ", state[k].second,
                                      "; name the same contacts in the same order here"));
  }
  /// Contacts that were not there yet begin anew.
  void restore(State const& state, All const& bodies) {
    for (std::size_t k = 0; k < pairs_.size(); ++k) k < state.size() ? pairs_[k]->restore(state[k].contact, bodies) : pairs_[k]->part(bodies);
  }

 private:
  template <std::size_t I, std::size_t J>
  struct Of final : Pair {
    using Contact = BodyContact<Body<I>, Body<J>>;

    Of(All const& bodies, Options<I, J> const& options) : Pair(I, J), contact(std::get<I>(bodies), std::get<J>(bodies), options) {}
    std::unique_ptr<Pair> copy() const override { return std::make_unique<Of>(*this); }
    void expect(All& bodies) override { contact.expect(std::get<I>(bodies), std::get<J>(bodies)); }
    void apply(All& bodies, Scalar h) override { contact.apply(std::get<I>(bodies), std::get<J>(bodies), h); }
    void part(All const& bodies) override { contact.reset(std::get<I>(bodies), std::get<J>(bodies)); }
    std::any save() const override { return contact.save(); }
    void restore(std::any const& state, All const& bodies) override {
      contact.restore(std::any_cast<ContactState<Scalar> const&>(state), std::get<I>(bodies), std::get<J>(bodies));
    }

    Contact contact;
  };
  template <std::size_t I>
  struct Of<I, I> final : Pair {
    using Contact = SelfContact<Body<I>>;

    Of(All const& bodies, Options<I, I> const& options) : Pair(I, I), contact(std::get<I>(bodies), options) {}
    std::unique_ptr<Pair> copy() const override { return std::make_unique<Of>(*this); }
    void expect(All& bodies) override { contact.expect(std::get<I>(bodies)); }
    void apply(All& bodies, Scalar h) override { contact.apply(std::get<I>(bodies), h); }
    void part(All const& bodies) override { contact.part(std::get<I>(bodies)); }
    std::any save() const override { return contact.save(); }
    void restore(std::any const& state, All const& bodies) override { contact.restore(std::any_cast<ContactState<Scalar> const&>(state), std::get<I>(bodies)); }

    Contact contact;
  };

  std::vector<std::unique_ptr<Pair>> pairs_;
};

}  // namespace palpate::detail
