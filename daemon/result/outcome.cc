#include "daemon/result/outcome.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "calib/model/units.h"
#include "calib/result/finding_phrase.h"

namespace cellcal::daemon {

namespace {

struct KindOfOutcome {
  bool good = false;
  std::optional<bool> published = {};
};
constexpr EnumTable<OutcomeKind, KindOfOutcome> kKinds{
    {{OutcomeKind::kPublished, {true, true}},
     {OutcomeKind::kWithheld, {false, false}},
     {OutcomeKind::kHolds, {true, {}}},
     {OutcomeKind::kDoesNotHold, {false, {}}},
     {OutcomeKind::kUndecided, {false, {}}},
     {OutcomeKind::kQualified, {true, {}}},
     {OutcomeKind::kNotQualified, {false, {}}},
     {OutcomeKind::kFound, {true, {}}},
     {OutcomeKind::kNothingMet, {true, {}}},
     {OutcomeKind::kUpdated, {true, true}},
     {OutcomeKind::kNothingChanged, {true, false}},
     {OutcomeKind::kUpdateWithheld, {false, false}}}};

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

  const std::vector<calib::MasteredZero>& mastered;

  SessionOutcome operator()(const calib::TcpCheck& check) const {
    using enum calib::CheckVerdict;
    static constexpr EnumTable<calib::CheckVerdict, OutcomeKind> kTable{
        {{kHolds, OutcomeKind::kHolds},
         {kDoesNotHold, OutcomeKind::kDoesNotHold},
         {kUndecided, OutcomeKind::kUndecided}}};
    SessionOutcome outcome;
    outcome.kind = kTable[check.verdict()];
    std::ranges::copy_if(mastered, std::back_inserter(outcome.zeros),
                         [](const calib::MasteredZero& one) { return !one.holds(); });
    // The touches name a change of their own only where they alarm.
    const bool by_zeros_alone = !outcome.zeros.empty() && check.log_odds <= check.log_alarm;
    if (outcome.kind == OutcomeKind::kDoesNotHold && !by_zeros_alone)
      outcome.change = likeliest(check.explanations);
    outcome.touches = check.touches;
    // A shift of the TCP is no description of another change.
    if (!check.explanations.empty() &&
        (!outcome.change || outcome.change->kind == calib::ChangeKind::kTool))
      outcome.tcp_shift = {check.shift_m, check.u_along_m()};
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
    outcome.contacts = phrases(q);
    outcome.contacts.pop_back();  // its verdict is the outcome's
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

using calib::kMmPerM, calib::Phrase;

/// Names of a list as `id` + NAME, with commas between.
template <class T>
Phrase in_a_row(const char* id, const std::vector<T>& list) {
  Phrase names;
  for (const T& one : list)
    names = joined("say.join.comma", names, std::string(id) + to_string(one));
  return names;
}

/// Reason of a result that is not good; empty for others.
Phrase reason(const SessionOutcome& outcome) {
  switch (outcome.kind) {
    case OutcomeKind::kWithheld: return in_a_row("finding.", outcome.withheld_by);
    case OutcomeKind::kNotQualified:
      if (!outcome.not_as_stated.empty()) return in_a_row("say.contacts.", outcome.not_as_stated);
      return {"say.session.not_qualified.few", {{"n", outcome.touches}}};
    case OutcomeKind::kUpdateWithheld:
      return outcome.update ? std::string("say.update.") + to_string(*outcome.update) : "";
    default: return {};
  }
}

/// True if a check finds a change that is no shift of the tool.
bool names_another(const SessionOutcome& outcome) {
  return outcome.kind == OutcomeKind::kDoesNotHold && outcome.change &&
         outcome.change->kind != calib::ChangeKind::kTool;
}

Phrase opening(const SessionOutcome& outcome) {
  const Phrase opening{
      std::string("say.session.") + to_string(outcome.kind),
      {{"n", outcome.touches}, {"spheres", outcome.spheres.size()}, {"what", reason(outcome)}}};
  if (names_another(outcome))
    return joined("say.join.colon", opening, calib::phrase(*outcome.change));
  if (!outcome.tcp_shift) return opening;
  return joined("say.join.colon", opening,
                {"say.session.shift",
                 {{"mm", kMmPerM * outcome.tcp_shift->shift_m.norm()},
                  {"u", kMmPerM * outcome.tcp_shift->u_m}}});
}

/// Remedy where no change is identified.
Phrase remedy(const SessionOutcome& outcome) {
  std::string id = std::string("say.session.") + to_string(outcome.kind) + ".do";
  if (outcome.kind == OutcomeKind::kDoesNotHold && (outcome.change || !outcome.zeros.empty()))
    return {};
  return calib::sentence_of(id) ? Phrase(std::move(id)) : Phrase();
}

}  // namespace

bool is_good(OutcomeKind kind) { return kKinds[kind].good; }

SessionOutcome outcome_of(const SessionResult& result) {
  return std::visit(OutcomeOf{result.mastered}, result.of);
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

Phrase phrase(const FoundSphere& sphere) {
  // As in the cell file: with decimal points.
  std::string line = fmt::format("{}: centre_mm = [{:.2f}, {:.2f}, {:.2f}]", sphere.target,
                                 kMmPerM * sphere.centre_m.x(), kMmPerM * sphere.centre_m.y(),
                                 kMmPerM * sphere.centre_m.z());
  if (!sphere.on.empty()) {
    std::vector<double> deg;
    for (const double rad : sphere.taught_rad)  // no "-0.00"
      deg.push_back(std::round(100.0 * rad * calib::kDegPerRad) / 100.0 + 0.0);
    line += fmt::format(", on = \"{}\", taught_deg = [{:.2f}]", sphere.on, fmt::join(deg, ", "));
  }
  return {sphere.moved_m ? "say.sphere.found.moved" : "say.sphere.found",
          {{"line", line},
           {"u", kMmPerM * sphere.u_m},
           {"touches", sphere.touches},
           {"moved", kMmPerM * sphere.moved_m.value_or(0.0)}}};
}

std::vector<Phrase> phrases(const SessionOutcome& outcome) {
  std::vector<Phrase> lines{opening(outcome)};
  const auto add_targets = [&](const char* id, const std::vector<std::string>& targets) {
    if (!targets.empty())
      lines.push_back({id, {{"targets", fmt::format("{}", fmt::join(targets, ", "))}}});
  };
  add_targets("say.session.no_contact", outcome.not_found);
  add_targets("say.session.unsteady", outcome.unsteady);
  for (const calib::MasteredZero& one : outcome.zeros) lines.push_back(phrase(one));
  if (outcome.change) {
    const bool acts = outcome.kind == OutcomeKind::kDoesNotHold;
    const Phrase what = names_another(outcome) ? Phrase() : calib::phrase(*outcome.change);
    lines.push_back(joined("say.join.sentences", what,
                           acts ? calib::remedy_phrase(*outcome.change) : Phrase()));
  }
  lines.insert(lines.end(), outcome.contacts.begin(), outcome.contacts.end());
  for (const FoundSphere& one : outcome.spheres) lines.push_back(phrase(one));
  if (Phrase what = remedy(outcome); !what.empty()) lines.push_back(std::move(what));
  return lines;
}

}  // namespace cellcal::daemon
