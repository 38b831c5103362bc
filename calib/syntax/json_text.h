#pragma once
// JSON as text, both ways: the parser and the writer take the compiler long, so they stand once.

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

namespace cellcal::calib {

/// Discarded (`is_discarded()`) where the text is not JSON.
nlohmann::json parse_json(std::string_view text);

/// Of JSON that is known to be valid; keys keep their order.
nlohmann::ordered_json parse_ordered_json(std::string_view text);

/// In one line. Throws what nlohmann throws at bytes that are not UTF-8.
std::string write_json(const nlohmann::json& value);

/// A value a line, as files have it; bytes that are not UTF-8 are replaced.
std::string write_lines(const nlohmann::ordered_json& value);

}  // namespace cellcal::calib
