#include "daemon/service/journal_recorder.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "calib/model/enum_table.h"
#include "calib/model/kinematics.h"
#include "calib/model/units.h"
#include "daemon/files/log_context.h"
#include "daemon/service/touch_news.h"

namespace cellcal::daemon {

namespace {

LogEvent event_of(Ending ending) {
  using enum Ending;
  static constexpr EnumTable<Ending, LogEvent> kTable{{{kDone, LogEvent::kSessionDone},
                                                       {kAborted, LogEvent::kSessionAborted},
                                                       {kFailed, LogEvent::kSessionFailed}}};
  return kTable[ending];
}

}  // namespace

void JournalRecorder::record(const RecordTouch& recorded) {
  RecordTouch touch = recorded;
  if (arm_) touch.tip_m = nominal_tip(*arm_, touch.touch);
  journal_.record(session_, touch);
  const calib::Touch& made = touch.touch;
  const LogScope scope({.session = session_,
                        .touch = static_cast<std::int64_t>(touch.index) + 1,
                        .event = LogEvent::kTouch});
  spdlog::info("session {}: touch {} on {} recorded, {}", session_, touch.index + 1, made.target,
               made.readings > 1
                   ? fmt::format("confirmed by {} slow contacts within {:.4f} mm", made.readings,
                                 made.spread_m * calib::kMmPerM)
                   : fmt::format("one contact at {:.0f} mm/s", made.speed_m_s * calib::kMmPerM));
}

void JournalRecorder::record(const RecordEnd& end) {
  std::vector<Report> also;
  try {
    if (end_reports_) also = end_reports_(session_, end);
  } catch (const std::exception& error) {  // recording the end takes precedence
    spdlog::warn("session {}: its end is reported without an alarm: {}", session_, error.what());
  }
  journal_.record(session_, end, backend_.utc_now(), also);
  const LogScope scope({.session = session_, .event = event_of(end.ending)});
  if (end.ending == Ending::kFailed) {
    spdlog::error("session {} failed: {}", session_, end.failure);
  } else {
    spdlog::info("session {} {}", session_,
                 end.ending == Ending::kDone ? "is done" : "was aborted");
  }
}

void JournalRecorder::note(const std::string& utc, const std::string& words) {
  journal_.note(session_, utc, words);
  spdlog::debug("session {}: {}", session_, words);
}

}  // namespace cellcal::daemon
