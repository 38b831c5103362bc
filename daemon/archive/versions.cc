#include "daemon/archive/versions.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "calib/files/calibration_json.h"
#include "calib/syntax/toml_json.h"
#include "calib/verdict/change.h"
#include "daemon/tasks/recorded/active_calibration.h"

namespace cellcal::daemon {

namespace {

using Why = NotActivated::Why;

/// Its calibration, or why it has none that may be used.
Published usable(Journal& journal, std::int64_t session) {
  std::optional<SessionRecord> record;
  try {
    record = journal.session(session);
  } catch (const JournalError& damaged) {
    throw NotActivated(Why::kDamaged, damaged.what());
  }
  if (!record)
    throw NotActivated(Why::kNoSession,
                       fmt::format("no session {}. See 'cellcal versions'", session));
  if (record->state != RecordState::kDone || record->calibration.empty())
    throw NotActivated(
        Why::kWithheld,
        fmt::format("session {} has no calibration. See 'cellcal versions'", session));
  try {
    auto calibration =
        calib::calibration_from_json(record->calibration, fmt::format("session {}", session));
    if (!calibration.verdict.publish)
      throw NotActivated(Why::kWithheld,
                         fmt::format("the result of session {} was withheld. See 'cellcal show {}'",
                                     session, session));
    return {std::move(*record), std::move(calibration)};
  } catch (const calib::FileError& wrong) {
    throw NotActivated(Why::kDamaged, wrong.what());
  }
}

/// Of the robot, where the cell file states it.
std::string serial_of(const SessionRecord& record) {
  const auto cell = nlohmann::json::parse(calib::toml_to_json(record.inputs.cell_text));
  const nlohmann::json::json_pointer where("/identity/robot_serial");
  return cell.contains(where) ? cell.at(where).get<std::string>() : "";
}

bool same_tools(const calib::Cell& a, const calib::Cell& b) {
  static constexpr double kRounding = 1e-9;
  const auto same = [](const calib::Tool& x, const calib::Tool& y) {
    return x.tcp.isApprox(y.tcp, kRounding) &&
           std::abs(x.tip_radius_m - y.tip_radius_m) <= kRounding;
  };
  return same(a.tool, b.tool) && std::ranges::equal(a.other_tools, b.other_tools, same);
}

/// Of a cell that has since got another arm or tool an old calibration says nothing.
void refuse_foreign(const Published& wanted, const Published& newest) {
  const SessionRecord& record = wanted.record;
  const std::string was = serial_of(record), is = serial_of(newest.record);
  const bool same_arm = was == is;  // where one states none, nobody knows
  const calib::Cell &then = wanted.calibration.cell, &now = newest.calibration.cell;
  if (same_arm && calib::same_nominal(then, now) && same_tools(then, now)) return;
  throw NotActivated(
      Why::kForeign,
      fmt::format(
          "session {} is of another robot or tool than session {}, the newest of {}. Calibrate "
          "again: 'cellcal run'",
          record.id, newest.record.id, record.inputs.cell_name));
}

/// Sessions of this journal and cell that are done, the newest first.
std::vector<std::int64_t> done_of(Journal& journal, const std::string& cell) {
  std::vector<std::int64_t> sessions;
  for (const SessionRecord& record : journal.sessions())
    if (!record.origin && record.state == RecordState::kDone && record.inputs.cell_name == cell)
      sessions.push_back(record.id);
  return sessions;
}

std::optional<Published> newest_of(Journal& journal, const std::string& cell) {
  for (const std::int64_t session : done_of(journal, cell))
    if (auto found = published(journal, session)) return found;
  return std::nullopt;
}

std::optional<Published> in_use(Journal& journal, std::int64_t of_cell) {
  if (of_cell == 0) return active_calibration(journal, "");
  const auto record = journal.session(of_cell);
  return record ? active_calibration(journal, record->inputs.cell_name) : std::nullopt;
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
                  {}};
  for (const Activation& activation : activations)
    if (activation.session == version.session) version.activated = activation;
  return version;
}

}  // namespace

std::optional<Version> version_in_use(Journal& journal) {
  const auto active = in_use(journal, 0);
  if (!active) return std::nullopt;
  return version_of(journal, *active, active->record.id, journal.activations());
}

std::vector<Version> versions(Journal& journal, std::int64_t of_cell, std::size_t most) {
  const auto active = in_use(journal, of_cell);
  std::vector<Version> all;
  if (!active) return all;
  const std::vector<Activation> activations = journal.activations();
  for (const std::int64_t session : done_of(journal, active->record.inputs.cell_name)) {
    if (all.size() == most) break;
    const auto one = published(journal, session);
    if (!one) continue;
    all.push_back(version_of(journal, *one, active->record.id, activations));
  }
  return all;
}

void activate(Journal& journal, const Activation& wanted) {
  const Published one = usable(journal, wanted.session);
  const std::string& cell = one.record.inputs.cell_name;
  if (one.record.origin)
    throw NotActivated(
        Why::kForeign,
        fmt::format(
            "session {} was recorded by another journal: another robot's, for all that is known. "
            "Name one of this cell: 'cellcal versions'",
            wanted.session));
  if (const auto newest = newest_of(journal, cell)) refuse_foreign(one, *newest);
  const auto active = active_calibration(journal, cell);
  if (active && active->record.id == wanted.session)
    throw NotActivated(Why::kActive, fmt::format("session {} is in use already", wanted.session));
  journal.activate(wanted);
}

std::int64_t roll_back(Journal& journal, std::int64_t of_cell, Activation wanted) {
  const auto active = in_use(journal, of_cell);
  if (!active)
    throw NotActivated(
        Why::kNothingBefore,
        "nothing is in use: no calibration was published. Calibrate first: 'cellcal run'");
  const auto before = in_use_before(journal, active->record.inputs.cell_name);
  if (!before)
    throw NotActivated(
        Why::kNothingBefore,
        fmt::format("nothing was in use before session {}, which is in use", active->record.id));
  wanted.session = *before;
  activate(journal, wanted);
  return *before;
}

Comparison compare(Journal& journal, std::int64_t before, std::int64_t after) {
  const Published one = usable(journal, before), other = usable(journal, after);
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
