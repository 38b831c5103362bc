#pragma once
// What a calibration says for a controller's $config.dat: the tool's frame as it was identified, bases on
// the touched targets; and how far the axes are mastered off, as a proposal that nobody writes.

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
  std::optional<int> tool;                          ///< number of TOOL_DATA that is the cell's tool
  std::map<int, std::array<std::string, 3>> bases;  ///< by BASE_DATA's number: origin, on +x, on +y
  std::vector<KrlFile> controller;                  ///< $config.dat, $machine.dat
  std::string calibration;                          ///< its file, for the comments
};

struct ProposedFrame {
  enum class Kind { kTool, kBase };

  Kind kind = Kind::kTool;
  std::string name;  ///< "TOOL_DATA[1]"
  calib::FrameMmDeg frame;
  std::optional<calib::FrameMmDeg> old;   ///< as the controller's file has it
  double shift_mm = 0.0, turn_deg = 0.0;  ///< from the old one
  /// Tools: 1 sigma of each component where the touches decided; 0: as the cell file states it.
  std::array<double, 3> sigma_mm{};
};

/// How far an axis stands off what its controller shows.
struct MasteringOffset {
  std::string joint;
  double offset_deg = 0.0, sigma_deg = 0.0;  ///< to be added to the shown angle; 1 sigma
  calib::DecidedBy decided_by = calib::DecidedBy::kData;
};

struct ProposedFrames {
  std::vector<ProposedFrame> frames;
  std::vector<MasteringOffset> mastering;
  bool robroot_stated = false;
  /// The lines of $config.dat, LF between them.
  std::string config_lines;
  /// A KRL program that sets them, the old values in its comments. CR LF, ASCII.
  std::string snippet;
};

/// A TOOL_DATA further than this from the cell file's tool is another tool.
inline constexpr double kAnotherToolMm = 10.0;

/// Throws FileError: no such target, three in a line, a tool that is not the cell's.
ProposedFrames propose_frames(const calib::Calibration& calibration, const FramesRequest& request);

}  // namespace cellcal::daemon::krl
