#include "daemon/tasks/recorded/last_calibration.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "daemon/tasks/recorded/active_calibration.h"

namespace cellcal::daemon {

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

}  // namespace cellcal::daemon
