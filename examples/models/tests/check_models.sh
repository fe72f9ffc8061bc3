#!/bin/sh
# SPDX-License-Identifier: MIT
# Every model under one finger and one blade: what should hold of them on any machine. No times.
#   sh check_models.sh path/to/models
program=$1
. "${0%/*}/../../check.sh"

views=$(seq -f 'models_%g' 0 15)
# shellcheck disable=SC2086
album models_skin models_force $views
cat drawn.out
# Columns from the end: lines, us each, made, cut us, stable ms, MB, tick ms, volume, trembling, force off, force, most, off.
awk '/ [0-9.-]+ +[0-9]+$/ && NF > 13 { name = $1; for (k = 2; k <= NF - 13; ++k) name = name " " $k
    off[name] = $(NF - 12); force[name] = $(NF - 9); trembling[name] = $(NF - 8); lost[name] = $(NF - 7); stable[name] = $(NF - 4); made[name] = $(NF - 2)
    ++rows }
  function wants(what, holds) { if (!holds) { print "not so: " what; bad = 1 } }
  END {
    wants("15 rows", rows == 15)
    # Finite elements come nearer with each mesh, in displacement and force.
    wants("convergence", off["stable neo-Hooke, fine"] < off["stable neo-Hooke, middle"] && off["stable neo-Hooke, middle"] < off["stable neo-Hooke"])
    wants("convergence of the force", force["stable neo-Hooke, fine"] < force["stable neo-Hooke, middle"] &&
      force["stable neo-Hooke, middle"] < force["stable neo-Hooke"])
    # On the same mesh they, tensor mass too, are nearer than springs, and those nearer than surfaces.
    split("stable neo-Hooke|corotational|tensor mass|tensor mass, corotated", near, "|")
    for (k in near) wants(near[k] " below 35 %", off[near[k]] > 0 && off[near[k]] < 35)
    split("springs, E by Van Gelder|springs, E by Lloyd|cubes|cubes, split once", between, "|")
    for (k in between) wants(between[k] " from 35 to 65 %", off[between[k]] > 35 && off[between[k]] < 65)
    split("springs on the skin, fitted|vertex rings, fitted|long elements", far, "|")
    for (k in far) wants(far[k] " above 65 %", off[far[k]] > 65)
    # The same mesh, the same linear law: corotational elements and corotated tensors agree.
    wants("corotated", off["corotational"] - off["tensor mass, corotated"] < 1 && off["tensor mass, corotated"] - off["corotational"] < 1)
    for (name in force) if (name ~ /fitted/) wants(name " has the force", force[name] > -0.5 && force[name] < 0.5)
    for (name in trembling) wants(name " is at rest", trembling[name] < 10)
    # Springs lose volume, solids at a Poisson ratio of 0.45 less, long elements nothing.
    for (name in lost) if (name ~ /springs|cubes|rings/) wants(name " loses more", lost[name] > 1.5 * lost["stable neo-Hooke"])
    wants("long elements keep it", lost["long elements"] < 0.005 && lost["long elements"] > -0.005)
    # Whatever has tetrahedra, cubes or a skin of springs was cut.
    for (name in made) wants(name " is cut or not", name ~ /vertex rings|long/ ? made[name] == 0 : made[name] > 5)
    for (name in stable) wants(name " any step or not", name ~ /vertex rings|long|cubes/ ? stable[name] == "inf" : stable[name] > 0.01 && stable[name] < 5)
    exit bad
  }' drawn.out || fail "not the numbers expected"
finish
