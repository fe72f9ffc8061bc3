// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/palpate.hpp>

#include <palpate/extend/tissue.hpp>

/// Tissue that has forces but no way to change its surface: particles on springs of 10 N/m to where they rest.
using Beads = palpate::testing::TissueArchetype<double>;
