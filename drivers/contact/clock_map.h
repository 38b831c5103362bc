#pragma once
// Conversion of microcontroller ticks to host time.
//
// Model: within the window the two clocks differ by an offset and a constant drift. Each PING/PONG
// gives one sample: the midpoint of the host's interval corresponds to the midpoint of the
// sensor's.
//
// Assumption: both directions take equally long (PING and PONG have the same length, so that the
// transmission time cancels). The excess of the round trip over transmission and turnaround may be
// on either side; the error of a sample is at most half of it. Samples with a small excess are used
// and weighted; the stated uncertainty contains the smallest excess as a systematic part. A sensor
// whose rate is only approximately nominal (115 200 baud from 16 MHz is fast by 2 %) makes the
// excess negative; it is treated in the same way.
//
// Failure case: a constant one-sided delay (an adapter's latency timer) shifts the map by half of
// it. It is within the stated uncertainty, and constant: it is absorbed by the slope over search
// speeds.

#include <array>
#include <cstddef>
#include <cstdint>

#include "drivers/contact/wire/ctp.h"
#include "drivers/time.h"

namespace cellcal::drivers {

class ClockMap {
 public:
  static constexpr std::size_t kWindow = 64;     ///< number of samples used
  static constexpr std::size_t kMinSamples = 8;  ///< minimum number for a map

  enum class Sample { kTaken, kOutlier, kJumped };

  /// wire_s: one-way transmission time of a PING, from its first to its last bit.
  explicit ClockMap(double wire_s) : wire_s_(wire_s) {}

  void reset();
  /// kOutlier: contradicts the map; kJumped: as did the last few, the map was reset.
  Sample add(TimePoint sent, TimePoint received, std::uint32_t t_rx, std::uint32_t t_tx);

  bool valid() const { return valid_; }
  std::size_t samples() const { return count_; }
  /// Host time of a tick stamp within +-17 minutes of the last sample. Requires valid().
  TimePoint to_host(std::uint32_t ticks) const;
  /// 1 sigma of to_host() [s], increasing with the distance from the samples.
  double sigma_s(std::uint32_t ticks) const;
  /// 1 sigma at the newest sample [s].
  double sigma_s() const;
  /// Rate of the sensor's clock relative to nominal [1e-6].
  double drift_ppm() const;

  double round_trip_min_s() const { return rtt_min_s_; }
  double round_trip_p50_s() const { return rtt_p50_s_; }
  double round_trip_p99_s() const { return rtt_p99_s_; }

 private:
  struct Point {
    double x_s = 0.0;       ///< sensor time since the base
    double y_s = 0.0;       ///< host time since the base, minus x_s
    double excess_s = 0.0;  ///< round trip minus wire and turnaround; negative: a faster line
    double round_trip_s = 0.0;
  };

  double x_of(std::uint32_t ticks) const;
  double deviation_s(double x_s) const { return offset_s_ + slope_ * (x_s - mean_x_s_); }
  double sigma_at_s(double x_s) const;
  void fit();
  void round_trips();

  double wire_s_;
  std::array<Point, kWindow> points_{};
  std::size_t count_ = 0, next_ = 0;
  int contradictions_ = 0;

  TimePoint base_host_{};
  std::uint32_t last_ticks_ = 0;   ///< of the newest sample
  std::int64_t last_elapsed_ = 0;  ///< since the base, unwrapped

  bool valid_ = false;
  double mean_x_s_ = 0.0, offset_s_ = 0.0, slope_ = 0.0;
  double offset_var_s2_ = 0.0, slope_var_ = 0.0, systematic_s_ = 0.0;
  double rtt_min_s_ = 0.0, rtt_p50_s_ = 0.0, rtt_p99_s_ = 0.0;
};

}  // namespace cellcal::drivers
