#pragma once
// From a session that has ended, or a decision of the schedule, to what somebody is told.

#include <optional>

#include "daemon/journal/journal.h"
#include "daemon/notify/notice.h"
#include "daemon/result/outcome.h"
#include "daemon/schedule/decision.h"
#include "daemon/service/status.h"

namespace cellcal::daemon {

/// Of a session that came to its end with this outcome.
News news_of(OutcomeKind outcome);
/// Of a session that is about to be recorded as ended so, without what other sessions say of it: known before its end is
/// on disk. Reads the journal.
Notice news_of_end(std::int64_t session, const RecordEnd& end, const std::string& utc,
                   Journal& journal);
/// Reads the journal. `status`: its final one.
Notice news_of(const Status& status, Journal& journal);
/// Nothing where nobody has to know.
std::optional<Notice> news_of(const Decision& decision);

}  // namespace cellcal::daemon
