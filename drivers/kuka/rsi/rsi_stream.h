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
#include <cstdint>

#include "drivers/kuka/wire/rsi_codec.h"

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

}  // namespace cellcal::drivers
