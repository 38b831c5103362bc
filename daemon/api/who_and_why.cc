#include "daemon/api/who_and_why.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "daemon/files/printable.h"

namespace cellcal::daemon {

namespace {

constexpr std::size_t kLongestName = 100;

}  // namespace

std::string line_in(const nlohmann::json& body, const char* key, std::size_t longest) {
  const std::string text =
      body.contains(key) && body[key].is_string() ? body[key].get<std::string>() : "";
  if (text.find_first_not_of(' ') == std::string::npos || text.size() > longest ||
      printable(text) != text)
    throw BadRequest(fmt::format(
        "\"{}\" must be a text of 1 to {} bytes without control characters", key, longest));
  return text;
}

std::string who_asks(const Request& request, const nlohmann::json& body) {
  if (!body.contains("by")) return request.caller.name;
  return fmt::format("{} ({})", line_in(body, "by", kLongestName), request.caller.name);
}

}  // namespace cellcal::daemon
