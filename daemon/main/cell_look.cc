#include "daemon/main/cell_look.h"

#include "calib/files/calibration_json.h"
#include "calib/model/iso_time.h"
#include "daemon/archive/versions.h"

namespace cellcal::daemon {

namespace {

using plant::sparkplug::CellNow;

constexpr std::chrono::seconds kReadAgain{30};

std::int64_t whole(std::uint64_t count) { return static_cast<std::int64_t>(count); }

void put_status(const Status& status, CellNow& now) {
  now.software = calib::software_version();
  now.phase = to_string(status.phase);
  now.running = kActivePhases.has(status.phase) || status.phase == Phase::kStopping;
  if (status.session != 0) {
    auto& session = now.session.emplace(CellNow::Session{status.session,
                                                         status.kind,
                                                         static_cast<std::int64_t>(status.done),
                                                         static_cast<std::int64_t>(status.total),
                                                         {}});
    if (status.failure) session.failure = to_string(status.failure->kind);
  }
  if (!status.links) return;
  const drivers::RobotState& robot = status.links->robot;
  now.link = CellNow::Link{status.links->open, whole(robot.late), whole(robot.quality.gaps),
                           whole(status.links->contact.quality.crc_errors)};
}

CellNow::InUse in_use_of(const Version& version) {
  return {version.session, calib::seconds_of(version.ended), version.workspace, version.predicted_m,
          version.in_scope ? std::optional(version.in_scope->mean_u95_m) : std::nullopt};
}

CellNow::Check check_of(const calib::CheckMeasurement& seen) {
  const bool decided = seen.verdict != calib::CheckVerdict::kUndecided;
  const bool measured = decided && seen.left_out != calib::LeftOut::kIncomplete;
  return {seen.session, seen.time_s,
          decided ? std::optional(seen.verdict == calib::CheckVerdict::kHolds) : std::nullopt,
          measured ? std::optional(seen.shift_m.norm()) : std::nullopt};
}

}  // namespace

CellSnapshotReader::CellSnapshotReader(SessionService& service, Journal& journal)
    : service_(service), journal_(journal), drift_(journal) {}

void CellSnapshotReader::read_results() {
  CellNow read;
  if (const auto version = version_in_use(journal_)) read.calibration = in_use_of(*version);
  try {
    if (const auto drift = drift_.look()) {
      read.drift_state = to_string(drift->chart.state);
      read.drift_advice = to_string(drift->chart.advice);
      if (!drift->chart.points.empty()) read.check = check_of(drift->chart.points.back().check);
    }
  } catch (const NotUsable&) {  // then no calibration is published either
  }
  results_ = std::move(read);
}

CellNow CellSnapshotReader::now() {
  const Status status = service_.status();
  CellNow now;
  put_status(status, now);
  now.emulated = emulated_;
  const auto time = std::chrono::steady_clock::now();
  if (status.session != of_session_ || now.running != of_running_ || time - read_at_ > kReadAgain) {
    read_results();
    of_session_ = status.session;
    of_running_ = now.running;
    read_at_ = time;
  }
  now.calibration = results_.calibration;
  now.check = results_.check;
  now.drift_state = results_.drift_state;
  now.drift_advice = results_.drift_advice;
  return now;
}

}  // namespace cellcal::daemon
