#pragma once
// Derives notices from the end of a session or a decision of the schedule.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "calib/model/enum_table.h"
#include "calib/words/phrase.h"
#include "daemon/config/unattended_config.h"
#include "daemon/journal/journal.h"
#include "daemon/result/outcome.h"
#include "daemon/service/status.h"
#include "daemon/session/failure.h"
#include "daemon/unattended/decision.h"

namespace cellcal::daemon {

// Notification to an absent operator. A value; the sentences are formatted below.

enum class News {
  kDone,       ///< a session ended successfully
  kWithheld,   ///< it ended, and its result must not be used
  kDrifted,    ///< it ended, and the cell has changed since the previous calibration
  kUndecided,  ///< a check ended, with touches that gave no contact point
  kRecovered,  ///< a check ended, and with it an alarm of the control chart
  kFailed,
  kAborted,
  kInterrupted,  ///< the daemon was killed, or the power failed, during a session
  kNotBegun      ///< a window of the schedule passed without its session
};
inline constexpr auto kAllNews = all_values<News>();
/// "not-begun", as in the posted JSON.
constexpr const char* to_string(News news) { return own_name<'-'>(news); }

struct Notice {
  News news = News::kDone;
  std::int64_t session = 0;  ///< 0: none
  std::string kind, cell, started, ended;
  bool update = false;  ///< of a calibration
  std::string
      anew;  ///< command of a new session of a kind that is not resumed; empty: it is resumed
  std::size_t touches = 0;
  std::optional<Failure> failure;
  std::string outcome;                                    ///< to_string(OutcomeKind); empty: none
  calib::DriftAdvice advice = calib::DriftAdvice::kNone;  ///< of a check, or of the control chart
  std::vector<calib::Phrase> findings;  ///< of the verdict; what is text already, in English
  std::optional<double> near_m,
      over_m;              ///< predicted mean error: near the targets, over the workspace
  bool by_chart = false;   ///< kDrifted or kRecovered by the control chart alone
  std::string entry, day;  ///< kNotBegun: of the schedule
  calib::Phrase why;       ///< kNotBegun
};

/// Notice kind of a completed session with this outcome.
News news_of(OutcomeKind outcome);
/// Notice for a session about to be recorded as ended, without information from other sessions, so that it is
/// available before the end is on disk. Reads the journal.
Notice notice_of_end(std::int64_t session, const RecordEnd& end, const std::string& utc,
                     Journal& journal);
/// `status`: final one of the session. Reads the journal.
Notice news_of(const Status& status, Journal& journal);
/// None where no notification is needed. Reads the journal.
std::optional<Notice> news_of(const Decision& decision, Journal& journal);

// A notice as text for operators, and as JSON for programs (format "cellcal.notice/1").

struct Message {
  std::string subject;  ///< one line
  std::string body;     ///< lines
  std::string json;     ///< with subject and body
};

/// `host`: name of this computer.
Message compose(const Notice& notice, const calib::Language& language, const std::string& host);

}  // namespace cellcal::daemon
