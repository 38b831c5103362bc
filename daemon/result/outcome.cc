#include "daemon/result/outcome.h"

#include <algorithm>

#include "calib/result/names.h"

namespace cellcal::daemon {

namespace {

using calib::Named;

constexpr std::array kNames{Named{OutcomeKind::kPublished, "published"},
                            Named{OutcomeKind::kWithheld, "withheld"},
                            Named{OutcomeKind::kHolds, "holds"},
                            Named{OutcomeKind::kDoesNotHold, "does_not_hold"},
                            Named{OutcomeKind::kUndecided, "undecided"},
                            Named{OutcomeKind::kQualified, "qualified"},
                            Named{OutcomeKind::kNotQualified, "not_qualified"},
                            Named{OutcomeKind::kFound, "found"},
                            Named{OutcomeKind::kNothingMet, "nothing_met"},
                            Named{OutcomeKind::kUpdated, "updated"},
                            Named{OutcomeKind::kNothingChanged, "nothing_changed"},
                            Named{OutcomeKind::kUpdateWithheld, "update_withheld"}};

template <class T>
void add_once(std::vector<T>& list, const T& one) {
  if (std::ranges::find(list, one) == list.end()) list.push_back(one);
}

/// The likeliest that is a change; none where nothing changed.
std::optional<calib::Explanation> likeliest(const std::vector<calib::Explanation>& explanations) {
  for (const calib::Explanation& one : explanations)
    if (one.kind != calib::ChangeKind::kNothing) return one;
  return std::nullopt;
}

OutcomeKind kind_of(const calib::Calibration& calibration) {
  const bool published = calibration.verdict.publish;
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

const char* to_string(OutcomeKind kind) { return calib::name_of(kNames, kind); }
std::optional<OutcomeKind> outcome_kind(const std::string& name) {
  return calib::named(kNames, name);
}

bool is_good(OutcomeKind kind) {
  switch (kind) {
    case OutcomeKind::kPublished:
    case OutcomeKind::kHolds:
    case OutcomeKind::kQualified:
    case OutcomeKind::kFound:
    case OutcomeKind::kNothingMet:
    case OutcomeKind::kUpdated:
    case OutcomeKind::kNothingChanged:
      return true;
    case OutcomeKind::kWithheld:
    case OutcomeKind::kDoesNotHold:
    case OutcomeKind::kUndecided:
    case OutcomeKind::kNotQualified:
    case OutcomeKind::kUpdateWithheld:
      break;
  }
  return false;
}

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
  switch (outcome.kind) {
    case OutcomeKind::kPublished:
    case OutcomeKind::kUpdated:
      return true;
    case OutcomeKind::kWithheld:
    case OutcomeKind::kNothingChanged:
    case OutcomeKind::kUpdateWithheld:
      return false;
    case OutcomeKind::kHolds:
    case OutcomeKind::kDoesNotHold:
    case OutcomeKind::kUndecided:
    case OutcomeKind::kQualified:
    case OutcomeKind::kNotQualified:
    case OutcomeKind::kFound:
    case OutcomeKind::kNothingMet:
      break;
  }
  return std::nullopt;
}

}  // namespace cellcal::daemon
