// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/detail/text.hpp>
#include <palpate/core/detail/whole_file.hpp>
#include <palpate/core/error.hpp>

#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace palpate::detail {

/// A text file of comma-separated columns with a header line, held as text; cells point into it.
/// Read       blank lines and lines that start with # are skipped; a byte-order mark, carriage returns, blanks around a cell and
///            double quotes around a cell are dropped. Commas inside quotes are not understood.
/// Errors     every message names the file, and the line, counted from 1 as editors do.
class CsvTable {
 public:
  using Row = std::vector<std::string_view>;

  explicit CsvTable(std::filesystem::path path) : path_(std::move(path)), text_(read_whole_file(path_)) { skip_mark(); }
  CsvTable(CsvTable const&) = delete;
  CsvTable& operator=(CsvTable const&) = delete;

  /// The next line with content, split into cells; false at the end.
  bool next(Row& row) {
    while (position_ < text_.size()) {
      std::string_view const rest = std::string_view(text_).substr(position_);
      auto const length = rest.find('\n');
      position_ += length == std::string_view::npos ? rest.size() : length + 1;
      ++line_;
      std::string_view const content = trimmed(rest.substr(0, length));
      if (content.empty() || content.front() == '#') continue;
      split(content, row);
      return true;
    }
    return false;
  }

  int line() const noexcept { return line_; }
  /// Does the text end with the end of a line? If not, its last number may have lost digits.
  bool ends_with_line() const noexcept { return text_.ends_with('\n'); }

  /// The value of a cell; throws with the line and the column's name unless it is a number.
  double number(Row const& row, std::size_t column, std::string_view name) const {
    if (auto const value = to_number<double>(row[column])) return *value;
    fail_here(message("column ", name, " holds \"", legible(row[column]), "\", which is not a number a double can hold; ",
                      "write numbers with a decimal point"));
  }

  [[noreturn]] void fail(std::string_view what) const { throw FileError(message(path_.string(), ": ", what)); }
  [[noreturn]] void fail_here(std::string_view what) const {
    throw FileError(message(path_.string(), ", line ", line_, ": ", what));
  }

 private:
  static void split(std::string_view line, Row& row) {
    row.clear();
    for (;;) {
      auto const comma = line.find(',');
      std::string_view cell = trimmed(line.substr(0, comma));
      if (cell.size() >= 2 && cell.front() == '"' && cell.back() == '"') cell = trimmed(cell.substr(1, cell.size() - 2));
      row.push_back(cell);
      if (comma == std::string_view::npos) return;
      line.remove_prefix(comma + 1);
    }
  }

  void skip_mark() noexcept {
    if (text_.rfind("\xEF\xBB\xBF", 0) == 0) position_ = 3;
  }

  std::filesystem::path path_;
  std::string text_;
  std::size_t position_ = 0;
  int line_ = 0;
};

}  // namespace palpate::detail
