#pragma once
// Command cellcal frames: frames of a calibration for a controller's $config.dat.

#include <filesystem>
#include <string>
#include <vector>

#include "daemon/cli/client.h"
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

// Frames set on the controller through the daemon. Each function returns its exit status and throws on
// failure.

struct SendFrames {
  bool send = false, confirm = false, list = false;
  bool other_calibration = false;  ///< also a calibration that is not in use on the daemon
  int restore = 0;                 ///< number of --sent; 0: none
};

/// Reads all frames, shows old and new values, asks for confirmation and sets them. Stops at the first
/// failure and lists the frames set before.
int send_frames(const Connection& daemon, const FramesCommand& frames, const SendFrames& how);
int list_sent_frames(const Connection& daemon);
int restore_frame(const Connection& daemon, const SendFrames& how);

// Position of the arm, from the controller through the daemon.

/// Prints the axis angles in the format of a taught sphere. Throws as ask() does.
int show_position(const Connection& daemon);

}  // namespace cellcal::daemon
