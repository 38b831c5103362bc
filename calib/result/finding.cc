#include "calib/result/finding.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "calib/model/units.h"
#include "calib/result/names.h"

namespace cellcal::calib {

namespace {

constexpr std::array kKinds = {
    Named{FindingKind::kTouchScatter, "touch_scatter"},
    Named{FindingKind::kDuplicateTouches, "duplicate_touches"},
    Named{FindingKind::kManyOutliers, "many_outliers"},
    Named{FindingKind::kOutliersOfTarget, "outliers_of_target"},
    Named{FindingKind::kCheckTouches, "check_touches"},
    Named{FindingKind::kGrossCheckTouches, "gross_check_touches"},
    Named{FindingKind::kNoCheckTouches, "no_check_touches"},
    Named{FindingKind::kUnseenPlace, "unseen_place"},
    Named{FindingKind::kUnseenNotJudged, "unseen_not_judged"},
    Named{FindingKind::kTemperature, "temperature"},
    Named{FindingKind::kModelError, "model_error"},
    Named{FindingKind::kTooFewTouches, "too_few_touches"},
    Named{FindingKind::kRank, "rank"},
    Named{FindingKind::kTooFewDirections, "too_few_directions"},
    Named{FindingKind::kAllLeftOut, "all_left_out"},
    Named{FindingKind::kNotTouched, "not_touched"},
    Named{FindingKind::kCertifiedLength, "certified_length"},
    Named{FindingKind::kCertifiedTwice, "certified_twice"},
    Named{FindingKind::kArtefactSize, "artefact_size"},
    Named{FindingKind::kStatedCentre, "stated_centre"},
    Named{FindingKind::kExchangedCentres, "exchanged_centres"},
    Named{FindingKind::kNegativeCompliance, "negative_compliance"},
    Named{FindingKind::kArmScale, "arm_scale"},
    Named{FindingKind::kOffNominal, "off_nominal"},
    Named{FindingKind::kEffectiveRadius, "effective_radius"},
    Named{FindingKind::kScaleByLengths, "scale_by_lengths"},
    Named{FindingKind::kScaleByReadings, "scale_by_readings"},
    Named{FindingKind::kScaleByNothing, "scale_by_nothing"},
    Named{FindingKind::kUncheckedReadings, "unchecked_readings"},
    Named{FindingKind::kUncheckedTouch, "unchecked_touch"},
    Named{FindingKind::kUncheckedLengths, "unchecked_lengths"},
    Named{FindingKind::kUncheckedLength, "unchecked_length"},
    Named{FindingKind::kRequired, "required"},
    Named{FindingKind::kNoGain, "no_gain"},
    Named{FindingKind::kGain, "gain"},
    Named{FindingKind::kChanged, "changed"},
    Named{FindingKind::kChangeAccepted, "change_accepted"},
    Named{FindingKind::kUnchanged, "unchanged"},
    Named{FindingKind::kNotCompared, "not_compared"},
    Named{FindingKind::kUpdated, "updated"},
    Named{FindingKind::kUpdateNotNeeded, "update_not_needed"},
    Named{FindingKind::kUpdateContradicted, "update_contradicted"},
    Named{FindingKind::kUpdateNotResolved, "update_not_resolved"},
    Named{FindingKind::kUpdateNotFound, "update_not_found"},
    Named{FindingKind::kUpdateTooFew, "update_too_few"},
    Named{FindingKind::kNotIdentified, "not_identified"},
    Named{FindingKind::kLikelyCause, "likely_cause"},
    Named{FindingKind::kMovedTarget, "moved_target"},
    Named{FindingKind::kJumped, "jumped"},
    Named{FindingKind::kStillWithModelError, "still_with_model_error"},
    Named{FindingKind::kReferenceMethod, "reference_method"},
    Named{FindingKind::kRecorded, "recorded"},
};
constexpr std::array kSeverities = {Named{Severity::kWithholds, "withholds"},
                                    Named{Severity::kWarns, "warns"},
                                    Named{Severity::kInforms, "informs"}};
constexpr std::array kSubjects = {
    Named{Subject::Of::kSession, "session"},     Named{Subject::Of::kTouch, "touch"},
    Named{Subject::Of::kTarget, "target"},       Named{Subject::Of::kJoint, "joint"},
    Named{Subject::Of::kTool, "tool"},           Named{Subject::Of::kLength, "length"},
    Named{Subject::Of::kParameter, "parameter"}, Named{Subject::Of::kRobot, "robot"}};

Subject about(Subject::Of of, std::string name) {
  Subject subject;
  subject.of = of;
  subject.name = std::move(name);
  return subject;
}

}  // namespace

const char* to_string(FindingKind kind) { return name_of(kKinds, kind); }
std::optional<FindingKind> finding_kind(const std::string& name) { return named(kKinds, name); }
const char* to_string(Severity severity) { return name_of(kSeverities, severity); }
std::optional<Severity> severity(const std::string& name) { return named(kSeverities, name); }
const char* to_string(Subject::Of of) { return name_of(kSubjects, of); }
std::optional<Subject::Of> subject_of(const std::string& name) { return named(kSubjects, name); }

Subject about_touch(std::size_t index, const Touch& touch) {
  return after(about(Subject::Of::kTouch, touch.target), index, touch);
}
Subject about_target(const Target& target) {
  Subject subject = about(Subject::Of::kTarget, target.id);
  subject.target_kind = target.kind;
  return subject;
}
Subject about_joint(std::string name) { return about(Subject::Of::kJoint, std::move(name)); }
Subject about_tool(std::string name) { return about(Subject::Of::kTool, std::move(name)); }
Subject about_length(std::string from, std::string to) {
  Subject subject = about(Subject::Of::kLength, std::move(from));
  subject.other_end = std::move(to);
  return subject;
}
Subject about_parameter(const Cell& cell, const ParameterKey& key) {
  Subject subject = about(Subject::Of::kParameter, parameter_name(cell, key));
  subject.parameter = key;
  return subject;
}
Subject about_robot(std::string file, std::string name) {
  Subject subject = about(Subject::Of::kRobot, std::move(file));
  subject.other_end = std::move(name);
  return subject;
}
Subject after(Subject subject, std::size_t index, const Touch& touch) {
  subject.touch = index;
  subject.line = touch.line;
  return subject;
}

Quantity in_mm(std::string name, double m, double sigma_m) {
  return {std::move(name), m * kMmPerM, "mm", sigma_m * kMmPerM};
}

Quantity in_deg(std::string name, double rad, double sigma_rad) {
  return {std::move(name), rad * kDegPerRad, "deg", sigma_rad * kDegPerRad};
}

std::vector<Quantity> shift_in_mm(const Eigen::Vector3d& shift_m, double sigma_m) {
  const Eigen::Vector3d mm = shift_m * kMmPerM;
  return {{"shift", mm.norm(), "mm", sigma_m * kMmPerM},
          {"x", mm.x(), "mm"},
          {"y", mm.y(), "mm"},
          {"z", mm.z(), "mm"}};
}

Finding likely(LikelyCause cause, Subject about, std::vector<Quantity> evidence,
               std::vector<FindingPart> parts) {
  Finding finding{FindingKind::kLikelyCause, Severity::kWithholds, std::move(about),
                  std::move(evidence), std::move(parts)};
  finding.cause = cause;
  return finding;
}

const Quantity* find(const std::vector<Quantity>& evidence, const std::string& name) {
  const auto its = std::find_if(evidence.begin(), evidence.end(),
                                [&](const Quantity& one) { return one.name == name; });
  return its == evidence.end() ? nullptr : &*its;
}

double value(const std::vector<Quantity>& evidence, const std::string& name) {
  const Quantity* its = find(evidence, name);
  return its == nullptr ? std::numeric_limits<double>::quiet_NaN() : its->value;
}

const Finding* first(const std::vector<Finding>& findings, FindingKind kind) {
  const auto its = std::find_if(findings.begin(), findings.end(),
                                [&](const Finding& one) { return one.kind == kind; });
  return its == findings.end() ? nullptr : &*its;
}

bool has(const std::vector<Finding>& findings, FindingKind kind) {
  return first(findings, kind) != nullptr;
}

void erase(std::vector<Finding>& findings, FindingKind kind) {
  std::erase_if(findings, [&](const Finding& one) { return one.kind == kind; });
}

}  // namespace cellcal::calib
