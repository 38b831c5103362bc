#include "daemon/unattended/service_session_gateway.h"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <utility>

#include "calib/model/enum_table.h"
#include "calib/model/iso_time.h"
#include "calib/model/linear.h"
#include "daemon/tasks/options.h"

namespace cellcal::daemon {

namespace {

using End = Standing::State;

/// Default without earlier sessions of the kind.
double guess_s(const std::string& kind) { return kind == "calibrate" ? 3600.0 : 600.0; }
/// Number of earlier sessions considered.
constexpr std::size_t kMostConsidered = 3;
/// Longer ones by the wall clock are steps of it, or pauses.
constexpr double kMostByWallClock_s = 86400.0;
/// Reserve for the variation between windows.
constexpr double kSpare = 1.25;

End state_of(const SessionRecord& record) {
  using enum RecordState;
  static constexpr EnumTable<RecordState, End> kTable{{{kRunning, End::kInterrupted},
                                                       {kInterrupted, End::kInterrupted},
                                                       {kAborted, End::kAborted},
                                                       {kFailed, End::kFailed},
                                                       {kDone, End::kDone},
                                                       {kDamaged, End::kInterrupted}}};
  return kTable[record.state];
}

End state_of(Phase phase) {
  switch (phase) {
    case Phase::kDone: return End::kDone;
    case Phase::kAborted: return End::kAborted;
    default: return End::kFailed;
  }
}

std::string end_of(std::int64_t session, std::size_t touches, const char* state,
                   const std::string& failure) {
  return fmt::format("{}/{}/{}/{}", session, touches, state, failure);
}

SessionKind kind_of(const SessionRecord& record) {
  const auto options = options_in(record.inputs);  // none: not usable
  return options ? options->kind : SessionKind::kCalibrate;
}

}  // namespace

const std::vector<SessionRecord>& ServiceSessionGateway::records(const Status& status) {
  const std::uint64_t newest = is_final(status.phase) ? status.seq : 0;
  if (read_at_ != newest) {
    records_ = journal_.sessions();
    std::erase_if(records_, [](const SessionRecord& one) { return one.origin.has_value(); });
    read_at_ = newest;
  }
  return records_;
}

Standing ServiceSessionGateway::standing() {
  const Status status = service_.status();
  Standing standing;
  standing.aborts = service_.aborts();
  standing.session = status.session;
  standing.busy = kActivePhases.has(status.phase) || status.phase == Phase::kStopping;
  if (standing.busy) return standing;
  std::size_t touches = status.done, planned = status.total;
  if (status.session > 0) {
    standing.state = state_of(status.phase);
    if (status.failure) standing.failure = *status.failure;
  } else if (const auto newest = journal_.newest_own()) {
    standing.session = newest->id;
    standing.state = state_of(*newest);
    standing.failure = failure_from_journal(newest->failure);
    touches = static_cast<std::size_t>(newest->touches);
    planned = static_cast<std::size_t>(newest->planned);
  } else {
    return standing;
  }
  standing.end = end_of(standing.session, touches, own_name(standing.state),
                        standing.state == End::kFailed ? describe(standing.failure) : "");
  if (planned > 0)
    standing.left_share =
        1.0 - static_cast<double>(std::min(touches, planned)) / static_cast<double>(planned);
  return standing;
}

std::int64_t ServiceSessionGateway::start(const RunRequest& request) {
  try {
    return service_.start(request);
  } catch (const BusyError& busy) {
    throw NotNow(busy.what());
  }
}

std::int64_t ServiceSessionGateway::begin(const ScheduledSession& session, const std::string& by,
                                          std::uint64_t aborts) {
  const auto kind = session_kind(session.kind);
  if (!kind) throw RequestError("unknown kind of session \"" + session.kind + "\"");
  RunRequest request;
  request.kind = *kind;
  request.cell = session.cell;
  request.fit_touches = session.touches;
  if (session.check) request.check_touches = *session.check;
  request.goal_mm = session.goal_mm;
  request.load = session.load;
  request.unattended = by;
  request.unless_aborted = aborts;
  return start(request);
}

std::int64_t ServiceSessionGateway::resume(const std::string& by, std::uint64_t aborts) {
  RunRequest request;
  request.resume = true;
  request.unattended = by;
  request.unless_aborted = aborts;
  return start(request);
}

void ServiceSessionGateway::stop() { service_.abort({FailureKind::kWindowOver}); }

/// By the session's own clock; by the wall clock where retention has dropped that.
std::optional<double> ServiceSessionGateway::duration_s(const SessionRecord& record) {
  const auto [known, is_new] = took_s_.try_emplace(record.id);
  if (!is_new) return known->second;
  try {
    const double phases_s = phase_times(journal_.changes(record.id)).total_s;
    if (phases_s > 0.0) return known->second = phases_s;
  } catch (const DamagedError&) {
    return {};
  }
  const auto began = calib::seconds_of(record.started), ended = calib::seconds_of(record.ended);
  if (began && ended && *ended > *began && *ended - *began < kMostByWallClock_s)
    known->second = *ended - *began;
  return known->second;
}

/// Median of the newest.
double ServiceSessionGateway::foreseen_s(const ScheduledSession& session) {
  std::vector<double> took_s;
  for (const SessionRecord& record : records(service_.status())) {
    if (record.state != RecordState::kDone || record.inputs.cell_name != session.cell.string())
      continue;
    if (session.kind != to_string(kind_of(record))) continue;
    const auto lasted_s = duration_s(record);
    if (!lasted_s || record.touches == 0) continue;
    double share = 1.0;
    if (session.touches && !session.goal_mm)
      share = static_cast<double>(*session.touches + session.check.value_or(10)) / record.touches;
    took_s.push_back(*lasted_s * share);
    if (took_s.size() == kMostConsidered) break;
  }
  if (took_s.empty()) return guess_s(session.kind);
  return kSpare * calib::median(std::move(took_s));
}

}  // namespace cellcal::daemon
