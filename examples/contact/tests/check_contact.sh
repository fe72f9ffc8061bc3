#!/bin/sh
# SPDX-License-Identifier: MIT
# Bodies in contact: rest depths, sliding and weight are those by hand.
#   sh check_contact.sh path/to/contact
program=$1
. "${0%/*}/../../check.sh"

album contact_slope contact_egg
cat drawn.out
awk '/^a slab/ { depth = $(NF - 3) }
  /^leapfrog|^backward Euler/ { ++rows; want($NF, depth, 0.03 * depth) }
  /^on slopes/ { ++rows; want($5, 0, 0.1) }
  /^where it holds/ { ++rows; want($7, 0, 2) }
  /^an egg/ { ++rows; want($(NF - 4), $(NF - 1), 0.01 * $(NF - 1)) }
  function want(value, wanted, within) { if (value < wanted - within || value > wanted + within) { print value, "is not", wanted; bad = 1 } }
  END { exit bad || rows != 6 }' drawn.out || fail "not what is found by hand"
finish
