#pragma once
// A program as far as its taught points go: which motions there are, to which points, in which tool
// and base. Everything else of KRL is passed over; where it could change what a motion means the
// motion is refused instead.
//
// Which tool and base: an inline form's FDAT_ACT followed by BAS(#PTP_PARAMS..) and its like, WITH of a
// spline motion, BAS(#TOOL,n), $TOOL=TOOL_DATA[n] and $TOOL={...}. They hold on in the order of the
// text up to the end of the sub-program, or to a call (krl_calls.h) or BAS command that might change them. Where a
// sub-program sets frames or calls inside of IF, LOOP and the like, or has GOTO, they hold up to the
// next line of that kind alone.

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "daemon/krl/krl_changes.h"
#include "daemon/krl/krl_data.h"

namespace cellcal::daemon::krl {

/// A tool or base: a number of TOOL_DATA or BASE_DATA (0: $NULLFRAME), or as it stands in the text.
struct FrameRef {
  int number = 0;
  std::optional<calib::FrameMmDeg> literal;
  bool operator==(const FrameRef& other) const;
};

/// What is active at a motion; empty: that cannot be told.
struct Frames {
  std::optional<FrameRef> tool, base;
  bool external = false;  ///< the tool stands in the cell
  Lost lost;              ///< why a tool or base is not known
};

struct Motion {
  std::string point;  ///< key of Program::points, or where it is left of Program::left_points
  bool left = false;  ///< goes to a point that stays as it is
  bool cp = false;    ///< LIN, CIRC, a spline: stays in the posture that it begins in
  Frames frames;
  int line = 0;
  /// The motion right before it, whose posture this one begins in; -1: none that is sure.
  int previous = -1;
  Lost lost;  ///< why there is none
  std::optional<Refusal> wrong_frame_data;  ///< the FDAT that it names is not there
};

struct Program {
  std::map<std::string, Point>
      points;  ///< that motions go to; by name, or "line 12" where nameless
  std::vector<Motion> motions;
  int motion_lines = 0;  ///< with those that were not understood
  std::map<std::string, Point> left_points;  ///< those of `left` whose values are known
  std::map<std::string, std::string> left;   ///< points that stay as they are, and where they stand
  std::vector<Refusal> refusals;
  FrameChanges changes;
  Data data;  ///< of .dat and .src; of the controller's files the tools, bases, loads and FDATs
};

struct ProgramFiles {
  KrlFile src;
  std::optional<KrlFile> dat;
  std::vector<KrlFile> controller;  ///< $config.dat, $machine.dat
  std::vector<KrlFile> modules = {};  ///< .src files whose routines it may call
};

/// `leave`: names, in upper case, of points that stay as they are; `still`: of routines that neither move
/// nor set frames. Throws FileError for a name of `leave` that no point has.
Program read_program(const ProgramFiles& files, const std::vector<std::string>& leave,
                     const std::vector<std::string>& still);

}  // namespace cellcal::daemon::krl
