#pragma once
// Internal to this module: one batch in one transaction.

#include <string>
#include <string_view>
#include <vector>

#include "daemon/fleet/connection.h"

namespace cellcal::daemon::fleet {

/// Throws StoreUnavailable, BadData; nothing is written then.
Written write_once(pqxx::connection& connection, const Batch& batch);

// Corrections of each joint, extracted from a calibration for comparison between robots.

struct Correction {
  std::string joint, parameter, unit;
  double correction = 0.0, sigma = 0.0;  ///< in `unit`
  const char* decided_by = "";
};

/// Corrections of the arm's joints. Empty for a document that this version cannot read, which is
/// stored nevertheless.
std::vector<Correction> corrections_of(std::string_view document);

}  // namespace cellcal::daemon::fleet
