// SPDX-License-Identifier: MIT
#pragma once

// Several bodies that touch each other, in one simulator. Beside palpate.hpp, since a program with one body needs none of it.
#include <palpate/contact/body_contact.hpp>
#include <palpate/contact/obstacle.hpp>
#include <palpate/contact/self_contact.hpp>
#include <palpate/mesh/box.hpp>
#include <palpate/mesh/capsule.hpp>
#include <palpate/scene/per_body.hpp>
#include <palpate/scene/scene.hpp>
#include <palpate/scene/scene_tool.hpp>
