#include "drivers/kuka/eki/eki_frames.h"

#include <cmath>
#include <utility>

namespace cellcal::drivers {
namespace {

using namespace std::chrono_literals;

// The controller obeys a disconnected session until it detects the disconnection.
constexpr Duration kSendLimit = 3s;
// States arrive every 12 to 100 ms.
constexpr Duration kStatesCease = 1s;
// 0.3 s of rest, a pass of the submit program and a state; ten times as long for a slow submit interpreter.
constexpr Duration kAnswerLimit = 4s;

}  // namespace

bool same_frame(const EkiFrameValues& sent, const EkiFrameValues& read) {
  constexpr double kReal = 1.0 / (1 << 23);  // last bit of a 32-bit REAL
  constexpr double kMm = 1e-4, kDeg = 1e-5;  // last decimals of the text
  for (std::size_t i = 0; i < sent.size(); ++i) {
    const double allowed = (i < 3 ? kMm : kDeg) + std::abs(sent[i]) * kReal;
    if (!(std::abs(sent[i] - read[i]) <= allowed)) return false;
  }
  return true;
}

EkiFrameExchange::EkiFrameExchange(EkiFrameRequest request, std::uint32_t ask, TimePoint connected)
    : request_(request), ask_(ask), begun_(connected) {}

void EkiFrameExchange::on_bytes(std::string_view bytes, TimePoint now) {
  for (const char c : bytes) {
    if (result_) return;
    switch (framer_.push(c)) {
      case EkiFramer::Event::kNone:
        break;
      case EkiFramer::Event::kDocument:
        on_document(framer_.document(), now);
        break;
      case EkiFramer::Event::kOversized:
        return end(EkiFrameTrouble::kNotAStream);
    }
  }
}

/// Every state repeats the answer: a damaged one is ignored.
void EkiFrameExchange::on_document(std::string_view document, TimePoint now) {
  if (parser_.parse_state(document, state_) != EkiError::kNone) return;
  heard_at_ = now;
  if (sent_) {
    std::optional<EkiFrameAnswer> answer;
    if (parse_frame_answer(document, answer) != EkiError::kNone) return;
    if (answer && answer->ask == ask_ && answer->done != EkiFrameDone::kNotYet) judge(*answer);
    return;
  }
  if (!knows_frames(document)) return end(EkiFrameTrouble::kTooOld);
  look(now);
}

/// Sends the request once the conditions are met.
void EkiFrameExchange::look(TimePoint now) {
  // Reports a moving arm before anything is sent; the controller checks it again.
  const bool stands = rest_.look(state_, now) || request_.kind == EkiFrameKind::kAdvice;
  if (state_.session != 0) {
    in_the_way_ = EkiFrameTrouble::kInSession;
  } else if (!stands) {
    in_the_way_ = EkiFrameTrouble::kMoves;
  } else {
    EkiFrameCommand command{ask_, request_.values.has_value(), request_.kind, request_.number, {}};
    if (request_.values) command.values = *request_.values;
    auto text = format_frame_command(command);
    if (!text) return end(EkiFrameTrouble::kNoTelegram);
    output_ = std::move(*text);
    sent_ = true;
    sent_at_ = now;
  }
}

void EkiFrameExchange::judge(const EkiFrameAnswer& answer) {
  const bool set = request_.values.has_value();
  const bool whole = answer.done != EkiFrameDone::kIncomplete;
  if (whole &&
      (answer.kind != request_.kind || answer.number != request_.number || answer.set != set))
    return end(EkiFrameTrouble::kOtherFrame);
  EkiFrameResult result;
  if (answer.done != EkiFrameDone::kDone) {
    result.end = EkiFrameEnd::kRefused;
    result.refusal = answer.done;
  } else {
    result.old_values = answer.old_values;
    result.new_values = answer.new_values;
    result.end = !set                                              ? EkiFrameEnd::kRead
                 : same_frame(*request_.values, answer.new_values) ? EkiFrameEnd::kSet
                                                                   : EkiFrameEnd::kDiffers;
  }
  result_ = std::move(result);
}

/// Losing the answer to a read has no consequences.
void EkiFrameExchange::end(EkiFrameTrouble why) {
  if (result_) return;
  result_.emplace();
  result_->end = sent_ && request_.values ? EkiFrameEnd::kUnknown : EkiFrameEnd::kNotSent;
  result_->trouble = why;
}

void EkiFrameExchange::on_tick(TimePoint now) {
  if (!sent_ && now - begun_ > kSendLimit)
    end(now - heard_at_ > kStatesCease ? EkiFrameTrouble::kNoState : in_the_way_);
  if (sent_ && now - sent_at_ > kAnswerLimit) end(EkiFrameTrouble::kNoAnswer);
}

void EkiFrameExchange::set(const EkiFrameValues& values, std::uint32_t ask, TimePoint now) {
  result_.reset();
  request_.values = values;
  ask_ = ask;
  begun_ = now;
  sent_ = false;
  in_the_way_ = EkiFrameTrouble::kNoState;
}

void EkiFrameExchange::on_closed() { end(EkiFrameTrouble::kClosed); }

std::string EkiFrameExchange::drain_output() { return std::exchange(output_, {}); }

}  // namespace cellcal::drivers
