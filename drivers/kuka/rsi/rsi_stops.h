#pragma once
// Second stop path: the digital input connected to the sensor's opto output, as reported in each
// packet. Off means contact: a touch, a broken wire, a board without supply or a hung one.
//
// Off always stops the arm. On is trusted as 'free' only if the input has recently followed a touch
// and its opening: it switched off together with the sensor's own stamp, and on again. Until then,
// and after it has missed a touch, only the sensor's bytes can report that nothing is touched.

#include <cstdint>
#include <optional>

#include "drivers/kuka/moves/cause.h"
#include "drivers/kuka/moves/position_record.h"
#include "drivers/kuka/rsi/rsi_config.h"
#include "drivers/robot.h"
#include "drivers/time.h"

namespace cellcal::drivers {

/// Time from the sensor's stamp of a contact to a packet that shows it: optocoupler, the controller's
/// filter, its cycle, and late processing on this computer.
inline constexpr std::chrono::milliseconds kInputFollows{60};
/// Validity of the proof by a touch that the input followed.
inline constexpr std::chrono::minutes kInputProofLasts{5};
/// Maximum silence or delay of the sensor's messages while the input follows: half a second, plus one
/// idle heartbeat. The record of positions covers it and the longest rest after it (2 s at 4 ms).
inline constexpr std::chrono::milliseconds kInputWatchLimit{600};

class ContactInput {
 public:
  explicit ContactInput(bool configured) : configured_(configured) {}

  /// Another session of the controller: discards all knowledge.
  void reset() { *this = ContactInput(configured_); }
  /// State in one packet; empty: absent, or a damaged packet.
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
  /// The contact has opened, by the sensor's messages and by the input.
  void judge_opening() {
    if (went_off_ && !missed_) proven_at_ = now_;
    went_off_ = false;
  }

 private:
  /// Tolerance by which the clock map may place the edge after the packet that shows it.
  static constexpr std::chrono::milliseconds kAhead{4};

  bool configured_;
  std::optional<bool> on_;
  std::optional<TimePoint> contact_since_, proven_at_;
  TimePoint now_{};
  bool went_off_ = false, missed_ = false;
};

// Following-error monitor with two criteria, the second of which reacts faster:
//
//   1. Following error: an axis is farther than follow_tolerance_deg from everything that was
//      commanded within follow_window_s.
//   2. Standstill: an axis does not move although its command advances. Let `lag` be at most
//      longest_lag_s. Within any window an arm that follows moves at least as far as the smallest
//      travel commanded within a window of equal length, now or up to `lag` ago. An axis that moves
//      less than a quarter of it is at standstill: at a limit that clamps without a message, at a
//      closed brake, at an obstacle.

/// AxisNotFollowing or AxisStands. To be called after each packet of a moving arm; `cycle_s` from
/// packet to packet.
std::optional<Cause> following_fault(const PositionRecord& record, const RsiConfig& config,
                                     double cycle_s);

}  // namespace cellcal::drivers
