#pragma once
// What of a program is not understood, or cannot be corrected: a program with one such point is not
// written at all.

#include <optional>
#include <string>
#include <vector>

#include "calib/export/corrector.h"

namespace cellcal::daemon::krl {

enum class Why {
  kComputed,         ///< the program reads or changes the point beside moving to it
  kArray,            ///< an element of an array
  kOperator,         ///< ':' behind the point
  kRelative,         ///< LIN_REL and its like
  kPartial,          ///< not all of its components are stated, or one of S and T alone
  kNotANumber,       ///< a component that is no finite number of a possible size, or unknown
  kUnknownPoint,     ///< it stands in none of the files
  kTwice,            ///< it is declared twice
  kGlobal,           ///< declared GLOBAL: other modules use it
  kElsewhere,        ///< of another file, which is not corrected with the program
  kShared,           ///< it moves to a point that a refused module moves to
  kToolNotKnown,     ///< which tool is active cannot be told
  kBaseNotKnown,     ///< which base is active cannot be told
  kNoSuchTool,       ///< no TOOL_DATA of that number
  kNoSuchBase,       ///< no BASE_DATA of that number
  kFrameChanged,     ///< the program changes the TOOL_DATA, BASE_DATA, LOAD_DATA or $ROBROOT
  kNoSuchFrameData,  ///< no FDAT of that name
  kTwoFrames,        ///< moved to with more than one tool or base
  kExternalTool,     ///< the tool stands in the cell, the arm carries the part
  kExternalAxes,     ///< an external axis that is not at 0, or moves
  kNoConfiguration,  ///< no S and T, and no motion before it that tells them
  kPostureNotKnown,  ///< a CP motion, and the posture that it begins in cannot be told
  kOtherPosture,     ///< a CP motion that begins in another posture than S says
  kWrongTurn,        ///< S and T belong to no posture inside the limits
  kNotReached,       ///< `reached` says why
  kOutsideScope,     ///< the calibration holds near its targets only
  kNotVerified,      ///< the written numbers would not bring the TCP there
  kNoClosedForm,     ///< S and T are known of six axes with a spherical wrist
};

/// The statement behind which something is not known any more.
struct Lost {
  std::string what;  ///< the call's name, "BAS(#INITMOV)", "IF"; empty: none
  int line = 0;
};

struct Refusal {
  Why why = Why::kComputed;
  std::string file;
  int line = 0;
  std::string what;  ///< the point's, tool's or statement's name, as the file has it
  int number = -1;   ///< kNoSuchTool, kNoSuchBase
  std::optional<calib::NotReached> reached = std::nullopt;
  Lost lost = {};  ///< of frames and postures that are not known
};

/// "weld.src:12: XP3: ... : what to do".
std::string words(const Refusal& refusal, const calib::Robot& robot);
/// For programs: "computed", "no_such_tool", ...
const char* name_of(Why why);

}  // namespace cellcal::daemon::krl
