#pragma once
// A program that acts as a controller like public RSI simulators: it sends a packet, waits for the
// reply, sleeps, and sends the next. Its IPOC counts packets, its pace is determined by the sleep,
// an unanswered packet is repeated after a second, and the next adapter finds the last accepted
// correction. Sans I/O, any clock; deterministic for a seed.

#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/time.h"
#include "tests/drivers/kuka/rsi/foreign_packet.h"
#include "tests/drivers/kuka/wire/sen_frame.h"

namespace cellcal::drivers {

struct SleepyHabits {
  double sleep_s = 0.004;
  double jitter = 0.15;    ///< of each sleep, exponential, as a share of it
  double drift = 0.2;      ///< slow change of the pace, up and down, as a share of it
  double pause_s = 0.0;    ///< occasional delay by other load on its computer
  unsigned ipoc_step = 1;  ///< 4: as if counting milliseconds, which they are not
  bool counts_on = false;  ///< IPOC advances without answers
  double repeat_s = 1.0;   ///< until an unanswered packet is sent again
  bool setpoint = true;    ///< ASPos is sent: the pose at the start
  double lag_s = 0.02;     ///< of its arm; 0: it jumps from reply to reply
  unsigned seed = 1;
};

class SleepyPeer {
 public:
  SleepyPeer(const SleepyHabits& habits, std::vector<double> start_rad)
      : h_(habits),
        start_rad_(std::move(start_rad)),
        setpoint_(start_rad_),
        actual_(start_rad_),
        random_(habits.seed) {}

  /// Its program continues, at `now` or as soon after as it wakes. The packet to send, or empty.
  std::string tick(TimePoint now) {
    if (!begun_) begun_ = woken_ = moved_at_ = now;
    settle_at(now);
    setpoint_ = taken_;
    if (now < woken_) return {};
    if (waiting_ && now - sent_ < duration(h_.repeat_s)) return {};
    if (waiting_) {
      ++delay_;
      if (h_.counts_on) ipoc_ += h_.ipoc_step;
    }
    waiting_ = true;
    sent_ = now;
    return packet();
  }

  void receive(std::string_view reply, TimePoint now) {
    const auto frame = read_sen(reply);
    if (!waiting_ || !frame || frame->ipoc != std::to_string(ipoc_)) return;
    for (std::size_t i = 0; i < 6 && i < frame->axes_deg.size(); ++i) {
      const double target = start_rad_[i] + frame->axes_deg[i] * kRad;
      largest_step_rad_ = std::max(largest_step_rad_, std::abs(target - taken_[i]));
      taken_[i] = target;
    }
    waiting_ = false;
    ++replies_;
    ipoc_ += h_.ipoc_step;
    woken_ = now + duration(next_sleep_s(now));
  }

  std::vector<double> actual_rad_at(TimePoint t) const {
    std::vector<double> at = actual_;
    const double dt = std::chrono::duration<double>(t - moved_at_).count();
    const double share = h_.lag_s > 0.0 ? -std::expm1(-std::max(0.0, dt) / h_.lag_s) : 1.0;
    for (std::size_t i = 0; i < at.size(); ++i) at[i] += share * (setpoint_[i] - at[i]);
    return at;
  }

  bool waits() const { return waiting_; }
  TimePoint woken() const { return woken_; }
  std::uint64_t replies() const { return replies_; }
  /// Largest step of an axis by one reply.
  double largest_step_rad() const { return largest_step_rad_; }
  double held_rad(std::size_t axis) const { return taken_[axis] - start_rad_[axis]; }

 private:
  static constexpr double kRad = std::numbers::pi / 180.0;
  static constexpr double kDriftPeriodS = 9.0;
  static constexpr double kPausesPerS = 0.2;

  static Duration duration(double s) {
    return std::chrono::duration_cast<Duration>(std::chrono::duration<double>(s));
  }

  void settle_at(TimePoint now) {
    actual_ = actual_rad_at(now);
    moved_at_ = now;
  }

  double next_sleep_s(TimePoint now) {
    const double t = std::chrono::duration<double>(now - *begun_).count();
    const double pace = 1.0 + h_.drift * std::sin(2.0 * std::numbers::pi * t / kDriftPeriodS);
    std::exponential_distribution<double> more(1.0);
    double sleep_s = h_.sleep_s * (pace + h_.jitter * more(random_));
    std::uniform_real_distribution<double> chance;
    if (h_.pause_s > 0.0 && chance(random_) < kPausesPerS * sleep_s) sleep_s += h_.pause_s;
    return sleep_s;
  }

  std::string packet() const {
    ForeignPacket text;
    SixAngles start{};
    for (std::size_t i = 0; i < 6; ++i) {
      text.actual_deg[i] = actual_[i] / kRad;
      start[i] = start_rad_[i] / kRad;
    }
    if (h_.setpoint) text.setpoint_deg = start;
    text.delay = delay_;
    text.ipoc = ipoc_;
    return text_of(text);
  }

  SleepyHabits h_;
  std::vector<double> start_rad_, setpoint_, actual_, taken_{start_rad_};
  std::mt19937_64 random_;
  std::optional<TimePoint> begun_;
  TimePoint woken_{}, sent_{}, moved_at_{};
  bool waiting_ = false;
  unsigned ipoc_ = 0, delay_ = 0;
  std::uint64_t replies_ = 0;
  double largest_step_rad_ = 0.0;
};

}  // namespace cellcal::drivers
