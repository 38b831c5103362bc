#pragma once
// A calibration's proposals for a controller's $config.dat: the identified tool frame, bases on the
// touched targets; and the mastering offsets of the axes, which are never written.

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "calib/export/krl_text.h"
#include "calib/model/units.h"
#include "calib/result/calibration.h"

namespace cellcal::daemon::krl {

using namespace calib::krl;

struct FramesRequest {
  std::optional<int> tool;                          ///< number of the TOOL_DATA
  std::map<int, std::array<std::string, 3>> bases;  ///< by BASE_DATA: origin, on +x, on +y
  std::vector<KrlFile> controller;                  ///< $config.dat, $machine.dat
  std::string calibration;                          ///< its file name, for the comments
  std::string program = "cellcal_frames";           ///< name of the snippet's routine and file
};

struct ProposedFrame {
  enum class Kind { kTool, kBase };

  Kind kind = Kind::kTool;
  std::string name;  ///< "TOOL_DATA[1]"
  calib::FrameMmDeg frame;
  std::optional<calib::FrameMmDeg> old;   ///< from the controller's file
  double shift_mm = 0.0, turn_deg = 0.0;  ///< from the old frame
  /// Tools: 1 sigma of each component identified by touches; 0: as in the cell file.
  std::array<double, 3> sigma_mm{};
};
/// All zeros: a number in which nothing was stored.
bool is_empty(const calib::FrameMmDeg& frame);

struct ProposedFrames {
  std::vector<ProposedFrame> frames;
  std::vector<calib::ZeroOffset> mastering;
  bool robroot_stated = false;
  /// Lines of $config.dat, separated by LF.
  std::string config_lines;
  /// KRL program that sets them, old values in its comments. CR LF, ASCII.
  std::string snippet;
};

/// A TOOL_DATA farther than this from the cell file's tool is another tool.
inline constexpr double kAnotherToolMm = 10.0;

/// Throws FileError: unknown target, three in a line, a tool that is not the cell's.
ProposedFrames propose_frames(const calib::Calibration& calibration, const FramesRequest& request);

}  // namespace cellcal::daemon::krl
