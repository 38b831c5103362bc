#pragma once
// Properties of the link derived from its packets: cycle, decimals, gaps, late replies.
//
// IPOC counts milliseconds on real controllers (+4 or +12 per packet); some peers count packets.
// The step is therefore taken from IPOC, its duration from the arrivals, and if both agree on
// milliseconds the exact value is used. Peers that count packets are paced by sleeping, with a pace
// that depends on the load of their computer: the cycle then follows the newest arrivals slowly,
// without steps in the speed of a move. A stall of either computer affects few packets and is
// ignored.
//
// A peer that counts packets, or whose format differs from a controller's, may print "-90.0" for an
// exact -90: the resolution of its angles shows only once they change.

#include <array>
#include <cmath>
#include <cstdint>
#include <optional>

#include "drivers/kuka/wire/rsi_codec.h"
#include "drivers/robot.h"
#include "drivers/time.h"

namespace cellcal::drivers {

enum class Arrival : std::uint8_t {
  kFirst,
  kNext,
  kRepeat,   ///< same IPOC again
  kStale,    ///< older than the newest: overtaken in transit
  kRestart,  ///< IPOC jumped or fell, or Delay fell: another session, or many packets lost
};

class RsiStream {
 public:
  explicit RsiStream(int silence_cycles) : silence_cycles_(silence_cycles) {}

  /// Start of a session; everything is learned again.
  void reset() { *this = RsiStream(silence_cycles_); }
  Arrival push(const RobFrame& frame, TimePoint t_rx);
  /// A packet in which only IPOC is valid. Only kNext advances.
  Arrival push_damaged(std::uint32_t ipoc, TimePoint t_rx);
  /// After kRestart: detected by Delay.
  bool delay_fell() const { return delay_fell_; }

  bool learnt() const { return cycle_s_ > 0.0; }
  bool odd_cycle() const { return odd_cycle_; }  ///< measured far outside 2..40 ms; learning again
  bool counts_packets() const { return learnt() && !counts_milliseconds_; }  ///< not milliseconds
  bool counts_milliseconds() const { return learnt() && counts_milliseconds_; }
  double cycle_s() const { return cycle_s_; }  ///< 0 until learned
  /// Time that a reply's motion is computed for: at most IPOC's milliseconds, so that packets which this
  /// computer received late do not raise the speed. 0 until learned.
  double motion_cycle_s() const;
  double seconds_per_ipoc() const;
  std::uint32_t step() const { return step_; }  ///< IPOC increment per packet, 0 if unknown
  /// The configured cycles; at least 0.2 s if IPOC counts packets.
  double silence_limit_s() const;
  int decimals() const { return decimals_; }
  /// True until the angles of a peer other than a controller have changed for the first time.
  bool decimals_unproven() const {
    return learnt() && (foreign_hand_ || !counts_milliseconds_) && !changed_;
  }
  std::uint64_t packets() const { return packets_; }
  std::uint64_t gaps() const { return gaps_; }  ///< missing packets between received ones

 private:
  static constexpr std::size_t kPaces = 32;

  Arrival place(std::uint32_t ipoc) const;
  void step_to(std::uint32_t ipoc, TimePoint t_rx);
  void note_pace(TimePoint t_rx, std::uint32_t counts);
  double pace_s() const;
  int silent_cycles() const;
  void learn();
  void follow();

