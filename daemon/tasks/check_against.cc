#include "daemon/tasks/check_against.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>

#include "calib/files/calibration_json.h"
#include "daemon/tasks/options.h"

namespace cellcal::daemon {

namespace {

/// None: it has none that is published, or cannot be read.
std::optional<calib::Calibration> published(Journal& journal, std::int64_t session) {
  try {
    const auto record = journal.session(session);
    if (!record || record->state != "done" || record->calibration.empty()) return std::nullopt;
    auto calibration = calib::calibration_from_json(
        record->calibration, fmt::format("calibration of session {}", session));
    if (!calibration.verdict.publish) return std::nullopt;
    return calibration;
  } catch (const std::runtime_error& error) {  // of another version, or damaged
    spdlog::warn("calibration of session {} is not used: {}", session, error.what());
    return std::nullopt;
  }
}

}  // namespace

SessionRecord published_session(Journal& journal, const std::filesystem::path& cell,
                                std::optional<std::int64_t> session) {
  for (const SessionRecord& record : journal.sessions()) {
    if (session ? record.id != *session : record.origin.has_value()) continue;
    if (!cell.empty() && record.inputs.cell_name != cell.string()) continue;
    if (published(journal, record.id)) return *journal.session(record.id);
  }
  if (session)
    throw NothingToCheck(
        fmt::format("session {} has no published calibration{}. See 'cellcal history'", *session,
                    cell.empty() ? "" : " of " + cell.string()));
  throw NothingToCheck(
      fmt::format("no published calibration{}: nothing to check. Calibrate first: 'cellcal run'",
                  cell.empty() ? "" : " of " + cell.string()));
}

calib::Calibration calibration_of(Journal& journal, std::int64_t session) {
  auto calibration = published(journal, session);
  if (!calibration)
    throw NothingToCheck(fmt::format(
        "session {} has no published calibration any more. See 'cellcal history'", session));
  return std::move(*calibration);
}

std::vector<std::vector<calib::Touch>> checks_before(Journal& journal, std::int64_t calibrated,
                                                     std::int64_t before) {
  std::vector<std::vector<calib::Touch>> checks;
  for (const SessionRecord& record : journal.sessions()) {
    if (record.id >= before || record.id <= calibrated || record.state != "done" || record.origin)
      continue;
    try {
      const SessionOptions options = options_from_json(record.inputs.options);
      if (options.kind != SessionKind::kCheck || options.against != calibrated) continue;
      checks.push_back(journal.touches(record.id));
    } catch (const std::runtime_error& error) {
      spdlog::warn("check {} is not referred to: {}", record.id, error.what());
    }
  }
  std::ranges::reverse(checks);
  return checks;
}

}  // namespace cellcal::daemon
