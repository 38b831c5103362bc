#pragma once
// Parts of a program that are not understood or cannot be corrected. A program with one of them is
// not written.

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "calib/export/corrector.h"
#include "calib/words/phrase.h"

namespace cellcal::daemon::krl {

struct Program;

enum class Why {
  kComputed,           ///< the program also reads or changes the point
  kHandedOver,         ///< a routine that may move gets the point; `lost` names it
  kArray,              ///< an element of an array
  kGeometricOperator,  ///< ':' after the point
  kRelativeMotion,     ///< LIN_REL and the like
  kPartial,            ///< missing components, or one of S and T alone
  kNotANumber,         ///< a component that is unknown, not finite or out of range
  kUnknownPoint,       ///< in none of the files
  kDeclaredTwice,
  kGlobal,           ///< declared GLOBAL: other modules use it
  kImported,         ///< imported under another name
  kElsewhere,        ///< in another file, which is not corrected with the program
  kShared,           ///< its point belongs to a refused module, too
  kToolNotKnown,     ///< the active tool is unknown
  kBaseNotKnown,     ///< the active base is unknown
  kNoSuchTool,       ///< no TOOL_DATA of that number
  kNoSuchBase,       ///< no BASE_DATA of that number
  kLoadNotKnown,     ///< the load in force is unknown
  kNoSuchLoad,       ///< no LOAD_DATA of that number with a mass
  kFrameChanged,     ///< a program changes the TOOL_DATA, BASE_DATA, LOAD_DATA or $ROBROOT
  kNoSuchFrameData,  ///< no FDAT of that name
  kTwoFrames,        ///< used with more than one tool or base
  kExternalTool,     ///< the tool is fixed in the cell, the arm carries the part
  kExternalAxes,     ///< an external axis that may carry the arm is not at 0, or moves
  kExternalBase,     ///< a positioner carries the base, and the calibration has none
  kUncoupledBase,    ///< $BASE=BASE_DATA[n] sets a positioner's base, which then turns with no axis
  kNoExternalValue,  ///< position of the linear unit, or of the positioner that carries the base, missing
  kOtherUnit,        ///< the machine data have another linear unit than the calibration, or none
  kOtherKinematic,   ///< the machine data's external kinematic is not the calibration's positioner
  kOutsideTouched,   ///< the positioner's angles were not touched
  kNoConfiguration,  ///< no S and T, and no preceding motion that defines them
  kPostureNotKnown,  ///< a CP motion whose initial posture is unknown
  kOtherPosture,     ///< a CP motion whose initial posture differs from S
  kWrongTurn,        ///< no posture within the limits has this S and T
  kNotReached,       ///< reason in `reached`
  kOutsideScope,     ///< the calibration is valid near its targets only
  kNotVerified,      ///< the TCP would miss with the written numbers
  kOwnPosition,      ///< takes the arm's own position, which is corrected already
  kNotRestored,      ///< its rewriting for run time could not be taken back byte for byte
  kNoClosedForm,     ///< S and T are defined for six axes with a spherical wrist only
};

/// The statement that sets a value, or after which it is unknown.
struct Lost {
  std::string what;  ///< name of the call, "BAS(#INITMOV)", "DEF"; empty: none
  int line = 0;
  int other = 0;  ///< line that sets another value on another way to the same place; 0: none
  bool any_time = false;  ///< the call is an interrupt's or trigger's
};

struct Refusal {
  Why why = Why::kComputed;
  std::string file;
  int line = 0;
  std::string what;  ///< name of the point, tool or statement, as in the file
  int number = -1;   ///< kNoSuchTool, kNoSuchBase, kNoSuchLoad, kUncoupledBase
  std::optional<calib::NotReached> reached = std::nullopt;
  Lost lost = {};  ///< for unknown frames and postures; `what` is a file for kShared, kFrameChanged
};

/// "weld.src:12: XP3: ... : what to do".
calib::Phrase phrase(const Refusal& refusal, const calib::Robot& robot);
/// In English, as in files.
std::string words(const Refusal& refusal, const calib::Robot& robot);
/// For programs, the enumerators' own: "computed", "no_such_tool", ...
const char* name_of(Why why);

// Of the modules of a program or backup.

/// By file and line.
void sort_by_place(std::vector<Refusal>& refusals);
/// Refusals of each module: unreadable statements, and the refused points of its motions. `of_points`: by the key of
/// the point.
std::vector<std::vector<Refusal>> refusals_of_modules(
    const Program& program, std::multimap<std::string, Refusal> of_points);
/// A point of a refused module stays unchanged, and with it all modules that move to it.
void refuse_shared(const Program& program, std::vector<std::vector<Refusal>>& refusals);

}  // namespace cellcal::daemon::krl
