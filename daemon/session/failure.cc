// The sentence of each failure: what happened, where, and what to do next.

#include "daemon/session/failure.h"

#include <cmath>

#include "calib/model/units.h"
#include "daemon/session/interruption.h"
#include "daemon/session/rules.h"

namespace cellcal::daemon::rules {

namespace {

using calib::kMmPerM;
using calib::Phrase;

/// "no packet for 48 ms. Check the cable".
Phrase sentences(const Phrase& a, const Phrase& b) {
  return calib::joined("say.join.sentences", a, b);
}

/// "touch 12 of 40 (S2): ...", unchanged outside of a touch.
Phrase at_touch(const State& state, Phrase what) {
  const bool touching = kMovingPhases.has(state.phase) || kStandingPhases.has(state.phase);
  // A touch on disk counts as done while the arm still retreats from it.
  const bool leaving = state.phase == Phase::kRetreat && state.done > 0;
  const std::size_t touch = leaving && !state.touch_failed ? state.done - 1 : state.done;
  const std::size_t row = state.one_by_one ? 0 : touch;
  if (!touching || !state.plan || row >= state.plan->touches.size()) return what;
  return {state.one_by_one ? "say.failure.at_touch.about" : "say.failure.at_touch",
          {{"touch", touch + 1},
           {"total", state.total()},
           {"target", state.plan->touches[row].target},
           {"what", std::move(what)}}};
}

Phrase target(const State& state) {
  return state.plan && state.current_index() < state.plan->touches.size()
             ? Phrase(state.planned().target)
             : "say.failure.the_target";
}

Phrase or_else(const Phrase& words, const char* fallback) {
  return words.empty() ? fallback : words;
}

Phrase robot_words(const Links& links, const char* fallback = "say.failure.not_ready") {
  return {"say.failure.robot", {{"why", or_else(links.robot_words, fallback)}}};
}

Phrase sensor_words(const Links& links) {
  return {"say.failure.sensor", {{"why", or_else(links.contact_words, "say.failure.not_ready")}}};
}

Phrase link_words(const Links& links) {
  Phrase words;
  if (links.robot == drivers::RobotLink::kNotReferenced)
    words = robot_words(links, "say.failure.not_referenced");
  else if (links.robot != drivers::RobotLink::kReady)
    words = robot_words(links);
  if (links.contact == drivers::ContactLink::kReady) return words;
  return sentences(words, sensor_words(links));
}

Phrase readings_words(const State& state, const Event& event) {
  const auto one = [](double along_m) {
    return Phrase("say.failure.reading", {{"mm", along_m * kMmPerM}});
  };
  Phrase words;
  for (const Reading& reading : state.slow)
    words = calib::joined("say.join.numbers", words, one(reading.along_m));
  const double last =
      event.move().latch ? travel_m(state.planned(), event.move().latch->contact_rad) : 0.0;
  return calib::joined("say.join.numbers", words, one(last));
}

double seconds(std::chrono::milliseconds t) { return std::chrono::duration<double>(t).count(); }

/// The sensor was not proven, though both links are ready.
Phrase not_proven_words(const State& state) {
  if (state.links.in_contact) return "say.failure.still_in_contact";
  return {"say.failure.self_test", {{"s", seconds(state.timeouts.proving)}}};
}

/// The link that did not come up, and what the operator starts.
Phrase not_ready_words(const State& state) {
  if (state.phase == Phase::kProving && state.links.ready()) return not_proven_words(state);
  if (state.phase != Phase::kConnecting) return link_words(state.links);
  const Missing which = missing(state);
  Phrase text;
  if (which.robot) text = sentences(robot_words(state.links), state.how_to_start);
  if (which.contact) text = sentences(text, sensor_words(state.links));
  return sentences(text, {"say.failure.waited", {{"s", seconds(state.timeouts.connecting)}}});
}

/// Evidence reported by the driver; missing packets or a stopped arm without a message of the controller have
/// causes, most likely first.
Phrase silent_words(const State& state, const Event& event) {
  using drivers::Interruption;
  const bool at_rest = event.kind() == EventKind::kLinks;
  const Interruption by = at_rest ? state.links.interruption : event.move().interruption;
  const Phrase words = event.words.empty() ? state.links.robot_words : event.words;
  const Phrase text =
      sentences(or_else(words, by == Interruption::kPacketsStopped ? "say.failure.no_more_packets"
                                                                   : "say.failure.session_stopped"),
                "say.failure.check_packets");
  const bool used_up = state.retries > 0 &&
                       goes_on(FailureKind::kRobotSilent, by) == GoesOn::kRetries &&
                       !may_go_on(state, FailureKind::kRobotSilent, by);
  if (!used_up) return text;
  const int used = state.interruptions.total() - state.interruptions.of_computer();
  return sentences(text, {"say.failure.retries_used", {{"n", used}}});
}

/// Evidence reported by the driver: of the move, or at rest of the sensor's link.
Phrase busy_words(const State& state, const Event& event) {
  const bool of_a_move = kMoveResults.has(event.kind());
  const bool replies = interruption_by(state, event) == drivers::Interruption::kLateReplies;
  const Phrase text = or_else(of_a_move ? event.words : state.links.contact_words,
                              replies ? "say.failure.busy.replies" : "say.failure.busy.sensor");
  const BusyRepeats& most = state.repeats;
  if (most.of_touch > 0 && repeats_of_touch(state) >= most.of_touch)
    return sentences(text, {"say.failure.repeats_used.touch", {{"n", most.of_touch}}});
  if (most.of_session > 0 && state.interruptions.of_computer() >= most.of_session)
    return sentences(text, {"say.failure.repeats_used.session", {{"n", most.of_session}}});
  return text;
}

Phrase no_contact_words(const State& state) {
  return {"say.failure.no_contact",
          {{"mm", (state.planned().search_m - state.planned().expected_m) * kMmPerM},
           {"target", target(state)}}};
}

Phrase too_early_words(const State& state, const Event& event) {
  const double met_m =
      event.move().latch ? travel_m(state.planned(), event.move().latch->contact_rad) : 0.0;
  return {"say.failure.too_early",
          {{"mm", (state.planned().expected_m - met_m) * kMmPerM}, {"target", target(state)}}};
}

Phrase disagreement_words(const State& state, const Event& event) {
  if (state.missed && state.first)
    return {"say.failure.slow_missed",
            {{"target", target(state)},
             {"mm", state.first->along_m * kMmPerM},
             {"beyond", state.policy.beyond_first_m * kMmPerM}}};
  return {"say.failure.disagree",
          {{"n", state.slow.size() + 1},
           {"target", target(state)},
           {"mm", state.policy.tolerance_m * kMmPerM},
           {"readings", readings_words(state, event)}}};
}

Phrase refused_to_arm_words(const State& state, const Phrase& why) {
  const NextSearch search = next_search(state, armed_speed_m_s(state));
  if (search.takes_s() <= kLongestSearchS)
    return sentences(
        {"say.failure.refused_to_arm", {{"why", or_else(why, "say.failure.no_answer")}}},
        state.links.contact_words);
  constexpr double kFull = 100.0;
  const bool by_override = search.full_speed_s <= kLongestSearchS;
  return {by_override ? "say.failure.search_too_slow.override" : "say.failure.search_too_slow",
          {{"s", search.takes_s()},
           {"mm", search.length_m * kMmPerM},
           {"percent", search.pace * kFull},
           {"least", std::ceil(kFull * search.full_speed_s / kLongestSearchS)},
           {"limit", kLongestArmingS}}};
}

Phrase attended_words(const Links& links) {
  if (by_hand(links.mode)) return {"say.failure.attended.mode", {{"mode", to_string(links.mode)}}};
  return {"say.failure.attended.override", {{"percent", links.override_percent.value_or(100)}}};
}

Phrase unexpected_words(const State& state, const Event& event) {
  return sentences({"say.failure.unexpected",
                    {{"event", std::string("say.happened.") + to_string(event.kind())},
                     {"phase", std::string("say.phase.") + to_string(state.phase)}}},
                   sentences(event.words, "say.failure.export"));
}

Phrase what(FailureKind kind, const State& state, const Event& event) {
  const Phrase& words = event.words;
  const Links& links = state.links;
  switch (kind) {
    case FailureKind::kPlan: return or_else(words, "say.failure.unreachable");
    case FailureKind::kNotFound:
    case FailureKind::kDevice:
    case FailureKind::kIdentify:
    case FailureKind::kReport: return words;
    case FailureKind::kPlanChanged: return "say.failure.plan_changed";
    case FailureKind::kLinkNotReady: return not_ready_words(state);
    case FailureKind::kContactFault:
      return or_else(state.links.contact_words, "say.failure.sensor_fault");
    case FailureKind::kContactClosed:
      return sentences("say.failure.contact_closed", state.links.contact_words);
    case FailureKind::kArmRefused: return refused_to_arm_words(state, words);
    case FailureKind::kNoContact: return no_contact_words(state);
    case FailureKind::kContactTooEarly: return too_early_words(state, event);
    case FailureKind::kUnexpectedContact:
      return sentences(or_else(words, "say.failure.contact_outside_search"),
                       "say.failure.jog_free");
    case FailureKind::kStillInContact: return sentences("say.failure.still_in_contact", words);
    case FailureKind::kReadingsDisagree: return disagreement_words(state, event);
    case FailureKind::kTooManyRevoked:
      return sentences({"say.failure.noise", {{"n", state.revoked + 1}, {"target", target(state)}}},
                       links.contact_words);
    case FailureKind::kContactSilent:
      return or_else(sentences(words, links.contact_words), "say.failure.no_heartbeat");
    case FailureKind::kComputerBusy: return busy_words(state, event);
    case FailureKind::kRobotSilent: return silent_words(state, event);
    case FailureKind::kMoveRefused: return or_else(words, "say.failure.not_begun");
    case FailureKind::kNotFollowing:
      return sentences(or_else(words, "say.failure.not_following"),
                       links.request == drivers::ControllerRequest::kCollision
                           ? "say.failure.collision"
                           : "say.failure.check_arm");
    case FailureKind::kStoppedElsewhere: return sentences("say.failure.stopped_elsewhere", words);
    case FailureKind::kTimeout:
      return sentences(
          {"say.failure.timeout", {{"phase", std::string("say.phase.") + to_string(state.phase)}}},
          words);
    case FailureKind::kStopUnconfirmed:
      return sentences("say.failure.stop_unconfirmed", link_words(links));
    case FailureKind::kJournal: return or_else(words, "say.failure.disk");
    case FailureKind::kAttended: return attended_words(state.links);
    case FailureKind::kControllerTest:
      return links.request == drivers::ControllerRequest::kMasteringTest
                 ? "say.failure.mastering_test"
                 : "say.failure.brake_test";
    case FailureKind::kWindowOver: return "say.schedule.why.window-over";
    case FailureKind::kDaemonStopped: return "say.failure.daemon_stopped";
    case FailureKind::kUnexpectedEvent: return unexpected_words(state, event);
  }
  return words;
}

Phrase setback_words(Setback why, const State& state) {
  switch (why) {
    case Setback::kNotBack:
      return sentences({"say.setback.not_back",
                        {{"s", seconds(state.busy_until && state.links.robot_up()
                                           ? state.timeouts.busy
                                           : state.timeouts.recovering)}}},
                       link_words(state.links));
    case Setback::kOtherSession: return "say.setback.other_session";
    case Setback::kAgain:
      return sentences({"say.setback.again", {{"s", seconds(state.timeouts.watching)}}},
                       link_words(state.links));
    case Setback::kRobotToo: return sentences("say.setback.robot_too", link_words(state.links));
    case Setback::kSensorSilent: return "say.setback.sensor_silent";
    case Setback::kMoved: return "say.setback.moved";
  }
  return {};
}

const char* next_step(FailureKind kind) {
  switch (kind) {
    case FailureKind::kPlan:
    case FailureKind::kNoContact:
    case FailureKind::kContactTooEarly:
      return "say.failure.then.or_anew";  // a resumed session uses the stored cell file
    case FailureKind::kNotFound:  // a resumed session would search by the stored cell file again
      return "say.failure.then.anew";
    case FailureKind::kIdentify:         // the same touches give the same result
    case FailureKind::kPlanChanged:      // needs a new session, as its text states
    case FailureKind::kUnexpectedEvent:  // a defect
      return nullptr;
    default: return "say.failure.then";
  }
}

Phrase with_next_step(FailureKind kind, const State& state, Phrase what) {
  const char* const then = next_step(kind);
  if (then == nullptr) return what;
  if (state.anew.empty()) return {then, {{"what", std::move(what)}}};
  return {"say.failure.then.command", {{"what", std::move(what)}, {"command", state.anew}}};
}

}  // namespace

Phrase failure_detail(FailureKind kind, const State& state, const Event& event) {
  return at_touch(state, what(kind, state, event));
}

Phrase failure_words(FailureKind kind, const State& state, const Event& event) {
  return with_next_step(kind, state, failure_detail(kind, state, event));
}

Phrase not_resumed_words(const Failure& failure, Setback why, const State& state) {
  return with_next_step(
      failure.kind, state,
      {"say.failure.not_resumed", {{"what", failure.detail}, {"why", setback_words(why, state)}}});
}

}  // namespace cellcal::daemon::rules
