#pragma once
// JSON as it is sent.

#include <nlohmann/json.hpp>
#include <string>

namespace cellcal::daemon {

/// Words of devices may hold any bytes; what is not UTF-8 is shown as such, never thrown over.
inline std::string dump(const nlohmann::json& value) {
  return value.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace cellcal::daemon
