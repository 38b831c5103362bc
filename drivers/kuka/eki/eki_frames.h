#pragma once
// One frame of the controller, read or set, beside any session (eki_aside.h).
//
// Model: the controller's submit program takes the telegram, waits until the arm has stood for 0.3 s, sets
// TOOL_DATA[n] or BASE_DATA[n], reads it again, and repeats old and new values in every state. Where the
// connection is lost before that it does nothing any more. What the checks say (kAdvice) is for the cell's own
// programs and is taken while the arm moves, too. Where it is lost behind the telegram and before
// the answer, nobody here knows whether it was set: that is `kUnknown`, and never counts as done.

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

/// `ask`: 1..2^31-1, hard to guess.
class EkiFrameExchange : public EkiAside {
 public:
  EkiFrameExchange(EkiFrameRequest request, std::uint32_t ask, TimePoint connected);

  void on_bytes(std::string_view bytes, TimePoint now) override;
  void on_tick(TimePoint now) override;
  void on_closed() override;
  bool ended() const override { return result_.has_value(); }
  /// Behind a read, on the same connection: sets these values. `ask`: another one than before.
  void set(const EkiFrameValues& values, std::uint32_t ask, TimePoint now);
  /// From then on its outcome can be unknown.
  std::string take_output() override;
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

/// Over TCP, in this thread. With a `choice` the frame is read, and where the choice gives values they are set on
/// the same connection: nobody else is served in between. A connection that the controller takes and closes again,
/// or says nothing on, is tried again as `limits` has it while the choice was not asked. At most some ten seconds
/// behind that. Reaches nothing but this address. Throws DriverError where it is no IP address, and what the choice throws.
EkiFrameResult exchange_frame(const std::string& address, std::uint16_t port,
                              const EkiFrameRequest& request, const EkiFrameChoice& choice = {},
                              const EkiReconnectLimits& limits = {});

}  // namespace cellcal::drivers
