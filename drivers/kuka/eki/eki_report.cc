#include "drivers/kuka/eki/eki_report.h"

#include <fmt/format.h>

#include "drivers/kuka/wire/stated_tcp.h"

namespace cellcal::drivers {
namespace {

OperatingMode mode_of(EkiMode mode) {
  switch (mode) {
    case EkiMode::kT1:
      return OperatingMode::kT1;
    case EkiMode::kT2:
      return OperatingMode::kT2;
    case EkiMode::kAut:
      return OperatingMode::kAut;
    case EkiMode::kExt:
      return OperatingMode::kExt;
    case EkiMode::kUnknown:
      break;
  }
  return OperatingMode::kUnknown;
}

ControllerRequest request_of(EkiRequest request) {
  switch (request) {
    case EkiRequest::kBrakeTest:
      return ControllerRequest::kBrakeTest;
    case EkiRequest::kMasteringTest:
      return ControllerRequest::kMasteringTest;
    case EkiRequest::kCollision:
      return ControllerRequest::kCollision;
    case EkiRequest::kNone:
      break;
  }
  return ControllerRequest::kNone;
}

/// Remedy for the operator; empty without a request.
const char* request_words(EkiRequest request) {
  switch (request) {
    case EkiRequest::kBrakeTest:
      return "brake test requested by the controller. Run it";
    case EkiRequest::kMasteringTest:
      return "mastering test requested by the controller. Run it";
    case EkiRequest::kCollision:
      return "collision detected by the controller. Look at arm and tool, then acknowledge it on the "
             "pendant";
    case EkiRequest::kNone:
      break;
  }
  return "";
}

std::string readiness(const EkiCoreState& s) {
  std::string words = fmt::format("the controller is not ready (mode {}, override {} %",
                                  to_string(mode_of(s.mode)), s.override_percent);
  if (s.fault != 0) words += fmt::format(", fault {}", s.fault);
  words += ")";
  if (!s.drives) words += ": drives off. Release emergency stops, switch the drives on";
  if (s.stopped) words += ": a stop message is active. Acknowledge it on the pendant";
  if (s.drives && !s.stopped)
    words += ": the program does not run. Select CELLCAL_EKI and start it";
  return words;
}

std::string trouble_words(const EkiCoreState& s, const std::string& peer) {
  switch (s.trouble) {
    case EkiTrouble::kNone:
      return {};
    case EkiTrouble::kNotConnected:
      return fmt::format(
          "no connection to the controller at TCP {}. Check that its submit program runs (it "
          "opens the port), address and port, the cable, the firewall (54600 to 54615 pass), "
          "and that no other client is connected (the controller accepts one)",
          peer);
    case EkiTrouble::kNoState:
      return fmt::format("connected to {}, but no state for {:.1f} s. Check that CELLCAL_SUB runs",
                         peer, s.waited_s);
    case EkiTrouble::kNotHeard:
      return "the controller sends states but has not accepted this computer's session yet. Check "
             "that channel file and program come from one run of 'cellcal kuka-files'";
    case EkiTrouble::kOtherSession:
      return fmt::format(
          "the controller obeys session {}, not this one ({}). Check whether another computer "
          "is connected",
          s.other_session, s.session);
    case EkiTrouble::kTooFewAxes:
      return fmt::format(
          "states with fewer than {} axes. Add Axis/@A1.. (and Ext/@E1..) to the channel file",
          s.wire_axes);
    case EkiTrouble::kCoarse:
      return "angles with fewer than 3 decimals: too coarse to calibrate";
    case EkiTrouble::kNotReady:
      return readiness(s);
    case EkiTrouble::kUnread:
      return "the controller reads no telegrams. Check that CELLCAL_SUB runs";
  }
  return "unknown trouble";
}

const char* loss_words(EkiLoss loss) {
  switch (loss) {
    case EkiLoss::kNone:
      return "";
    case EkiLoss::kSilence:
      return "no more states";
    case EkiLoss::kClosed:
      return "the connection was closed";
    case EkiLoss::kSessionTaken:
      return "the controller obeyed another session";
    case EkiLoss::kNotAStream:
      return "the received bytes are not EKI documents";
    case EkiLoss::kNotTaken:
      return "the controller did not confirm a command";
  }
  return "";
}

void add(std::string& words, const std::string& more) {
  if (more.empty()) return;
  if (!words.empty()) words += ". ";
  words += more;
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
  state.mode = mode_of(s.mode);
  if (s.link != RobotLink::kDown && s.connected) state.request = request_of(s.request);
  if (s.link != RobotLink::kDown) state.override_percent = s.override_percent;
  state.cycle_s = s.cycle_s;
  state.packets = s.states;
  state.quality.jitter_s = s.jitter_s;
  state.quality.longest_gap_s = s.longest_gap_s;
  state.quality.bad_packets = s.bad_documents;
  if (s.link == RobotLink::kLost) {
    add(state.words, fmt::format("link lost: {}. Find the cause on the pendant and in the network",
                                 loss_words(s.loss)));
  }
  if (s.link == RobotLink::kNotReferenced && s.rereference_pending &&
      s.trouble == EkiTrouble::kNone) {
    add(state.words, "referencing: waiting for the arm to come to rest");
  }
  if (s.unasked) add(state.words, words(*s.unasked));
  add(state.words, trouble_words(s, peer));
  add(state.words, request_words(s.connected ? s.request : EkiRequest::kNone));
  if (s.bad_documents > 0) {
    add(state.words, fmt::format("{} damaged states, last: {}, \"{}\"", s.bad_documents,
                                 to_string(s.last_error), s.last_bad));
  }
  if (s.unread_by_controller > 0) {
    add(state.words,
        fmt::format(
            "{} telegrams not readable for the controller. Check that channel file and program "
            "come from one run of 'cellcal kuka-files'",
            s.unread_by_controller));
  }
  return state;
}

}  // namespace cellcal::drivers
