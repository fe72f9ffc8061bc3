// SPDX-License-Identifier: MIT
#pragma once

/// Whether the compiler may fuse a product and a sum, which changes the last bit.
#ifdef __FMA__
inline constexpr bool may_fuse = true;
#else
inline constexpr bool may_fuse = false;
#endif
