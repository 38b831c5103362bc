#include "daemon/result/outcome_words.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "calib/model/units.h"
#include "calib/result/tcp_check.h"

namespace cellcal::daemon {

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

/// What to do where no change is named.
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
