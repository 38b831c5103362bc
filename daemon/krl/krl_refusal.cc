#include "daemon/krl/krl_refusal.h"

#include "calib/files/text.h"
#include "calib/model/enum_table.h"

namespace cellcal::daemon::krl {

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
                                 {Why::kNoExternalValue, "no_external_value"},
                                 {Why::kOtherUnit, "other_unit"},
                                 {Why::kOtherKinematic, "other_kinematic"},
                                 {Why::kOutsideTouched, "outside_touched"},
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

namespace {

/// " since CLAMP() in line 12".
calib::Phrase since(const Lost& lost) {
  if (lost.what.empty()) return {};
  return {"say.krl.since", {{"what", calib::shown(lost.what)}, {"line", lost.line}}};
}

calib::Phrase why_phrase(const Refusal& r, const calib::Robot& robot) {
  if (r.why == Why::kNotReached && r.reached) return calib::phrase(*r.reached, robot);
  return {std::string("say.krl.why.") + name_of(r.why),
          {{"n", r.number}, {"since", since(r.lost)}, {"module", calib::shown(r.lost.what, 120)}}};
}

}  // namespace

calib::Phrase phrase(const Refusal& r, const calib::Robot& robot) {
  return {"say.krl.refusal",
          {{"file", r.file},
           {"line", r.line},
           {"what", calib::shown(r.what)},
           {"why", why_phrase(r, robot)}}};
}

std::string words(const Refusal& r, const calib::Robot& robot) {
  return calib::words(phrase(r, robot));
}

}  // namespace cellcal::daemon::krl
