// Text of each failure: what happened, where, and what to do next.

#include "daemon/session/failure.h"

#include <fmt/format.h>

#include <cctype>

#include "calib/model/units.h"
#include "daemon/session/interruption.h"
#include "daemon/session/rules.h"

namespace cellcal::daemon::rules {

namespace {

using calib::kMmPerM;

/// Joins two sentences: "no packet for 48 ms" and "check the cable".
std::string joined(std::string words, std::string more) {
  if (words.empty()) return more;
  if (more.empty()) return words;
  more.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(more.front())));
  return std::move(words) + ". " + more;
}

/// "touch 12 of 40 (S2): ", or empty outside of a touch.
std::string where(const State& state) {
  const bool touching = kMovingPhases.has(state.phase) || kStandingPhases.has(state.phase);
  // A touch on disk counts as done while the arm still retreats from it.
  const bool leaving = state.phase == Phase::kRetreat && state.done > 0;
  const std::size_t touch = leaving && !state.touch_failed ? state.done - 1 : state.done;
  const std::size_t row = state.one_by_one ? 0 : touch;
  if (!touching || !state.plan || row >= state.plan->touches.size()) return "";
  return fmt::format("touch {} of {}{} ({}): ", touch + 1, state.one_by_one ? "about " : "",
                     state.total(), state.plan->touches[row].target);
}

std::string target(const State& state) {
  return state.plan && state.current_index() < state.plan->touches.size()
             ? state.planned().target
             : std::string("the target");
}

std::string or_else(const std::string& words, const char* fallback) {
  return words.empty() ? fallback : words;
}

std::string link_words(const Links& links) {
  std::string words;
  if (links.robot == drivers::RobotLink::kNotReferenced) {
    words = "robot: " + or_else(links.robot_words, "not referenced");
  } else if (links.robot != drivers::RobotLink::kReady) {
    words = "robot: " + or_else(links.robot_words, "not ready");
  }
  if (links.contact != drivers::ContactLink::kReady) {
    words = joined(words, "contact sensor: " + or_else(links.contact_words, "not ready"));
  }
  return words;
}

std::string readings_words(const State& state, const Event& event) {
  std::string words;
  for (const Reading& reading : state.slow) {
    words += fmt::format("{:.3f}, ", reading.along_m * kMmPerM);
  }
  const double last = event.latch ? travel_m(state.planned(), event.latch->contact_rad) : 0.0;
  return words + fmt::format("{:.3f} mm", last * kMmPerM);
}

double seconds(std::chrono::milliseconds t) { return std::chrono::duration<double>(t).count(); }

/// The link that did not come up, and what the operator starts.
std::string not_ready_words(const State& state) {
  if (state.phase != Phase::kConnecting) return link_words(state.links);
  const Missing which = missing(state);
  std::string text;
  if (which.robot) {
    text = joined("robot: " + or_else(state.links.robot_words, "not ready"), state.how_to_start);
  }
  if (which.contact) {
    text = joined(text, "contact sensor: " + or_else(state.links.contact_words, "not ready"));
  }
  return joined(text, fmt::format("waited {:.0f} s ([session] connect_wait_s)",
                                  seconds(state.timeouts.connecting)));
}

/// Causes of missing packets or a stopped arm without a message of the controller, most likely first.
constexpr const char* kPacketStopCauses =
    "check in this order: emergency stop, enabling switch and start key (T1), over RSI in T1 more "
    "than 250 mm/s at the TCP or flange ([motion] hand_speed_mm_s, speed_percent), the program and its "
    "message on the pendant, the cable, the controller's power";
constexpr const char* kArmStopCauses =
    "check in this order: emergency stop, enabling switch (T1), drives, obstacles in the arm's "
    "way, the correction limits on the controller";

/// Evidence reported by the driver.
std::string silent_words(const State& state, const Event& event) {
  using drivers::Interruption;
  const bool at_rest = event.kind == EventKind::kLinks;
  const Interruption by = at_rest ? event.links.interruption : event.interruption;
  const std::string words = event.words.empty() ? state.links.robot_words : event.words;
  std::string text;
  switch (by) {
    case Interruption::kPacketsStopped:
      text = joined(or_else(words, "no more packets from the controller"), kPacketStopCauses);
      break;
    default:
      text = joined(or_else(words, "the robot controller stopped the session"), kPacketStopCauses);
      break;
  }
  if (state.retries > 0 && goes_on(FailureKind::kRobotSilent, by) == GoesOn::kRetries &&
      !may_go_on(state, FailureKind::kRobotSilent, by)) {
    text =
        joined(text, fmt::format("all {} automatic retries are used ([session] retries)",
                                 state.interruptions.total() - state.interruptions.of_computer()));
  }
  return text;
}

