#include "drivers/kuka/eki/eki_report.h"

#include "drivers/kuka/wire/wire_axes.h"

namespace cellcal::drivers {
namespace {

/// Remedy for the operator; empty without a request.
Sentence request_words(ControllerRequest request) {
  switch (request) {
    case ControllerRequest::kBrakeTest: return "say.eki.request.brake_test";
    case ControllerRequest::kMasteringTest: return "say.eki.request.mastering_test";
    case ControllerRequest::kCollision: return "say.eki.request.collision";
    case ControllerRequest::kNone: break;
  }
  return {};
}

void add(Sentence& all, Sentence more) { all = sentences(std::move(all), std::move(more)); }

Sentence readiness(const EkiCoreState& s) {
  Sentence all{s.fault != 0 ? "say.eki.not_ready.fault" : "say.eki.not_ready",
               {{"mode", to_string(s.mode)}, {"percent", s.override_percent}, {"fault", s.fault}}};
  if (!s.drives) add(all, "say.eki.not_ready.drives");
  if (s.stopped) add(all, "say.eki.not_ready.stopped");
  if (s.drives && !s.stopped) add(all, "say.eki.not_ready.program");
  return all;
}

Sentence trouble_words(const EkiCoreState& s, const std::string& peer) {
  switch (s.trouble) {
    case EkiTrouble::kNone: return {};
    case EkiTrouble::kNotConnected: return {"say.eki.not_connected", {{"at", peer}}};
    case EkiTrouble::kNoState: return {"say.eki.no_state", {{"at", peer}, {"s", s.waited_s}}};
    case EkiTrouble::kNotHeard: return "say.eki.not_heard";
    case EkiTrouble::kOtherSession:
      return {"say.eki.other_session", {{"other", s.other_session}, {"session", s.session}}};
    case EkiTrouble::kTooFewAxes: return {"say.eki.too_few_axes", {{"axes", s.wire_axes}}};
    case EkiTrouble::kCoarse: return "say.eki.coarse";
    case EkiTrouble::kNotReady: return readiness(s);
    case EkiTrouble::kUnread: return "say.eki.unread";
  }
  return {};
}

Sentence loss_words(EkiLoss loss) {
  switch (loss) {
    case EkiLoss::kNone: return {};
    case EkiLoss::kSilence: return "say.eki.lost.silence";
    case EkiLoss::kClosed: return "say.eki.lost.closed";
    case EkiLoss::kSessionTaken: return "say.eki.lost.session_taken";
    case EkiLoss::kNotAStream: return "say.eki.lost.not_a_stream";
    case EkiLoss::kNotTaken: return "say.eki.lost.not_taken";
  }
  return {};
}

}  // namespace

RobotState to_robot_state(const EkiCoreState& s, const std::string& peer) {
  RobotState state;
  state.link = s.link;
  state.linear_unit = s.linear_unit;
  state.actual_rad.assign(s.actual_rad, s.actual_rad + s.axes);
  state.commanded_rad.assign(s.commanded_rad, s.commanded_rad + s.axes);
  if (s.states_tcp) state.stated_tcp = to_stated_tcp(s.tcp);
  state.moving = s.moving;
  if (s.link == RobotLink::kLost) state.interruption = Interruption::kOther;
  state.session = s.session;
  state.needs_operator = s.link == RobotLink::kNotReferenced && !s.ready;
  state.mode = s.mode;
  if (s.link != RobotLink::kDown && s.connected) state.request = s.request;
  if (s.link != RobotLink::kDown) state.override_percent = s.override_percent;
  state.override_slows = true;
  state.cycle_s = s.cycle_s;
  state.packets = s.states;
  state.quality.jitter_s = s.jitter_s;
  state.quality.longest_gap_s = s.longest_gap_s;
  state.quality.bad_packets = s.bad_documents;
  if (s.link == RobotLink::kLost) add(state.words, {"say.eki.lost", {{"why", loss_words(s.loss)}}});
  if (s.link == RobotLink::kNotReferenced && s.rereference_pending &&
      s.trouble == EkiTrouble::kNone)
    add(state.words, "say.robot.referencing");
  if (s.unasked) add(state.words, words(*s.unasked));
  add(state.words, trouble_words(s, peer));
  add(state.words, request_words(s.connected ? s.request : ControllerRequest::kNone));
  if (s.bad_documents > 0)
    add(state.words, {"say.eki.damaged",
                      {{"states", s.bad_documents},
                       {"error", to_string(s.last_error)},
                       {"bytes", std::string(s.last_bad)}}});
  if (s.unread_by_controller > 0)
    add(state.words, {"say.eki.unreadable", {{"telegrams", s.unread_by_controller}}});
  return state;
}

}  // namespace cellcal::drivers
