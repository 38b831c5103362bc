#pragma once
// cellcal frames: what a calibration says for a controller's $config.dat.

#include <filesystem>
#include <string>
#include <vector>

#include "daemon/krl/frames.h"

namespace cellcal::daemon {

struct FramesCommand {
  std::filesystem::path calibration, output;
  std::vector<std::filesystem::path> controller;  ///< $config.dat, $machine.dat
  int tool = 0;                                   ///< of TOOL_DATA; 0: none
  std::vector<std::string> bases;                 ///< "3=S1,S2,S3"
  bool withheld = false, json = false;
};
int frames(const FramesCommand& command);
/// What is proposed, for whoever goes on with it. Throws FileError.
krl::ProposedFrames frames_of(const FramesCommand& command, const calib::Calibration& calibration);

/// "3=S1,S2,S3" is one.
bool is_base(const std::string& text);

}  // namespace cellcal::daemon
