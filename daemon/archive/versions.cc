#include "daemon/archive/versions.h"

#include <fmt/format.h>

#include <algorithm>

namespace cellcal::daemon {

namespace {

using Why = NotActivated::Why;

std::optional<InUse> of_cell_or_newest(Journal& journal, std::int64_t of_cell) {
  if (of_cell == 0) return in_use(journal, "");
  const auto all = journal.sessions();  // a damaged session still names its cell
  const auto listed = std::ranges::find(all, of_cell, &SessionRecord::id);
  return listed == all.end() ? std::nullopt : in_use(journal, listed->inputs.cell_name);
}

std::optional<calib::InScope> in_scope(Journal& journal, const Published& one) {
  return calib::apart_in_scope(nullptr, one.calibration, journal.touches(one.record.id),
                               one.calibration.verdict.workspace);
}

Version version_of(Journal& journal, const Published& one, std::int64_t active,
                   const std::vector<Activation>& activations) {
  const calib::Calibration& c = one.calibration;
  Version version{one.record.id,
                  one.record.ended,
                  one.record.inputs.cell_name,
                  c.verdict.workspace,
                  c.verdict.workspace ? c.predicted_workspace_m : c.predicted_near_targets_m,
                  in_scope(journal, one),
                  one.record.id == active,
                  {},
                  {}};
  for (const Activation& activation : activations)
    if (activation.session == version.session) version.activated = activation;
  return version;
}

}  // namespace

std::optional<Version> version_in_use(Journal& journal) {
  const auto active = in_use(journal, "");
  if (!active || !active->calibration) return std::nullopt;
  return version_of(journal, *active->calibration, active->session, journal.activations());
}

std::vector<Version> versions(Journal& journal, std::int64_t of_cell, std::size_t most) {
  const auto active = of_cell_or_newest(journal, of_cell);
  std::vector<Version> all;
  if (!active) return all;
  const std::vector<Activation> activations = journal.activations();
  for (const std::int64_t session : done_or_damaged(journal, active->cell)) {
    if (all.size() >= most && session != active->session) continue;
    try {
      if (const auto one = published(journal, session))
        all.push_back(version_of(journal, *one, active->session, activations));
    } catch (const NotUsable& unusable) {
      Version& damaged = all.emplace_back();
      damaged.session = session;
      damaged.cell = active->cell;
      damaged.active = session == active->session;
      damaged.trouble = unusable.what();
    }
  }
  return all;
}

void activate(Journal& journal, const Activation& wanted) {
  const Published one = usable(journal, wanted.session);
  const auto active = in_use(journal, one.record.inputs.cell_name);
  if (active && active->session == wanted.session)
    throw NotActivated(Why::kActive, fmt::format("session {} is in use already", wanted.session));
  journal.activate(wanted);
}

std::int64_t roll_back(Journal& journal, std::int64_t of_cell, Activation wanted) {
  const auto active = of_cell_or_newest(journal, of_cell);
  if (!active)
    throw NotActivated(
        Why::kNothingBefore,
        "nothing is in use: no calibration was published. Calibrate first: 'cellcal run'");
  const auto before = in_use_before(journal, active->cell);
  if (!before)
    throw NotActivated(
        Why::kNothingBefore,
        fmt::format(
            "session {}, which is in use, is the first of its line. Put another one into use by its number: "
            "'cellcal versions', 'cellcal activate ID'",
            active->session));
  wanted.session = *before;
  activate(journal, wanted);
  return *before;
}

Comparison compare(Journal& journal, std::int64_t before, std::int64_t after) {
  const Published one = published_or_refused(journal, before),
                  other = published_or_refused(journal, after);
  Comparison result{
      before, after, one.calibration.verdict.workspace && other.calibration.verdict.workspace,
      {},     0.0,   {}};
  const std::vector<calib::Touch> touches = journal.touches(after);
  result.apart =
      calib::apart_in_scope(&one.calibration, other.calibration, touches, result.workspace);
  if (!result.apart) return result;
  if (const auto change = calib::change_since(one.calibration, other.calibration, touches))
    result.expected_m = change->expected_m;
  result.parameters = calib::parameter_differences(one.calibration, other.calibration);
  return result;
}

}  // namespace cellcal::daemon