  int silence_cycles_;
  std::uint64_t packets_ = 0, gaps_ = 0;
  int decimals_ = -1;
  /// Unit of IPOC; and whether the arrivals agree.
  bool counts_milliseconds_ = false, exact_ = false;
  bool foreign_hand_ = false, changed_ = false;
  AxisAngles first_deg_;
  std::uint32_t last_ipoc_ = 0, step_ = 0;
  std::uint32_t last_delay_ = 0;
  int stale_in_a_row_ = 0;
  bool delay_fell_ = false;
  TimePoint last_rx_{};
  /// Seconds per count of IPOC between packets, most recent values.
  std::array<double, kPaces> paces_{};
  std::size_t pace_count_ = 0, next_pace_ = 0;
  double cycle_s_ = 0.0;
  bool odd_cycle_ = false;
};

// Start of a sequence of identical packets. Some peers repeat a packet until it is answered, with
// the arm at rest. Repetition of an answered packet shows that replies are no longer accepted.

class RepeatWatch {
 public:
  void note(std::uint32_t ipoc, const AxisAngles& actual_rad, TimePoint t_rx) {
    if (ipoc_ == ipoc && actual_rad_ == actual_rad) return;
    ipoc_ = ipoc;
    actual_rad_ = actual_rad;
    since_ = t_rx;
  }
  double same_s(TimePoint t_rx) const {
    return std::chrono::duration<double>(t_rx - since_).count();
  }

 private:
  std::uint32_t ipoc_ = 0;
  AxisAngles actual_rad_;
  TimePoint since_{};
};

// Determines whether the controller's session continues after a silence. Only a short one excludes
// another session: a program that ended cannot be restarted manually within half a second.

class PauseWatch {
 public:
  /// Packets stopped after this one.
  void begin(std::uint32_t ipoc, double seconds_per_ipoc, std::optional<std::uint32_t> delay,
             TimePoint t_rx) {
    left_ = Left{ipoc, seconds_per_ipoc, delay, t_rx};
  }
  void forget() { left_.reset(); }

  /// First packet after the silence: true if IPOC is consistent with the clock, and Delay has not
  /// restarted.
  bool is_over(std::uint32_t ipoc, std::optional<std::uint32_t> delay, TimePoint t_rx) const {
    if (!left_ || left_->seconds_per_ipoc <= 0.0) return false;
    const double elapsed_s = std::chrono::duration<double>(t_rx - left_->t_rx).count();
    const double by_ipoc_s =
        static_cast<std::int32_t>(ipoc - left_->ipoc) * left_->seconds_per_ipoc;
    const bool goes_on = elapsed_s <= kLongestS && std::abs(by_ipoc_s - elapsed_s) <= kContinuityS;
    return goes_on && delay.has_value() == left_->delay.has_value() &&
           delay.value_or(0) >= left_->delay.value_or(0);
  }

 private:
  static constexpr double kLongestS = 0.5;
  /// Tolerance for queued packets, and two quartzes.
  static constexpr double kContinuityS = 0.05;

  struct Left {
    std::uint32_t ipoc = 0;
    double seconds_per_ipoc = 0.0;
    std::optional<std::uint32_t> delay;
    TimePoint t_rx{};
  };
  std::optional<Left> left_;
};

// Evaluates the controller's count of late replies (Delay): the number of late ones, and whether
// any reply is accepted. A wrong SENTYPE or IPOC is discarded without a message: only Delay shows
// it.

class DelayWatch {
 public:
  /// Another session: its first packet becomes the reference.
  void begin_session();
  /// The first packet of a session that is answered; Delay, if sent.
  void begin_answers(std::optional<std::uint32_t> delay) { first_ = delay; }
  /// Delay of a packet. Returns the number of late replies since the last one.
  std::uint32_t note(std::optional<std::uint32_t> delay);
  void replied() { ++replies_; }

  std::optional<std::uint32_t> last() const { return last_; }
  bool counts() const { return counts_; }  ///< it has increased: the controller sends it
  std::uint64_t replies() const { return replies_; }
  /// Newest packets in a row that count no further late reply.
  std::uint32_t accepted_in_a_row() const { return accepted_in_a_row_; }
  /// True if every reply of this session, of at least `replies`, counts as late, except those in
  /// transit.
  bool refused(std::uint64_t replies) const;

 private:
  std::optional<std::uint32_t> first_, last_;
  std::uint64_t replies_ = 0;
  std::uint32_t accepted_in_a_row_ = 0;
  bool counts_ = false;
};

}  // namespace cellcal::drivers
