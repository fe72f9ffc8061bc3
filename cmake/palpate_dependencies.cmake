# SPDX-License-Identifier: MIT
# Finds what the core needs (Eigen, threads) and what the asked components need (FCL, nlohmann-json, oneTBB, VTK).
#
# PALPATE_COMPONENTS names the components this build uses: any of collision, json, parallel, vtk. A component that is named must be
# found. Without the variable, a build of palpate itself takes those whose libraries are there, and a host that pulls
# palpate in with add_subdirectory() gets the core alone.
include(cmake/palpate_vtk.cmake)

# A host's own directories must see what is found here.
if(NOT PROJECT_IS_TOP_LEVEL)
  set(CMAKE_FIND_PACKAGE_TARGETS_GLOBAL ON)
endif()

find_package(Eigen3 3.4 REQUIRED NO_MODULE)
set(THREADS_PREFER_PTHREAD_FLAG ON)
find_package(Threads REQUIRED)

set(palpate_known_components collision json parallel vtk)
set(palpate_has_collision OFF)
set(palpate_has_json OFF)
set(palpate_has_parallel OFF)
set(palpate_has_vtk OFF)
if(DEFINED PALPATE_COMPONENTS)
  set(palpate_components ${PALPATE_COMPONENTS})
elseif(PROJECT_IS_TOP_LEVEL)
  set(palpate_components ${palpate_known_components})
else()
  set(palpate_components "")
endif()

foreach(component IN LISTS palpate_components)
  if(component STREQUAL "collision")
    find_package(fcl 0.7 QUIET)
    # fcl is a plain target name: unchecked, a missing one would silently become -lfcl.
    if(TARGET fcl)
      set(palpate_has_collision ON)
    endif()
    set(palpate_missing "FCL 0.7 with libccd (Debian: libfcl-dev libccd-dev)")
  elseif(component STREQUAL "json")
    find_package(nlohmann_json 3.10 QUIET)
    if(TARGET nlohmann_json::nlohmann_json)
      set(palpate_has_json ON)
    endif()
    set(palpate_missing "nlohmann-json 3.10 (Debian: nlohmann-json3-dev)")
  elseif(component STREQUAL "parallel")
    find_package(TBB QUIET)
    if(TARGET TBB::tbb)
      set(palpate_has_parallel ON)
    endif()
    set(palpate_missing "oneTBB (Debian: libtbb-dev)")
  elseif(component STREQUAL "vtk")
    palpate_find_vtk()
    if(VTK_FOUND)
      set(palpate_has_vtk ON)
    endif()
    set(palpate_missing "VTK 9 (Debian: libvtk9-dev)")
  else()
    message(FATAL_ERROR "PALPATE_COMPONENTS: there is no component '${component}' (components: collision, json, parallel, vtk).")
  endif()
  if(NOT palpate_has_${component})
    if(DEFINED PALPATE_COMPONENTS)
      message(FATAL_ERROR "palpate: component '${component}' needs ${palpate_missing}, which was not found. "
                          "Install it, or take '${component}' out of PALPATE_COMPONENTS.")
    endif()
    message(STATUS "palpate: component '${component}' is left out, ${palpate_missing} was not found")
  endif()
endforeach()
