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
  std::size_t module = 0;
  bool left = false;  ///< goes to a point that stays as it is
  bool cp = false;    ///< LIN, CIRC, a spline: stays in the posture that it begins in
  Frames frames;
  int line = 0;
  /// The motion right before it, whose posture this one begins in; -1: none that is sure.
  int previous = -1;
  Lost lost;                                ///< why there is none
  std::optional<Refusal> wrong_frame_data;  ///< the FDAT that it names is not there
};

/// A .src, its .dat, and what it changes itself.
struct Module {
  std::string src;
  FrameChanges changes;
  int motion_lines = 0;           ///< with those that were not understood
  std::vector<Refusal> refusals;  ///< of what was not understood
};

/// One module, or all of a backup.
struct Program {
  std::vector<Module> modules;
  /// That motions go to; by name, or "line 12" where nameless. In a backup those of one module alone have
  /// its number behind '@'.
  std::map<std::string, Point> points;
  std::vector<Motion> motions;
  std::map<std::string, Point> left_points;  ///< those of `left` whose values are known
  std::map<std::string, std::string> left;   ///< points that stay as they are, and where they stand
  std::map<std::string, Refusal>
      computed;                ///< points that are read or changed beside motions, by key
  std::vector<Refusal> twice;  ///< points that are given twice
  Data data;  ///< of the controller's files the tools, bases, loads and FDATs; of one module all
};

/// The key without the module's number.
std::string name_of_key(const std::string& key);
/// Homes and the mastering reference: nobody moves them.
bool stays(const std::string& name);

struct ProgramFiles {
  KrlFile src;
  std::optional<KrlFile> dat;
  std::vector<KrlFile> controller;    ///< $config.dat, $machine.dat
  std::vector<KrlFile> modules = {};  ///< .src files whose routines it may call
};

/// `leave`: names, in upper case, of points that stay as they are; `still`: of routines that neither move
/// nor set frames. Throws FileError for a name of `leave` that no point has.
Program read_program(const ProgramFiles& files, const std::vector<std::string>& leave,
                     const std::vector<std::string>& still);

/// All modules of a controller together.
struct BackupFiles {
  std::vector<ProgramFiles> modules;  ///< without `controller` and `modules` of their own
  std::vector<KrlFile> data;          ///< .dat files without a .src
  std::vector<KrlFile> controller;    ///< $config.dat, $machine.dat
};
Program read_programs(const BackupFiles& files, const std::vector<std::string>& leave,
                      const std::vector<std::string>& still);

}  // namespace cellcal::daemon::krl
