#pragma once
// From a session that has ended, or a decision of the schedule, to what somebody is told.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "daemon/journal/journal.h"
#include "daemon/result/outcome.h"
#include "daemon/service/status.h"
#include "daemon/session/failure.h"
#include "daemon/unattended/decision.h"

namespace cellcal::daemon {

// What somebody is told who is not there. A value; message.h makes the sentences.

enum class News {
  kDone,       ///< a session ended as it should
  kWithheld,   ///< it ended, and its result must not be used
  kDrifted,    ///< it ended, and the cell is another than in the calibration before
  kUndecided,  ///< a check ended, and touches gave no contact point
  kRecovered,  ///< a check ended, and with it an alarm of the control chart
  kFailed,
  kAborted,
  kNotBegun  ///< a window of the schedule passed without its session
};
inline constexpr News kAllNews[] = {News::kDone,      News::kWithheld,  News::kDrifted,
                                    News::kUndecided, News::kRecovered, News::kFailed,
                                    News::kAborted,   News::kNotBegun};
/// Hyphenated; stands in what is posted.
const char* to_string(News news);

struct Notice {
  News news = News::kDone;
  std::int64_t session = 0;  ///< 0: of none
  std::string kind, cell, started, ended;
  std::size_t touches = 0;
  std::optional<Failure> failure;
  std::string outcome;                ///< to_string(OutcomeKind); empty: it has none
  std::vector<std::string> findings;  ///< of the verdict, in English
  std::optional<double> near_m,
      over_m;                     ///< predicted mean error near the targets, over the workspace
  bool by_chart = false;          ///< kDrifted or kRecovered, and only all checks together say so
  std::string entry, night, why;  ///< kNotBegun: of the schedule; why in English
};

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
