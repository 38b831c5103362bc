#include "sim/mcu/microcontroller.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

namespace cellcal::sim {

using std::chrono::nanoseconds;

namespace {

constexpr std::uint32_t kClockHz = 16'000'000;
/// One round of the board's converter (avr/analog.c), rounded up.
constexpr std::chrono::microseconds kConversion{160};
/// After a change: the current round may be half complete, and the sensor requires two.
constexpr int kConversions = 3;
/// Step of the gun's capacitor, until it has settled to within the tolerance.
constexpr std::chrono::microseconds kGunStep{10};
constexpr double kAtRestV = 1e-3;
/// Switching time of the relay's armature.
constexpr std::chrono::milliseconds kRelayTime{10};
/// Maximum size of a datagram; longer ones are refused by the board.
constexpr std::size_t kMostBytes = HOST_MAX_DATAGRAM + 1;

TestPin pin_of(sensor_pull pull) {
  switch (pull) {
    case SENSOR_PULLED_LOW: return TestPin::kLow;
    case SENSOR_PULLED_HIGH: return TestPin::kHigh;
    case SENSOR_LIFTED: return TestPin::kPullUp;
    default: return TestPin::kReleased;
  }
}

/// As converted by the board: in units of its supply, taken as 5000 mV.
std::uint16_t millivolts(double v, double supply_v) {
  return static_cast<std::uint16_t>(std::lround(std::clamp(v / supply_v, 0.0, 1.0) * 5e3));
}

// The board's parts [ohm], as in the schematic.
constexpr double kFeedOhm = 1e3;         // R1
constexpr double kPullDownOhm = 47e3;    // R2
constexpr double kEarthPullUpOhm = 1e3;  // R9
/// Leakage of air and board, so that no node floats.
constexpr double kAirOhm = 1e10;
/// In series with the gun's capacitor: negligible.
constexpr double kCapacitorOhm = 1e-3;

enum Node : int { kFeed, kFeedEnd, kGun, kSenseEnd, kSense, kFirst, kLast, kBack, kNodes };

/// Nodal analysis: conductances and currents into each node.
struct Network {
  using Volts = Eigen::Matrix<double, kNodes, 1>;

  void join(Node a, Node b, double ohm) {
    siemens(a, a) += 1.0 / ohm;
    siemens(b, b) += 1.0 / ohm;
    siemens(a, b) -= 1.0 / ohm;
    siemens(b, a) -= 1.0 / ohm;
  }
  void tie(Node a, double volt, double ohm) {
    siemens(a, a) += 1.0 / ohm;
    ampere[a] += volt / ohm;
  }
  void drain(Node a, double amperes) { ampere[a] -= amperes; }
  Volts solve() const { return siemens.llt().solve(ampere); }

