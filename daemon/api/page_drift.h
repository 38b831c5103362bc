#pragma once
// What the sessions of one cell file found, one beside the other: does the arm stay as it is?

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "calib/result/calibration.h"
#include "daemon/archive/drift_watch.h"
#include "daemon/controller/advice_publisher.h"
#include "daemon/journal/journal.h"

namespace cellcal::daemon::web {

/// More of the newest are not looked at.
inline constexpr std::size_t kMostCompared = 30;

/// `calibration` gives that of a session, nothing where it has none. Sessions of another cell file
/// than `cell` are left out; an empty `cell` stands for that of the newest that has a result.
/// Oldest first. `checks`: the control chart of the newest published calibration; null: there is none. `controller`: the
/// advice that it has acknowledged.
std::string drift_to_json(
    const std::vector<SessionRecord>& newest_first, std::string cell,
    const std::function<std::optional<calib::Calibration>(std::int64_t)>& calibration,
    const Drift* checks = nullptr, const AdviceStatus& controller = {});

}  // namespace cellcal::daemon::web
