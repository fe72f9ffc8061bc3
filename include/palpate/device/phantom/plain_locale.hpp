// SPDX-License-Identifier: MIT
#pragma once

#if defined(__linux__)
#include <locale.h>
#endif

namespace palpate::detail::phantom {

/// While it lives, this thread writes and reads numbers with a point, whatever the program's locale: drivers read their files with it, and a decimal
/// comma has spoilt them.
/// Cost       two exchanges of a pointer; the first one in a process makes the locale.
/// Limits     Linux; elsewhere it does nothing.
class PlainLocale {
 public:
#if defined(__linux__)
  PlainLocale() noexcept : before_(plain() != locale_t{} ? ::uselocale(plain()) : locale_t{}) {}
  ~PlainLocale() {
    if (before_ != locale_t{}) ::uselocale(before_);
  }
#else
  PlainLocale() noexcept {}
  ~PlainLocale() {}
#endif
  PlainLocale(PlainLocale const&) = delete;
  PlainLocale& operator=(PlainLocale const&) = delete;

#if defined(__linux__)
 private:
  static locale_t plain() noexcept {
    static locale_t const made = ::newlocale(LC_ALL_MASK, "C", locale_t{});   // for ever: threads that are never joined use it
    return made;
  }
  locale_t before_;
#endif
};

}  // namespace palpate::detail::phantom
