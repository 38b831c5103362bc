#include "calib/words/finding_words.h"

#include "calib/words/cause_words.h"
#include "calib/words/sentences.h"

namespace cellcal::calib {

namespace {

std::string passed_on(const Finding& f) { return f.text; }

std::string still_with_model_error(const Finding& f) {
  return "also with the model error estimated: " +
         (f.still.empty() ? f.text : words(f.still.front()));
}

std::string reference_method(const Finding&) { return "reference method, for comparison only"; }

/// How a kind is worded. `opening`: what the sentence is about; null where that depends on more than
/// the kind.
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
    {FindingKind::kUncheckedReadings, "unchecked scale", sentences::unchecked_readings},
    {FindingKind::kUncheckedTouch, "unchecked touch", sentences::unchecked_touch},
    {FindingKind::kUncheckedLengths, "unchecked scale", sentences::unchecked_lengths},
    {FindingKind::kUncheckedLength, "unchecked scale", sentences::unchecked_length},
    {FindingKind::kRequired, "required accuracy", sentences::required},
    {FindingKind::kNoGain, "gain too small", sentences::no_gain},
    {FindingKind::kGain, "accuracy", sentences::gain},
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

/// Of kinds whose opening depends on more.
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
