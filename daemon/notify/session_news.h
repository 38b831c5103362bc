#pragma once
// From a session that has ended, or a decision of the schedule, to what somebody is told.

#include <optional>

#include "calib/result/calibration.h"
#include "daemon/journal/journal.h"
#include "daemon/notify/notice.h"
#include "daemon/schedule/decision.h"
#include "daemon/service/status.h"

namespace cellcal::daemon {

/// Of a session that came to its end with this verdict.
News news_of(const calib::Verdict& verdict);
/// Reads the journal. `status`: its final one.
Notice news_of(const Status& status, Journal& journal);
/// Nothing where nobody has to know.
std::optional<Notice> news_of(const Decision& decision);

}  // namespace cellcal::daemon
