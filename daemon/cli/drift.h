#pragma once
// The checks of the newest calibration as a control chart, for a person at a terminal.

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "daemon/cli/client.h"

namespace cellcal::daemon {

/// Of a calibration's "update": "updated from session 12 of 2026-11-20, by 9 touches: S2 moved", or why it was not; a line. Empty
/// where it is none.
std::string update_line(const nlohmann::json& update);

/// Of "checks" of GET /v1/drift: sentences, a plot over time, the newest checks. Ends with a line break.
std::string drift_text(const nlohmann::json& checks);

/// Of its "controller": what CELLCAL_ADVICE is, or why it is not; empty where nothing is published.
std::string acknowledged_text(const nlohmann::json& controller);

/// 3 where the chart alarms.
int show_drift(const Connection& daemon);

}  // namespace cellcal::daemon
