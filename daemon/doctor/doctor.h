#pragma once
// Examination of a cell without motion. The arm is held in place: over RSI the adapter answers by its rule
// for new sessions, over EKI only heartbeats are sent. No move is ever begun.

#include <filesystem>
#include <functional>
#include <stop_token>
#include <string>

#include "daemon/doctor/finding.h"

namespace cellcal::daemon {

struct DoctorRequest {
  std::filesystem::path config;
  std::filesystem::path cell;   ///< empty: robot and cell files are not checked
  std::filesystem::path files;  ///< controller files to compare; empty: none
  double wait_s = 20.0;         ///< for the controller's first packet or state
  double observe_s = 10.0;      ///< observation period of the links, once they are up
  /// Operator action required now, and the time left for it.
  std::function<void(const std::string&)> hint = [](const std::string&) {};
  std::stop_token stop{};  ///< when requested, ends soon with incomplete findings
};

/// Runs all checks, ordered so that the first failure is the first to resolve. Throws nothing that a cell
/// could cause.
void examine(const DoctorRequest& request, Findings& findings);

struct DaemonConfig;
/// The same within the daemon, with its active configuration and its own rights. No session may be under way.
void examine_from_within(const DoctorRequest& request, const DaemonConfig& config,
                         Findings& findings);

}  // namespace cellcal::daemon
