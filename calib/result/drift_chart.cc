#include "calib/result/drift_chart.h"

namespace cellcal::calib {

const char* to_string(LeftOut why) {
  switch (why) {
    case LeftOut::kNo:
      return "no";
    case LeftOut::kUndecided:
      return "undecided";
    case LeftOut::kNotTheTool:
      return "not_the_tool";
    case LeftOut::kOtherTouches:
      return "other_touches";
  }
  return "";
}

const char* to_string(DriftState state) {
  switch (state) {
    case DriftState::kTooFew:
      return "too_few";
    case DriftState::kInControl:
      return "in_control";
    case DriftState::kWarns:
      return "warns";
    case DriftState::kAlarms:
      return "alarms";
    case DriftState::kUnknown:
      return "unknown";
  }
  return "";
}

const char* to_string(DriftAdvice advice) {
  switch (advice) {
    case DriftAdvice::kNone:
      return "none";
    case DriftAdvice::kCheckAgain:
      return "check_again";
    case DriftAdvice::kLetItWarmUp:
      return "let_it_warm_up";
    case DriftAdvice::kRemeasureTcp:
      return "re_measure_tcp";
    case DriftAdvice::kRecalibrate:
      return "recalibrate";
  }
  return "";
}

const char* to_string(DriftShape shape) { return shape == DriftShape::kStep ? "step" : "creep"; }

}  // namespace cellcal::calib
