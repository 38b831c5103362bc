#pragma once
// What the packets themselves tell about the link: cycle, decimals, gaps, late replies.
//
// IPOC counts milliseconds on real controllers (+4 or +12 per packet); some peers count packets.
// So the step is taken from IPOC, its duration from the arrivals, and where both agree on
// milliseconds the exact value is used. Who counts packets paces by sleeping, and its pace changes
// with the load of its computer: there the cycle follows the newest arrivals, slowly, so that a
// move's speed does not step. A stall of either computer is in few of them and does not count.
//
// A peer that counts packets, or does not write as a controller does, may print "-90.0" for an
// exact -90: how fine its angles are shows only once they change.

#include <array>
#include <cstdint>

#include "drivers/kuka/wire/rsi_codec.h"

namespace cellcal::drivers {

enum class Arrival : std::uint8_t {
  kFirst,
  kNext,
  kRepeat,   ///< same IPOC again
  kStale,    ///< older than the newest: overtaken on the way
  kRestart,  ///< IPOC jumped or went back, or Delay fell: another session, or many packets lost
};

class RsiStream {
 public:
  explicit RsiStream(int silence_cycles) : silence_cycles_(silence_cycles) {}

  /// A session begins anew; everything has to be learnt again.
  void reset() { *this = RsiStream(silence_cycles_); }
  Arrival push(const RobFrame& frame, TimePoint t_rx);
  /// One of which nothing but IPOC is sound. Only kNext goes on by it.
  Arrival push_damaged(std::uint32_t ipoc, TimePoint t_rx);
  /// Behind kRestart: it was Delay that showed it.
  bool delay_fell() const { return delay_fell_; }

  bool learnt() const { return cycle_s_ > 0.0; }
  bool odd_cycle() const { return odd_cycle_; }  ///< measured far outside 2..40 ms; learning again
  bool counts_packets() const { return learnt() && !counts_milliseconds_; }  ///< IPOC does
  bool counts_milliseconds() const { return learnt() && counts_milliseconds_; }
  double cycle_s() const { return cycle_s_; }  ///< 0 until learnt
  double seconds_per_ipoc() const;
  std::uint32_t step() const { return step_; }  ///< of IPOC per packet, 0 if not known
  /// The configured cycles; at least 0.2 s where IPOC counts packets.
  double silence_limit_s() const;
  int decimals() const { return decimals_; }
  /// True until the angles of a peer that is no controller have changed for the first time.
  bool decimals_unproven() const {
    return learnt() && (foreign_hand_ || !counts_milliseconds_) && !changed_;
  }
  std::uint64_t packets() const { return packets_; }
  std::uint64_t gaps() const { return gaps_; }  ///< packets missing between those that came

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
  /// By what IPOC is; and whether the arrivals agree.
  bool counts_milliseconds_ = false, exact_ = false;
  bool foreign_hand_ = false, changed_ = false;
  AxisAngles first_deg_;
  std::uint32_t last_ipoc_ = 0, step_ = 0;
  std::uint32_t last_delay_ = 0;
  int stale_in_a_row_ = 0;
  bool delay_fell_ = false;
  TimePoint last_rx_{};
  /// Seconds per count of IPOC from packet to packet, the newest of them.
  std::array<double, kPaces> paces_{};
  std::size_t pace_count_ = 0, next_pace_ = 0;
  double cycle_s_ = 0.0;
  bool odd_cycle_ = false;
};

}  // namespace cellcal::drivers
