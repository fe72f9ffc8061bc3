// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/vtk/detail/text_scanner.hpp>

#include <bit>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>

namespace palpate::detail {

/// Throws `FileError` when an STL file holds fewer triangles than it announces: VTK would read what is there.
/// A binary file announces its number of triangles (80 bytes of text, the number, 50 bytes each); a text file ends in "endsolid".
inline void check_stl_complete(std::string_view bytes, std::string const& name) {
  constexpr std::size_t header = 84, triangle = 50;
  std::uint32_t announced = 0;
  if (bytes.size() >= header) {
    std::memcpy(&announced, bytes.data() + 80, sizeof announced);   // the format is little-endian
    if constexpr (std::endian::native == std::endian::big)
      announced = (announced >> 24) | ((announced >> 8) & 0xff00u) | ((announced << 8) & 0xff0000u) | (announced << 24);
    if (bytes.size() == header + triangle * announced) return;
  }
  std::string_view text = bytes;
  bool const printable = bytes.find('\0') == std::string_view::npos;
  if (take_word(text) == "solid" && printable) {
    if (bytes.find("endsolid") == std::string_view::npos)
      throw FileError(message(name, ": there is no \"endsolid\"; the file was cut short"));
    return;
  }
  if (bytes.size() < header)
    throw FileError(message(name, ": ", bytes.size(), " bytes are too few for an STL file; was it cut short?"));
  if (bytes.size() < header + triangle * announced)
    throw FileError(message(name, ": the file announces ", announced, " triangles and holds ",
                            (bytes.size() - header) / triangle, "; it was cut short"));
}

}  // namespace palpate::detail
