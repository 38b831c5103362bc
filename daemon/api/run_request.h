#pragma once
// What POST /v1/run asks for.

#include <string>

#include "daemon/service/service.h"

namespace cellcal::daemon {

/// Throws BadRequest naming the key.
RunRequest run_request(const std::string& body);

}  // namespace cellcal::daemon
