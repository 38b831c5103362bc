#pragma once

#include <string>

#include "calib/model/error.h"
#include "daemon/config/config.h"

namespace cellcal::daemon::testing {

/// Reason for the refusal of a configuration, or "accepted".
inline std::string reason(const std::string& text) {
  try {
    parse_config(text, "d.toml");
    return "accepted";
  } catch (const calib::FileError& error) {
    return error.what();
  }
}

}  // namespace cellcal::daemon::testing
