#!/bin/sh
# SPDX-License-Identifier: MIT
# A body pulls and pushes as the formulas of its laws say.
#   sh check_laws.sh path/to/laws
program=$1
. "${0%/*}/../../check.sh"

album laws_tension laws_sheet
cat drawn.out
# Yardsticks by hand, 50 N/m and 0.5 N at 4 mm of 20: linear 0.2; saturating 0.2/(1 + 0.4) both ways; locking with 0.8 N 0.2/(1 + 0.25) and
# 0.2/(1 - 0.25); cubic 0.2 + 1e6 * 6.4e-8 = 0.264; Fung (50 * 0.02/5)(e - 1) = 0.3437 and 0.2 (1 - 1/e) = 0.1264.
awk '/^linear/ { law(-0.2, 0.2) } /^saturating/ { law(-0.1429, 0.1429) } /^locking/ { law(-0.2667, 0.1600) } /^cubic/ { law(-0.264, 0.264) } /^Fung/ { law(-0.1264, 0.3437) }
  function law(push, pull) {
    ++rows
    if ($(NF - 3) - push > 1e-4 || push - $(NF - 3) > 1e-4 || $(NF - 2) - pull > 1e-4 || pull - $(NF - 2) > 1e-4) { print "not", push, pull, "in:", $0; bad = 1 }
    if (!($(NF - 1) < 1e-12)) { print "off the formula:", $0; bad = 1 }
    sheet[$1] = $NF
  }
  END { exit bad || rows != 5 || !(sheet["saturating"] < sheet["locking"] && sheet["locking"] < sheet["linear"] && sheet["linear"] < sheet["cubic"]) }' drawn.out || fail "not the laws"
finish
