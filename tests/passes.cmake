# SPDX-License-Identifier: MIT
# `setup.sh test` compiles the tests in two passes: plainly with gcc in double, and with clang in float under the sanitizers. Most of a run is
# compiling, so what is large belongs to one of them; `setup.sh test --long` runs every file in both.
#
# palpate_select_tests(<variable> <pass>): takes out of the list of folder/file.cpp what the other pass is for. A pass of "" keeps everything.

# Only plainly: numbers (orders, closed forms, statistics), which compute for long and touch little memory that others do not.
set(plain_tests
  "^body/test_(aliasing|archetypes|damping|gravity|reference|reference_scene|stability_limits|stable_step|truncation)[.]"
  "^core/test_(similarity|triple_buffer|units)[.]"
  "^cutting/test_(blade_edge|counts|material_path|separating_counts|volume_cutter_force)[.]"
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
  "^tissue/test_(mass_scaling|maximum_elongation|solid_solver|solid_yardsticks|spring_law|supported)[.]"
  "^tool/test_(hands_at_rest|random_poses|rod_contact|tool_shape|trocar)[.]"
  "^training/test_(alignment|comparison|guidance|replay|smoothness)[.]"
  "^vtk/test_(plot|series)[.]")

# Only under the sanitizers, as far as they are not among those above: what changes meshes and searches in them.
set(sanitized_tests "^(collision|collision_fcl|cutting|mesh|scene|tool|volume)/" "^network/test_(protocol|sockets)[.]")

# Of those under the sanitizers, the ones that compute so much that they are compiled with -O1.
set(optimised_tests
  "^body/test_(allocation|execution|surface_changes|touch|zone)[.]"
  "^(collision|collision_fcl|cutting|material|scene|tool|volume)/"
  "^device/test_(scripted_device|simulated_hand)[.]"
  "^haptics/test_facet_planes[.]"
  "^json/test_network_file[.]"
  "^mesh/test_(generators|tetrahedral_edits)[.]"
  "^network/test_sockets[.]"
  "^simulator/test_(many_tools|realtime)[.]"
  "^tissue/test_(corotated_tensor_mass|cubes|element|element_tissue|finite_elements|long_elements|nodal_pressure|stiffness_rows|tensor_mass)[.]"
  "^tissue/test_(models_touched|two_layers|vertex_rings|viscoelastic|young_springs)[.]")

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
  if(pass STREQUAL "plain")
    set(selected ${plain} ${both})
  elseif(pass STREQUAL "sanitized")
    set(selected ${rest})
  elseif(pass STREQUAL "")
    set(selected ${plain} ${rest})
  else()
    message(FATAL_ERROR "PALPATE_TEST_PASS is '${pass}'; it is plain, sanitized or empty, which is both")
  endif()
  list(SORT selected)
  set(${variable} ${selected} PARENT_SCOPE)
endfunction()
