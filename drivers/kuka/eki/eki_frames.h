#pragma once
// Reads or sets one frame of the controller outside a session (eki_aside.h).
//
// Model: the controller's submit program receives the telegram, waits until the arm has been at rest for 0.3
// s, sets TOOL_DATA[n] or BASE_DATA[n], reads it back, and repeats old and new values in every state. If the
// connection is lost before that, nothing is set. The advice of the checks (kAdvice) is for the cell's own
// programs and is accepted during motion, too. If the connection is lost after the telegram and before the
// answer, the outcome is unknown: `kUnknown`, which never counts as done.

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "drivers/kuka/eki/eki_aside.h"
#include "drivers/kuka/wire/eki_frame_codec.h"
#include "drivers/kuka/wire/eki_framer.h"

namespace cellcal::drivers {

struct EkiFrameRequest {
  EkiFrameKind kind = EkiFrameKind::kTool;
  int number = 0;
  std::optional<EkiFrameValues> values;  ///< empty: read
};

enum class EkiFrameEnd {
  kRead,
  kSet,      ///< and the value read back is the value sent
  kDiffers,  ///< the controller reports success, but the value read back differs
  kRefused,  ///< by the controller; nothing was set
  kNotSent,  ///< no request was sent; nothing was set
  kUnknown,  ///< sent, without a reliable answer
};

/// Reason for kNotSent or kUnknown.
enum class EkiFrameTrouble {
  kNone,
  kNoConnection,  ///< refused or unreachable
  kNoState,       ///< connected, but no readable state, or states have ceased
  kTooOld,        ///< the controller's program does not support frames
  kInSession,     ///< the controller obeys a session
  kMoves,         ///< the arm is not at rest
  kClosed,        ///< connection closed or broken
  kNoAnswer,      ///< timeout
  kOtherFrame,    ///< the answer refers to another frame
  kNotAStream,    ///< no end of a document
  kNoTelegram,    ///< the values exceed the size of a telegram
};

struct EkiFrameResult {
  EkiFrameEnd end = EkiFrameEnd::kNotSent;
  EkiFrameTrouble trouble = EkiFrameTrouble::kNone;
  EkiFrameDone refusal = EkiFrameDone::kNotYet;          ///< kRefused
  std::optional<EkiFrameValues> old_values, new_values;  ///< kRead, kSet, kDiffers
  std::string peer;                                      ///< "172.31.1.147:54600"
  std::string detail;                                    ///< kNoConnection: system error message
};

/// Chooses the new value of a frame from the current one; empty: no change. An exception ends the connection,
/// without anything sent.
using EkiFrameChoice = std::function<std::optional<EkiFrameValues>(const EkiFrameValues& now)>;

/// Compares the values sent and read back: equal within the last decimal of the text and the resolution of a
/// 32-bit REAL.
bool same_frame(const EkiFrameValues& sent, const EkiFrameValues& read);

/// `ask`: 1..2^31-1, hard to guess.
class EkiFrameExchange : public EkiAside {
 public:
  EkiFrameExchange(EkiFrameRequest request, std::uint32_t ask, TimePoint connected);

  void on_bytes(std::string_view bytes, TimePoint now) override;
  void on_tick(TimePoint now) override;
  void on_closed() override;
  bool ended() const override { return result_.has_value(); }
  /// After a read, on the same connection: sets these values. `ask`: different from the preceding
  /// one.
  void set(const EkiFrameValues& values, std::uint32_t ask, TimePoint now);
  /// From this call on the outcome may be unknown.
  std::string drain_output() override;
  const std::optional<EkiFrameResult>& result() const { return result_; }

 private:
  void on_document(std::string_view document, TimePoint now);
  void look(TimePoint now);
  void judge(const EkiFrameAnswer& answer);
  void end(EkiFrameTrouble why);

  EkiFrameRequest request_;
  std::uint32_t ask_;
  EkiFramer framer_;
  EkiParser parser_;
  EkiState state_;
  EkiRest rest_;
  TimePoint begun_, heard_at_{}, sent_at_{};
  EkiFrameTrouble in_the_way_ = EkiFrameTrouble::kNoState;
  bool sent_ = false;
  std::string output_;
  std::optional<EkiFrameResult> result_;
};

/// Over TCP, in the calling thread. With a `choice` the frame is read, and any values chosen are set on the same
/// connection, so that no other client is served in between. A connection that the controller closes again, or on which
/// no state arrives, is retried according to `limits` unless the choice was called. Takes at most about ten more
/// seconds. Connects to this address only. Throws DriverError if it is not an IP address, and any exception of the
/// choice.
EkiFrameResult exchange_frame(const std::string& address, std::uint16_t port,
                              const EkiFrameRequest& request, const EkiFrameChoice& choice = {},
                              const EkiReconnectLimits& limits = {});

}  // namespace cellcal::drivers
