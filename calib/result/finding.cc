#include "calib/result/finding.h"

#include <algorithm>
#include <limits>

#include "calib/model/units.h"
#include "calib/result/finding_phrase.h"
#include "calib/result/sentences.h"

namespace cellcal::calib {

namespace {

Subject about(Subject::Of of, std::string name) {
  Subject subject;
  subject.of = of;
  subject.name = std::move(name);
  return subject;
}

Phrase passed_on(const Finding& f) { return f.text; }

Phrase still_with_model_error(const Finding& f) {
  return {"say.finding.still",
          {{"finding", f.still.empty() ? Phrase(f.text) : phrase(f.still.front())}}};
}

/// Wording of a kind. `opening`: subject of the sentence; null if it depends on more than the kind.
/// `sentence`: null if it depends on the kind alone.
struct Wording {
  FindingKind kind;
  const char* opening;
  Phrase (*sentence)(const Finding&);
};

constexpr Wording kWordings[] = {
    {FindingKind::kTouchScatter, "say.opening.touch_scatter", sentences::touch_scatter},
    {FindingKind::kDuplicateTouches, "say.opening.duplicate_touches", sentences::duplicate_touches},
    {FindingKind::kManyOutliers, "say.opening.many_outliers", nullptr},
    {FindingKind::kOutliersOfTarget, "say.opening.many_outliers", sentences::outliers_of_target},
    {FindingKind::kCheckTouches, "say.opening.check_touches", sentences::check_touches},
    {FindingKind::kGrossCheckTouches, "say.opening.gross_check_touches",
     sentences::gross_check_touches},
    {FindingKind::kNoCheckTouches, "say.opening.no_check_touches", nullptr},
    {FindingKind::kUnseenPlace, "say.opening.unseen_place", nullptr},
    {FindingKind::kUnseenNotJudged, "say.opening.unseen_not_judged", sentences::unseen_not_judged},
    {FindingKind::kTemperature, "say.opening.temperature", nullptr},
    {FindingKind::kModelError, "say.opening.model_error", sentences::model_error},
    {FindingKind::kTooFewTouches, "say.opening.too_few_touches", sentences::too_few_touches},
    {FindingKind::kRank, "say.opening.rank", nullptr},
    {FindingKind::kTooFewDirections, "say.opening.too_few_directions",
     sentences::too_few_directions},
    {FindingKind::kAllLeftOut, "say.opening.too_few_directions", sentences::all_left_out},
    {FindingKind::kNotTouched, "say.opening.not_touched", sentences::not_touched},
    {FindingKind::kCertifiedLength, nullptr, sentences::certified_length},
    {FindingKind::kCertifiedTwice, nullptr, nullptr},
    {FindingKind::kArtefactSize, nullptr, sentences::artefact_size},
    {FindingKind::kStatedCentre, "say.opening.stated_centre", sentences::stated_centre},
    {FindingKind::kExchangedCentres, "say.opening.stated_centre", sentences::exchanged_centres},
    {FindingKind::kNegativeCompliance, "say.opening.negative_compliance", nullptr},
    {FindingKind::kArmScale, "say.opening.arm_scale", nullptr},
    {FindingKind::kOffNominal, nullptr, sentences::off_nominal},
    {FindingKind::kEffectiveRadius, nullptr, sentences::effective_radius},
    {FindingKind::kScaleByLengths, "say.opening.scale_by_lengths", sentences::scale_by_lengths},
    {FindingKind::kScaleByReadings, "say.opening.scale_by_lengths", sentences::scale_by_readings},
    {FindingKind::kScaleByNothing, "say.opening.scale_by_lengths", sentences::scale_by_nothing},
    {FindingKind::kScopeOfTouches, "say.opening.scale_by_lengths", sentences::scope_of_touches},
    {FindingKind::kUncheckedReadings, "say.opening.unchecked_readings", nullptr},
    {FindingKind::kUncheckedTouch, "say.opening.unchecked_touch", nullptr},
    {FindingKind::kUncheckedLengths, "say.opening.unchecked_readings", nullptr},
    {FindingKind::kUncheckedLength, "say.opening.unchecked_readings", nullptr},
    {FindingKind::kRequired, "say.opening.required", sentences::required},
    {FindingKind::kNoGain, "say.opening.no_gain", sentences::no_gain},
    {FindingKind::kGain, "say.opening.gain", sentences::gain},
    {FindingKind::kControllerModel, "say.opening.controller_model", nullptr},
    {FindingKind::kChanged, "say.opening.changed", sentences::changed},
    {FindingKind::kChangeAccepted, "say.opening.change_accepted", sentences::change_accepted},
    {FindingKind::kUnchanged, "say.opening.change_accepted", sentences::unchanged},
    {FindingKind::kNotCompared, "say.opening.not_compared", nullptr},
    {FindingKind::kUpdated, "say.opening.updated", sentences::updated},
    {FindingKind::kUpdateNotNeeded, "say.opening.update_not_needed", sentences::update_not_needed},
    {FindingKind::kUpdateContradicted, "say.opening.update_contradicted",
     sentences::update_contradicted},
    {FindingKind::kUpdateNotResolved, "say.opening.update_contradicted",
     sentences::update_not_resolved},
    {FindingKind::kUpdateNotFound, "say.opening.update_contradicted", sentences::update_not_found},
    {FindingKind::kUpdateTooFew, "say.opening.update_contradicted", nullptr},
    {FindingKind::kNotIdentified, "say.opening.not_identified", passed_on},
    {FindingKind::kLikelyCause, "say.opening.likely_cause", sentences::cause},
    {FindingKind::kMovedTarget, nullptr, sentences::moved_target},
    {FindingKind::kJumped, nullptr, sentences::jumped},
    {FindingKind::kStillWithModelError, "", still_with_model_error},
    {FindingKind::kReferenceMethod, "", nullptr},
    {FindingKind::kRecorded, "", passed_on},
};

const Wording* wording_of(FindingKind kind) {
  for (const Wording& one : kWordings)
    if (one.kind == kind) return &one;
  return nullptr;
}

/// Opening of kinds where it depends on more.
Phrase own_opening(const Finding& f) {
  const auto about = [&](const char* id) { return sentences::said(id, f); };
  switch (f.kind) {
    case FindingKind::kCertifiedLength:
    case FindingKind::kCertifiedTwice: return about("say.opening.certified_length");
    case FindingKind::kArtefactSize:
      if (!sentences::has(f, "longer")) return about("say.opening.diameter");
      return about(f.about.name.empty() ? "say.opening.all_wires" : "say.opening.wire");
    case FindingKind::kOffNominal:
      return f.withholds() ? "say.opening.far_from_nominal" : "say.opening.beyond_tolerance";
    case FindingKind::kEffectiveRadius:
      return f.withholds() ? "say.opening.effective_radius" : "say.opening.radius_offset";
    case FindingKind::kMovedTarget:
      return sentences::is_set(f, "or_lengths") ? "say.opening.moved_target.or_lengths"
                                                : "say.opening.moved_target";
    case FindingKind::kJumped:
      if (f.parts.size() != 1) return "say.opening.jumped";
      return f.parts.front().about.of == Subject::Of::kTool ? "say.opening.jumped.tool"
                                                            : "say.opening.jumped.joint";
    default: return {};
  }
}

}  // namespace

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
Subject about_positioner(std::string axis) {
  return about(Subject::Of::kPositioner, std::move(axis));
}
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

Phrase sentence_phrase(const Finding& f) {
  const Wording* wording = wording_of(f.kind);
  if (wording == nullptr) return {};
  if (wording->sentence != nullptr) return wording->sentence(f);
  return sentences::said(std::string("say.finding.") + to_string(f.kind), f);
}

Phrase phrase(const Finding& f) {
  const Wording* wording = wording_of(f.kind);
  const Phrase about =
      wording != nullptr && wording->opening != nullptr ? wording->opening : own_opening(f);
  if (about.empty()) return sentence_phrase(f);
  return {"say.finding", {{"about", about}, {"finding", sentence_phrase(f)}}};
}

std::string sentence(const Finding& f) { return words(sentence_phrase(f)); }

std::string words(const Finding& f) { return words(phrase(f)); }

std::vector<std::string> words(const std::vector<Finding>& findings) {
  std::vector<std::string> all;
  for (const Finding& one : findings) all.push_back(words(one));
  return all;
}

}  // namespace cellcal::calib
