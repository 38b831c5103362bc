#include "daemon/tasks/recorded/active_calibration.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <limits>
#include <map>
#include <utility>
#include <vector>

#include "calib/files/calibration_json.h"

namespace cellcal::daemon {

namespace {

/// Places among all that was ever written, with their sessions; the latest first.
std::vector<std::pair<std::int64_t, std::int64_t>> candidates(Journal& journal,
                                                              const std::string& cell_name,
                                                              std::int64_t before) {
  const auto last = std::numeric_limits<std::int64_t>::max();
  const std::int64_t until = before > 0 ? journal.last_entry(before) : last;
  std::vector<std::pair<std::int64_t, std::int64_t>> all;
  std::vector<std::int64_t> own;
  for (const SessionRecord& record : journal.sessions()) {
    if (record.origin || record.state != RecordState::kDone || (before > 0 && record.id >= before))
      continue;
    if (!cell_name.empty() && record.inputs.cell_name != cell_name) continue;
    own.push_back(record.id);
    all.emplace_back(journal.last_entry(record.id), record.id);
  }
  for (const Activation& one : journal.activations())
    if (one.entry < until && std::ranges::find(own, one.session) != own.end())
      all.emplace_back(one.entry, one.session);
  std::ranges::sort(all, std::greater{});
  return all;
}

}  // namespace

std::optional<Published> published(Journal& journal, std::int64_t session) {
  try {
    auto record = journal.session(session);
    if (!record || record->state != RecordState::kDone || record->calibration.empty())
      return std::nullopt;
    auto calibration = calib::calibration_from_json(
        record->calibration, fmt::format("calibration of session {}", session));
    if (!calibration.verdict.publish) return std::nullopt;
    return Published{std::move(*record), std::move(calibration)};
  } catch (const std::runtime_error& error) {  // of another version, or damaged
    spdlog::warn("calibration of session {} is not used: {}", session, error.what());
    return std::nullopt;
  }
}

std::optional<Published> active_calibration(Journal& journal, const std::string& cell_name,
                                            std::int64_t before) {
  for (const auto& [entry, session] : candidates(journal, cell_name, before))
    if (auto found = published(journal, session)) return found;
  return std::nullopt;
}

std::optional<std::int64_t> in_use_before(Journal& journal, const std::string& cell_name) {
  auto uses = candidates(journal, cell_name, 0);
  std::ranges::reverse(uses);
  std::map<std::int64_t, bool> usable;
  std::vector<std::int64_t> stack;
  for (const auto& [entry, session] : uses) {
    const auto [known, is_new] = usable.try_emplace(session, false);
    if (is_new) known->second = published(journal, session).has_value();
    if (!known->second) continue;
    const auto again = std::ranges::find(stack, session);
    if (again != stack.end())
      stack.erase(again + 1, stack.end());
    else
      stack.push_back(session);
  }
  return stack.size() < 2 ? std::nullopt : std::optional(stack[stack.size() - 2]);
}

}  // namespace cellcal::daemon
