#pragma once
// The page: what a browser is given at "/" and under "/page/". Everybody may have these; they say
// nothing of the cell.

#include <optional>

#include "daemon/api/http/message.h"

namespace cellcal::daemon {

/// Nothing where the request is for none of them. Waits for nothing.
std::optional<Response> page_answer(const Request& request);

}  // namespace cellcal::daemon
