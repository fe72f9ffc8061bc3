# SPDX-License-Identifier: MIT
# palpate::palpate, palpate::collision, palpate::haply, palpate::json, palpate::network, palpate::parallel and
# palpate::vtk, under the names an installed package has.
#
# All of them always exist and are always installed: they are headers, so what this machine happens to have does not
# change the package. Only the link items depend on the libraries that were found.
include(GNUInstallDirs)

file(GLOB_RECURSE palpate_headers CONFIGURE_DEPENDS "${PROJECT_SOURCE_DIR}/include/palpate/*.hpp")
set(palpate_vtk_headers ${palpate_headers})
list(FILTER palpate_vtk_headers INCLUDE REGEX "/include/palpate/vtk/")
set(palpate_collision_headers ${palpate_headers})
list(FILTER palpate_collision_headers INCLUDE REGEX "/include/palpate/collision/fcl[^/]*\\.hpp$")
set(palpate_haply_headers ${palpate_headers})
list(FILTER palpate_haply_headers INCLUDE REGEX "/include/palpate/haply/")
set(palpate_json_headers ${palpate_headers})
list(FILTER palpate_json_headers INCLUDE REGEX "/include/palpate/json/")
set(palpate_network_headers ${palpate_headers})
list(FILTER palpate_network_headers INCLUDE REGEX "/include/palpate/network/")
set(palpate_parallel_headers ${palpate_headers})
list(FILTER palpate_parallel_headers INCLUDE REGEX "/include/palpate/parallel/")
set(palpate_core_headers ${palpate_headers})
list(REMOVE_ITEM palpate_core_headers ${palpate_vtk_headers} ${palpate_collision_headers} ${palpate_haply_headers} ${palpate_json_headers}
     ${palpate_network_headers} ${palpate_parallel_headers})

# palpate_add_interface(<target> <exported name> <headers>...)
function(palpate_add_interface target name)
  add_library(${target} INTERFACE)
  add_library(palpate::${name} ALIAS ${target})
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${name})
  target_compile_features(${target} INTERFACE cxx_std_20)
  # CMake 3.22 and older ignore the file set of an installed target: the include folder is said in words too.
  target_include_directories(${target} INTERFACE "$<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>")
  target_sources(${target} INTERFACE FILE_SET HEADERS BASE_DIRS "${PROJECT_SOURCE_DIR}/include" FILES ${ARGN})
endfunction()

palpate_add_interface(palpate palpate ${palpate_core_headers})
target_link_libraries(palpate INTERFACE Eigen3::Eigen Threads::Threads)

# A target that links a component whose library was not looked for stops at a name that says what to do.
palpate_add_interface(palpate_collision collision ${palpate_collision_headers})
set(palpate_collision_items fcl)
palpate_add_interface(palpate_haply haply ${palpate_haply_headers})
set(palpate_haply_items Boost::headers nlohmann_json::nlohmann_json)
palpate_add_interface(palpate_json json ${palpate_json_headers})
set(palpate_json_items nlohmann_json::nlohmann_json)
palpate_add_interface(palpate_network network ${palpate_network_headers})
set(palpate_network_items Boost::headers)
palpate_add_interface(palpate_parallel parallel ${palpate_parallel_headers})
set(palpate_parallel_items TBB::tbb)
palpate_add_interface(palpate_vtk vtk ${palpate_vtk_headers})
list(TRANSFORM palpate_vtk_modules PREPEND VTK:: OUTPUT_VARIABLE palpate_vtk_items)
foreach(component IN LISTS palpate_known_components)
  target_link_libraries(palpate_${component} INTERFACE palpate "$<INSTALL_INTERFACE:${palpate_${component}_items}>")
  if(palpate_has_${component})
    target_link_libraries(palpate_${component} INTERFACE "$<BUILD_INTERFACE:${palpate_${component}_items}>")
  else()
    target_link_libraries(palpate_${component}
                          INTERFACE "$<BUILD_INTERFACE:palpate::name_${component}_in_PALPATE_COMPONENTS>")
  endif()
endforeach()
