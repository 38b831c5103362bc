#include "calib/result/finding.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "calib/model/enum_table.h"
#include "calib/model/units.h"
#include "calib/result/likely_cause.h"
#include "calib/result/sentences.h"

namespace cellcal::calib {

namespace {

constexpr EnumNames<FindingKind> kKinds{
    {{FindingKind::kTouchScatter, "touch_scatter"},
     {FindingKind::kDuplicateTouches, "duplicate_touches"},
     {FindingKind::kManyOutliers, "many_outliers"},
     {FindingKind::kOutliersOfTarget, "outliers_of_target"},
     {FindingKind::kCheckTouches, "check_touches"},
     {FindingKind::kGrossCheckTouches, "gross_check_touches"},
     {FindingKind::kNoCheckTouches, "no_check_touches"},
     {FindingKind::kUnseenPlace, "unseen_place"},
     {FindingKind::kUnseenNotJudged, "unseen_not_judged"},
     {FindingKind::kTemperature, "temperature"},
     {FindingKind::kModelError, "model_error"},
     {FindingKind::kTooFewTouches, "too_few_touches"},
     {FindingKind::kRank, "rank"},
     {FindingKind::kTooFewDirections, "too_few_directions"},
     {FindingKind::kAllLeftOut, "all_left_out"},
     {FindingKind::kNotTouched, "not_touched"},
     {FindingKind::kCertifiedLength, "certified_length"},
     {FindingKind::kCertifiedTwice, "certified_twice"},
     {FindingKind::kArtefactSize, "artefact_size"},
     {FindingKind::kStatedCentre, "stated_centre"},
     {FindingKind::kExchangedCentres, "exchanged_centres"},
     {FindingKind::kNegativeCompliance, "negative_compliance"},
     {FindingKind::kArmScale, "arm_scale"},
     {FindingKind::kOffNominal, "off_nominal"},
     {FindingKind::kEffectiveRadius, "effective_radius"},
     {FindingKind::kScaleByLengths, "scale_by_lengths"},
     {FindingKind::kScaleByReadings, "scale_by_readings"},
     {FindingKind::kScaleByNothing, "scale_by_nothing"},
     {FindingKind::kScopeOfTouches, "scope_of_touches"},
     {FindingKind::kUncheckedReadings, "unchecked_readings"},
     {FindingKind::kUncheckedTouch, "unchecked_touch"},
     {FindingKind::kUncheckedLengths, "unchecked_lengths"},
     {FindingKind::kUncheckedLength, "unchecked_length"},
     {FindingKind::kRequired, "required"},
     {FindingKind::kNoGain, "no_gain"},
     {FindingKind::kGain, "gain"},
     {FindingKind::kControllerModel, "controller_model"},
     {FindingKind::kChanged, "changed"},
     {FindingKind::kChangeAccepted, "change_accepted"},
     {FindingKind::kUnchanged, "unchanged"},
     {FindingKind::kNotCompared, "not_compared"},
     {FindingKind::kUpdated, "updated"},
     {FindingKind::kUpdateNotNeeded, "update_not_needed"},
     {FindingKind::kUpdateContradicted, "update_contradicted"},
     {FindingKind::kUpdateNotResolved, "update_not_resolved"},
     {FindingKind::kUpdateNotFound, "update_not_found"},
     {FindingKind::kUpdateTooFew, "update_too_few"},
     {FindingKind::kNotIdentified, "not_identified"},
     {FindingKind::kLikelyCause, "likely_cause"},
     {FindingKind::kMovedTarget, "moved_target"},
     {FindingKind::kJumped, "jumped"},
     {FindingKind::kStillWithModelError, "still_with_model_error"},
     {FindingKind::kReferenceMethod, "reference_method"},
     {FindingKind::kRecorded, "recorded"}}};
constexpr EnumNames<Severity> kSeverities{{{Severity::kWithholds, "withholds"},
                                           {Severity::kWarns, "warns"},
                                           {Severity::kInforms, "informs"}}};
constexpr EnumNames<Subject::Of> kSubjects{{{Subject::Of::kSession, "session"},
                                            {Subject::Of::kTouch, "touch"},
                                            {Subject::Of::kTarget, "target"},
                                            {Subject::Of::kJoint, "joint"},
                                            {Subject::Of::kTool, "tool"},
                                            {Subject::Of::kLength, "length"},
                                            {Subject::Of::kParameter, "parameter"},
                                            {Subject::Of::kRobot, "robot"}}};

Subject about(Subject::Of of, std::string name) {
  Subject subject;
  subject.of = of;
  subject.name = std::move(name);
  return subject;
}

}  // namespace

const char* to_string(FindingKind kind) { return kKinds[kind]; }
std::optional<FindingKind> finding_kind(const std::string& name) { return kKinds.key_of(name); }
const char* to_string(Severity severity) { return kSeverities[severity]; }
std::optional<Severity> severity(const std::string& name) { return kSeverities.key_of(name); }
const char* to_string(Subject::Of of) { return kSubjects[of]; }
std::optional<Subject::Of> subject_of(const std::string& name) { return kSubjects.key_of(name); }

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

namespace {

std::string passed_on(const Finding& f) { return f.text; }

std::string still_with_model_error(const Finding& f) {
  return "also with the model error estimated: " +
         (f.still.empty() ? f.text : words(f.still.front()));
}

std::string reference_method(const Finding&) { return "reference method, for comparison only"; }

/// Wording of a kind. `opening`: subject of the sentence; null if it depends on more than the kind.
struct Phrase {
  FindingKind kind;
  const char* opening;
  std::string (*sentence)(const Finding&);
};

constexpr Phrase kPhrases[] = {
    {FindingKind::kTouchScatter, "touch scatter (chi^2)", sentences::touch_scatter},
    {FindingKind::kDuplicateTouches, "duplicate touches", sentences::duplicate_touches},
    {FindingKind::kManyOutliers, "outliers", sentences::many_outliers},
    {FindingKind::kOutliersOfTarget, "outliers", sentences::outliers_of_target},
    {FindingKind::kCheckTouches, "check touches", sentences::check_touches},
    {FindingKind::kGrossCheckTouches, "gross check touches", sentences::gross_check_touches},
    {FindingKind::kNoCheckTouches, "no check touches", sentences::no_check_touches},
    {FindingKind::kUnseenPlace, "unseen place", sentences::unseen_place},
    {FindingKind::kUnseenNotJudged, "not judged", sentences::unseen_not_judged},
    {FindingKind::kTemperature, "temperature", sentences::temperature},
    {FindingKind::kModelError, "model error", sentences::model_error},
    {FindingKind::kTooFewTouches, "too few touches", sentences::too_few_touches},
    {FindingKind::kRank, "undetermined geometry", sentences::rank},
    {FindingKind::kTooFewDirections, "too few directions", sentences::too_few_directions},
    {FindingKind::kAllLeftOut, "too few directions", sentences::all_left_out},
    {FindingKind::kNotTouched, "not touched", sentences::not_touched},
    {FindingKind::kCertifiedLength, nullptr, sentences::certified_length},
    {FindingKind::kCertifiedTwice, nullptr, sentences::certified_twice},
    {FindingKind::kArtefactSize, nullptr, sentences::artefact_size},
    {FindingKind::kStatedCentre, "stated centre", sentences::stated_centre},
    {FindingKind::kExchangedCentres, "stated centre", sentences::exchanged_centres},
    {FindingKind::kNegativeCompliance, "negative compliance", sentences::negative_compliance},
    {FindingKind::kArmScale, "scale", sentences::arm_scale},
    {FindingKind::kOffNominal, nullptr, sentences::off_nominal},
    {FindingKind::kEffectiveRadius, nullptr, sentences::effective_radius},
    {FindingKind::kScaleByLengths, "scope", sentences::scale_by_lengths},
    {FindingKind::kScaleByReadings, "scope", sentences::scale_by_readings},
    {FindingKind::kScaleByNothing, "scope", sentences::scale_by_nothing},
    {FindingKind::kScopeOfTouches, "scope", sentences::scope_of_touches},
    {FindingKind::kUncheckedReadings, "unchecked scale", sentences::unchecked_readings},
    {FindingKind::kUncheckedTouch, "unchecked touch", sentences::unchecked_touch},
    {FindingKind::kUncheckedLengths, "unchecked scale", sentences::unchecked_lengths},
    {FindingKind::kUncheckedLength, "unchecked scale", sentences::unchecked_length},
    {FindingKind::kRequired, "required accuracy", sentences::required},
    {FindingKind::kNoGain, "gain too small", sentences::no_gain},
    {FindingKind::kGain, "accuracy", sentences::gain},
    {FindingKind::kControllerModel, "controller's model", sentences::controller_model},
    {FindingKind::kChanged, "changed since the last calibration", sentences::changed},
    {FindingKind::kChangeAccepted, "since the last calibration", sentences::change_accepted},
    {FindingKind::kUnchanged, "since the last calibration", sentences::unchanged},
    {FindingKind::kNotCompared, "not compared", sentences::not_compared},
    {FindingKind::kUpdated, "updated", sentences::updated},
    {FindingKind::kUpdateNotNeeded, "nothing to update", sentences::update_not_needed},
    {FindingKind::kUpdateContradicted, "not updated", sentences::update_contradicted},
    {FindingKind::kUpdateNotResolved, "not updated", sentences::update_not_resolved},
    {FindingKind::kUpdateNotFound, "not updated", sentences::update_not_found},
    {FindingKind::kUpdateTooFew, "not updated", sentences::update_too_few},
    {FindingKind::kNotIdentified, "not identified", passed_on},
    {FindingKind::kLikelyCause, "likely cause", cause_words},
    {FindingKind::kMovedTarget, nullptr, sentences::moved_target},
    {FindingKind::kJumped, nullptr, sentences::jumped},
    {FindingKind::kStillWithModelError, "", still_with_model_error},
    {FindingKind::kReferenceMethod, "", reference_method},
    {FindingKind::kRecorded, "", passed_on},
};

const Phrase* phrase_of(FindingKind kind) {
  for (const Phrase& one : kPhrases)
    if (one.kind == kind) return &one;
  return nullptr;
}

/// Opening of kinds where it depends on more.
std::string own_opening(const Finding& f) {
  switch (f.kind) {
    case FindingKind::kCertifiedLength:
    case FindingKind::kCertifiedTwice:
      return "certified length " + sentences::length_of(f);
    case FindingKind::kArtefactSize:
      if (!sentences::has(f, "longer")) return "diameter of " + f.about.name;
      return f.about.name.empty() ? "all wires" : "wire " + f.about.name;
    case FindingKind::kOffNominal:
      return f.withholds() ? "far from nominal" : "beyond tolerance";
    case FindingKind::kEffectiveRadius:
      return f.withholds() ? "effective radius" : "radius offset";
    case FindingKind::kMovedTarget:
      return sentences::is_set(f, "or_lengths") ? "moved target or wrong certified length"
                                                : "moved target";
    case FindingKind::kJumped:
      if (f.parts.size() != 1) return "change during the session";
      return f.parts.front().about.of == Subject::Of::kTool ? "knocked tool" : "slipped joint";
    default:
      return {};
  }
}

}  // namespace

std::string sentence(const Finding& f) {
  const Phrase* phrase = phrase_of(f.kind);
  return phrase == nullptr ? std::string() : phrase->sentence(f);
}

std::string words(const Finding& f) {
  const Phrase* phrase = phrase_of(f.kind);
  const std::string about =
      phrase != nullptr && phrase->opening != nullptr ? phrase->opening : own_opening(f);
  return about.empty() ? sentence(f) : about + ": " + sentence(f);
}

std::vector<std::string> words(const std::vector<Finding>& findings) {
  std::vector<std::string> all;
  for (const Finding& one : findings) all.push_back(words(one));
  return all;
}

}  // namespace cellcal::calib
