# SPDX-License-Identifier: MIT
# Configures the golden programs, builds those named in -Dprograms=<name>,<name>, runs them and compares what they print with what their
# comments promise.
include("${CMAKE_CURRENT_LIST_DIR}/configure.cmake")
string(REPLACE "," ";" programs "${programs}")
execute_process(COMMAND "${CMAKE_COMMAND}" --build "${host}" --parallel 1 --target ${programs} COMMAND_ERROR_IS_FATAL ANY)

set(failures "")

macro(run program)
  execute_process(COMMAND "${host}/${program}" WORKING_DIRECTORY "${host}" OUTPUT_VARIABLE output
                  COMMAND_ERROR_IS_FATAL ANY)
  message("${program}:\n${output}")
endmacro()

# expect_lines(<program> <text>): the whole output, to the character.
macro(expect_lines program text)
  run(${program})
  if(NOT output STREQUAL "${text}")
    list(APPEND failures "${program} should print:\n${text}")
  endif()
endmacro()

# expect_between(<program> <least> <value> <most>): bounds included.
macro(expect_between program least value most)
  if("${value}" STREQUAL "" OR "${value}" LESS "${least}" OR "${value}" GREATER "${most}")
    list(APPEND failures "${program}: '${value}' should be between ${least} and ${most}")
  endif()
endmacro()

macro(check_01_palpate)
  run(01_palpate)
  string(STRIP "${output}" displacement)
  expect_between(01_palpate -2.1340 "${displacement}" -2.1330)   # m; -2.13352 by adaptive eighth-order integration
endmacro()

macro(check_02_own_policies)
  expect_lines(02_own_policies "-0.008322\n")
endmacro()

macro(check_03_cut)
  expect_lines(03_cut "no contact particles 48 triangles 50 crossings VP 0 VV 0 PV 0 PP 22
area 0.010000000 mass 0.100000000 pieces 1
")
endmacro()

macro(check_04_cutting_force)
  run(04_cutting_force)
  if(output MATCHES "^([0-9.]+) ([0-9.]+) ([0-9.]+)\nmse below 5e-5: yes\npushes back\n$")
    expect_between(04_cutting_force 0.1825 "${CMAKE_MATCH_1}" 0.1835)   # N at 15 mm
    expect_between(04_cutting_force 0.1841 "${CMAKE_MATCH_2}" 0.1851)
  else()
    list(APPEND failures "04_cutting_force should print three forces, 'mse below 5e-5: yes' and 'pushes back'")
  endif()
endmacro()

macro(check_06_solid)
  run(06_solid)
  if(output MATCHES "^sag ([-0-9.]+) mm\nback at rest: yes\n$")
    expect_between(06_solid -4.34 "${CMAKE_MATCH_1}" -4.23)   # 0.83 to 0.85 of Timoshenko's 5.10 mm, as four elements through the height reach
  else()
    list(APPEND failures "06_solid should print the sag in mm and 'back at rest: yes', printed '${output}'")
  endif()
endmacro()

macro(check_07_organ)
  expect_lines(07_organ "smallest dihedral angle above 10 degrees: yes\nharder above the nodule: yes\n")
endmacro()

macro(check_08_cut_volume)
  expect_lines(08_cut_volume "pieces 2 cut area 0.001600 m2 lips 0.003200 m2\nvolume 0.000064000000 m3 mass 0.064000000000 kg\n")
endmacro()

macro(check_09_tools)
  expect_lines(09_tools "tools 3, both hooks pull outwards: yes\ncut opened: yes, mass kept: yes\n")
endmacro()

macro(check_10_network)
  expect_lines(10_network "felt the tissue: yes, patches came: yes, force at the end 0: yes\n")
endmacro()

macro(check_05_simulator)
  run(05_simulator)
  if(output MATCHES "^ticks 3600 cut 1 largest force ([0-9.]+) N\n$")
    expect_between(05_simulator 0.001 "${CMAKE_MATCH_1}" 3.3)   # N; the device's limit
  else()
    list(APPEND failures "05_simulator should print 'ticks 3600 cut 1 largest force ... N'")
  endif()
  if(EXISTS "${host}/session.csv")
    file(STRINGS "${host}/session.csv" rows)
    list(LENGTH rows count)
    list(GET rows 0 header)
    if(NOT count EQUAL 3601
       OR NOT header STREQUAL "time_s,tip_x_m,tip_y_m,tip_z_m,depth_m,phase,force_x_N,force_y_N,force_z_N,energy_J")
      list(APPEND failures "05_simulator: session.csv should hold the documented header and 3600 rows, has ${count} lines")
    endif()
    # The same run gives the same bytes.
    file(SHA256 "${host}/session.csv" first)
    run(05_simulator)
    file(SHA256 "${host}/session.csv" second)
    if(NOT first STREQUAL second)
      list(APPEND failures "05_simulator: two runs wrote different bytes to session.csv")
    endif()
  else()
    list(APPEND failures "05_simulator should write session.csv")
  endif()
endmacro()

foreach(program IN LISTS programs)
  cmake_language(CALL check_${program})
endforeach()

if(failures)
  list(JOIN failures "\n" failures)
  message(FATAL_ERROR "${failures}")
endif()
