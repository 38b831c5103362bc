#pragma once
// Control chart of the checks of the newest calibration, for terminals.

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "daemon/cli/client.h"

namespace cellcal::daemon {

/// From a calibration's "update", one line: "updated from session 12 of 2026-11-20, by 9 touches: S2 moved",
/// or why it was not; empty for other calibrations.
std::string update_line(const nlohmann::json& update);

/// From "checks" of GET /v1/drift: sentences, a plot over time, the newest checks. Ends with a line break.
std::string drift_text(const nlohmann::json& checks);

/// From its "controller": value of CELLCAL_ADVICE, or why it was not acknowledged; empty where nothing is
/// published.
std::string acknowledged_text(const nlohmann::json& controller);

/// 3 where the chart alarms.
int show_drift(const Connection& daemon);

}  // namespace cellcal::daemon
