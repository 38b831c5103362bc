#pragma once
// One frame of the controller, read or set, over a connection of its own. The channel takes one client: while
// a session holds it there is no such connection, and while this one stands no session can begin. It says no
// hello, so nobody is obeyed and nothing moves.
//
// Model: the controller's submit program takes the telegram, waits until the arm has stood for 0.3 s, sets
// TOOL_DATA[n] or BASE_DATA[n], reads it again, and repeats old and new values in every state. Where the
// connection is lost before that it does nothing any more. Where it is lost behind the telegram and before
// the answer, nobody here knows whether it was set: that is `kUnknown`, and never counts as done.

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "drivers/kuka/wire/eki_frame_codec.h"
#include "drivers/time.h"

namespace cellcal::drivers {

struct EkiFrameRequest {
  EkiFrameKind kind = EkiFrameKind::kTool;
  int number = 0;
  std::optional<EkiFrameValues> values;  ///< none: read
};

enum class EkiFrameEnd {
  kRead,
  kSet,      ///< and read back as it was sent
  kDiffers,  ///< the controller says that it was set, and reads something else back
  kRefused,  ///< by the controller; nothing was set
  kNotSent,  ///< nothing was asked of it; likewise
  kUnknown,  ///< sent, and no answer that could be believed
};

/// Why kNotSent, or why kUnknown.
enum class EkiFrameTrouble {
  kNone,
  kNoConnection,  ///< not to be had
  kNoState,       ///< connected, and no state that could be read, or none any more
  kTooOld,        ///< the controller's program knows no frames
  kInSession,     ///< it obeys somebody
  kMoves,         ///< the arm does not stand
  kClosed,        ///< connection closed or broken
  kNoAnswer,      ///< in time
  kOtherFrame,    ///< the answer is about another frame than was asked
  kNotAStream,    ///< no end of a document
  kNoTelegram,    ///< the values do not fit into one
};

struct EkiFrameResult {
  EkiFrameEnd end = EkiFrameEnd::kNotSent;
  EkiFrameTrouble trouble = EkiFrameTrouble::kNone;
  EkiFrameDone refusal = EkiFrameDone::kNotYet;          ///< kRefused
  std::optional<EkiFrameValues> old_values, new_values;  ///< kRead, kSet, kDiffers
  std::string peer;                                      ///< "172.31.1.147:54600"
  std::string detail;                                    ///< kNoConnection: the system's words
};

/// What a frame is to be, from what it is now; none: as it is. What it throws ends the connection, and nothing was
/// sent then.
using EkiFrameChoice = std::function<std::optional<EkiFrameValues>(const EkiFrameValues& now)>;

/// What was sent, and what came back: equal within the last decimal of the text, and what a 32-bit REAL holds.
bool same_frame(const EkiFrameValues& sent, const EkiFrameValues& read);

/// Sans I/O: bytes in, bytes out. `ask`: 1..2^31-1, hard to guess.
class EkiFrameExchange {
 public:
  EkiFrameExchange(EkiFrameRequest request, std::uint32_t ask, TimePoint connected);

  void on_bytes(std::string_view bytes, TimePoint now);
  void on_tick(TimePoint now);
  void on_closed();
  /// Behind a read, on the same connection: sets these values. `ask`: another one than before.
  void set(const EkiFrameValues& values, std::uint32_t ask, TimePoint now);
  /// To be sent, all of it, once. From then on its outcome can be unknown.
  std::string take_output();
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
  AxisAngles rest_deg_;
  TimePoint begun_, heard_at_{}, rest_since_{}, sent_at_{};
  EkiFrameTrouble in_the_way_ = EkiFrameTrouble::kNoState;
  bool sent_ = false;
  std::string output_;
  std::optional<EkiFrameResult> result_;
};

/// Over TCP, in this thread. With a `choice` the frame is read, and where the choice gives values they are set on
/// the same connection: nobody else is served in between. A connection that the controller takes and closes again,
/// or says nothing on, is tried again for 12 s while the choice was not asked. At most some twenty seconds. Reaches
/// nothing but this address. Throws DriverError where it is no IP address, and what the choice throws.
EkiFrameResult exchange_frame(const std::string& address, std::uint16_t port,
                              const EkiFrameRequest& request, const EkiFrameChoice& choice = {});

}  // namespace cellcal::drivers