  Eigen::Matrix<double, kNodes, kNodes> siemens =
      Eigen::Matrix<double, kNodes, kNodes>::Identity() / kAirOhm;
  Volts ampere = Volts::Zero();
};

Network network_of(const TouchCircuit& c) {
  Network net;
  const double supply_v = c.board.supply_v;
  net.tie(kFeed, supply_v, kFeedOhm);
  const double plug = c.isolated ? TouchCircuit::kOpen : 0.0;
  net.join(kFeed, kFeedEnd, c.feed_wire + plug);
  net.join(kFeedEnd, kGun, c.feed_lug);
  net.join(kGun, kSenseEnd, c.sense_lug);
  net.join(kFeedEnd, kSenseEnd, c.between_lugs);
  net.join(kSenseEnd, kSense, c.sense_end + c.sense_wire + c.board.surge_ohm + plug);
  net.join(kFeed, kSense, c.feed_to_sense + c.board.surge_ohm);
  net.tie(kSense, 0.0, kPullDownOhm);
  net.tie(kSense, supply_v, c.sense_to_supply);
  net.tie(kGun, 0.0, c.gun_to_earth);
  net.tie(kFirst, 0.0, c.earth_out + plug);
  net.join(kFirst, kLast, c.earth_between);
  net.join(kLast, kBack, c.earth_end + c.earth_back + plug);
  net.tie(kBack, 0.0, c.earth_to_back);
  net.tie(kBack, supply_v, kEarthPullUpOhm);
  if (c.touching) net.join(kGun, kLast, c.touch_ohm);
  net.drain(kFeed, c.feed_leak_a);
  net.drain(kSense, c.sense_leak_a);
  const TestPin pin = c.test_joint_open ? TestPin::kReleased : c.test_pin;
  if (pin == TestPin::kLow) net.tie(kSense, 0.0, c.board.test_ohm);
  if (pin == TestPin::kHigh) net.tie(kSense, supply_v, c.board.test_ohm);
  if (pin == TestPin::kPullUp) net.tie(kSense, supply_v, c.board.pull_up_ohm);
  return net;
}

CircuitVoltages as_it_is(const TouchCircuit& c, std::optional<double> gun_v) {
  Network net = network_of(c);
  if (gun_v) net.tie(kGun, *gun_v, kCapacitorOhm);
  const auto volt = net.solve();
  return {volt[kFeed], volt[kSense], volt[kBack]};
}

}  // namespace

Microcontroller::Microcontroller(const McuOptions& options, TimePoint power_on)
    : options_(options),
      now_(power_on),
      clock_from_(power_on),
      first_ticks_(options.first_ticks),
      boot_id_(options.boot_id),
      rx_free_(power_on),
      tx_free_(power_on) {
  boot(CTP_RESET_POWER);
}

void Microcontroller::boot(std::uint8_t cause) {
  sensor_identity identity{};
  identity.version = options_.version;
  std::copy(options_.firmware.begin(), options_.firmware.end(), identity.firmware);
  identity.uid = options_.uid;
  identity.boot_id = boot_id_;
  identity.clock_hz = kClockHz;
  identity.reset_cause = cause;
  identity.has_fuses = !options_.datagrams;
  identity.datagrams = options_.datagrams;
  identity.has_relay = options_.relay;
  identity.fuses_low = options_.board.fuses_low;
  identity.fuses_high = options_.board.fuses_high;
  identity.fuses_extended = options_.board.fuses_extended;
  identity.loader = options_.board.loader;
  identity.baud = static_cast<std::uint32_t>(options_.baud);
  identity.pong_lead = static_cast<std::uint16_t>(options_.turnaround.count() * CTP_TICKS_PER_US);
  sensor_init(&sensor_, &identity, ticks(now_));
  host_link_init(&link_, &sensor_);
  pin_high_ = seen_high_ = true;  // initial state of the core
  last_test_ = TEST_NONE;
  last_armed_ = false;
  circuit_.test_pin = TestPin::kReleased;
  circuit_.board = options_.circuit;
  move_relay(now_);
  settle(now_);
}

Duration Microcontroller::byte_time() const {
  return nanoseconds{std::int64_t{1'000'000'000} * CTP_BITS_PER_BYTE / options_.baud};
}

std::uint32_t Microcontroller::ticks(TimePoint t) const {
  const double ns = static_cast<double>(nanoseconds(t - clock_from_).count());
  const double count = std::floor(ns / int{CTP_TICK_NS} * (1.0 + options_.drift_ppm * 1e-6));
  return first_ticks_ + static_cast<std::uint32_t>(static_cast<std::int64_t>(count));
}

/// The first instant at which its clock has advanced by `wait` ticks.
TimePoint Microcontroller::when(std::uint32_t wait) const {
  if (wait == 0) return now_;
  const std::uint32_t target = ticks(now_) + wait;
  const double tick_ns = int{CTP_TICK_NS} / (1.0 + options_.drift_ppm * 1e-6);
  // The current tick began before now_, by an amount not contained in the count of whole ticks.
  const double since_ns = static_cast<double>(nanoseconds(now_ - clock_from_).count());
  const double begun_ns = since_ns - std::floor(since_ns / tick_ns) * tick_ns;
  constexpr int kRoundingNs = 2;
  TimePoint t =
      now_ + nanoseconds{static_cast<std::int64_t>(wait * tick_ns - begun_ns) - kRoundingNs};
  while (static_cast<std::int32_t>(ticks(t) - target) < 0) t += nanoseconds{1};
  return t;
}

// The touch circuit -------------------------------------------------------------------------------

void Microcontroller::examine_circuit(TimePoint t) {
  const bool holds = circuit_.gun_farad > 0.0;
  if (!holds) gun_v_.reset();
  if (holds && !gun_v_) gun_v_ = circuit_.gun_at_rest_v();
  volts_ = circuit_.voltages(gun_v_);
  pin_high_ = circuit_.pin_high(pin_high_, gun_v_);
  gun_moves_ = holds && std::abs(*gun_v_ - circuit_.gun_at_rest_v()) > kAtRestV;
  gun_at_ = t;
  if (!silent_) conversions_left_ = kConversions;  // a hung board samples it after it resumes
}

void Microcontroller::report_edge(TimePoint t) {
  if (pin_high_ == seen_high_ || silent_) return;
  seen_high_ = pin_high_;
  sensor_on_edge(&sensor_, ticks(t), pin_high_);
  follow_output(t);
}

/// The circuit has changed: the pin follows immediately, the converter in its turn.
void Microcontroller::settle(TimePoint t) {
  examine_circuit(t);
  if (!silent_) convert(now_);
  report_edge(t);
}

/// Updates the gun's capacitor to t.
void Microcontroller::move_gun(TimePoint t) {
  if (!gun_moves_ || t < gun_at_ + kGunStep) return;
  gun_v_ = circuit_.gun_after_v(*gun_v_, std::chrono::duration<double>(t - gun_at_).count());
  examine_circuit(t);
  report_edge(t);
}

void Microcontroller::drive_relay(TimePoint t) {
  const bool pull = sensor_relay(&sensor_) && !relay_dead_;
  if (!options_.relay || relay_at_ != TimePoint::max() || pull == relay_pulled_) return;
  relay_at_ = t + kRelayTime;
}

/// End of the armature's motion: four poles, and the mirror contact, which welded poles hold open.
void Microcontroller::move_relay(TimePoint t) {
  if (!options_.relay) return;
  relay_at_ = TimePoint::max();
  relay_pulled_ = (sensor_relay(&sensor_) && !relay_dead_) || (relay_pulled_ && relay_welded_);
  circuit_.isolated = !relay_pulled_;
  sensor_on_mirror(&sensor_, ticks(t), relay_pulled_);
}

void Microcontroller::on_output(OnOutput callback) {
  on_output_ = std::move(callback);
  free_ = sensor_free(&sensor_);
  on_output_(now_, free_);
}

void Microcontroller::follow_output(TimePoint t) {
  const bool free = sensor_free(&sensor_);
  if (free == free_) return;
  free_ = free;
  if (on_output_) on_output_(t, free);
}

void Microcontroller::convert(TimePoint t) {
  --conversions_left_;
  next_conversion_ = t + kConversion;
  const double supply_v = circuit_.board.supply_v;
  const sensor_voltages mv{millivolts(volts_.sense_v, supply_v),
                           millivolts(volts_.feed_v, supply_v),
                           millivolts(volts_.earth_v, supply_v)};
  sensor_on_voltages(&sensor_, ticks(t), &mv);
}

/// Applies the firmware's outputs to the circuit, and schedules the next sampling.
void Microcontroller::follow_test() {
  const TestPin pin = pin_of(sensor_drive(&sensor_));
  const bool resamples = sensor_.test != last_test_ || armed() != last_armed_;
  last_test_ = sensor_.test;
  last_armed_ = armed();
  if (pin != circuit_.test_pin) {
    circuit_.test_pin = pin;
    settle(now_);
  } else if (resamples) {
    conversions_left_ = kConversions;
    convert(now_);
  }
}

void Microcontroller::edge(TimePoint t, bool closed) { edges_.emplace(t, closed); }

void Microcontroller::set_faults(const McuFaults& faults, TimePoint t) {
  advance(t);
  const bool touching = circuit_.touching;
  silent_ = faults.silent;
  circuit_ = faults.circuit;
  circuit_.touching = touching;
  circuit_.board = options_.circuit;
  relay_welded_ = faults.relay_welded;
  relay_dead_ = faults.relay_dead;
  move_relay(t);
  circuit_.test_pin = pin_of(sensor_drive(&sensor_));
  settle(t);
}

void Microcontroller::set_drift(double ppm, TimePoint t) {
  advance(t);
  first_ticks_ = ticks(t);
  clock_from_ = t;
  options_.drift_ppm = ppm;
}

void Microcontroller::reset(TimePoint t, std::uint8_t cause) {
  advance(t);
  now_ = clock_from_ = tx_free_ = t;
  first_ticks_ = 0;
  ++boot_id_;
  repeats_ += sensor_.repeats;
  // Transmitted bytes have left; the current partial frame is lost with the reset.
  std::erase_if(output_, [t](const Output& o) { return o.t > t; });
  boot(cause);
  follow_output(t);
}

// Time --------------------------------------------------------------------------------------------

void Microcontroller::receive(std::span<const std::uint8_t> bytes, TimePoint t) {
  rx_free_ = std::max(rx_free_, t);
  for (const std::uint8_t byte : bytes) {
    rx_free_ += byte_time();
    arrivals_.push_back({rx_free_, byte});
  }
}

void Microcontroller::receive(std::span<const std::uint8_t> bytes, TimePoint t,
                              const host_address& from) {
  const TimePoint end = t + byte_time() * static_cast<std::int64_t>(bytes.size());
  datagrams_.push_back({end, from, {bytes.begin(), bytes.end()}});
}

TimePoint Microcontroller::next_event() const {
  TimePoint t = next_internal();
  if (!output_.empty()) t = std::min(t, output_.front().t);
  return std::max(t, now_);
}

TimePoint Microcontroller::next_internal() const {
  TimePoint t = TimePoint::max();
  if (!edges_.empty()) t = std::min(t, edges_.begin()->first);
  if (!arrivals_.empty()) t = std::min(t, arrivals_.front().t);
  if (!datagrams_.empty()) t = std::min(t, datagrams_.front().t);
  if (silent_) return t;
  if (conversions_left_ > 0) t = std::min(t, next_conversion_);
  if (gun_moves_) t = std::min(t, gun_at_ + kGunStep);
  t = std::min(t, relay_at_);
  const std::uint32_t now = ticks(now_);
  t = std::min(t, when(sensor_wait(&sensor_, now, false)));
  return std::min(t, std::max(tx_free_, when(sensor_wait(&sensor_, now, true))));
}

void Microcontroller::advance(TimePoint t) {
  for (TimePoint next = next_internal(); next <= t; next = next_internal()) {
    now_ = std::max(now_, next);
    process(now_);
  }
  now_ = std::max(now_, t);
}

void Microcontroller::run(TimePoint t) {
  if (silent_) return;
  host_link_run(&link_, ticks(t));
  if (conversions_left_ > 0 && next_conversion_ <= t) convert(t);
  sensor_run(&sensor_, ticks(t));
  follow_test();
  drive_relay(t);
  follow_output(t);
}

void Microcontroller::hear(TimePoint t) {
  while (!arrivals_.empty() && arrivals_.front().t <= t) {
    const Arrival arrival = arrivals_.front();
    arrivals_.pop_front();
    if (!silent_) sensor_on_byte(&sensor_, arrival.byte, ticks(arrival.t));
  }
  while (!datagrams_.empty() && datagrams_.front().t <= t) {
    const Datagram datagram = std::move(datagrams_.front());
    datagrams_.pop_front();
    if (silent_) continue;
    host_link_take(&link_, &datagram.from, datagram.bytes.data(),
                   static_cast<std::uint16_t>(std::min(datagram.bytes.size(), kMostBytes)),
                   ticks(datagram.t));
  }
}

void Microcontroller::process(TimePoint t) {
  move_gun(t);
  if (relay_at_ <= t) {
    move_relay(t);
    settle(t);
  }
  run(t);  // a due sample uses the level before the edge
  while (!edges_.empty() && edges_.begin()->first <= t) {
    const auto [at, closed] = *edges_.begin();
    edges_.erase(edges_.begin());
    circuit_.touching = closed;
    settle(at);
  }
  hear(t);
  run(t);
  if (!silent_) transmit(t);
}

void Microcontroller::transmit(TimePoint t) {
  if (t < tx_free_) return;  // only at a frame boundary
  Output output;
  std::uint32_t start = 0;
  const std::uint32_t now = ticks(t);
  output.frame.size = sensor_next_frame(&sensor_, now, output.frame.data.data(), &start);
  if (output.frame.size == 0) return;
  tx_free_ = (start == now ? t : when(start - now)) +
             byte_time() * static_cast<std::int64_t>(output.frame.size);
  output.t = tx_free_;
  output.to = link_.host;
  // Without a HELLO there is no destination address.
  if (!options_.datagrams || link_.there) output_.push_back(output);
}

std::optional<Microcontroller::Output> Microcontroller::next_output() {
  if (output_.empty() || output_.front().t > now_) return std::nullopt;
  const Output output = output_.front();
  output_.pop_front();
  return output;
}

CircuitVoltages TouchCircuit::voltages(std::optional<double> gun_v) const {
  const CircuitVoltages at = as_it_is(*this, gun_v);
  return {feed_reads_v.value_or(at.feed_v), sense_reads_v.value_or(at.sense_v),
          earth_reads_v.value_or(at.earth_v)};
}

bool TouchCircuit::pin_high(bool before, std::optional<double> gun_v) const {
  const double sense_v = as_it_is(*this, gun_v).sense_v;
  if (capture_joint_open || (sense_v > board.low_v && sense_v < board.high_v)) return before;
  return sense_v >= board.high_v;
}

double TouchCircuit::gun_at_rest_v() const { return network_of(*this).solve()[kGun]; }

double TouchCircuit::gun_after_v(double from_v, double seconds) const {
  Network net = network_of(*this);
  const double rest_v = net.solve()[kGun];
  Network pulled = network_of(*this);
  pulled.drain(kGun, -1.0);  // one ampere: yields the resistance seen by the capacitor
  const double ohm = pulled.solve()[kGun] - rest_v;
  return rest_v + (from_v - rest_v) * std::exp(-seconds / (ohm * gun_farad));
}

}  // namespace cellcal::sim
