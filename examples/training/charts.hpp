// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/training/comparison.hpp>
#include <palpate/training/session.hpp>

#include <filesystem>
#include <string>
#include <vector>

namespace training {

/// One person's session, as it is drawn: the force is the tissue's alone.
struct Drawn {
  std::string label;
  palpate::Session const* session;
  palpate::Comparison const* comparison = nullptr;   // with the expert's; none for the expert
};

/// path.png: the tips from above. deviation.png: how far from the expert's path, over time. force.png: the tissue's force over depth.
void write_charts(std::filesystem::path const& folder, std::vector<Drawn> const& all);

}  // namespace training
