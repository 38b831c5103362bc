#pragma once
// Everything about a cell that can be looked at without moving it. The arm is held where it stands:
// over RSI the adapter answers by its own rule for new sessions, over EKI nothing but beats are
// sent. No move is ever begun here.

#include <filesystem>
#include <functional>
#include <stop_token>
#include <string>

#include "daemon/doctor/finding.h"

namespace cellcal::daemon {

struct DoctorRequest {
  std::filesystem::path config;
  std::filesystem::path cell;   ///< empty: robot and cell files are not looked at
  std::filesystem::path files;  ///< controller's files to compare; empty: none
  double wait_s = 20.0;         ///< for the controller's first packet or state
  double observe_s = 10.0;      ///< of the links, once they are up
  /// What the person has to do now, and how long there is time for it.
  std::function<void(const std::string&)> hint = [](const std::string&) {};
  std::stop_token stop{};  ///< asked for: ends soon, with findings that nobody reads
};

/// Looks at everything in an order in which what fails first is what is mended first. Throws
/// nothing that a cell could cause.
void examine(const DoctorRequest& request, Findings& findings);

struct DaemonConfig;
/// The same from within the daemon, with the configuration that is in force and its own rights. No session may be
/// under way.
void examine_from_within(const DoctorRequest& request, const DaemonConfig& config,
                         Findings& findings);

}  // namespace cellcal::daemon
