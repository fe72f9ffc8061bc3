// SPDX-License-Identifier: MIT
#pragma once

namespace palpate {

/// In which order a relaxation visits the free particles.
enum class VisitOrder {
  index,           ///< as they are numbered
  breadth_first,   ///< the touched ones, then their neighbours, then theirs: ring by ring
  random,          ///< shuffled anew for every sweep, from the seed
};

}  // namespace palpate
