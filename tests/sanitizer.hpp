// SPDX-License-Identifier: MIT
// PALPATE_TEST_SANITIZER: a sanitizer owns the heap and the calls into the kernel.
#pragma once

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define PALPATE_TEST_SANITIZER 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer) || __has_feature(memory_sanitizer)
#define PALPATE_TEST_SANITIZER 1
#endif
#endif
