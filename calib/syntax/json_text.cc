#include "calib/syntax/json_text.h"

#include <nlohmann/json.hpp>

namespace cellcal::calib {

nlohmann::json parse_json(std::string_view text) {
  return nlohmann::json::parse(text, nullptr, false);
}

nlohmann::ordered_json parse_ordered_json(std::string_view text) {
  return nlohmann::ordered_json::parse(text);
}

std::string write_json(const nlohmann::json& value) { return value.dump(); }

std::string write_lines(const nlohmann::ordered_json& value) {
  return value.dump(1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace cellcal::calib
