#include "virtual_sensor.h"

#include <algorithm>
#include <cmath>

namespace cellcal::test {

using std::chrono::nanoseconds;

namespace {

constexpr std::uint32_t kClockHz = 16'000'000;
constexpr std::uint16_t kSupplyMv = 5000, kLiftedMv = 2900, kPulledDownMv = 0;

}  // namespace

VirtualSensor::VirtualSensor(const sim::McuOptions& options, TimePoint power_on)
    : options_(options),
      now_(power_on),
      booted_(power_on),
      first_ticks_(options.first_ticks),
      boot_id_(options.boot_id),
      rx_free_(power_on),
      tx_free_(power_on) {
  boot(CTP_RESET_POWER);
}

void VirtualSensor::boot(std::uint8_t cause) {
  sensor_identity identity{};
  identity.version = options_.version;
  std::copy(options_.firmware.begin(), options_.firmware.end(), identity.firmware);
  identity.uid = options_.uid;
  identity.boot_id = boot_id_;
  identity.clock_hz = kClockHz;
  identity.reset_cause = cause;
  identity.baud = static_cast<std::uint32_t>(options_.baud);
  identity.pong_lead = static_cast<std::uint16_t>(options_.turnaround.count() * CTP_TICKS_PER_US);
  sensor_init(&sensor_, &identity, ticks(now_));
  pin_high_ = true;
  measure();
}

Duration VirtualSensor::byte_time() const {
  return nanoseconds{std::int64_t{1'000'000'000} * CTP_BITS_PER_BYTE / options_.baud};
}

std::uint32_t VirtualSensor::ticks(TimePoint t) const {
  const double ns = static_cast<double>(nanoseconds(t - booted_).count());
  const double count = std::floor(ns / int{CTP_TICK_NS} * (1.0 + options_.drift_ppm * 1e-6));
  return first_ticks_ + static_cast<std::uint32_t>(static_cast<std::int64_t>(count));
}

/// The first instant at which its clock shows so many ticks more than now.
TimePoint VirtualSensor::when(std::uint32_t wait) const {
  if (wait == 0) return now_;
  const std::uint32_t target = ticks(now_) + wait;
  const double ns =
      static_cast<double>(wait) * int{CTP_TICK_NS} / (1.0 + options_.drift_ppm * 1e-6);
  // The present tick has begun before now_: by how much, the count of whole ticks does not say.
  const double since_ns = static_cast<double>(nanoseconds(now_ - booted_).count());
  const double tick_ns = int{CTP_TICK_NS} / (1.0 + options_.drift_ppm * 1e-6);
  const double begun_ns = since_ns - std::floor(since_ns / tick_ns) * tick_ns;
  constexpr int kRoundingNs = 2;
  TimePoint t = now_ + nanoseconds{static_cast<std::int64_t>(ns - begun_ns) - kRoundingNs};
  while (static_cast<std::int32_t>(ticks(t) - target) < 0) t += nanoseconds{1};
  return t;
}

// The touch circuit -------------------------------------------------------------------------------

bool VirtualSensor::closed_at_pin() const {
  if (faults_.wire_broken || feed_broken_ || sense_broken_) return true;
  if (faults_.stuck_open) return false;
  return closed_ || sensor_drive(&sensor_) == SENSOR_PULLED_LOW;
}

void VirtualSensor::measure() {
  const bool pulled = sensor_drive(&sensor_) == SENSOR_PULLED_LOW;
  const bool lifted = sensor_drive(&sensor_) == SENSOR_LIFTED;
  const bool no_sense = faults_.wire_broken || sense_broken_;
  const bool no_feed = faults_.wire_broken || feed_broken_;
  const bool low = closed_at_pin();
  std::uint16_t sense = low ? options_.contact_mv : options_.open_mv;
  if (no_sense || (no_feed && !closed_)) sense = lifted ? kLiftedMv : kPulledDownMv;
  if (faults_.sense_mv) sense = *faults_.sense_mv;
  std::uint16_t feed = closed_ || (pulled && !no_sense) ? options_.contact_mv : options_.open_mv;
  if (no_feed) feed = kSupplyMv;
  sensor_on_voltages(&sensor_, sense, feed);
}

void VirtualSensor::follow_pin(TimePoint t) {
  const bool high = !closed_at_pin();
  if (high == pin_high_) return;
  pin_high_ = high;
  if (!faults_.silent) sensor_on_edge(&sensor_, ticks(t), high);
}

void VirtualSensor::set_faults(const sim::McuFaults& faults, TimePoint t) {
  advance(t);
  faults_ = faults;
  measure();
  follow_pin(t);
}

void VirtualSensor::break_wires(bool feed_wire, bool sense_wire, TimePoint t) {
  advance(t);
  feed_broken_ = feed_wire;
  sense_broken_ = sense_wire;
  measure();
  follow_pin(t);
}

void VirtualSensor::reset(TimePoint t, std::uint8_t cause) {
  advance(t);
  now_ = booted_ = tx_free_ = t;
  first_ticks_ = 0;
  ++boot_id_;
  // What already was on the wire has left; the half frame of this moment is lost with the reset.
  std::erase_if(output_, [t](const Output& o) { return o.t > t; });
  boot(cause);
  follow_pin(t);
}

// Time --------------------------------------------------------------------------------------------

void VirtualSensor::receive(std::span<const std::uint8_t> bytes, TimePoint t) {
  rx_free_ = std::max(rx_free_, t);
  for (const std::uint8_t byte : bytes) {
    rx_free_ += byte_time();
    arrivals_.push_back({rx_free_, byte});
  }
}

TimePoint VirtualSensor::next_event() const {
  TimePoint t = next_internal();
  if (!output_.empty()) t = std::min(t, output_.front().t);
  return std::max(t, now_);
}

TimePoint VirtualSensor::next_internal() const {
  TimePoint t = TimePoint::max();
  if (!edges_.empty()) t = std::min(t, edges_.begin()->first);
  if (!arrivals_.empty()) t = std::min(t, arrivals_.front().t);
  if (faults_.silent) return t;
  const std::uint32_t now = ticks(now_);
  t = std::min(t, when(sensor_wait(&sensor_, now, false)));
  return std::min(t, std::max(tx_free_, when(sensor_wait(&sensor_, now, true))));
}

void VirtualSensor::advance(TimePoint t) {
  for (TimePoint next = next_internal(); next <= t; next = next_internal()) {
    now_ = std::max(now_, next);
    process(now_);
  }
  now_ = std::max(now_, t);
}

void VirtualSensor::run(TimePoint t) {
  if (faults_.silent) return;
  measure();
  sensor_run(&sensor_, ticks(t));
  measure();
  follow_pin(t);
}

void VirtualSensor::process(TimePoint t) {
  run(t);  // a sample that is due sees the level from before the edge
  while (!edges_.empty() && edges_.begin()->first <= t) {
    const auto [at, closed] = *edges_.begin();
    edges_.erase(edges_.begin());
    closed_ = closed;
    measure();
    follow_pin(at);
  }
  while (!arrivals_.empty() && arrivals_.front().t <= t) {
    const Arrival arrival = arrivals_.front();
    arrivals_.pop_front();
    if (!faults_.silent) sensor_on_byte(&sensor_, arrival.byte, ticks(arrival.t));
  }
  run(t);
  if (!faults_.silent) transmit(t);
}

void VirtualSensor::transmit(TimePoint t) {
  if (quiet_) sensor_log(&sensor_, nullptr);
  if (t < tx_free_) return;  // only at a frame boundary
  Output output;
  std::uint32_t start = 0;
  const std::uint32_t now = ticks(t);
  output.frame.size = sensor_next_frame(&sensor_, now, output.frame.data.data(), &start);
  if (output.frame.size == 0) return;
  tx_free_ = (start == now ? t : when(start - now)) +
             byte_time() * static_cast<std::int64_t>(output.frame.size);
  output.t = tx_free_;
  output_.push_back(output);
}

std::optional<VirtualSensor::Output> VirtualSensor::next_output() {
  if (output_.empty() || output_.front().t > now_) return std::nullopt;
  const Output output = output_.front();
  output_.pop_front();
  return output;
}

std::size_t VirtualSensorLine::read(std::span<std::uint8_t> into, TimePoint& t) {
  const auto output = peer_.next_output();
  if (!output) return 0;
  const auto bytes = output->frame.bytes();
  std::copy(bytes.begin(), bytes.end(), into.begin());
  t = output->t;
  return bytes.size();
}

}  // namespace cellcal::test