/// Evidence reported by the driver: of the move, or at rest of the sensor's link.
std::string busy_words(const State& state, const Event& event) {
  const bool of_a_move = kMoveResults.has(event.kind);
  const bool replies = interruption_by(state, event) == drivers::Interruption::kLateReplies;
  const std::string text =
      or_else(of_a_move ? event.words : state.links.contact_words,
              replies ? "this computer was busy: replies too late for the controller. Stop other "
                        "programs on this computer"
                      : "this computer was busy: an answer of the contact sensor came too late. "
                        "Stop other programs on this computer");
  const BusyRepeats& most = state.repeats;
  if (most.of_touch > 0 && repeats_of_touch(state) >= most.of_touch)
    return joined(text, fmt::format("all {} repeats of one touch are used ([session] "
                                    "busy_repeats_touch)",
                                    most.of_touch));
  if (most.of_session > 0 && state.interruptions.of_computer() >= most.of_session)
    return joined(text, fmt::format("all {} repeats of a session are used ([session] "
                                    "busy_repeats)",
                                    most.of_session));
  return text;
}

std::string no_contact_words(const State& state) {
  return fmt::format(
      "no contact up to {:.1f} mm beyond the expected surface of {} (cell file). Check centre_mm "
      "and diameter_mm in the cell file, and the contact circuit",
      (state.planned().search_m - state.planned().expected_m) * kMmPerM, target(state));
}

std::string too_early_words(const State& state, const Event& event) {
  const double met_m = event.latch ? travel_m(state.planned(), event.latch->contact_rad) : 0.0;
  return fmt::format(
      "contact {:.1f} mm before the expected surface of {} (cell file): the tip met something "
      "else, or centre_mm is wrong. Look at the tip, then correct centre_mm or remove the obstacle",
      (state.planned().expected_m - met_m) * kMmPerM, target(state));
}

std::string disagreement_words(const State& state, const Event& event) {
  if (state.missed && state.first)
    return fmt::format(
        "contact on {} after {:.3f} mm in the fast search, no contact in the slow search up to "
        "{:.1f} mm beyond it: noise, a short circuit or a loose sphere. Check the sensor's cable "
        "and the tip, and clamp the sphere",
        target(state), state.first->along_m * kMmPerM, state.policy.beyond_first_m * kMmPerM);
  return fmt::format(
      "{} readings on {} do not agree within {:.3f} mm ({}). Clean tip and sphere, and look "
      "for a loose sphere or a loose tool",
      state.slow.size() + 1, target(state), state.policy.tolerance_m * kMmPerM,
      readings_words(state, event));
}

std::string attended_words(const Links& links) {
  const std::string found =
      rules::by_hand(links.mode)
          ? fmt::format("operating mode {} at the controller", to_string(links.mode))
          : fmt::format("override {} % at the controller", links.override_percent.value_or(100));
  return found +
         ": unattended session stopped. Set mode AUT or EXT and override 100 % when the cell is "
         "clear";
}

