#pragma once
// The daemon's figures in the text format of Prometheus, version 0.0.4.

#include <string>
#include <vector>

#include "calib/result/calibration.h"
#include "calib/result/drift_chart.h"
#include "daemon/plant/line/line_status.h"
#include "daemon/service/service.h"

namespace cellcal::daemon {

/// Of the state and its links, of all sessions, of the newest result and of its checks (null: there is none). What is not known is
/// left out.
std::string metrics_text(const Status& status, const std::vector<SessionRecord>& sessions,
                         const calib::Calibration* newest,
                         const calib::DriftChart* drift = nullptr);

/// Of the line to the plant, where one is named.
std::string metrics_text(const plant::LineStatus& line, const OutboxCount& outbox);

}  // namespace cellcal::daemon
