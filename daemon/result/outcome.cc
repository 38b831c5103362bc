#include "daemon/result/outcome.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "calib/model/units.h"

namespace cellcal::daemon {

namespace {

struct KindOfOutcome {
  const char* name = "unknown";
  bool good = false;
  std::optional<bool> published = {};
};
constexpr EnumTable<OutcomeKind, KindOfOutcome> kKinds{
    {{OutcomeKind::kPublished, {"published", true, true}},
     {OutcomeKind::kWithheld, {"withheld", false, false}},
     {OutcomeKind::kHolds, {"holds", true, {}}},
     {OutcomeKind::kDoesNotHold, {"does_not_hold", false, {}}},
     {OutcomeKind::kUndecided, {"undecided", false, {}}},
     {OutcomeKind::kQualified, {"qualified", true, {}}},
     {OutcomeKind::kNotQualified, {"not_qualified", false, {}}},
     {OutcomeKind::kFound, {"found", true, {}}},
     {OutcomeKind::kNothingMet, {"nothing_met", true, {}}},
     {OutcomeKind::kUpdated, {"updated", true, true}},
     {OutcomeKind::kNothingChanged, {"nothing_changed", true, false}},
     {OutcomeKind::kUpdateWithheld, {"update_withheld", false, false}}}};

template <class T>
void add_once(std::vector<T>& list, const T& one) {
  if (std::ranges::find(list, one) == list.end()) list.push_back(one);
}

/// The most likely change; none where nothing changed.
std::optional<calib::Explanation> likeliest(const std::vector<calib::Explanation>& explanations) {
  for (const calib::Explanation& one : explanations)
    if (one.kind != calib::ChangeKind::kNothing) return one;
  return std::nullopt;
}

OutcomeKind kind_of(const calib::Calibration& calibration) {
  const bool published = calibration.verdict.publish();
  if (!calibration.update) return published ? OutcomeKind::kPublished : OutcomeKind::kWithheld;
  if (published) return OutcomeKind::kUpdated;
  return calibration.update->outcome == calib::UpdateOutcome::kNothingChanged
             ? OutcomeKind::kNothingChanged
             : OutcomeKind::kUpdateWithheld;
}

struct OutcomeOf {
  SessionOutcome operator()(const calib::Calibration& calibration) const {
    SessionOutcome outcome{kind_of(calibration)};
    outcome.touches =
        static_cast<std::size_t>(std::max(0, calibration.after.count + calibration.check.count));
    for (const calib::Finding& one : calibration.verdict.findings)
      if (one.withholds()) add_once(outcome.withheld_by, one.kind);
    if (!calibration.update) return outcome;
    outcome.update = calibration.update->outcome;
    outcome.touches = calibration.update->touches;
    outcome.not_found = calibration.update->not_found;
    if (outcome.kind != OutcomeKind::kNothingChanged)
      outcome.change = likeliest(calibration.update->explanations);
    return outcome;
  }

  SessionOutcome operator()(const calib::TcpCheck& check) const {
    SessionOutcome outcome;
    switch (check.verdict()) {
      case calib::CheckVerdict::kHolds:
        outcome.kind = OutcomeKind::kHolds;
        break;
      case calib::CheckVerdict::kDoesNotHold:
        outcome.kind = OutcomeKind::kDoesNotHold;
        outcome.change = likeliest(check.explanations);
        break;
      case calib::CheckVerdict::kUndecided:
        outcome.kind = OutcomeKind::kUndecided;
        break;
    }
    outcome.touches = check.touches;
    if (!check.explanations.empty()) outcome.tcp_shift = {check.shift_m, check.u_along_m()};
    for (const calib::NotFound& one : check.not_found) add_once(outcome.not_found, one.target);
    for (const calib::UnsteadyTouch& one : check.unsteady) add_once(outcome.unsteady, one.target);
    outcome.remedy = calib::remedy_of(
        check.verdict(), outcome.change ? outcome.change->kind : calib::ChangeKind::kNothing);
    return outcome;
  }

  SessionOutcome operator()(const Qualification& q) const {
    SessionOutcome outcome{q.passed() ? OutcomeKind::kQualified : OutcomeKind::kNotQualified};
    outcome.touches = static_cast<std::size_t>(std::max(0, q.touches));
    outcome.not_as_stated = q.findings;
    return outcome;
  }

  SessionOutcome operator()(const FoundSpheres& found) const {
    SessionOutcome outcome{OutcomeKind::kFound};
    outcome.spheres = found.spheres;
    for (const FoundSphere& one : found.spheres)
      outcome.touches += static_cast<std::size_t>(std::max(0, one.touches));
    return outcome;
  }

