# SPDX-License-Identifier: MIT
# `setup.sh test` compiles the tests in three passes: for a host with gcc, plainly with clang in double, and with clang in float under the sanitizers. Most of
# a run is compiling, for which gcc takes up to three times as long where much is compiled together; so what is large belongs to one or two of them.
# `setup.sh test --long` runs every file with gcc, and under the sanitizers.
#
# palpate_select_tests(<variable> <pass>): takes out of the list of folder/file.cpp what other passes are for. A pass of "" keeps everything.

# As most hosts are compiled: the packs of numbers.
set(host_tests "^core/" "^native/core/test_simd[.]")

# Only by `setup.sh test --long`.
set(long_tests "^native/tissue/test_(nodal_pressure|stiffness_rows|viscoelastic)[.]" "^tissue/test_float_tangent[.]")

# Only plainly: numbers (orders, closed forms, statistics), which compute for long and touch little memory that others do not. What random strokes, edits
# and whole runs reach is left to the sanitizers.
set(plain_tests
  "^body/test_(aliasing|allocation|archetypes|critical_stiffness|damping|execution|gravity|implicit_body|reference)[.]"
  "^body/test_(reference_scene|slide|stability_limits|stable_step|step|substeps|touch|volume)[.]"
  "^body/test_(truncation|zone)[.]"
  "^core/test_(similarity|triple_buffer|units)[.]"
  "^cutting/test_(allocation|archetypes|blade_edge|counts|crossings_per_tick|cube_cutter|edges_per_tick|material_path|quality|rest_area)[.]"
  "^cutting/test_(separating_counts|separating_rest_lengths|separating_states|states|strokes)[.]"
  "^cutting/test_volume_cutter_(follows|force|scenes|springs)[.]"
  "^device/test_(concept|lifecycle|limit|trajectory_shapes)[.]"
  "^fitting/test_(fit|fit_network|fit_stiffness|fitted_force|least_squares)[.]"
  "^force/test_(band_limited_noise|blade|concept|contact_laws|curve|curve_report|cutting_force|indentation_spring|liver|needle_force)[.]"
  "^force/test_(network_training|noise|organ_force|tissue_reaction|trainer)[.]"
  "^haptics/test_(contact_coupling|coupled_force|facet_planes|filtered_wall|handover_jumps|implicit_contact|local_model)[.]"
  "^haptics/test_(passivity|passivity_walls|patch_handover|patch_update|plane_handover|shaded_normal|surface_fit)[.]"
  "^haptics/test_(plane_set|press_then_cut|solid|spring_then_tissue|surface_proxy|surface_sensor|velocity_estimate|virtual_coupling|workspace_mapping)[.]"
  "^(contact|extend|integrator|material|native|parallel|scene|statics)/"
  "^network/test_(bodies|network_simulation|nodes)[.]"
  "^phantom/test_phantom_simulator[.]"
  "^simulator/test_(body_loop|closed_loop|contact_energy|coupled_force|force_along_strokes|many_hands|pacer)[.]"
  "^simulator/test_(proxy_force|servo_guard|servo_guard_strokes|stiffness_limit|tick_statistics|torque|trocar_option)[.]"
  "^tissue/test_(corotated_tensor_mass|cubes|element|element_tissue|finite_elements|float_tangent)[.]"
  "^tissue/test_(long_elements|mass_scaling|maximum_elongation|move_rest|solid_fields)[.]"
  "^tissue/test_(models_touched|nodal_pressure|solid_solver|solid_yardsticks|spring_law|stiffness_rows|supported|tensor_mass|two_layers)[.]"
  "^tissue/test_(vertex_rings|viscoelastic|young_springs)[.]"
  "^tool/test_(forceps|forceps_simulator|hands_at_rest|hook|random_poses|rod_contact|tool_shape|trocar)[.]"
  "^training/test_(alignment|comparison|guidance|replay|smoothness)[.]"
  "^volume/test_filled_body[.]" "^vtk/test_(plot|series)[.]")

