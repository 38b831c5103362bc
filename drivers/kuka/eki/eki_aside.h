#pragma once
// Requests to the controller outside a session, over a separate connection without a hello: the controller
// obeys no client, and nothing moves. The channel takes one client: no such connection is possible during a
// session, and no session can begin during such a connection.

#include <cstdint>
#include <functional>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>

#include "drivers/kuka/wire/eki_codec.h"
#include "drivers/time.h"

namespace cellcal::drivers {

struct EkiReconnectLimits {
  /// Retry period of a new client: the controller reopens its port shortly after a client has disconnected, and may
  /// accept and close a connection once until then; it detects a disconnected cable after 10 s.
  Duration reopens_within = std::chrono::seconds(12);
  std::stop_token stop = {};
};

// Reads or sets one frame of the controller outside a session (eki_aside.h).
//
// Model: the controller's submit program receives the telegram, waits until the arm has been at rest for 0.3
// s, sets TOOL_DATA[n] or BASE_DATA[n], reads it back, and repeats old and new values in every state. If the
// connection is lost before that, nothing is set. The advice of the checks (kAdvice) is for the cell's own
// programs and is accepted during motion, too. If the connection is lost after the telegram and before the
// answer, the outcome is unknown: `kUnknown`, which never counts as done.

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
  AxisAngles axes_deg;                                   ///< measured, at rest; without a request
  std::string peer;                                      ///< "172.31.1.147:54600"
  std::string detail;                                    ///< kNoConnection: system error message
};

/// Chooses the new value of a frame from the current one; empty: no change. An exception ends the connection,
/// without anything sent.
using EkiFrameChoice = std::function<std::optional<EkiFrameValues>(const EkiFrameValues& now)>;

/// Compares the values sent and read back: equal within the last decimal of the text and the resolution of a
/// 32-bit REAL.
bool same_frame(const EkiFrameValues& sent, const EkiFrameValues& read);

/// Sans I/O: bytes in, bytes out.
class EkiFrameExchange {
 public:
  /// `ask`: 1..2^31-1, hard to guess.
  EkiFrameExchange(EkiFrameRequest request, std::uint32_t ask, TimePoint connected)
      : request_(request), ask_(ask), begun_(connected) {}
  /// Sends nothing, and reads the position.
  explicit EkiFrameExchange(TimePoint connected) : begun_(connected) {}

  void on_bytes(std::string_view bytes, TimePoint now);
  void on_tick(TimePoint now);
  void on_closed() { end(EkiFrameTrouble::kClosed); }
  bool ended() const { return result_.has_value(); }
  /// After a read, on the same connection: sets these values. `ask`: different from the preceding
  /// one.
  void set(const EkiFrameValues& values, std::uint32_t ask, TimePoint now);
  /// Output to be sent completely, once. From this call on the outcome may be unknown.
  std::string drain_output();
  const std::optional<EkiFrameResult>& result() const { return result_; }

 private:
  void on_document(std::string_view document, TimePoint now);
  /// Rest of the arm: within 0.01 deg for 0.3 s, the controller's own criterion.
  bool stands(TimePoint now);
  void update(TimePoint now);
  void judge(const EkiFrameAnswer& answer);
  void end(EkiFrameTrouble why);

  std::optional<EkiFrameRequest> request_;
  std::uint32_t ask_ = 0;
  EkiFramer framer_;
  EkiParser parser_;
  EkiState state_;
  AxisAngles rest_deg_;
  TimePoint begun_, heard_at_{}, sent_at_{}, rest_since_{};
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

// Position of the arm, as sent by the controller's submit program to every EKI client: for teaching by the
// pendant, in T1, with any robot program selected. Nothing is sent, no session is started, nothing moves.

enum class EkiPositionTrouble {
  kNone,
  kNoConnection,
  kNoState,    ///< connected, but no readable state
  kInSession,  ///< the controller obeys a session
  kMoves,      ///< the arm is not at rest
  kClosed,
  kNotAStream,
};

struct EkiPosition {
  EkiPositionTrouble trouble = EkiPositionTrouble::kNone;
  AxisAngles axes_deg;  ///< measured, A1 to A6 and external axes; kNone
  std::string peer;     ///< "172.31.1.147:54600"
  std::string detail;   ///< kNoConnection: the system's error message
};

/// Of an exchange without a request.
EkiPosition position_of(const EkiFrameResult& result);

/// Over TCP, in the calling thread; retried according to `limits` if the controller accepts no client. Throws
/// DriverError if `address` is not an IP address.
EkiPosition read_position(const std::string& address, std::uint16_t port,
                          const EkiReconnectLimits& limits = {});

}  // namespace cellcal::drivers
