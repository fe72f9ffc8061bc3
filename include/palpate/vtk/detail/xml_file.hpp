// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/detail/text.hpp>
#include <palpate/core/error.hpp>

#include <vtkNew.h>
#include <vtkSmartPointer.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace palpate::detail {

/// Throws `FileError` where an XML file of VTK announces a number that can not be: VTK writes beyond its lists for one below zero. What is compressed may be
/// many times as long.
inline void check_xml_numbers(std::string_view bytes, std::string const& name) {
  auto const most = static_cast<long long>(bytes.size()) * (bytes.find("compressor") == std::string_view::npos ? 1 : 1000);
  std::string_view const head = bytes.substr(0, bytes.find("<AppendedData"));
  constexpr std::string_view stem = "NumberOf";
  for (auto at = head.find(stem); at != std::string_view::npos; at = head.find(stem, at + 1)) {
    std::string_view rest = head.substr(at);
    auto const equal = std::min(rest.find_first_of("=\"'"), rest.size());
    std::string_view const attribute = trimmed(rest.substr(0, equal));
    rest.remove_prefix(equal);
    if (!rest.starts_with('=')) continue;   // within a name
    rest.remove_prefix(std::min(rest.find_first_of("\"'"), rest.size() - 1) + 1);
    std::string_view const value = rest.substr(0, rest.find_first_of("\"'"));
    auto const number = to_number<long long>(trimmed(value));
    if (!number || *number < 0 || *number > most)
      throw FileError(message(name, ": ", legible(attribute), " is \"", legible(value), "\"; the file was cut short or is damaged, save it again"));
  }
}

/// The first numbers of what is encoded in base64, or the bytes as they are: the lowest byte first, as this library's machines write.
inline std::uint64_t leading_word(std::string_view bytes, bool base64, std::size_t place, std::size_t size) {
  constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::uint64_t word = 0;
  for (std::size_t i = 0; i < size; ++i) {
    std::size_t const at = place * size + i;
    std::uint64_t byte = 0;
    if (!base64) {
      byte = at < bytes.size() ? static_cast<unsigned char>(bytes[at]) : 0u;
    } else {
      std::size_t const first = at / 3 * 4 + at % 3;
      if (first + 1 >= bytes.size()) break;
      auto const a = digits.find(bytes[first]), b = digits.find(bytes[first + 1]);
      if (a == std::string_view::npos || b == std::string_view::npos) return ~std::uint64_t{0};   // not base64: VTK takes it for any number
      byte = ((a << (2 * (at % 3 + 1))) | (b >> (4 - 2 * (at % 3)))) & 0xFFu;
    }
    word |= byte << (8 * i);
  }
  return word;
}

/// Throws `FileError` where compressed data announce more blocks, or longer ones, than the file can hold: VTK makes room for each, and looks at each.
inline void check_xml_blocks(std::string_view bytes, std::string const& name) {
  auto const file_tag = bytes.substr(0, bytes.find('>', bytes.find("<VTKFile")));
  if (file_tag.find("compressor") == std::string_view::npos || file_tag.find("BigEndian") != std::string_view::npos) return;
  std::size_t const size = file_tag.find("UInt64") != std::string_view::npos ? 8 : 4;
  auto const check = [&](std::string_view data, bool base64) {
    if (base64 && data.starts_with('<')) return;   // there are none
    if (leading_word(data, base64, 0, size) > bytes.size() || leading_word(data, base64, 1, size) > std::max(1100 * bytes.size(), std::size_t{1} << 26))
      throw FileError(message(name, ": compressed data announce more than this file can hold; it was cut short or is damaged, save it again"));
  };
  auto const appended = std::min(bytes.find("<AppendedData"), bytes.size());
  auto const start = bytes.find('_', appended);
  bool const raw = bytes.substr(appended, bytes.find('>', appended) - appended).find("raw") != std::string_view::npos;
  for (auto at = bytes.find("<DataArray"); at < appended; at = bytes.find("<DataArray", at + 1)) {
    auto const end = bytes.find('>', at);
    if (end >= appended) break;
    std::string_view const tag = bytes.substr(at, end - at);
    if (tag.find("format=\"binary\"") != std::string_view::npos || tag.find("format='binary'") != std::string_view::npos) {
      check(bytes.substr(std::min(bytes.find_first_not_of(" \t\r\n", end + 1), bytes.size())), true);
    } else if (auto const offset = tag.find("offset=\""); offset != std::string_view::npos && start != std::string_view::npos) {
      std::string_view rest = tag.substr(offset + 8);
      auto const number = to_number<long long>(rest.substr(0, rest.find('"')));
      if (number && *number >= 0 && static_cast<std::size_t>(*number) < bytes.size() - start) check(bytes.substr(start + 1 + static_cast<std::size_t>(*number)), !raw);
    }
  }
}

/// The file with blanks for the data of points, cells and fields: VTK's reader follows damaged arrays of texts into memory that is not its own.
inline std::string without_data(std::string text) {
  auto const head = std::min(text.find("<AppendedData"), text.size());
  for (std::string const element : {"FieldData", "PointData", "CellData"}) {
    auto const next = [&](std::size_t from) { return text.find("<" + element, from); };
    for (auto at = next(0); at < head; at = next(at + 1)) {
      auto const tag = text.find('>', at);
      bool const empty = tag != std::string::npos && text[tag - 1] == '/';
      auto const end = empty ? tag : text.find("</" + element + ">", at);
      if (end >= head || next(at + 1) < end) break;   // the parser says what is wrong
      for (auto i = at; i < end + (empty ? 1 : element.size() + 3); ++i)
        if (text[i] != '\n') text[i] = ' ';
    }
  }
  return text;
}

/// The surface or grid of an XML file.
template <class Reader>
auto read_xml(std::string const& bytes, std::string const& name) {
  check_xml_numbers(bytes, name);
  check_xml_blocks(bytes, name);
  vtkNew<Reader> reader;
  reader->ReadFromInputStringOn();
  reader->SetInputString(without_data(bytes));
  reader->Update();
  return vtkSmartPointer(reader->GetOutput());
}

}  // namespace palpate::detail
