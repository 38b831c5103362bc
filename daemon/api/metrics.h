#pragma once
// Metrics of the daemon in the Prometheus text format, version 0.0.4.

#include <string>
#include <vector>

#include "calib/result/calibration.h"
#include "calib/result/drift_chart.h"
#include "daemon/plant/line/line_status.h"
#include "daemon/service/service.h"

namespace cellcal::daemon {

/// Metrics of the state and its links, of all sessions, of the newest result, of the calibration in use and of its
/// checks (null: none). Unknown values are omitted.
std::string metrics_text(const Status& status, const std::vector<SessionRecord>& sessions,
                         const calib::Calibration* newest,
                         const calib::Calibration* in_use = nullptr,
                         const calib::DriftChart* drift = nullptr);

/// Metrics of the connection to the plant, where one is configured.
std::string metrics_text(const plant::LineStatus& line, const OutboxCount& outbox);

}  // namespace cellcal::daemon
