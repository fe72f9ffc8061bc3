// SPDX-License-Identifier: MIT
// Nothing but a reason to compile the precompiled header that all test programs share.
