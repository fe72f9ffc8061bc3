// SPDX-License-Identifier: MIT
#pragma once

// The haptic hierarchy over a network: all of the component network.
#include <palpate/network/hand_reporter.hpp>
#include <palpate/network/haptic_client.hpp>
#include <palpate/network/impaired_link.hpp>
#include <palpate/network/local_surface.hpp>
#include <palpate/network/messages.hpp>
#include <palpate/network/network_simulation.hpp>
#include <palpate/network/onlooker.hpp>
#include <palpate/network/options.hpp>
#include <palpate/network/picture_messages.hpp>
#include <palpate/network/protocol.hpp>
#include <palpate/network/remote_tissue.hpp>
#include <palpate/network/surface_then_tissue.hpp>
#include <palpate/network/tissue_node.hpp>
#include <palpate/network/tissue_server.hpp>
#include <palpate/network/weber_deadband.hpp>
