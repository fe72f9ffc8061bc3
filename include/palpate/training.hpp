// SPDX-License-Identifier: MIT
#pragma once

/// training: sessions of a person, recorded, replayed and compared; guidance of a hand along a path. Not part of palpate.hpp.
#include <palpate/training/alignment.hpp>
#include <palpate/training/comparison.hpp>
#include <palpate/training/configuration.hpp>
#include <palpate/training/even_recording.hpp>
#include <palpate/training/guidance.hpp>
#include <palpate/training/replay.hpp>
#include <palpate/training/replay_address.hpp>
#include <palpate/training/score.hpp>
#include <palpate/training/session.hpp>
#include <palpate/training/session_io.hpp>
#include <palpate/training/smoothness.hpp>
