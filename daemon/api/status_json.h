#pragma once
// Status of a session as JSON, without line breaks.

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "daemon/service/status.h"

namespace cellcal::daemon {

/// A recorded touch, for lists.
nlohmann::json touch_json(std::size_t index, const calib::Touch& touch);
/// Keyed by cause.
nlohmann::json to_json(const InterruptionCounts& counts);
std::string status_to_json(const Status& status);
/// {"session","index","target","set","joints_deg","tip_mm","residual_mm","u95_mm"}
std::string made_touch_to_json(const MadeTouch& made);
/// {"session","joints_deg"}
std::string joints_to_json(std::int64_t session, const drivers::AxisAngles& joints_rad);

}  // namespace cellcal::daemon
