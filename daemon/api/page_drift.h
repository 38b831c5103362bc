#pragma once
// Results of the sessions of one cell file over time: stability of the arm.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "calib/result/calibration.h"
#include "daemon/archive/drift_watch.h"
#include "daemon/controller/advice_publisher.h"
#include "daemon/journal/journal.h"

namespace cellcal::daemon::web {

/// Maximum number of sessions.
inline constexpr std::size_t kMostCompared = 30;

/// `calibration`: that of a session, none without a result. Only sessions of the cell file `cell` are
/// included, where it is empty those of the newest with a result. Oldest first. `checks`: control chart of
/// the newest published calibration; null: none. `controller`: advice acknowledged by the controller.
std::string drift_to_json(
    const std::vector<SessionRecord>& newest_first, std::string cell,
    const std::function<std::optional<calib::Calibration>(std::int64_t)>& calibration,
    const Drift* checks = nullptr, const AdviceStatus& controller = {});

}  // namespace cellcal::daemon::web
