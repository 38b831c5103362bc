#pragma once
// The page: what a browser is given at "/" and under "/page/". Everybody may have these; they say
// nothing of the cell.

#include <optional>
#include <string_view>

#include "daemon/api/http/message.h"

namespace cellcal::daemon {

/// The page itself, by its asset's path: of a cell, or of a plant.
inline constexpr const char* kCellPage = "/";
inline constexpr const char* kFleetPage = "/fleet";

/// Nothing where the request is for none of them. Waits for nothing.
std::optional<Response> page_answer(const Request& request);
/// With that page at "/", and no other.
std::optional<Response> page_answer_at(const Request& request, std::string_view home);

}  // namespace cellcal::daemon
