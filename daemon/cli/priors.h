#pragma once
// Command cellcal priors: parameter spreads of a fleet's calibrations, and the robot file with them.

#include <filesystem>
#include <string>
#include <vector>

#include "calib/priors/learn.h"

namespace cellcal::daemon {

/// From files and directories of calibrations, without a daemon.
struct LearnPriorsCommand {
  std::vector<std::filesystem::path> from;
  std::string robot;             ///< file or shipped robot; empty: that of most calibrations
  std::filesystem::path after;   ///< earlier priors, whose version is incremented; empty: none
  std::filesystem::path output;  ///< empty: standard output
  bool json = false;
};
int learn_priors(const LearnPriorsCommand& command);

struct ShowPriorsCommand {
  std::filesystem::path file;
  bool json = false;
};
int show_priors(const ShowPriorsCommand& command);

struct AcceptPriorsCommand {
  std::filesystem::path file, output;
  std::string robot;
  bool json = false;
};
int accept_priors(const AcceptPriorsCommand& command);

// For display.
std::string spreads_words(const calib::FleetPriors& priors);
std::string changes_words(const std::vector<calib::PriorChange>& changes);
std::string set_aside_words(const calib::SetAside& one);
std::string no_priors_words(const calib::Learned& learned);

}  // namespace cellcal::daemon
