// SPDX-License-Identifier: MIT
// VTK's readers and the OpenGL driver keep or lose some memory of their own, and draw with threads that a sanitizer did not see
// being built. Of a damaged number, VTK may ask for more memory than there is, which is an error of the file. Read by the sanitizers' run time, where there is one.
extern "C" char const* __asan_default_options();
extern "C" char const* __tsan_default_options();

extern "C" char const* __asan_default_options() { return "detect_leaks=0:allocator_may_return_null=1"; }
extern "C" char const* __tsan_default_options() { return "ignore_noninstrumented_modules=1"; }
