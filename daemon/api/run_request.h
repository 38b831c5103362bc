#pragma once
// What POST /v1/run asks for.

#include <stdexcept>
#include <string>

#include "daemon/service/service.h"

namespace cellcal::daemon {

/// A request that is wrong in itself.
struct BadRequest : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Throws BadRequest naming the key.
RunRequest run_request(const std::string& body);

}  // namespace cellcal::daemon
