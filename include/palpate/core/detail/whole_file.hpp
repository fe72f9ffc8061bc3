// SPDX-License-Identifier: MIT
#pragma once

#include <palpate/core/error.hpp>

#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <system_error>

namespace palpate::detail {

/// All bytes of a file. Throws `FileError` that begins with the path.
inline std::string read_whole_file(std::filesystem::path const& path) {
  auto const fail = [&](std::string_view what) { throw FileError(message(path.string(), ": ", what)); };
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored)) fail("the file does not exist; check the path");
  if (std::filesystem::is_directory(path, ignored)) fail("this is a folder; give a file");
  std::ifstream file(path, std::ios::binary);
  if (!file) fail("the file can not be opened; check that it may be read");
  std::string text;
  std::array<char, 16384> block;   // not by iterators, which let an exception of the buffer through
  while (file.read(block.data(), block.size()), file.gcount() > 0) text.append(block.data(), static_cast<std::size_t>(file.gcount()));
  if (file.bad()) fail("reading stopped with an error; check the disk or copy the file again");
  return text;
}

/// Writes `content` to `path` so that the file is there as a whole or not at all: a new file beside the target is written,
/// closed without error and then renamed. An older file at `path` stays untouched until then; a link keeps pointing at its file.
/// Throws `FileError`; a partly written file is removed.
inline void write_whole_file(std::filesystem::path const& path, std::string_view content) {
  namespace fs = std::filesystem;
  auto const fail = [&](std::string_view reason, std::string_view remedy) {
    throw FileError(message("can not write ", path.string(), ": ", reason, "; ", remedy));
  };
  if (path.filename().empty()) fail("it names no file", "give a folder and a file name");

  std::error_code ignored;
  fs::path target = path;
  if (fs::is_symlink(path, ignored)) {
    fs::path const resolved = fs::weakly_canonical(path, ignored);
    if (!ignored) target = resolved;
  }
  fs::path const folder = target.has_parent_path() ? target.parent_path() : fs::path(".");
  if (!fs::is_directory(folder, ignored))
    fail(message("there is no folder ", folder.string()), "create it first or choose another");
  if (fs::exists(target, ignored) && !fs::is_regular_file(target, ignored))
    fail("it exists and is not a regular file", "choose another name");

  std::FILE* file = nullptr;
  fs::path temporary;
  for (int attempt = 0; file == nullptr; ++attempt) {   // "x": a file that another writer is busy with is not shared
    temporary = target;
    temporary += message(".part", attempt);
    errno = 0;
    file = std::fopen(temporary.string().c_str(), "wbx");
    if (file == nullptr && (errno != EEXIST || attempt == 99))
      fail(std::generic_category().message(errno),
           message("check that folder ", folder.string(), " may be written, and remove old .part files from it"));
  }
  errno = 0;
  bool const written = std::fwrite(content.data(), 1, content.size(), file) == content.size() && std::fflush(file) == 0;
  int problem = errno;
  bool const closed = std::fclose(file) == 0;
  if (written && !closed) problem = errno;
  std::error_code renaming;
  if (written && closed) fs::rename(temporary, target, renaming);
  if (!written || !closed || renaming) {
    fs::remove(temporary, ignored);
    fail(renaming ? renaming.message() : std::generic_category().message(problem),
         "check the free space and the rights of its folder; nothing was left half-written");
  }
}

}  // namespace palpate::detail
