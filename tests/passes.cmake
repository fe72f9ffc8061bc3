# SPDX-License-Identifier: MIT
# `setup.sh test` compiles the tests in three passes: for a host with gcc, plainly with clang in double, and with clang in float under the sanitizers. Most of
# a run is compiling, for which gcc takes up to three times as long where much is compiled together; so what is large belongs to one or two of them.
# `setup.sh test --long` runs every file with gcc, and under the sanitizers.
#
# palpate_select_tests(<variable> <pass>): takes out of the list of folder/file.cpp what other passes are for. A pass of "" keeps everything.

# As most hosts are compiled: the packs of numbers, steps and their orders, and the force loops for this processor.
set(host_tests "^(core|integrator|native)/")

# Only plainly: numbers (orders, closed forms, statistics), which compute for long and touch little memory that others do not.
set(plain_tests
  "^body/test_(aliasing|archetypes|damping|gravity|reference|reference_scene|stability_limits|stable_step|truncation)[.]"
  "^core/test_(similarity|triple_buffer|units)[.]"
  "^cutting/test_(blade_edge|counts|material_path|separating_counts|volume_cutter_follows|volume_cutter_force|volume_cutter_scenes)[.]"
  "^device/test_(concept|lifecycle|limit|trajectory_shapes)[.]"
  "^fitting/test_(fit|fit_network|fit_stiffness|least_squares)[.]"
  "^force/test_(band_limited_noise|blade|concept|contact_laws|curve|curve_report|cutting_force|indentation_spring|liver|needle_force)[.]"
  "^force/test_(network_training|noise|organ_force|tissue_reaction|trainer)[.]"
  "^haptics/test_(contact_coupling|coupled_force|filtered_wall|handover_jumps|passivity|passivity_walls|patch_handover|patch_update|plane_handover)[.]"
  "^haptics/test_(plane_set|press_then_cut|solid|spring_then_tissue|surface_proxy|velocity_estimate|virtual_coupling|workspace_mapping)[.]"
  "^(contact|extend|integrator|native|parallel|statics)/"
  "^network/test_(bodies|network_simulation|nodes)[.]"
  "^phantom/test_phantom_simulator[.]"
  "^simulator/test_(body_loop|closed_loop|force_along_strokes|many_hands|pacer|proxy_force|tick_statistics|trocar_option)[.]"
  "^tissue/test_(corotated_tensor_mass|cubes|element|long_elements|mass_scaling|maximum_elongation|models_touched|nodal_pressure|solid_solver)[.]"
  "^tissue/test_(solid_yardsticks|spring_law|stiffness_rows|supported|two_layers|vertex_rings|viscoelastic|young_springs)[.]"
  "^tool/test_(hands_at_rest|random_poses|rod_contact|tool_shape|trocar)[.]"
  "^training/test_(alignment|comparison|guidance|replay|smoothness)[.]"
  "^vtk/test_(plot|series)[.]")

# Only under the sanitizers, as far as they are not among those above: what changes meshes and searches in them.
set(sanitized_tests "^(collision|collision_fcl|cutting|mesh|scene|tool|volume)/" "^network/test_(protocol|sockets)[.]")

# The ones that compute so much that they are optimised in the other two passes, as all are that are only compiled plainly.
set(optimised_tests
  "^body/test_(allocation|execution|surface_changes|touch|zone)[.]"
  "^(collision|collision_fcl|cutting|material|scene|tool|volume)/"
  "^device/test_(scripted_device|simulated_hand)[.]"
  "^haptics/test_facet_planes[.]"
  "^json/test_network_file[.]"
  "^mesh/test_(generators|tetrahedral_edits)[.]"
  "^network/test_sockets[.]"
  "^simulator/test_(many_tools|realtime)[.]"
  "^tissue/test_(element_tissue|finite_elements|tensor_mass)[.]"
  ${plain_tests})

function(palpate_select_tests variable pass)
  set(plain ${${variable}})
  set(rest ${${variable}})
  foreach(pattern IN LISTS plain_tests)
    list(FILTER rest EXCLUDE REGEX "${pattern}")
  endforeach()
  if(rest)
    list(REMOVE_ITEM plain ${rest})
  endif()
  set(both ${rest})
  foreach(pattern IN LISTS sanitized_tests)
    list(FILTER both EXCLUDE REGEX "${pattern}")
  endforeach()
  if(pass STREQUAL "host")
    set(selected ${plain} ${both})
    list(FILTER selected INCLUDE REGEX "${host_tests}")
  elseif(pass STREQUAL "plain")
    set(selected ${plain} ${both})
    list(FILTER selected EXCLUDE REGEX "${host_tests}")
  elseif(pass STREQUAL "sanitized")
    set(selected ${rest})
  elseif(pass STREQUAL "")
    set(selected ${plain} ${rest})
  else()
    message(FATAL_ERROR "PALPATE_TEST_PASS is '${pass}'; it is host, plain, sanitized or empty, which is all")
  endif()
  list(SORT selected)
  set(${variable} ${selected} PARENT_SCOPE)
endfunction()
