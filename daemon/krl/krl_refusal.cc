#include "daemon/krl/krl_refusal.h"

#include <fmt/format.h>

#include "calib/syntax/shown.h"

namespace cellcal::daemon::krl {

namespace {

std::string what_is_wrong(const Refusal& r, const calib::Robot& robot) {
  switch (r.why) {
    case Why::kComputed:
      return "is read or changed here; what is computed from a point cannot be corrected. Teach it, or "
             "keep it as it is with --leave";
    case Why::kArray:
      return "is an element of an array, which may be any. Give the point a name of its own";
    case Why::kOperator:
      return "the geometric operator ':' is not followed. Teach the resulting point";
    case Why::kRelative:
      return "moves relative to where the arm is. Teach the resulting point";
    case Why::kPartial:
      return "has not all components: X, Y, Z, A, B, C or A1 to A6 are needed, and of S and T both or "
             "none";
    case Why::kNotANumber:
      return "has a component that is no number, too large, or none of such a point";
    case Why::kUnknownPoint:
      return "is declared in none of the files. Give its .dat file, or the $config.dat that has it";
    case Why::kTwice:
      return "is given a value twice";
    case Why::kGlobal:
      return "is declared GLOBAL, so other programs may move to it. Keep it as it is with --leave";
    case Why::kToolNotKnown:
      return "which tool is active here cannot be told. Set $TOOL, or FDAT_ACT, right before the "
             "motion";
    case Why::kBaseNotKnown:
      return "which base is active here cannot be told. Set $BASE, or FDAT_ACT, right before the "
             "motion";
    case Why::kNoSuchTool:
      return fmt::format(
          "TOOL_DATA[{}] stands in none of the files. Give the controller's "
          "$config.dat with --config",
          r.number);
    case Why::kNoSuchBase:
      return fmt::format(
          "BASE_DATA[{}] stands in none of the files. Give the controller's "
          "$config.dat with --config",
          r.number);
    case Why::kFrameChanged:
      return "the program itself changes the TOOL_DATA, BASE_DATA, LOAD_DATA or $ROBROOT that holds "
             "here. Set it in $config.dat alone";
    case Why::kNoSuchFrameData:
      return "this FDAT stands in none of the files, or is changed by the program. Give its .dat "
             "file";
    case Why::kTwoFrames:
      return "is moved to with different tools or bases; one correction cannot be right for both";
    case Why::kExternalTool:
      return "the tool stands in the cell (IPO_FRAME #TCP); this is not corrected";
    case Why::kExternalAxes:
      return "external axes that are not at 0, or move, are not corrected";
    case Why::kNoConfiguration:
      return "has no S and T, and no motion right before it tells them. Touch it up as E6POS";
    case Why::kPostureNotKnown:
      return "LIN, CIRC and splines stay in the posture that they begin in, and which that is cannot "
             "be told here. Set a PTP to a point with S and T right before";
    case Why::kOtherPosture:
      return "LIN, CIRC and splines stay in the posture that they begin in, and the motion before "
             "ends in another than S says. Touch the point up again, or go there by PTP";
    case Why::kWrongTurn:
      return "its S and T belong to no posture of this robot inside its limits. Is it this robot's "
             "program, and are tool and base right?";
    case Why::kNotReached:
      return r.reached ? calib::words(*r.reached, robot) : "is not reached";
    case Why::kOutsideScope:
      return "lies more than 150 mm from all targets, and this calibration holds near them only. "
             "--anywhere corrects it all the same, with its u95";
    case Why::kNotVerified:
      return "the corrected numbers do not bring the TCP there within 0.02 mm";
    case Why::kNoClosedForm:
      return "Cartesian points need an arm of six axes whose last three meet in a point";
  }
  return {};
}

}  // namespace

std::string words(const Refusal& r, const calib::Robot& robot) {
  return fmt::format("{}:{}: {}: {}", r.file, r.line, calib::shown(r.what),
                     what_is_wrong(r, robot));
}

const char* name_of(Why why) {
  switch (why) {
    case Why::kComputed:
      return "computed";
    case Why::kArray:
      return "array";
    case Why::kOperator:
      return "geometric_operator";
    case Why::kRelative:
      return "relative_motion";
    case Why::kPartial:
      return "partial";
    case Why::kNotANumber:
      return "not_a_number";
    case Why::kUnknownPoint:
      return "unknown_point";
    case Why::kTwice:
      return "declared_twice";
    case Why::kGlobal:
      return "global";
    case Why::kToolNotKnown:
      return "tool_not_known";
    case Why::kBaseNotKnown:
      return "base_not_known";
    case Why::kNoSuchTool:
      return "no_such_tool";
    case Why::kNoSuchBase:
      return "no_such_base";
    case Why::kFrameChanged:
      return "frame_changed";
    case Why::kNoSuchFrameData:
      return "no_such_frame_data";
    case Why::kTwoFrames:
      return "two_frames";
    case Why::kExternalTool:
      return "external_tool";
    case Why::kExternalAxes:
      return "external_axes";
    case Why::kNoConfiguration:
      return "no_configuration";
    case Why::kPostureNotKnown:
      return "posture_not_known";
    case Why::kOtherPosture:
      return "other_posture";
    case Why::kWrongTurn:
      return "wrong_turn";
    case Why::kNotReached:
      return "not_reached";
    case Why::kOutsideScope:
      return "outside_scope";
    case Why::kNotVerified:
      return "not_verified";
    case Why::kNoClosedForm:
      return "no_closed_form";
  }
  return "";
}

}  // namespace cellcal::daemon::krl