std::string what(FailureKind kind, const State& state, const Event& event) {
  const std::string& words = event.words;
  switch (kind) {
    case FailureKind::kPlan:
      return or_else(words,
                     "no touch can be reached from the arm's position. Jog it away from obstacles");
    case FailureKind::kNotFound:
    case FailureKind::kDevice:
    case FailureKind::kIdentify:
    case FailureKind::kReport:
      return words;
    case FailureKind::kPlanChanged:
      return "the software was changed since the session began and makes another plan. Start a new "
             "session";
    case FailureKind::kLinkNotReady:
      return not_ready_words(state);
    case FailureKind::kContactFault:
      return or_else(event.links.contact_words, "the contact sensor reports a fault");
    case FailureKind::kContactClosed:
      return joined(
          "contact closed before the first move: the tip touches something, or the sense line is "
          "shorted or broken. Jog the arm free, or repair the wire",
          event.links.contact_words);
    case FailureKind::kArmRefused:
      return joined("the contact sensor refused to arm: " + or_else(words, "no answer"),
                    state.links.contact_words);
    case FailureKind::kNoContact:
      return no_contact_words(state);
    case FailureKind::kContactTooEarly:
      return too_early_words(state, event);
    case FailureKind::kUnexpectedContact:
      return joined(or_else(words, "contact outside of a search"), "jog the arm free");
    case FailureKind::kStillInContact:
      return joined(
          "contact did not open while the tip backed off. Clean the tip, and look for "
          "spatter and a short circuit",
          words);
    case FailureKind::kReadingsDisagree:
      return disagreement_words(state, event);
    case FailureKind::kTooManyRevoked:
      return joined(fmt::format("{} trips of the contact sensor on {} were noise. Check the "
                                "sensor's cable, earth and shield",
                                state.revoked + 1, target(state)),
                    state.links.contact_words);
    case FailureKind::kContactSilent:
      return joined(or_else(words, "no heartbeat from the contact sensor in time"),
                    state.links.contact_words);
    case FailureKind::kComputerBusy:
      return busy_words(state, event);
    case FailureKind::kRobotSilent:
      return silent_words(state, event);
    case FailureKind::kMoveRefused:
      return or_else(words, "the controller did not begin the move");
    case FailureKind::kNotFollowing:
      return joined(or_else(words, "the arm does not follow its set-points"),
                    state.links.request == drivers::ControllerRequest::kCollision
                        ? "collision detected by the controller: look at arm and tool"
                        : kArmStopCauses);
    case FailureKind::kStoppedElsewhere:
      return joined("the move was stopped by another source. Find it", words);
    case FailureKind::kTimeout:
      return joined(fmt::format("'{}' took longer than its time limit", to_string(state.phase)),
                    words);
    case FailureKind::kStopUnconfirmed:
      return joined(
          "stop was commanded, but the arm is not confirmed at rest. Press the emergency "
          "stop and look at the arm",
          link_words(state.links));
    case FailureKind::kJournal:
      return or_else(words, "the journal's disk does not answer. Check the disk");
    case FailureKind::kAttended:
      return attended_words(event.links);
    case FailureKind::kControllerTest:
      return fmt::format(
          "{} requested by the controller: unattended session ended before the next "
          "touch. Run the test",
          to_string(state.links.request));
    case FailureKind::kUnexpectedEvent:
      return joined(fmt::format("internal error: event '{}' in phase '{}'", to_string(event.kind),
                                to_string(state.phase)),
                    joined(words, "send the session's export ('cellcal export')"));
  }
  return words;
}

}  // namespace

std::string setback_words(Setback why, const State& state) {
  switch (why) {
    case Setback::kNotBack:
      return joined(fmt::format("not all links were back within {:.0f} s",
                                seconds(state.busy_until && state.links.robot_up()
                                            ? state.timeouts.busy
                                            : state.timeouts.recovering)),
                    link_words(state.links));
    case Setback::kOtherSession:
      return "the controller has begun another session: its program was stopped meanwhile";
    case Setback::kAgain:
      return joined(
          fmt::format("the links were not stable for {:.0f} s", seconds(state.timeouts.watching)),
          link_words(state.links));
    case Setback::kRobotToo:
      return joined("the controller's link or program stopped meanwhile", link_words(state.links));
    case Setback::kSensorSilent:
      return "the contact sensor itself sent nothing meanwhile, according to its time stamps";
    case Setback::kMoved:
      return "the arm is not where it was left: it may have been moved";
  }
  return "";
}

const char* next_step(FailureKind kind) {
  switch (kind) {
    case FailureKind::kPlan:
    case FailureKind::kNoContact:
    case FailureKind::kContactTooEarly:
      // a resumed session uses the stored cell file
      return ". Then: 'cellcal run --resume', or a new session if the cell file was changed";
    case FailureKind::kNotFound:  // a resumed session would search by the stored cell file again
      return ". Then start a new session";
    case FailureKind::kIdentify:         // the same touches give the same result
    case FailureKind::kPlanChanged:      // needs a new session, as its text states
    case FailureKind::kUnexpectedEvent:  // a defect
      return "";
    default:
      return ". Then: 'cellcal run --resume'";
  }
}

std::string failure_detail(FailureKind kind, const State& state, const Event& event) {
  return where(state) + what(kind, state, event);
}

}  // namespace cellcal::daemon::rules
