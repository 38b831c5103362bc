#pragma once
// A program reduced to its taught points: motions, their points, tools and bases. Other statements
// are ignored; a motion is refused if they could change its meaning.
//
// Tool and base: an inline form's FDAT_ACT followed by BAS(#PTP_PARAMS..) and the like, WITH of a
// spline motion, BAS(#TOOL,n), $TOOL=TOOL_DATA[n] and $TOOL={...}. They are known at a motion where
// all paths to it agree (krl_state.h).

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "calib/model/error.h"
#include "daemon/krl/krl_changes.h"
#include "daemon/krl/krl_data.h"
#include "daemon/krl/krl_flow.h"

namespace cellcal::daemon::krl {

/// A tool or base: number of TOOL_DATA or BASE_DATA (0: $NULLFRAME), or written out in the text.
struct FrameRef {
  int number = 0;
  std::optional<calib::FrameMmDeg> literal;
  /// Base on an external kinematic, EK(...): the index of MACHINE_DEF. 0: as MACHINE_FRAME_DAT[number] says; -1: set
  /// as $BASE itself, which turns with no axis.
  int machine = 0;
  bool operator==(const FrameRef& other) const;
};

/// A load: number of LOAD_DATA, a variable of type LOAD, or written out in the text.
struct LoadRef {
  int number = -1;
  std::string name;
  LoadData stated;  ///< without a number
  bool operator==(const LoadRef&) const = default;
};

/// Identification of a tool.
struct ToolUsed {
  int number = 0;          ///< of TOOL_DATA; -1: written out in the text
  bool cells = false;      ///< the cell file's own, with its bending; otherwise stiff and as stated
  bool load_known = true;  ///< from LOAD_DATA; otherwise the cell's tool is assumed as the load
  /// Of LOAD_DATA, where the program sets another than the tool's own, or where that of the cell file's tool is not the
  /// cell file's.
  int load = -1;
  std::string load_name = {};  ///< of the variable, where the program sets one
  bool other_load() const { return load >= 0 || !load_name.empty(); }
  bool operator==(const ToolUsed&) const = default;
};

/// Active at a motion; empty: unknown.
struct Frames {
  std::optional<FrameRef> tool, base;
  bool external = false;  ///< the tool is fixed in the cell
  /// In force by $LOAD; none: the tool's own, as BAS and inline forms set it.
  std::optional<LoadRef> load;
  bool load_known = true;
  Aggregate load_parts;  ///< as far as $LOAD is written out
  /// The statement that set each, or made it unknown.
  Lost tool_at, base_at, load_at;

  /// LOAD_DATA that a known tool is borne with; -1: none.
  int load_number() const { return load ? load->number : tool->number; }
  /// The load where it is not the tool's own.
  std::optional<LoadRef> other_load() const {
    const bool own =
        load && load->name.empty() && tool && !tool->literal && load->number == tool->number;
    return own ? std::nullopt : load;
  }
};

struct Motion {
  std::string point;  ///< key of Program::points, or of Program::left_points
  std::size_t module = 0;
  bool left = false;  ///< its point stays unchanged
  bool cp = false;    ///< LIN, CIRC, a spline: keeps the posture of its start
  Frames frames;
  int line = 0;
  int start = 0;                            ///< place in Program::flow
  std::optional<Refusal> wrong_frame_data;  ///< its FDAT is missing
};

/// XP2=XP1: a point that may have another's value.
struct Copy {
  std::string to, from;  ///< keys of points
  Refusal refusal;       ///< where they cannot be corrected alike
};

/// TOOL_DATA[1]={FRAME: X 1.0,...} in a module's first routine, before it moves, calls a routine that may move, or jumps,
/// and while another frame is in force: for its motions this is the number's value if no statement makes it another.
struct AssignedFrame {
  std::size_t module = 0;
  bool tool = false;  ///< else a base
  int number = 0;
  calib::FrameMmDeg value;
};

/// A .src and its .dat.
struct Module {
  std::string src;
  /// Its own and its callees', and those of other modules that state a number.
  FrameChanges changes;
  int motion_lines = 0;           ///< including those not understood
  std::vector<Refusal> refusals;  ///< statements that are not understood
  bool kukas = false;             ///< the controller's own program: stays as it is
};

/// One module, or a whole backup.
struct Program {
  std::vector<Module> modules;
  /// Targets of motions; by name, or "line 12" if unnamed. In a backup, points of a single module
  /// have its number after '@'.
  std::map<std::string, Point> points;
  std::vector<Motion> motions;
  Flow flow;
  std::map<std::string, Point> left_points;  ///< those of `left` with known values
  std::map<std::string, std::string> left;   ///< points that stay unchanged, and their file
  std::map<std::string, Refusal> computed;   ///< points read or changed outside motions, by key
  std::vector<Refusal> twice;                ///< points stated twice
  FrameChanges changes;                      ///< by all modules but the controller's own
  std::map<std::string, calib::FileError> no_points;  ///< names of `leave` without a point
  std::vector<AssignedFrame> assigned;
  std::vector<Copy> copies;
  std::set<std::string> copied_to;  ///< keys of points that take another's value
  /// Of a single module: the routines of other modules that it calls and that move.
  std::vector<calib::Phrase> callees;
  Data data;  ///< the controller's tools, bases, loads and FDATs; for a single module all data
};

/// Key without the module's number.
std::string name_of_key(const std::string& key);
/// Programs of the controller's system (BAS, IR_STOPM, the brake test, $...), which have no points
/// of the user.
bool is_kukas_program(const std::string& src);
/// Homes, the mastering and brake references, which never change unless they are a module's own alone. `own`: of the
/// module's files; `global`: others see it, too.
bool stays(const std::string& name, bool own, bool global);

struct ProgramFiles {
  KrlFile src;
  std::optional<KrlFile> dat;
  std::vector<KrlFile> controller;    ///< $config.dat, $machine.dat
  std::vector<KrlFile> modules = {};  ///< .src files with routines that it may call
};

/// `leave`: names, in upper case, of points that stay unchanged; `still`: of routines that neither
/// move nor set frames.
Program read_program(const ProgramFiles& files, const std::vector<std::string>& leave,
                     const std::vector<std::string>& still);

/// All modules of a controller.
struct BackupFiles {
  std::vector<ProgramFiles> modules;  ///< without `controller` and `modules` of their own
  std::vector<KrlFile> data;          ///< .dat files without a .src
  std::vector<KrlFile> controller;    ///< $config.dat, $machine.dat
};
/// Warnings of the routines in `modules` of the first program that it calls, directly or not, and that move to points:
/// these stay uncorrected; and of those that no given file has.
std::vector<calib::Phrase> uncorrected_callees(const BackupFiles& files,
                                               const std::vector<std::string>& still);

/// Throws FileError for a name of `leave` without a point.
Program read_programs(const BackupFiles& files, const std::vector<std::string>& leave,
                      const std::vector<std::string>& still);

}  // namespace cellcal::daemon::krl
