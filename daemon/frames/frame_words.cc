#include "daemon/frames/frame_words.h"

#include <fmt/format.h>

namespace cellcal::daemon {

namespace {

using drivers::EkiFrameDone;
using drivers::EkiFrameEnd;
using drivers::EkiFrameResult;
using drivers::EkiFrameTrouble;

constexpr const char* kObeysSomebody =
    "the controller obeys somebody. Wait for the end of the session";
constexpr const char* kDoesNotStand = "the arm does not stand. Let go of the keys, and try again";
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
      return kObeysSomebody;
    case EkiFrameDone::kMoves:
      return kDoesNotStand;
    case EkiFrameDone::kNoSuchNumber:
      return "the controller's program has no such number (TOOL_DATA 1 to 16, BASE_DATA 1 to 32)";
    case EkiFrameDone::kOtherProgram:
      return "another program runs on the controller. Stop it, and try again";
    case EkiFrameDone::kIncomplete:
      return "the controller got the telegram in part. Try again; where it comes again, install the files of "
             "'cellcal kuka-files' anew, the channel file too, then cold start";
    case EkiFrameDone::kNotYet:
    case EkiFrameDone::kDone:
      break;
  }
  return "the controller refuses";
}

std::string trouble_words(const EkiFrameResult& result) {
  switch (result.trouble) {
    case EkiFrameTrouble::kNoConnection:
      return no_connection_words(result.peer, result.detail);
    case EkiFrameTrouble::kNoState:
      return no_state_words(result.peer);
    case EkiFrameTrouble::kTooOld:
      return "the controller's files know no frames. Install those that 'cellcal kuka-files' writes with "
             "[eki] write_frames = true, then cold start";
    case EkiFrameTrouble::kInSession:
      return kObeysSomebody;
    case EkiFrameTrouble::kMoves:
      return kDoesNotStand;
    case EkiFrameTrouble::kClosed:
      return kClosedWords;
    case EkiFrameTrouble::kNoAnswer:
      return "no answer in time";
    case EkiFrameTrouble::kOtherFrame:
      return "the answer is about another frame";
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
  return "this daemon sets no frames. Set backend = \"eki\" and [eki] write_frames = true in cellcald.toml, "
         "install the files that 'cellcal kuka-files' then writes, and cold start the controller; or copy the "
         "lines of 'cellcal frames' by hand";
}

std::string no_position_words() {
  return "this controller does not say where the arm stands beside a session: only one that is driven over EKI "
         "(backend = \"eki\") does. Type the axis angles that the pendant shows";
}

std::string position_words(const drivers::EkiPosition& position) {
  using drivers::EkiPositionTrouble;
  switch (position.trouble) {
    case EkiPositionTrouble::kNoConnection:
      return no_connection_words(position.peer, position.detail);
    case EkiPositionTrouble::kNoState:
      return no_state_words(position.peer);
    case EkiPositionTrouble::kInSession:
      return kObeysSomebody;
    case EkiPositionTrouble::kMoves:
      return kDoesNotStand;
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
  return fmt::format("{}: nothing was set: {}", to_string(name), why_words(result));
}

std::string why_words(const EkiFrameResult& result) {
  return result.end == EkiFrameEnd::kRefused ? refusal_words(result.refusal)
                                             : trouble_words(result);
}

std::string unknown_words(const FrameRecord& record, const std::string& why) {
  return fmt::format(
      "{}: unknown whether it was set: {}. Read it at the pendant, or 'cellcal frames --restore "
      "{}' reads it and sets the old values. It was {}; sent was {}",
      to_string(record.name), why, record.id, krl_text(record.before), krl_text(record.sent));
}

std::string outcome_words(const FrameRecord& record, const EkiFrameResult& result) {
  switch (record.outcome) {
    case FrameOutcome::kSet:
      return fmt::format(
          "{} set to {}, read back as sent. It was {}. Select the programs again that use it; "
          "'cellcal frames --restore {}' sets the old values",
          to_string(record.name), krl_text(record.sent), krl_text(record.before), record.id);
    case FrameOutcome::kDiffers:
      return fmt::format(
          "{}: {} sent, {} read back. Compare it at the pendant before the arm moves. It was {}",
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
