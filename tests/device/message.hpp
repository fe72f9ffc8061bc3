// SPDX-License-Identifier: MIT
#pragma once

#include <exception>
#include <string>
#include <string_view>

namespace palpate_test {

/// The text of the exception that `call` throws.
template <class Call>
std::string message_of(Call&& call) {
  try {
    call();
  } catch (std::exception const& error) {
    return error.what();
  }
  return "(no exception)";
}

/// What of `parts` the message does not contain, with the message; empty when it contains all of them. Works alike in every Catch2.
template <class... Parts>
std::string unsaid(std::string const& message, Parts const&... parts) {
  std::string missing;
  for (std::string_view const part : {std::string_view(parts)...})
    if (message.find(part) == std::string::npos) missing += "\"" + std::string(part) + "\" is not in: " + message + "\n";
  return missing;
}

}  // namespace palpate_test
