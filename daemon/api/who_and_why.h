#pragma once
// Who says so, and why, as a request's body has it.

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "daemon/api/http/message.h"

namespace cellcal::daemon {

inline constexpr std::size_t kLongestReason = 500;

/// One line that says something. Throws BadRequest.
std::string line_in(const nlohmann::json& body, const char* key, std::size_t longest);
/// The token's name, and in front of it what stands under "by": who says to be somebody is so by the word of this token
/// alone, which stays beside it. Throws BadRequest.
std::string who_asks(const Request& request, const nlohmann::json& body);

}  // namespace cellcal::daemon
