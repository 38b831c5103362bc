#include "daemon/controller/frame_words.h"

#include <fmt/format.h>

namespace cellcal::daemon {

namespace {

using drivers::EkiFrameDone;
using drivers::EkiFrameEnd;
using drivers::EkiFrameResult;
using drivers::EkiFrameTrouble;

constexpr const char* kInSessionWords = "a session is running on the controller. Wait for its end";
constexpr const char* kMovesWords = "the arm is moving. Release the jog keys, and try again";
constexpr const char* kClosedWords =
    "the controller closed the connection; or another client still has it: try again in 15 s";
constexpr const char* kNotAStreamWords =
    "the answer is longer than 8192 bytes: this is not cellcal's program";

std::string no_connection_words(const std::string& peer, const std::string& detail) {
  return fmt::format(
      "no connection to {} ({}). Check the network, and that the controller's submit "
      "interpreter runs CELLCAL_SUB; or another client still has it: try again in 15 s",
      peer, detail);
}

std::string no_state_words(const std::string& peer) {
  return fmt::format(
      "no state from {}. Check that the submit interpreter runs CELLCAL_SUB; or another client still "
      "has it: try again in 15 s",
      peer);
}

std::string refusal_words(EkiFrameDone refusal) {
  switch (refusal) {
    case EkiFrameDone::kInSession:
      return kInSessionWords;
    case EkiFrameDone::kMoves:
      return kMovesWords;
    case EkiFrameDone::kNoSuchNumber:
      return "number not in the controller's program (TOOL_DATA 1 to 16, BASE_DATA 1 to 32)";
    case EkiFrameDone::kOtherProgram:
      return "another program runs on the controller. Stop it, and try again";
    case EkiFrameDone::kIncomplete:
      return "incomplete telegram at the controller. Try again; if it repeats, reinstall the files "
             "of 'cellcal kuka-files', the channel file too, then cold start";
    case EkiFrameDone::kNotYet:
    case EkiFrameDone::kDone:
      break;
  }
  return "refused by the controller, no reason given. See the message on the pendant";
}

std::string trouble_words(const EkiFrameResult& result) {
  switch (result.trouble) {
    case EkiFrameTrouble::kNoConnection:
      return no_connection_words(result.peer, result.detail);
    case EkiFrameTrouble::kNoState:
      return no_state_words(result.peer);
    case EkiFrameTrouble::kTooOld:
      return "controller files without frame support. Install those that 'cellcal kuka-files' "
             "writes with [eki] write_frames = true, then cold start";
    case EkiFrameTrouble::kInSession:
      return kInSessionWords;
    case EkiFrameTrouble::kMoves:
      return kMovesWords;
    case EkiFrameTrouble::kClosed:
      return kClosedWords;
    case EkiFrameTrouble::kNoAnswer:
      return "no answer in time";
    case EkiFrameTrouble::kOtherFrame:
      return "the answer is for another frame";
    case EkiFrameTrouble::kNotAStream:
      return kNotAStreamWords;
    case EkiFrameTrouble::kNoTelegram:
      return "the values do not fit into a telegram";
    case EkiFrameTrouble::kNone:
      break;
  }
  return result.detail;
}

}  // namespace

std::string not_configured_words() {
  return "setting frames is off. Set backend = \"eki\" and [eki] write_frames = true in "
         "cellcald.toml, install the files that 'cellcal kuka-files' then writes, and cold start "
         "the controller; or copy the lines of 'cellcal frames' by hand";
}

std::string no_position_words() {
  return "the arm's position is available over EKI only (backend = \"eki\"), outside a session. "
         "Type the axis angles that the pendant shows";
}

std::string position_words(const drivers::EkiPosition& position) {
  using drivers::EkiPositionTrouble;
  switch (position.trouble) {
    case EkiPositionTrouble::kNoConnection:
      return no_connection_words(position.peer, position.detail);
    case EkiPositionTrouble::kNoState:
      return no_state_words(position.peer);
    case EkiPositionTrouble::kInSession:
      return kInSessionWords;
    case EkiPositionTrouble::kMoves:
      return kMovesWords;
    case EkiPositionTrouble::kClosed:
      return kClosedWords;
    case EkiPositionTrouble::kNotAStream:
      return kNotAStreamWords;
    case EkiPositionTrouble::kNone:
      break;
  }
  return {};
}

std::string not_sent_words(const FrameName& name, const EkiFrameResult& result) {
  return fmt::format("{}: not set: {}", to_string(name), why_words(result));
}

std::string why_words(const EkiFrameResult& result) {
  return result.end == EkiFrameEnd::kRefused ? refusal_words(result.refusal)
                                             : trouble_words(result);
}

std::string unknown_words(const FrameRecord& record, const std::string& why) {
  return fmt::format(
      "{}: result unknown: {}. Read it on the pendant, or 'cellcal frames --restore {}' reads it "
      "and sets the old values. Old: {}; sent: {}",
      to_string(record.name), why, record.id, krl_text(record.before), krl_text(record.sent));
}

std::string outcome_words(const FrameRecord& record, const EkiFrameResult& result) {
  switch (record.outcome) {
    case FrameOutcome::kSet:
      return fmt::format(
          "{} set to {}, read back as sent. It was {}. Select the programs that use it again; "
          "'cellcal frames --restore {}' sets the old values",
          to_string(record.name), krl_text(record.sent), krl_text(record.before), record.id);
    case FrameOutcome::kDiffers:
      return fmt::format(
          "{}: {} sent, {} read back. Compare it on the pendant before the arm moves. It was {}",
          to_string(record.name), krl_text(record.sent),
          krl_text(record.read_back.value_or(drivers::EkiFrameValues{})), krl_text(record.before));
    case FrameOutcome::kRefused:
    case FrameOutcome::kNotSent:
      return not_sent_words(record.name, result);
    case FrameOutcome::kUnknown:
      break;
  }
  return unknown_words(record, trouble_words(result));
}

}  // namespace cellcal::daemon
