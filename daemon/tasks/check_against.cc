#include "daemon/tasks/check_against.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "daemon/tasks/active_calibration.h"
#include "daemon/tasks/options.h"

namespace cellcal::daemon {

SessionRecord published_session(Journal& journal, const std::filesystem::path& cell,
                                std::optional<std::int64_t> session) {
  std::optional<Published> found;
  try {
    found = session ? usable(journal, *session) : active_calibration(journal, cell.string());
  } catch (const NotUsable& none) {
    using Why = NotUsable::Why;
    if (none.why != Why::kNoSession && none.why != Why::kWithheld) throw;
  }
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
  return published_or_refused(journal, session).calibration;
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

std::optional<Compared> last_calibration(Journal& journal, const std::string& cell_name,
                                         std::int64_t before, bool accepted) {
  const auto found = in_use(journal, cell_name, before);
  if (!found) return std::nullopt;
  if (!found->calibration && accepted) {
    spdlog::warn("not compared: {}", found->trouble);
    return std::nullopt;
  }
  if (!found->calibration) throw NotUsable(NotUsable::Why::kDamaged, found->trouble);
  const auto& active = found->calibration;
  constexpr std::size_t kDate = 10;  // YYYY-MM-DD
  const SessionRecord& record = active->record;
  return Compared{fmt::format("session {} of {}", record.id, record.ended.substr(0, kDate)),
                  accepted, record.calibration};
}

std::string compared_to_json(const Compared& compared) {
  return nlohmann::json{{"words", compared.words},
                        {"accepted", compared.accepted},
                        {"calibration", compared.calibration}}
             .dump() +
         "\n";
}

Compared compared_from_json(const std::string& text) {
  try {
    const nlohmann::json json = nlohmann::json::parse(text);
    return {json.at("words"), json.at("accepted"), json.at("calibration")};
  } catch (const nlohmann::json::exception&) {
    throw std::runtime_error(
        "compared.json: damaged: words, accepted and calibration are needed. Export the session again");
  }
}

}  // namespace cellcal::daemon
