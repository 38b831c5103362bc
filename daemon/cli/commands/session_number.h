#pragma once

#include <CLI/CLI.hpp>
#include <charconv>
#include <cstdint>
#include <string>

namespace cellcal::daemon {

/// Of an option or argument that is a session's number.
inline CLI::Validator session_number() {
  return CLI::Validator(
      [](const std::string& text) {
        std::int64_t number = 0;
        const char* const end = text.data() + text.size();
        const auto [at, error] = std::from_chars(text.data(), end, number);
        const bool sound = error == std::errc() && at == end && number > 0;
        return sound ? std::string()
                     : "\"" + text + "\" must be a session's number, a whole one from 1";
      },
      "");
}

}  // namespace cellcal::daemon
