// SPDX-License-Identifier: MIT
#pragma once

#include "options.hpp"
#include "outcome.hpp"
#include "scene.hpp"

#include <string>
#include <vector>

namespace incision {

/// Makes the folder and tries whether files can be written there, so that a long run is not in vain. Throws palpate::FileError.
/// What it made and nothing was written to is gone with it.
class OutputFolder {
 public:
  explicit OutputFolder(std::filesystem::path const& folder);
  ~OutputFolder();
  OutputFolder(OutputFolder const&) = delete;
  OutputFolder& operator=(OutputFolder const&) = delete;

 private:
  std::vector<std::filesystem::path> made_;   // the innermost first
};

/// Writes session.csv, tissue.pvd with its frames, and the pictures and charts. Every file is there as a whole or not at all.
/// Without a display the pictures are left out with one line on standard error. Returns the names of what was written.
std::vector<std::string> write_outputs(Options const& options, Organ const& organ, Hand const& hand, Outcome const& outcome);

}  // namespace incision
