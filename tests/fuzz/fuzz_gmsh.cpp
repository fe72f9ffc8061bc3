// SPDX-License-Identifier: MIT
// Any bytes as a Gmsh file: a valid volume, or an error in one line.
#include <palpate/core/error.hpp>
#include <palpate/mesh/validation.hpp>
#include <palpate/volume/read_gmsh.hpp>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

extern "C" int LLVMFuzzerTestOneInput(std::uint8_t const* data, std::size_t size) {
  try {
    auto const mesh = palpate::parse_gmsh(std::string_view(reinterpret_cast<char const*>(data), size), 1.0);
    if (!palpate::validate(mesh).empty()) std::abort();
    for (auto const& group : palpate::parse_gmsh_groups(std::string_view(reinterpret_cast<char const*>(data), size)))
      for (int const t : group.tetrahedra)
        if (t < 0 || t >= mesh.tetrahedra.cols()) std::abort();
  } catch (palpate::FileError const& error) {
    if (std::string_view(error.what()).find('\n') != std::string_view::npos) std::abort();
  }
  return 0;
}
