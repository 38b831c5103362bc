#include "calib/result/drift_chart.h"

#include <algorithm>
#include <array>

namespace cellcal::calib {

namespace {

constexpr std::array kAdvice{DriftAdvice::kNone, DriftAdvice::kCheckAgain,
                             DriftAdvice::kLetItWarmUp, DriftAdvice::kRemeasureTcp,
                             DriftAdvice::kRecalibrate};

}  // namespace

const CheckSeen* DriftChart::newest_decided() const {
  const auto newest = std::find_if(points.rbegin(), points.rend(), [](const DriftPoint& one) {
    return one.check.verdict != CheckVerdict::kUndecided;
  });
  return newest == points.rend() ? nullptr : &newest->check;
}

DriftAdvice remedy_of(CheckVerdict verdict, ChangeKind change) {
  if (verdict == CheckVerdict::kHolds) return DriftAdvice::kNone;
  if (verdict == CheckVerdict::kUndecided) return DriftAdvice::kCheckAgain;
  switch (change) {
    case ChangeKind::kTouch:
      return DriftAdvice::kCheckAgain;
    case ChangeKind::kGrowth:
      return DriftAdvice::kLetItWarmUp;
    case ChangeKind::kTool:
      return DriftAdvice::kRemeasureTcp;
    case ChangeKind::kNothing:  // too few touches met anything
    case ChangeKind::kSphere:
    case ChangeKind::kJoint:
      break;
  }
  return DriftAdvice::kRecalibrate;
}

std::optional<DriftAdvice> drift_advice(const std::string& name) {
  for (const DriftAdvice advice : kAdvice)
    if (name == to_string(advice)) return advice;
  return std::nullopt;
}

const char* to_string(LeftOut why) {
  switch (why) {
    case LeftOut::kNo:
      return "no";
    case LeftOut::kUndecided:
      return "undecided";
    case LeftOut::kIncomplete:
      return "incomplete";
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