# Only under the sanitizers, as far as they are not among those above: what changes meshes and searches in them, and what talks to devices and files.
set(sanitized_tests
  "^(collision|collision_fcl|cutting|device|force_dimension|haply|json|mesh|phantom|region|tool|volume|vtk)/"
  "^body/test_(edits|pieces)[.]" "^fitting/test_measurements[.]" "^network/test_(picture_messages|protocol|sockets)[.]"
  "^simulator/test_(recording|seqlock|snapshot)[.]" "^training/test_(replay_address|session)[.]")

# The ones that compute so much that they are optimised in the other two passes, as are all that are only compiled plainly, but the brief ones.
set(optimised_tests
  "^body/test_surface_changes[.]"
  "^(collision|collision_fcl|cutting|tool|volume)/"
  "^device/test_(scripted_device|simulated_hand)[.]"
  "^json/test_network_file[.]"
  "^mesh/test_(generators|tetrahedral_edits)[.]"
  "^network/test_sockets[.]"
  "^simulator/test_(many_tools|realtime)[.]"
  ${plain_tests})

# Of those, the ones that take less than 5 s without: less than what optimising them does.
set(brief_tests
  "^body/test_(aliasing|archetypes|critical_stiffness|slide|substeps|volume)[.]"
  "^contact/test_free_motion[.]"
  "^cutting/test_(archetypes|rest_area)[.]"
  "^device/test_(concept|lifecycle|limit|trajectory_shapes)[.]"
  "^extend/test_(device|force|integrator|law|material|tissue)[.]"
  "^fitting/test_(fit|fitted_force|least_squares)[.]"
  "^force/test_(band_limited_noise|blade|concept|contact_laws|curve|indentation_spring|liver|noise|organ_force|tissue_reaction|trainer)[.]"
  "^haptics/test_(handover_jumps|local_model|patch_update|press_then_cut|shaded_normal|surface_fit|velocity_estimate|virtual_coupling|workspace_mapping)[.]"
  "^integrator/test_(implicit|motion_forecast|order)[.]" "^material/"
  "^simulator/test_(contact_energy|coupled_force|pacer|servo_guard|servo_guard_strokes|stiffness_limit|tick_statistics|torque)[.]"
  "^tissue/test_(element|move_rest|solid_fields|spring_law|stiffness_rows)[.]"
  "^tool/test_(tool_shape|trocar)[.]"
  "^vtk/test_series[.]")

# palpate_matching(<out> <list> <patterns>): what of the list matches one of the patterns.
function(palpate_matching out list patterns)
  set(matching "")
  foreach(pattern IN LISTS ${patterns})
    set(some ${${list}})
    list(FILTER some INCLUDE REGEX "${pattern}")
    list(APPEND matching ${some})
  endforeach()
  set(${out} ${matching} PARENT_SCOPE)
endfunction()

function(palpate_select_tests variable pass)
  set(selected ${${variable}})
  set(left_out "")
  if(pass STREQUAL "sanitized")
    palpate_matching(left_out selected plain_tests)
  elseif(pass MATCHES "^(host|plain)$")
    palpate_matching(sanitized selected sanitized_tests)
    palpate_matching(plain sanitized plain_tests)
    palpate_matching(left_out selected long_tests)
    list(REMOVE_ITEM sanitized "" ${plain})
    list(APPEND left_out ${sanitized})
    palpate_matching(host selected host_tests)
    if(pass STREQUAL "host")
      set(selected ${host})
    else()
      list(APPEND left_out ${host})
    endif()
  elseif(NOT pass STREQUAL "")
    message(FATAL_ERROR "PALPATE_TEST_PASS is '${pass}'; it is host, plain, sanitized or empty, which is all")
  endif()
  list(REMOVE_ITEM selected "" ${left_out})
  list(SORT selected)
  set(${variable} ${selected} PARENT_SCOPE)
endfunction()
