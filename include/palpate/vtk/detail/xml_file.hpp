// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/detail/text.hpp>
#include <palpate/core/error.hpp>

#include <vtkNew.h>
#include <vtkSmartPointer.h>

#include <algorithm>
#include <cstddef>
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
  vtkNew<Reader> reader;
  reader->ReadFromInputStringOn();
  reader->SetInputString(without_data(bytes));
  reader->Update();
  return vtkSmartPointer(reader->GetOutput());
}

}  // namespace palpate::detail