  SessionOutcome operator()(const DryRun& run) const {
    return {OutcomeKind::kNothingMet, run.standoffs};
  }
};

}  // namespace

const char* to_string(OutcomeKind kind) { return kKinds[kind].name; }
std::optional<OutcomeKind> outcome_kind(const std::string& name) {
  const auto* const found = std::ranges::find(
      kOutcomeKinds, name, [](OutcomeKind kind) { return std::string_view(to_string(kind)); });
  return found == kOutcomeKinds.end() ? std::nullopt : std::optional(*found);
}

bool is_good(OutcomeKind kind) { return kKinds[kind].good; }

SessionOutcome outcome_of(const SessionResult& result) {
  return std::visit(OutcomeOf{}, result.of);
}

std::string cause_of(const SessionOutcome& outcome) {
  if (outcome.change) return to_string(outcome.change->kind);
  if (outcome.kind == OutcomeKind::kUpdateWithheld && outcome.update)
    return to_string(*outcome.update);
  if (!outcome.withheld_by.empty() && !is_good(outcome.kind))
    return to_string(outcome.withheld_by.front());
  return outcome.not_as_stated.empty() ? "" : to_string(outcome.not_as_stated.front());
}

std::optional<bool> published(const SessionOutcome& outcome) {
  return kKinds[outcome.kind].published;
}

namespace {

using calib::kMmPerM;

std::string shift_words(const SessionOutcome& outcome) {
  if (!outcome.tcp_shift) return "";
  return fmt::format(": TCP shift {:.2f} +- {:.2f} mm (k=2)",
                     kMmPerM * outcome.tcp_shift->shift_m.norm(), kMmPerM * outcome.tcp_shift->u_m);
}

/// "not_resolved" -> "not resolved"
std::string spaced(std::string name) {
  std::ranges::replace_if(
      name, [](char c) { return c == '_' || c == '-'; }, ' ');
  return name;
}

template <class T>
std::string in_a_row(const std::vector<T>& list) {
  std::string names;
  for (const T& one : list) names += (names.empty() ? "" : ", ") + spaced(to_string(one));
  return names;
}

std::string opening(const SessionOutcome& outcome) {
  switch (outcome.kind) {
    case OutcomeKind::kPublished:
      return "calibration published";
    case OutcomeKind::kWithheld:
      return "calibration withheld: " + in_a_row(outcome.withheld_by);
    case OutcomeKind::kHolds:
      return "calibration holds" + shift_words(outcome);
    case OutcomeKind::kDoesNotHold:
      return "calibration does not hold" + shift_words(outcome);
    case OutcomeKind::kUndecided:
      return "check undecided" + shift_words(outcome);
    case OutcomeKind::kQualified:
      return fmt::format("contacts qualified: {} touches", outcome.touches);
    case OutcomeKind::kNotQualified:
      return outcome.not_as_stated.empty()
                 ? fmt::format("contacts not qualified: {} touches are too few", outcome.touches)
                 : "contacts not qualified: " + in_a_row(outcome.not_as_stated);
    case OutcomeKind::kFound:
      return fmt::format("{} spheres found. Put these centres into the cell file",
                         outcome.spheres.size());
    case OutcomeKind::kNothingMet:
      return fmt::format("{} stand-offs reached, the tip met nothing", outcome.touches);
    case OutcomeKind::kUpdated:
      return "calibration updated";
    case OutcomeKind::kNothingChanged:
      return "nothing changed: the last calibration holds";
    case OutcomeKind::kUpdateWithheld:
      return "update withheld: " + spaced(outcome.update ? to_string(*outcome.update) : "");
  }
  return "";
}

/// Remedy where no change is identified.
std::string remedy(const SessionOutcome& outcome) {
  switch (outcome.kind) {
    case OutcomeKind::kDoesNotHold:
      return outcome.change
                 ? ""
                 : "Check that no sphere was moved and that the tool is not damaged, then calibrate again";
    case OutcomeKind::kUndecided:
      return "Clean tip and spheres, check that tip, spheres and stands are tight, and check again";
    case OutcomeKind::kUpdateWithheld:
      return "Run a full session: 'cellcal run'";
    default:
      return "";
  }
}

}  // namespace

std::string words(const FoundSphere& sphere) {
  std::string text =
      fmt::format("{}: centre_mm = [{:.2f}, {:.2f}, {:.2f}]  # +- {:g} mm (k=2), {} touches",
                  sphere.target, kMmPerM * sphere.centre_m.x(), kMmPerM * sphere.centre_m.y(),
                  kMmPerM * sphere.centre_m.z(), kMmPerM * sphere.u_m, sphere.touches);
  if (sphere.moved_m)
    text += fmt::format(", {:.1f} mm from the cell file's", kMmPerM * *sphere.moved_m);
  return text;
}

std::vector<std::string> words(const SessionOutcome& outcome) {
  std::vector<std::string> lines{opening(outcome)};
  if (!outcome.not_found.empty())
    lines.push_back(fmt::format("no contact with {}", fmt::join(outcome.not_found, ", ")));
  if (!outcome.unsteady.empty())
    lines.push_back(
        fmt::format("contacts with {} did not agree", fmt::join(outcome.unsteady, ", ")));
  if (outcome.change && outcome.kind == OutcomeKind::kDoesNotHold)
    lines.push_back(calib::words(*outcome.change) + ". " + calib::remedy_words(*outcome.change));
  else if (outcome.change)
    lines.push_back(calib::words(*outcome.change));
  for (const FoundSphere& one : outcome.spheres) lines.push_back(words(one));
  if (const std::string what = remedy(outcome); !what.empty()) lines.push_back(what);
  return lines;
}

}  // namespace cellcal::daemon
