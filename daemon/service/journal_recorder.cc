#include "daemon/service/journal_recorder.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include "calib/model/enum_table.h"
#include "calib/model/kinematics.h"
#include "calib/model/units.h"
#include "daemon/files/log_context.h"

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
  const LogScope scope({.session = session_, .event = event_of(end.ending)});
  // The log may be the only record: the disk of the journal may be full.
  if (end.ending == Ending::kFailed) spdlog::error("session {} failed: {}", session_, end.failure);
  journal_.record(session_, end, backend_.utc_now(), also);
  if (end.ending != Ending::kFailed) {
    spdlog::info("session {} {}{}", session_,
                 end.ending == Ending::kDone ? "is done" : "was aborted",
                 end.failure.empty() ? "" : ": " + end.failure);
  }
}

void JournalRecorder::note(const std::string& utc, const std::string& words) {
  journal_.note(session_, utc, words);
  spdlog::debug("session {}: {}", session_, words);
}

std::optional<std::array<double, 3>> nominal_tip(const calib::ArmModel& arm,
                                                 const calib::Touch& touch) {
  if (touch.joint_rad.size() != static_cast<std::size_t>(arm.joint_count())) return std::nullopt;
  const Eigen::Vector3d tip = arm.nominal_tcp(touch.joint_rad).translation();
  return std::array{tip.x(), tip.y(), tip.z()};
}

TouchPublication::TouchPublication(std::int64_t session, const calib::Cell& cell, std::size_t known)
    : session_(session),
      arm_(std::make_shared<const calib::ArmModel>(cell.robot, cell.tool)),
      published_(known) {}

std::shared_ptr<const MadeTouch> TouchPublication::next(const State& state,
                                                        const std::vector<calib::Touch>& touches) {
  if (!arm_ || touches.size() <= published_) return nullptr;
  const std::size_t nth = published_ + 1;
  const bool newest = touches.size() == nth;
  if (newest && state.assessed < nth && !is_final(state.phase)) return nullptr;
  auto made = std::make_shared<MadeTouch>();
  made->session = session_;
  made->index = published_;
  made->touch = touches[published_];
  made->linear_unit = arm_->robot().first_turning() > 0;
  made->tip_m = nominal_tip(*arm_, made->touch);
  if (state.assessed == nth) made->residual_m = state.residual_m;
  if (state.progress.u95_m > 0.0) made->u95_m = state.progress.u95_m;
  published_ = nth;
  return made;
}

}  // namespace cellcal::daemon
