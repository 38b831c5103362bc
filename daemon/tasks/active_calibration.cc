#include "daemon/tasks/active_calibration.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <utility>

#include "calib/files/calibration_json.h"
#include "calib/files/toml.h"
#include "calib/verdict/change.h"

namespace cellcal::daemon {

namespace {

using Why = NotUsable::Why;

/// Possibly published, but unusable.
NotUsable damaged(const std::string& why) {
  return {Why::kDamaged,
          why +
              ". Use another: 'cellcal versions', 'cellcal activate ID --reason WHY'. Or calibrate "
              "again: 'cellcal run --cell CELL --accept-change'"};
}

/// True if the session may have published, as far as the list shows: a damaged one is not excluded.
bool may_count(const SessionRecord& listed) {
  return !listed.origin && (listed.state == RecordState::kDamaged ||
                            (listed.state == RecordState::kDone && listed.has_calibration));
}

/// Positions in the journal's order of writing, with their sessions; latest first.
std::vector<std::pair<std::int64_t, SessionRecord>> candidates(Journal& journal,
                                                               const std::string& cell_name,
                                                               std::int64_t before) {
  const auto last = std::numeric_limits<std::int64_t>::max();
  const std::int64_t until = before > 0 ? journal.last_entry(before) : last;
  std::vector<std::pair<std::int64_t, SessionRecord>> all;
  std::vector<SessionRecord> own;
  for (SessionRecord& record : journal.sessions()) {
    if (before > 0 && record.id >= before) continue;
    // Without its own row, the cell of a session is unknown.
    if (!cell_name.empty() && !record.inputs.cell_name.empty() &&
        record.inputs.cell_name != cell_name)
      continue;
    if (may_count(record)) own.push_back(std::move(record));
  }
  for (const SessionRecord& record : own) all.emplace_back(journal.last_entry(record.id), record);
  for (const Activation& one : journal.activations())
    if (const auto of = std::ranges::find(own, one.session, &SessionRecord::id);
        one.entry < until && of != own.end())
      all.emplace_back(one.entry, *of);
  std::ranges::sort(all, std::greater{}, &std::pair<std::int64_t, SessionRecord>::first);
  return all;
}

/// Serial number of the robot, where the cell file states it.
std::string serial_of(const SessionRecord& record) {
  const auto cell = calib::toml_to_json(record.inputs.cell_text);
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

/// An old calibration does not apply to a cell whose arm or tool was replaced.
void refuse_foreign(const Published& wanted, const Published& newest) {
  const SessionRecord& record = wanted.record;
  const std::string was = serial_of(record), is = serial_of(newest.record);
  const bool same_arm = was == is;  // unknown where either is not stated
  const calib::Cell &then = wanted.calibration.cell, &now = newest.calibration.cell;
  if (same_arm && calib::same_nominal(then, now) && same_tools(then, now)) return;
  throw NotUsable(
      Why::kForeign,
      fmt::format(
          "session {} is of another robot or tool than session {}, the newest of {}. Calibrate "
          "again: 'cellcal run --cell CELL'",
          record.id, newest.record.id, record.inputs.cell_name));
}

/// Newest readable published calibration.
std::optional<Published> newest_of(Journal& journal, const std::string& cell) {
  for (const std::int64_t session : done_or_damaged(journal, cell)) try {
      if (auto found = published(journal, session)) return found;
    } catch (const NotUsable&) {  // not comparable with the remaining one
    }
  return std::nullopt;
}

}  // namespace

std::optional<Published> published(Journal& journal, std::int64_t session) {
  std::optional<SessionRecord> record;
  try {
    record = journal.session(session);
  } catch (const DamagedError& error) {
    if (!journal.may_be_published(session)) return std::nullopt;
    throw damaged(error.what());
  }
  if (!record || record->state != RecordState::kDone || record->calibration.empty())
    return std::nullopt;
  try {
    auto calibration = calib::calibration_from_json(
        record->calibration, fmt::format("calibration of session {}", session));
    if (!calibration.verdict.publish()) return std::nullopt;
    return Published{std::move(*record), std::move(calibration)};
  } catch (const calib::FileError& error) {  // another version
    if (!journal.was_published(session).value_or(true)) return std::nullopt;
    throw damaged(error.what());
  }
}

Published published_or_refused(Journal& journal, std::int64_t session) {
  if (auto found = published(journal, session)) return std::move(*found);
  const auto all = journal.sessions();
  const auto listed = std::ranges::find(all, session, &SessionRecord::id);
  if (listed == all.end())
    throw NotUsable(Why::kNoSession, fmt::format("no session {}. See 'cellcal versions'", session));
  throw NotUsable(
      Why::kWithheld,
      listed->state == RecordState::kDone && listed->outcome && published(*listed->outcome)
          ? fmt::format("the result of session {0} was withheld. See 'cellcal show {0}'", session)
          : fmt::format("session {} has no calibration. See 'cellcal versions'", session));
}

Published usable(Journal& journal, std::int64_t session) {
  Published one = published_or_refused(journal, session);
  if (one.record.origin)
    throw NotUsable(
        Why::kForeign,
        fmt::format("session {} was recorded by another journal: possibly of another robot. "
                    "Choose one of this cell: 'cellcal versions'",
                    session));
  if (const auto newest = newest_of(journal, one.record.inputs.cell_name))
    refuse_foreign(one, *newest);
  return one;
}

std::vector<std::int64_t> done_or_damaged(Journal& journal, const std::string& cell_name) {
  std::vector<std::int64_t> sessions;
  for (const SessionRecord& record : journal.sessions())
    if (record.inputs.cell_name == cell_name && may_count(record)) sessions.push_back(record.id);
  return sessions;
}

std::optional<InUse> in_use(Journal& journal, const std::string& cell_name, std::int64_t before) {
  for (const auto& [entry, record] : candidates(journal, cell_name, before)) {
    InUse found{
        record.id, record.inputs.cell_name.empty() ? cell_name : record.inputs.cell_name, {}, {}};
    try {
      found.calibration = published(journal, record.id);
      if (!found.calibration) continue;
    } catch (const NotUsable& error) {
      found.trouble =
          fmt::format("the calibration in use, of session {}: {}", record.id, error.what());
    }
    return found;
  }
  return std::nullopt;
}

std::optional<Published> active_calibration(Journal& journal, const std::string& cell_name,
                                            std::int64_t before) {
  auto found = in_use(journal, cell_name, before);
  if (!found) return std::nullopt;
  if (!found->calibration) throw NotUsable(Why::kDamaged, found->trouble);
  return std::move(found->calibration);
}

std::optional<std::int64_t> in_use_before(Journal& journal, const std::string& cell_name) {
  auto uses = candidates(journal, cell_name, 0);
  std::ranges::reverse(uses);
  std::map<std::int64_t, bool> used;
  std::vector<std::int64_t> stack;
  for (const auto& [entry, record] : uses) {
    const std::int64_t session = record.id;
    const auto [known, is_new] = used.try_emplace(session, true);
    if (is_new) try {
        known->second = published(journal, session).has_value();
      } catch (const NotUsable&) {  // it was in use nevertheless
      }
    if (!known->second) continue;
    const bool is_back = stack.size() > 1 && stack[stack.size() - 2] == session;
    if (is_back)
      stack.pop_back();
    else if (stack.empty() || stack.back() != session)
      stack.push_back(session);
  }
  return stack.size() < 2 ? std::nullopt : std::optional(stack[stack.size() - 2]);
}

}  // namespace cellcal::daemon
