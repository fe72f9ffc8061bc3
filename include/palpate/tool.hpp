// SPDX-License-Identifier: MIT
#pragma once

// Tools: what is held in the hand. Beside palpate.hpp, since a program with a point for a tool needs none of it.
#include <palpate/tool/blunt_tool.hpp>
#include <palpate/tool/built_in_shapes.hpp>
#include <palpate/tool/contact_forces.hpp>
#include <palpate/tool/forceps.hpp>
#include <palpate/tool/grasp.hpp>
#include <palpate/tool/hook.hpp>
#include <palpate/tool/rod_contact.hpp>
#include <palpate/tool/scalpel.hpp>
#include <palpate/tool/tool_shape.hpp>
#include <palpate/tool/trocar.hpp>
