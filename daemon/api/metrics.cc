#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "calib/files/calibration_json.h"
#include "calib/model/units.h"
#include "daemon/api/handlers.h"
#include "daemon/result/outcome.h"
#include "daemon/tasks/active_calibration.h"

namespace cellcal::daemon {

namespace {

/// Cumulative counts up to each bound, as defined by Prometheus.
void put_histogram(Exposition& out, const char* name, const char* help,
                   const drivers::TimeHistogram& times) {
  out.family(name, "histogram", help);
  double count = 0.0;
  for (std::size_t i = 0; i < times.counts.size(); ++i) {
    count += static_cast<double>(times.counts[i]);
    const bool last = i == times.kBounds_s.size();
    out.sample(count, {{"le", last ? "+Inf" : Exposition::number(times.kBounds_s[i])}}, "_bucket");
  }
  out.sample(times.sum_s, {}, "_sum");
  out.sample(count, {}, "_count");
}

void put_state(Exposition& out, const Status& status) {
  out.family("cellcal_build_info", "gauge", "Version of cellcald.");
  out.sample(1.0, {{"version", calib::software_version()}});
  out.family("cellcal_phase", "gauge", "1 for the phase that the session is in.");
  for (const Phase phase : kAllPhases)
    out.sample(phase == status.phase ? 1.0 : 0.0, {{"phase", to_string(phase)}});
  const bool running = kActivePhases.has(status.phase) || status.phase == Phase::kStopping;
  out.gauge("cellcal_session_running", "1 while a session is under way.", running);
  out.gauge("cellcal_session_number", "The newest session of this daemon, 0 for none.",
            status.session);
  out.gauge("cellcal_session_touches",
            "Touches recorded in that session; of a dry run, stand-offs reached.",
            static_cast<double>(status.done));
  out.gauge("cellcal_session_touches_planned", "Touches that it will have.", status.total);
  out.gauge("cellcal_session_interruptions", "Harmless interruptions after which it resumed.",
            status.interruptions.total());
  out.gauge("cellcal_session_busy_repeats",
            "Of these: touches repeated because this computer was late.",
            status.interruptions.of_computer());
  out.family("cellcal_session_interruptions_by_cause", "gauge", "The same, by their cause.");
  for (std::size_t i = 0; i < kCountedCauses.size(); ++i)
    out.sample(status.interruptions.of[i], {{"cause", kCountedCauses[i].name}});
  out.gauge("cellcal_session_residual_meters", "Residual of its newest touch, or of its fit.",
            status.residual_m);
  out.gauge("cellcal_session_u95_meters", "u95 predicted from its touches so far.", status.u95_m);
  out.gauge("cellcal_session_goal_meters", "Requested u95.", status.goal_m);
  out.gauge("cellcal_session_left_seconds", "Time left for its touches.", status.time_left_s);
  out.family("cellcal_session_failure", "gauge", "1 with the kind of failure that ended it.");
  if (status.failure) out.sample(1.0, {{"kind", to_string(status.failure->kind)}});
}

void put_robot(Exposition& out, const drivers::RobotState& robot) {
  const drivers::RobotQuality& q = robot.quality;
  out.gauge("cellcal_robot_cycle_seconds", "Learnt cycle of the controller.", robot.cycle_s);
  out.gauge("cellcal_robot_jitter_seconds", "1 sigma of it.", q.jitter_s);
  out.gauge("cellcal_robot_longest_gap_seconds", "Longest time between two packets.",
            q.longest_gap_s);
  out.counter("cellcal_robot_packets_total", "Packets taken.", robot.packets);
  out.counter("cellcal_robot_missing_packets_total", "Missing by the controller's count.", q.gaps);
  out.counter("cellcal_robot_bad_packets_total", "Damaged packets.", q.bad_packets);
  out.counter("cellcal_robot_late_replies_total", "Late replies as the controller counts them.",
              robot.late);
  out.counter("cellcal_robot_stops_by_input_total",
              "Stops by the controller's contact input, before the sensor's bytes.",
              robot.stops_by_input);
  put_histogram(out, "cellcal_robot_reply_seconds", "From a packet to its reply.", q.reply_times);
  out.gauge("cellcal_robot_reply_worst_seconds", "The longest since the link was opened.",
            q.reply_max_s);
}

void put_contact(Exposition& out, const drivers::ContactStatus& contact) {
  const drivers::ContactQuality& q = contact.quality;
  if (contact.in_contact)
    out.gauge("cellcal_contact_closed", "1 while the tool touches.", *contact.in_contact);
  if (contact.loop_ok)
    out.gauge("cellcal_contact_loop_ok", "1 while the wires are whole.", *contact.loop_ok);
  out.counter("cellcal_contact_frames_total", "Frames taken.", q.frames);
  out.counter("cellcal_contact_crc_errors_total", "Damaged frames.", q.crc_errors);
  out.counter("cellcal_contact_missing_frames_total", "Frames missing by the sensor's count.",
              q.gaps);
  out.counter("cellcal_contact_bounces_total", "Bounces of contacts.", q.bounces);
  put_histogram(out, "cellcal_contact_late_seconds", "How late this computer delivered heartbeats.",
                q.late_times);
  out.gauge("cellcal_contact_late_worst_seconds", "The latest since the port was opened.",
            q.late_worst_s);
  if (q.round_trip) {
    out.family("cellcal_contact_round_trip_seconds", "summary", "Request to answer over the line.");
    out.sample(q.round_trip->min_s, {{"quantile", "0"}});
    out.sample(q.round_trip->p50_s, {{"quantile", "0.5"}});
    out.sample(q.round_trip->p99_s, {{"quantile", "0.99"}});
  }
  if (q.clock_sigma_s)
    out.gauge("cellcal_contact_clock_sigma_seconds", "1 sigma of the map of its clock.",
              *q.clock_sigma_s);
}

void put_sessions(Exposition& out, const std::vector<SessionRecord>& sessions) {
  std::map<std::string, int> by_state;
  for (const RecordState state : kRecordStates) by_state[to_string(state)] = 0;
  double touches = 0.0;
  for (const SessionRecord& session : sessions) {
    ++by_state[to_string(session.state)];
    touches += static_cast<double>(session.touches);
  }
  out.family("cellcal_sessions", "gauge", "Sessions in the journal, by how they ended.");
  for (const auto& [state, count] : by_state) out.sample(count, {{"state", state}});
  out.counter("cellcal_touches_total", "Touches in the journal.", touches);
}

/// Outcome of the newest completed session; all 0 without a recorded outcome.
void put_outcome(Exposition& out, const std::vector<SessionRecord>& newest_first) {
  const auto newest = std::ranges::find(newest_first, RecordState::kDone, &SessionRecord::state);
  const auto outcome = newest == newest_first.end() ? std::nullopt : newest->outcome;
  out.family("cellcal_session_outcome", "gauge",
             "1 for the outcome of the newest session that is done.");
  for (const OutcomeKind kind : kOutcomeKinds)
    out.sample(outcome && outcome->kind == kind ? 1.0 : 0.0, {{"outcome", to_string(kind)}});
}

void put_result(Exposition& out, const calib::Calibration& newest) {
  out.gauge("cellcal_calibration_published", "1 where the newest result was published.",
            newest.verdict.publish());
  if (newest.check.count > 0)
    out.gauge("cellcal_calibration_check_meters", "Mean residual of its check touches.",
              newest.check.mean_m);
}

void put_in_use(Exposition& out, const calib::Calibration& used) {
  out.family("cellcal_calibration_error_meters", "gauge",
             "Predicted mean position error of the calibration in use.");
  out.sample(used.predicted_near_targets_m, {{"over", "targets"}});
  out.sample(used.predicted_workspace_m, {{"over", "workspace"}});
  if (used.nominal_workspace_u_m > 0.0) {
    out.family("cellcal_nominal_error_meters", "gauge",
               "Mean position error of this arm with its nominal model.");
    out.sample(used.nominal_near_targets_m, {{"over", "targets"}});
    out.sample(used.nominal_workspace_m, {{"over", "workspace"}});
    out.family("cellcal_nominal_error_u_meters", "gauge",
               "Expanded uncertainty (k = 2) of cellcal_nominal_error_meters.");
    out.sample(used.nominal_near_targets_u_m, {{"over", "targets"}});
    out.sample(used.nominal_workspace_u_m, {{"over", "workspace"}});
  }
  out.family("cellcal_joint_zero_degrees", "gauge",
             "To be added to the angle that the controller shows, by the calibration in use.");
  const auto zeros = [&](double calib::ZeroOffset::*figure) {
    for (const calib::ZeroOffset& one : zero_offsets(used))
      out.sample(one.*figure * calib::kDegPerRad, {{"joint", one.joint}});
  };
  zeros(&calib::ZeroOffset::offset_rad);
  out.family("cellcal_joint_zero_sigma_degrees", "gauge", "1 sigma of it.");
  zeros(&calib::ZeroOffset::sigma_rad);
}

void put_drift(Exposition& out, const calib::DriftChart& chart) {
  using calib::DriftState;
  out.family("cellcal_drift_state", "gauge", "1 for the state of the control chart over checks.");
  for (const DriftState state : {DriftState::kTooFew, DriftState::kInControl, DriftState::kWarns,
                                 DriftState::kAlarms, DriftState::kUnknown})
    out.sample(state == chart.state ? 1.0 : 0.0, {{"state", to_string(state)}});
  out.gauge("cellcal_drift_checks", "Checks in it.", chart.counted);
  out.gauge("cellcal_drift_undecided_checks", "Checks since the newest decided one.",
            chart.undecided);
  if (chart.counted == 0) return;  // no check passed: there is no centre
  for (auto point = chart.points.rbegin(); point != chart.points.rend(); ++point) {
    if (point->check.left_out != calib::LeftOut::kNo) continue;
    out.gauge("cellcal_drift_limit_ratio",
              "Statistic of the newest check divided by its alarm limit.", point->share);
    out.gauge("cellcal_drift_tcp_meters", "TCP of the newest off the centre of all.",
              point->off_m.norm());
    return;
  }
}

/// Newest result that this version can read, without updates that found nothing changed: the one before holds.
std::optional<calib::Calibration> newest_result(Journal& journal,
                                                const std::vector<SessionRecord>& newest_first) {
  for (const SessionRecord& session : newest_first) {
    if (session.state != RecordState::kDone || !session.has_calibration) continue;
    if (session.outcome && session.outcome->kind == OutcomeKind::kNothingChanged) continue;
    try {
      const auto record = journal.session(session.id);
      if (record && !record->calibration.empty())
        return calib::calibration_from_json(record->calibration, "the journal");
    } catch (const std::runtime_error& unreadable) {
      spdlog::debug("metrics without session {}: {}", session.id, unreadable.what());
    }
  }
  return std::nullopt;
}

}  // namespace

std::string metrics_text(const Status& status, const std::vector<SessionRecord>& sessions,
                         const calib::Calibration* newest, const calib::Calibration* in_use,
                         const calib::DriftChart* drift) {
  Exposition out;
  put_state(out, status);
  out.family("cellcal_arm_motion", "gauge", "1 for what the controller's newest packet shows.");
  for (const ArmMotion one : {ArmMotion::kMoving, ArmMotion::kAtRest, ArmMotion::kUnknown})
    out.sample(one == status.arm.motion ? 1.0 : 0.0, {{"motion", to_string(one)}});
  out.gauge("cellcal_robot_packet_age_seconds", "Age of that packet.", status.arm.packet_age_s);
  out.gauge("cellcal_links_open", "1 while a session holds its devices.",
            status.links && status.links->open);
  if (status.links) {
    put_robot(out, status.links->robot);
    put_contact(out, status.links->contact);
  }
  put_sessions(out, sessions);
  put_outcome(out, sessions);
  if (newest != nullptr) put_result(out, *newest);
  if (in_use != nullptr) put_in_use(out, *in_use);
  if (drift != nullptr) put_drift(out, *drift);
  return std::move(out).text();
}

std::string metrics_text(const plant::LineStatus& line, const OutboxCount& outbox) {
  Exposition out;
  out.gauge("cellcal_plant_connected", "1 while the plant's broker is there.", line.connected);
  out.gauge("cellcal_plant_waiting", "Facts that the broker has not acknowledged.", outbox.rows);
  out.gauge("cellcal_plant_waiting_bytes", "What they take in the journal.", outbox.bytes);
  out.counter("cellcal_plant_acknowledged_total", "Facts that it has.", line.acknowledged);
  out.counter("cellcal_plant_dropped_total", "Telemetry for which there was no room.",
              outbox.dropped + outbox.not_begun);
  return std::move(out).text();
}

Answer metrics(Api& api, const Call&) {
  std::vector<SessionRecord> sessions = api.journal.sessions();
  // Imported ones may be of another arm.
  std::erase_if(sessions, [](const SessionRecord& one) { return one.origin.has_value(); });
  const auto newest = newest_result(api.journal, sessions);
  const auto used = in_use(api.journal, "");
  std::shared_ptr<const Drift> drift;
  try {
    drift = api.drift_watch.evaluate();
  } catch (const NotUsable& damaged) {
    spdlog::debug("metrics without drift: {}", damaged.what());
  }
  std::string text =
      metrics_text(api.service.status(), sessions, newest ? &*newest : nullptr,
                   used && used->calibration ? &used->calibration->calibration : nullptr,
                   drift ? &drift->chart : nullptr);
  if (const auto line = api.plant_line ? api.plant_line() : std::nullopt)
    text += metrics_text(line->facts, api.journal.outbox());
  return Response{200, "text/plain; version=0.0.4; charset=utf-8", std::move(text)};
}

}  // namespace cellcal::daemon
