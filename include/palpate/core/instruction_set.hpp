// SPDX-License-Identifier: MIT
#pragma once

/// Units of one program have to be compiled for the same vector registers: inline functions of the same name would be different code, of which the
/// linker keeps one. Where a unit with AVX, or with PALPATE_PLAIN_SIMD, meets one without, ld and gold refuse: a name that is thread-local in one
/// unit only cannot be linked.
/// Limits     not seen by lld, nor between a program and its shared libraries.
#if defined(__ELF__)
namespace palpate::detail {

#if defined(__AVX512F__)
[[gnu::used]] inline thread_local char palpate_units_with_and_without_avx512 = 0;
#else
[[gnu::used]] inline char palpate_units_with_and_without_avx512 = 0;
#endif
#if defined(__AVX__)
[[gnu::used]] inline thread_local char palpate_units_with_and_without_avx = 0;
#else
[[gnu::used]] inline char palpate_units_with_and_without_avx = 0;
#endif

#if defined(PALPATE_PLAIN_SIMD)
[[gnu::used]] inline thread_local char palpate_units_with_and_without_plain_simd = 0;
#else
[[gnu::used]] inline char palpate_units_with_and_without_plain_simd = 0;
#endif

}  // namespace palpate::detail
#endif
