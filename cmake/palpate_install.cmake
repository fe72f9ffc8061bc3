# SPDX-License-Identifier: MIT
include(CMakePackageConfigHelpers)

# One stem, palpateConfig*.cmake; headers only, so the place is independent of the architecture.
set(palpate_package_dir "${CMAKE_INSTALL_DATADIR}/cmake/palpate")

# One targets file a component: a host that does not ask for VTK never sees its names.
foreach(target palpate palpate_collision palpate_haply palpate_json palpate_network palpate_parallel palpate_vtk)
  install(TARGETS ${target} EXPORT ${target}Targets FILE_SET HEADERS DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}")
  install(EXPORT ${target}Targets NAMESPACE palpate:: DESTINATION "${palpate_package_dir}")
endforeach()

configure_package_config_file(cmake/palpateConfig.cmake.in palpateConfig.cmake
                              INSTALL_DESTINATION "${palpate_package_dir}" NO_CHECK_REQUIRED_COMPONENTS_MACRO)
write_basic_package_version_file(palpateConfigVersion.cmake COMPATIBILITY SameMinorVersion ARCH_INDEPENDENT)
install(FILES "${CMAKE_CURRENT_BINARY_DIR}/palpateConfig.cmake" "${CMAKE_CURRENT_BINARY_DIR}/palpateConfigVersion.cmake"
              cmake/palpate_vtk.cmake
        DESTINATION "${palpate_package_dir}")
install(FILES LICENSE DESTINATION "${CMAKE_INSTALL_DATADIR}/doc/palpate")
