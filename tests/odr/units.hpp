// SPDX-License-Identifier: MIT
#pragma once

int first_unit_version();
int second_unit_version();
