#pragma once
// Command cellcal frames: frames of a calibration for a controller's $config.dat.

#include <filesystem>
#include <string>
#include <vector>

#include "daemon/krl/frames.h"

namespace cellcal::daemon {

struct FramesCommand {
  std::filesystem::path calibration, output;
  std::vector<std::filesystem::path> controller;  ///< $config.dat, $machine.dat
  int tool = 0;                                   ///< number in TOOL_DATA; 0: none
  std::vector<std::string> bases;                 ///< "3=S1,S2,S3"
  bool withheld = false, json = false;
};
int frames(const FramesCommand& command);
/// Proposed frames, also for sending. Throws FileError.
krl::ProposedFrames frames_of(const FramesCommand& command, const calib::Calibration& calibration);

/// True for the form "3=S1,S2,S3".
bool is_base(const std::string& text);

}  // namespace cellcal::daemon
