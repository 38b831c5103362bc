#include "daemon/tasks/recorded/check_against.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>

#include "daemon/tasks/recorded/active_calibration.h"
#include "daemon/tasks/recorded/options.h"

namespace cellcal::daemon {

SessionRecord published_session(Journal& journal, const std::filesystem::path& cell,
                                std::optional<std::int64_t> session) {
  auto found = session ? published(journal, *session) : active_calibration(journal, cell.string());
  if (found && (cell.empty() || found->record.inputs.cell_name == cell.string()))
    return std::move(found->record);
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
  return std::move(calibration->calibration);
}

std::vector<std::vector<calib::Touch>> checks_before(Journal& journal, std::int64_t calibrated,
                                                     std::int64_t before) {
  std::vector<std::vector<calib::Touch>> checks;
  for (const SessionRecord& record : journal.sessions()) {
    if (record.id >= before || record.id <= calibrated || record.state != RecordState::kDone ||
        record.origin)
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
