#pragma once
// History of the link over two seconds: arrival of each packet, measured and commanded position;
// and the position of the arm at an instant of the host's clock.
//
// Model of actual_at() (rsi_mover.h determines its validity over RSI): AIPos is the position at
// the instant of IPOC, IPOC is uniform, and a packet arrives with a delay that is never negative
// and small at least once in the record. The earliest arrival therefore determines the clock map,
// unaffected by late ones. Remaining errors are that smallest delay (equal for all touches) and the
// drift of two quartz clocks over the record (100 ppm: 0.2 ms).

#include <cstdint>
#include <memory>
#include <optional>

#include "drivers/robot.h"

namespace cellcal::drivers {

/// The axis with the largest difference between two poses, and the difference [rad].
struct AxisDistance {
  std::uint8_t axis = 0;
  double rad = 0.0;
};
AxisDistance farthest_axis(const AxisAngles& a, const AxisAngles& b);

class PositionRecord {
 public:
  static constexpr std::size_t kDepth = 512;  // 2 s at 4 ms: verdict of a trip, and settling

  struct Sample {
    TimePoint t_rx{};
    std::uint32_t ipoc = 0;
    AxisAngles actual_rad;
    AxisAngles commanded_rad;  ///< in the reply to this packet
  };

  PositionRecord();

  void clear() { size_ = 0; }
  void push(TimePoint t_rx, std::uint32_t ipoc, const AxisAngles& actual_rad,
            const AxisAngles& commanded_rad);
  /// Sets the reply to the newest packet.
  void set_commanded(const AxisAngles& commanded_rad);

  std::size_t size() const { return size_; }
  /// The packet `back` before the newest; back < size().
  const Sample& newest(std::size_t back = 0) const;

  /// Mean AIPos of `count` packets, the newest of them `back` before the newest of all.
  AxisAngles mean_actual_rad(std::size_t back, std::size_t count) const;
  /// True if the arm is at rest: the means over the newest `window` packets and over the `window`
  /// before them agree within 0.002 deg. False with fewer packets.
  bool rests(std::size_t window) const;
  struct Range {
    double min = 0.0, max = 0.0;
  };
  /// Range commanded to one axis within the newest `count` packets.
  Range commanded_range_rad(std::size_t axis, std::size_t count) const;

  /// AIPos interpolated at t; empty if t is outside the record.
  std::optional<AxisAngles> actual_at(TimePoint t, double seconds_per_ipoc) const;

 private:
  std::unique_ptr<Sample[]> samples_;
  std::size_t next_ = 0, size_ = 0;
};

}  // namespace cellcal::drivers
