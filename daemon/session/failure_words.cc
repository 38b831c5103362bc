// What each failure says: what happened, where, and what to do next.

#include <fmt/format.h>

#include "calib/model/units.h"
#include "daemon/session/interruption.h"
#include "daemon/session/rules.h"
#include "daemon/session/search_line.h"

namespace cellcal::daemon::rules {

namespace {

using calib::kMmPerM;

std::string joined(const std::string& words, const std::string& more) {
  if (words.empty()) return more;
  if (more.empty()) return words;
  return words + "; " + more;
}

/// "touch 12 of 40 (S2): ", or nothing outside of one.
std::string where(const State& state) {
  const bool touching = kMovingPhases.has(state.phase) || kStandingPhases.has(state.phase);
  // Once it is on disk a touch counts as done, while the arm still leaves it.
  const bool leaving = state.phase == Phase::kRetreat && state.done > 0;
  const std::size_t touch = leaving && !state.touch_failed ? state.done - 1 : state.done;
  const std::size_t row = state.one_by_one ? 0 : touch;
  if (!touching || !state.plan || row >= state.plan->touches.size()) return "";
  return fmt::format("touch {} of {}{} ({}): ", touch + 1, state.one_by_one ? "about " : "",
                     state.total(), state.plan->touches[row].target);
}

std::string target(const State& state) {
  return state.plan && state.in_hand() < state.plan->touches.size() ? state.planned().target
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

/// What was waited for and did not come, with what the operator starts.
std::string not_ready_words(const State& state) {
  if (state.phase != Phase::kConnecting) return link_words(state.links);
  const Missing which = missing(state);
  std::string text;
  if (which.robot) {
    text = "robot: " + or_else(state.links.robot_words, "not ready");
    text = joined(text, state.how_to_start);
  }
  if (which.contact) {
    text = joined(text, "contact sensor: " + or_else(state.links.contact_words, "not ready"));
  }
  return joined(text, fmt::format("waited {:.0f} s ([session] connect_wait_s)",
                                  seconds(state.timeouts.connecting)));
}

/// What stops packets, or an arm, without a word of the controller: most likely first.
constexpr const char* kWhatStopsPackets =
    "look, most likely first, at the emergency stop, the enabling switch and the start key (T1), "
    "the program and its message on the pendant, the cable, the controller's power";
constexpr const char* kWhatStopsAnArm =
    "look, most likely first, at the emergency stop, the enabling switch (T1), the drives, what "
    "may be in the arm's way, the limits of the correction";

constexpr const char* kResume = "then go on with 'cellcal run --resume'";

/// What the evidence says of a robot that fell silent; the driver's own words behind it.
std::string silent_words(const State& state, const Event& event) {
  using drivers::Interruption;
  const bool at_rest = event.kind == EventKind::kLinks;
  const Interruption by = at_rest ? event.links.interruption : event.interruption;
  const std::string words = event.words.empty() ? state.links.robot_words : event.words;
  std::string text;
  switch (by) {
    case Interruption::kLateReplies:
      text = joined("replies of this computer came too late for the controller", words);
      break;
    case Interruption::kPacketsStopped:
      text = joined(joined("packets from the robot controller stopped", words), kWhatStopsPackets);
      break;
    case Interruption::kOther:
    case Interruption::kNone:
      text = joined(joined("the robot controller does not go on", words), kWhatStopsPackets);
      break;
  }
  if (state.retries > 0 && state.interruptions >= state.retries &&
      is_harmless(FailureKind::kRobotSilent, by)) {
    text = joined(text, fmt::format("interruptions that it went on from by itself: {}, no more are "
                                    "allowed ([session] retries)",
                                    state.interruptions));
  }
  return joined(text, kResume);
}

std::string what(FailureKind kind, const State& state, const Event& event) {
  const std::string& words = event.words;
  switch (kind) {
    case FailureKind::kPlan:
      return or_else(words,
                     "no touch can be reached from where the arm stands; jog it away from what "
                     "is near and resume");
    case FailureKind::kDevice:
    case FailureKind::kIdentify:
    case FailureKind::kReport:
      return words;
    case FailureKind::kPlanChanged:
      return "the stored cell and options give another plan than the one that the session was "
             "begun with (the software has changed); start a new session";
    case FailureKind::kLinkNotReady:
      return joined(not_ready_words(state), kResume);
    case FailureKind::kContactFault:
      return joined("the contact sensor cannot be trusted",
                    joined(event.links.contact_words, "see 'cellcal status'"));
    case FailureKind::kContactClosed:
      return joined(
          "contact is closed before the first move: the tip touches something, or the "
          "sense line is shorted or broken; jog the arm free or mend the wire",
          event.links.contact_words);
    case FailureKind::kArmRefused:
      return joined(
          joined("the contact sensor would not be armed", words.empty() ? "no answer" : words),
          state.links.contact_words);
    case FailureKind::kNoContact:
      return fmt::format(
          "no contact by the end of travel on {}, {:.1f} mm behind the surface as "
          "the cell file states it; check centre and diameter in the cell file, "
          "and the contact circuit",
          target(state), (state.planned().search_m - state.planned().expected_m) * kMmPerM);
    case FailureKind::kContactTooEarly:
      return fmt::format(
          "contact {:.1f} mm before the surface of {} as the cell file states it: "
          "the tip met something else, or the centre in the cell file is wrong",
          (state.planned().expected_m -
           (event.latch ? travel_m(state.planned(), event.latch->contact_rad) : 0)) *
              kMmPerM,
          target(state));
    case FailureKind::kUnexpectedContact:
      return joined(or_else(words, "contact outside of a search"), "jog the arm free");
    case FailureKind::kStillInContact:
      return joined(
          "contact did not open on the way back: spatter at the tip, or a short; clean "
          "the tip",
          joined(words, kResume));
    case FailureKind::kReadingsDisagree:
      if (state.missed && state.first) {
        return fmt::format(
            "the fast search met something on {} after {:.3f} mm, and a slow one met nothing up to "
            "{:.1f} mm behind it: a short of the moment, noise, or a loose sphere; look at the "
            "sensor's cable and the tip",
            target(state), state.first->along_m * kMmPerM, state.policy.beyond_first_m * kMmPerM);
      }
      return fmt::format(
          "{} readings on {} do not agree within {:.3f} mm ({}); look for dirt, a "
          "loose sphere, a loose tool",
          state.slow.size() + 1, target(state), state.policy.tolerance_m * kMmPerM,
          readings_words(state, event));
    case FailureKind::kTooManyRevoked:
      return joined(fmt::format("{} trips of the contact sensor on {} were noise; check the "
                                "sensor's cable, earth and shield",
                                state.revoked + 1, target(state)),
                    state.links.contact_words);
    case FailureKind::kContactSilent:
      return joined("the contact sensor was not heard in time, the arm was stopped",
                    joined(joined(words, state.links.contact_words), kResume));
    case FailureKind::kRobotSilent:
      return silent_words(state, event);
    case FailureKind::kMoveRefused:
      return joined("the move was not begun", words);
    case FailureKind::kNotFollowing:
      return joined(joined("the arm does not follow", words), joined(kWhatStopsAnArm, kResume));
    case FailureKind::kStoppedElsewhere:
      return joined("the move was stopped, but not by this session", words);
    case FailureKind::kTimeout:
      return joined(fmt::format("'{}' took longer than plausible", to_string(state.phase)), words);
    case FailureKind::kStopUnconfirmed:
      return joined(
          "stop was commanded, but nothing says that the arm rests; use the emergency "
          "stop, and look at the arm",
          link_words(state.links));
    case FailureKind::kJournal:
      return or_else(
          words,
          "the disk that holds the journal does not answer; look at the disk, then go on "
          "with 'cellcal run --resume'");
    case FailureKind::kUnexpectedEvent:
      return joined(fmt::format("'{}' must not happen while '{}'", to_string(event.kind),
                                to_string(state.phase)),
                    joined(words, "please report this"));
  }
  return words;
}

}  // namespace

std::string setback_words(Setback why, const State& state) {
  switch (why) {
    case Setback::kNotBack:
      return joined(fmt::format("not all links were back within {:.0f} s",
                                seconds(state.timeouts.recovering)),
                    link_words(state.links));
    case Setback::kOtherSession:
      return "the controller has begun another session, so its program was stopped meanwhile";
    case Setback::kAgain:
      return joined(
          fmt::format("the links were not sound for {:.0f} s", seconds(state.timeouts.watching)),
          link_words(state.links));
    case Setback::kMoved:
      return "the arm is not where it was left: somebody may have moved it";
  }
  return "";
}

std::string failure_detail(FailureKind kind, const State& state, const Event& event) {
  return where(state) + what(kind, state, event);
}

}  // namespace cellcal::daemon::rules
