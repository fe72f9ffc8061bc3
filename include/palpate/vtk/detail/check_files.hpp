// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/detail/text.hpp>
#include <palpate/core/detail/whole_file.hpp>
#include <palpate/core/error.hpp>

#include <vtkCellArray.h>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <string>
#include <string_view>

namespace palpate::detail {

inline constexpr std::string_view byte_order_mark = "\xEF\xBB\xBF";   // of UTF-8, as some editors put it before a text

inline std::string lower_case(std::string text) {
  for (char& c : text)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return text;
}

/// The bytes of a file. Throws `FileError` in one line: missing, a folder, unreadable, empty.
inline std::string read_bytes(std::filesystem::path const& file) {
  std::string bytes = read_whole_file(file);
  if (bytes.find_first_not_of(" \t\r\n") == std::string::npos) throw FileError(message(file.string(), ": the file is empty"));
  return bytes;
}

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
  if (bytes.starts_with(byte_order_mark)) throw FileError(message(name, ": the file begins with a byte-order mark; save it as text without one"));
  std::string_view text = bytes;
  bool const printable = bytes.find('\0') == std::string_view::npos;
  if (lower_case(std::string(take_word(text))) == "solid" && printable) {
    if (lower_case(std::string(bytes)).find("endsolid") == std::string::npos)
      throw FileError(message(name, ": there is no \"endsolid\"; the file was cut short"));
    return;
  }
  if (bytes.size() < header)
    throw FileError(message(name, ": ", bytes.size(), " bytes are too few for an STL file; was it cut short?"));
  if (bytes.size() < header + triangle * announced)
    throw FileError(message(name, ": the file announces ", announced, " triangles and holds ",
                            (bytes.size() - header) / triangle, "; it was cut short"));
}

/// "face 3 refers to vertex 9, the file has vertices 0 … 3; was it cut short?"
inline std::string no_such_vertex(std::string const& name, std::string_view what, long long index, auto vertex, long long vertices) {
  return message(name, ": ", what, " ", index, " refers to vertex ", vertex, ", the file has vertices 0 … ", vertices - 1, "; was it cut short?");
}

/// VTK's filters follow every index: a corner that is no vertex must not reach them. `what`: a cell of the list.
inline void check_cell_array(vtkCellArray* cells, vtkIdType points, std::string_view what, std::string const& name) {
  if (!cells->IsValid()) throw FileError(message(name, ": the list of ", what, "s is damaged; save the file again"));
  for (vtkIdType cell = 0; cell < cells->GetNumberOfCells(); ++cell) {
    vtkIdType size = 0;
    vtkIdType const* corners = nullptr;
    cells->GetCellAtId(cell, size, corners);
    for (vtkIdType i = 0; i < size; ++i)
      if (corners[i] < 0 || corners[i] >= points) throw FileError(no_such_vertex(name, what, cell, corners[i], points));
  }
}

}  // namespace palpate::detail
