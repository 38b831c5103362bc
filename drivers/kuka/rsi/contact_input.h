#pragma once
// The second stop path: the digital input that the sensor's opto output is wired to, as each packet
// has it. Off is contact: a touch, a wire that is cut, a board without supply or one that hangs.
//
// Off stops the arm, always. On is believed to be 'free' only of an input that has followed a touch
// and its opening lately: that it went off beside the sensor's own stamp, and on again. Until then,
// and once it has missed a touch, the sensor's bytes alone say that nothing is touched.

#include <cstdint>
#include <optional>

#include "drivers/robot.h"
#include "drivers/time.h"

namespace cellcal::drivers {

/// From the sensor's stamp of a contact to a packet that has it: optocoupler, the controller's filter,
/// its cycle, and packets that this computer took late.
inline constexpr std::chrono::milliseconds kInputFollows{60};
/// A touch that the input followed proves it for so long.
inline constexpr std::chrono::minutes kInputProofLasts{5};
/// While it follows, so long may the sensor's words be missing or late: half a second, and one of the
/// idle heartbeats. The record of positions holds it and the longest rest behind it (2 s at 4 ms).
inline constexpr std::chrono::milliseconds kInputWatchLimit{600};

class ContactInput {
 public:
  explicit ContactInput(bool configured) : configured_(configured) {}

  /// Another session of the controller: nothing of it is known any more.
  void reset() { *this = ContactInput(configured_); }
  /// Of one packet; nothing: it does not have it, or is damaged.
  void note(std::optional<bool> on, TimePoint now) {
    const bool was = contact();
    on_ = configured_ ? on : std::nullopt;
    if (contact() && !was) contact_since_ = now;
    now_ = now;
  }

  bool contact() const { return on_ && !*on_; }
  bool follows() const { return path() == InputPath::kFollows; }
  InputPath path() const {
    if (!configured_) return InputPath::kNone;
    if (missed_) return InputPath::kMissed;
    if (!on_) return InputPath::kUntold;
    return proven_at_ && now_ - *proven_at_ <= kInputProofLasts ? InputPath::kFollows
                                                                : InputPath::kUnproven;
  }

  /// The sensor has confirmed a contact with this first edge, more than kInputFollows ago.
  void judge_contact(TimePoint edge) {
    const bool beside = contact_since_ && *contact_since_ + kAhead >= edge &&
                        *contact_since_ <= edge + kInputFollows;
    went_off_ = beside;
    if (!beside) {
      proven_at_.reset();
      missed_ = missed_ || on_.has_value();
    }
  }
  /// The contact has opened, by the sensor's words and by the input.
  void judge_opening() {
    if (went_off_ && !missed_) proven_at_ = now_;
    went_off_ = false;
  }

 private:
  /// By so much the clock map may have the edge behind the packet that shows it.
  static constexpr std::chrono::milliseconds kAhead{4};

  bool configured_;
  std::optional<bool> on_;
  std::optional<TimePoint> contact_since_, proven_at_;
  TimePoint now_{};
  bool went_off_ = false, missed_ = false;
};

}  // namespace cellcal::drivers
