#pragma once
// Static files of the web page, at "/" and under "/page/". Public: they contain no data of the cell.

#include <optional>
#include <string_view>

#include "daemon/api/http/http.h"

namespace cellcal::daemon {

/// The page by the path of its asset: of a cell, or of a plant.
inline constexpr const char* kCellPage = "/";
inline constexpr const char* kFleetPage = "/fleet";

/// None for other paths. Does not block.
std::optional<Response> page_answer(const Request& request);
/// Serves that page, and no other, at "/".
std::optional<Response> page_answer_at(const Request& request, std::string_view home);

}  // namespace cellcal::daemon
