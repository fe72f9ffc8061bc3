# SPDX-License-Identifier: MIT
# What a policy may offer besides is asked for by the name of a concept, so that a misspelt member is an error where the name is asserted and no
# silent other behaviour: no requires-expression stands outside a concept's definition. cmake -D source=<palpate> -P named_requirements.cmake
cmake_policy(VERSION 3.24)

# palpate_unnamed(<out> <text of a header>): the requires-expressions outside definitions of concepts, each up to its first brace.
function(palpate_unnamed out text)
  string(REGEX REPLACE "//[^\n]*" "" text "${text}")
  string(REGEX REPLACE "\"[^\"\n]*\"" "" text "${text}")
  string(REGEX REPLACE "[ \t\n]+" " " text "${text}")
  string(REGEX REPLACE "{[^{};]*}" "<>" text "${text}")   # { expression } -> concept, [](int) {}
  foreach(depth RANGE 3)                                  # parameters, and theirs
    string(REGEX REPLACE "\\([^(){};]*\\)" "@" text "${text}")
  endforeach()
  string(REGEX REPLACE "([(&|=!?:,]|requires|return) ?requires ?@? ?{[^{}]*}" "\\1 REQUIREMENTS" text "${text}")
  string(REGEX REPLACE "concept [a-zA-Z0-9_]+ =[^;]*;" "" text "${text}")
  string(REGEX MATCHALL "[^;{}]*REQUIREMENTS" found "${text}")
  set(${out} "${found}" PARENT_SCOPE)
endfunction()

# The check itself: each of these is found, and nothing of a concept is.
foreach(probe IN ITEMS "if constexpr (requires { a.b(); }) a.b();" "if constexpr (!requires(T& a) { { a.b() } -> C<int>; a.c(); }) return;"
                       "static_assert(requires(T const& a, void (*f)(void*) noexcept) { a.b(f); }, \"words\");" "bool const has = requires { typename T::Scalar; };"
                       "auto f() requires requires(T const& a) { a.save(); } { return 1; }" "if constexpr(  requires\n{ a.b(); })")
  palpate_unnamed(found "void g() { ${probe} }")
  if(NOT found MATCHES "REQUIREMENTS")
    message(FATAL_ERROR "this test does not find what it is for: ${probe}")
  endif()
endforeach()
palpate_unnamed(found "template <class T> concept A = B<T> && requires(T& a, void (*f)(void*) noexcept) { { a.b() } noexcept -> C<int>; a.c([](int) {}); } || requires { typename T::D; }; void f() requires A<int> {} template <class T> requires(N > 0 && (C<T> && ...)) struct E {};")
if(found)
  message(FATAL_ERROR "this test takes a concept for something else: ${found}")
endif()

set(wrong "")
set(concepts 0)
file(GLOB_RECURSE headers RELATIVE "${source}/include" "${source}/include/*.hpp")
foreach(header IN LISTS headers)
  file(READ "${source}/include/${header}" text)
  if(text MATCHES "[^a-zA-Z0-9_]requires[^a-zA-Z0-9_]")
    math(EXPR concepts "${concepts} + 1")
    palpate_unnamed(found "${text}")
    foreach(one IN LISTS found)
      string(REPLACE "REQUIREMENTS" "requires ..." one "${one}")
      string(APPEND wrong "\n  ${header}: ${one}")
    endforeach()
  endif()
endforeach()
if(wrong)
  message(FATAL_ERROR "a requires-expression outside a concept: name what is asked for by a concept in the concept.hpp of its family, and ask for that${wrong}")
endif()
if(concepts LESS 20)
  message(FATAL_ERROR "only ${concepts} headers with requirements were found below ${source}/include")
endif()
