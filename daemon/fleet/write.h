#pragma once
// Within this module: one batch in one transaction.

#include <string>
#include <string_view>
#include <vector>

#include "daemon/fleet/connection.h"

namespace cellcal::daemon::fleet {

/// Throws StoreUnavailable, BadData; then nothing of it is written.
Written write_once(pqxx::connection& connection, const Batch& batch);

// What a calibration says of each joint, taken out of its document for comparison over robots.

struct Correction {
  std::string joint, parameter, unit;
  double correction = 0.0, sigma = 0.0;  ///< in `unit`
  const char* decided_by = "";
};

/// Of the arm's joints. Empty of a document that this program cannot read: it is stored all the same.
std::vector<Correction> corrections_of(std::string_view document);

}  // namespace cellcal::daemon::fleet
