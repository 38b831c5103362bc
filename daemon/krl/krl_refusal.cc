#include "daemon/krl/krl_refusal.h"

#include <fmt/format.h>

#include "calib/files/text.h"
#include "calib/model/enum_table.h"

namespace cellcal::daemon::krl {

namespace {

constexpr const char* kOrNameCall =
    "; where a call ended it that neither moves nor sets frames, name it with --does-not-move, or give "
    "its .src";

/// " since CLAMP() in line 12".
std::string since(const Lost& lost) {
  return lost.what.empty()
             ? ""
             : fmt::format(" since {} in line {}", calib::shown(lost.what), lost.line);
}

std::string what_is_wrong(const Refusal& r, const calib::Robot& robot) {
  switch (r.why) {
    case Why::kComputed:
      return "read or changed here: values computed from a point cannot be corrected. Teach it, or "
             "keep it as it is with --leave";
    case Why::kArray:
      return "array element, not resolved. Give the point a name of its own";
    case Why::kOperator:
      return "geometric operator ':' not resolved. Teach the resulting point";
    case Why::kRelative:
      return "relative motion, not resolved. Teach the resulting point";
    case Why::kPartial:
      return "incomplete components: X, Y, Z, A, B, C or A1 to A6 are needed, and S and T both or "
             "neither";
    case Why::kNotANumber:
      return "invalid component: no number, too large, or unknown for this kind of point";
    case Why::kUnknownPoint:
      return "not declared in the given files. Give its .dat file, or the $config.dat that has it";
    case Why::kTwice:
      return "value given twice. Keep one";
    case Why::kGlobal:
      return "declared GLOBAL: other programs may move to it. Correct all of them with --backup, or "
             "keep it as it is with --leave";
    case Why::kElsewhere:
      return "point of another file: the path would mix corrected and uncorrected points. Correct "
             "all programs with --backup, or keep it as it is with --leave";
    case Why::kShared:
      return fmt::format(
          "also moved to by {}, which is refused: the point stays as it is, and so does this program",
          calib::shown(r.lost.what, 120));
    case Why::kToolNotKnown:
      return fmt::format(
          "active tool unknown{}. Set $TOOL, or FDAT_ACT, directly before the motion{}",
          since(r.lost), kOrNameCall);
    case Why::kBaseNotKnown:
      return fmt::format(
          "active base unknown{}. Set $BASE, or FDAT_ACT, directly before the motion{}",
          since(r.lost), kOrNameCall);
    case Why::kNoSuchTool:
      return fmt::format(
          "TOOL_DATA[{}] not in the given files. Give the controller's $config.dat with --config",
          r.number);
    case Why::kNoSuchBase:
      return fmt::format(
          "BASE_DATA[{}] not in the given files. Give the controller's $config.dat with --config",
          r.number);
    case Why::kLoadNotKnown:
      return fmt::format(
          "load in force unknown{}: the arm sags by it. Set $LOAD=LOAD_DATA[n], or FDAT_ACT, before "
          "the motion",
          since(r.lost));
    case Why::kNoSuchLoad:
      return fmt::format(
          "LOAD_DATA[{}] not in the given files, or without a mass. Give the controller's "
          "$config.dat with --config",
          r.number);
    case Why::kFrameChanged:
      return "the program changes the TOOL_DATA, BASE_DATA, LOAD_DATA or $ROBROOT used here. Set "
             "it in $config.dat only";
    case Why::kNoSuchFrameData:
      return "FDAT not in the given files, or changed by the program. Give its .dat file";
    case Why::kTwoFrames:
      return "used with different tools or bases: one correction cannot fit both. Teach one point "
             "for each";
    case Why::kExternalTool:
      return "external tool (IPO_FRAME #TCP): not corrected";
    case Why::kExternalAxes:
      return "external axis not at 0, and it may carry the arm: not corrected. Where it does not, give "
             "the controller's $machine.dat ($EX_AX_NUM, $EX_KIN)";
    case Why::kExternalBase:
      return "base of an external kinematic (MACHINE_FRAME_DAT): the positioner carries the part, and "
             "its place is not known here. Not corrected";
    case Why::kNoConfiguration:
      return fmt::format("S and T missing, and posture unknown{}. Touch it up as E6POS",
                         since(r.lost));
    case Why::kPostureNotKnown:
      return fmt::format(
          "start posture unknown{}, which LIN, CIRC and splines keep. Start with a PTP to a point "
          "with S and T",
          since(r.lost));
    case Why::kOtherPosture:
      return "S does not match the posture before, which LIN, CIRC and splines keep. Touch the "
             "point up again, or go there by PTP";
    case Why::kWrongTurn:
      return "S and T match no posture of this robot inside its limits. Check that program, tool "
             "and base belong to this robot";
    case Why::kNotReached:
      return r.reached ? calib::words(*r.reached, robot) : "not reached";
    case Why::kOutsideScope:
      return "more than 150 mm from all targets; this calibration holds near them only. --anywhere "
             "corrects it, with its u95";
    case Why::kNotVerified:
      return "TCP more than 0.02 mm off with the corrected values";
    case Why::kNotRestored:
      return "motions could not be taken back byte for byte after rewriting. Leave this program "
             "as it is";
    case Why::kNoClosedForm:
      return "Cartesian points need a six-axis arm with a spherical wrist (last three axes meet in "
             "a point)";
  }
  return {};
}

}  // namespace

std::string words(const Refusal& r, const calib::Robot& robot) {
  return fmt::format("{}:{}: {}: {}", r.file, r.line, calib::shown(r.what),
                     what_is_wrong(r, robot));
}

namespace {

constexpr EnumNames<Why> kNames({{Why::kComputed, "computed"},
                                 {Why::kArray, "array"},
                                 {Why::kOperator, "geometric_operator"},
                                 {Why::kRelative, "relative_motion"},
                                 {Why::kPartial, "partial"},
                                 {Why::kNotANumber, "not_a_number"},
                                 {Why::kUnknownPoint, "unknown_point"},
                                 {Why::kTwice, "declared_twice"},
                                 {Why::kGlobal, "global"},
                                 {Why::kElsewhere, "elsewhere"},
                                 {Why::kShared, "shared"},
                                 {Why::kToolNotKnown, "tool_not_known"},
                                 {Why::kBaseNotKnown, "base_not_known"},
                                 {Why::kNoSuchTool, "no_such_tool"},
                                 {Why::kNoSuchBase, "no_such_base"},
                                 {Why::kLoadNotKnown, "load_not_known"},
                                 {Why::kNoSuchLoad, "no_such_load"},
                                 {Why::kFrameChanged, "frame_changed"},
                                 {Why::kNoSuchFrameData, "no_such_frame_data"},
                                 {Why::kTwoFrames, "two_frames"},
                                 {Why::kExternalTool, "external_tool"},
                                 {Why::kExternalAxes, "external_axes"},
                                 {Why::kExternalBase, "external_base"},
                                 {Why::kNoConfiguration, "no_configuration"},
                                 {Why::kPostureNotKnown, "posture_not_known"},
                                 {Why::kOtherPosture, "other_posture"},
                                 {Why::kWrongTurn, "wrong_turn"},
                                 {Why::kNotReached, "not_reached"},
                                 {Why::kOutsideScope, "outside_scope"},
                                 {Why::kNotVerified, "not_verified"},
                                 {Why::kNotRestored, "not_restored"},
                                 {Why::kNoClosedForm, "no_closed_form"}});

}  // namespace

const char* name_of(Why why) { return kNames[why]; }

}  // namespace cellcal::daemon::krl
