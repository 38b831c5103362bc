#include "sim/mcu/microcontroller.h"

#include <algorithm>
#include <cmath>

namespace cellcal::sim {

namespace ctp = drivers::ctp;

namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::nanoseconds;

constexpr milliseconds kIdleStatus{CTP_IDLE_STATUS_MS};
constexpr milliseconds kKeepAliveLimit{CTP_KEEPALIVE_LIMIT_MS};
constexpr milliseconds kRepeatMin{CTP_REPEAT_MIN_MS};
constexpr std::chrono::seconds kSelfTestMaxAge{CTP_SELF_TEST_MAX_AGE_S};
constexpr milliseconds kSelfTest{CTP_SELF_TEST_MS};
constexpr microseconds kSelfTestPull{CTP_SELF_TEST_PULL_US};
constexpr milliseconds kMaxConfirm{CTP_CONFIRM_MAX_MS};
/// The real one keeps its events in a few hundred bytes.
constexpr std::size_t kMaxEvents = 8;
constexpr std::size_t kMaxNaks = 4;
constexpr std::size_t kMaxPongs = 4;
constexpr std::uint32_t kClockHz = 16'000'000;
constexpr std::uint16_t kBrokenMv = 0;  // pulled down, no current

}  // namespace

Microcontroller::Microcontroller(const McuOptions& options, TimePoint power_on)
    : options_(options),
      now_(power_on),
      clock_from_(power_on),
      first_ticks_(options.first_ticks),
      boot_id_(options.boot_id),
      rx_free_(power_on),
      tx_free_(power_on),
      next_status_(power_on + kIdleStatus) {
  announce(0);
}

void Microcontroller::announce(std::uint32_t nonce) { ident_nonce_ = nonce; }

std::uint32_t Microcontroller::ticks(TimePoint t) const {
  const double ns = static_cast<double>(nanoseconds(t - clock_from_).count());
  const double count = std::floor(ns / int{CTP_TICK_NS} * (1.0 + options_.drift_ppm * 1e-6));
  return first_ticks_ + static_cast<std::uint32_t>(static_cast<std::int64_t>(count));
}

Duration Microcontroller::byte_time() const {
  return nanoseconds{std::int64_t{1'000'000'000} * CTP_BITS_PER_BYTE / options_.baud};
}

Duration Microcontroller::frame_time(std::size_t payload) const {
  return byte_time() * static_cast<std::int64_t>(payload + CTP_OVERHEAD);
}

Duration Microcontroller::repeat_time() const {
  const Duration frame = frame_time(CTP_EVENT_SIZE);
  const Duration round_trip = frame + frame_time(CTP_ACK_SIZE) + options_.turnaround;
  return std::max<Duration>(kRepeatMin, 3 * frame + round_trip);
}

bool Microcontroller::level() const {
  if (faults_.wire_broken) return true;
  if (faults_.stuck_open) return false;
  return closed_ || pulled_until_.has_value();
}

std::uint16_t Microcontroller::sense_mv() const {
  if (faults_.sense_mv) return *faults_.sense_mv;
  if (faults_.wire_broken) return kBrokenMv;
  return level() ? options_.contact_mv : options_.open_mv;
}

void Microcontroller::edge(TimePoint t, bool closed) { edges_.emplace(t, closed); }

void Microcontroller::receive(std::span<const std::uint8_t> bytes, TimePoint t) {
  rx_free_ = std::max(rx_free_, t);
  for (const std::uint8_t byte : bytes) {
    rx_free_ += byte_time();
    arrivals_.push_back({rx_free_, byte});
  }
}

void Microcontroller::set_faults(const McuFaults& faults, TimePoint t) {
  advance(t);
  faults_ = faults;
  on_edge(t);
}

void Microcontroller::set_drift(double ppm, TimePoint t) {
  advance(t);
  first_ticks_ = ticks(t);
  clock_from_ = t;
  options_.drift_ppm = ppm;
}

void Microcontroller::reset(TimePoint t, std::uint8_t cause) {
  advance(t);
  Microcontroller fresh(options_, t);
  fresh.boot_id_ = boot_id_ + 1;
  fresh.first_ticks_ = 0;
  fresh.reset_cause_ = cause;
  fresh.faults_ = faults_;
  fresh.closed_ = closed_;
  fresh.edges_ = edges_;
  fresh.arrivals_ = arrivals_;
  fresh.rx_free_ = rx_free_;
  fresh.repeats_ = repeats_;
  // What already was on the wire has left; the half frame of this moment is lost with the reset.
  for (const Output& o : output_) {
    if (o.t <= t) fresh.output_.push_back(o);
  }
  *this = fresh;
  on_edge(t);
}

// Time --------------------------------------------------------------------------------------------

TimePoint Microcontroller::next_event() const {
  TimePoint t = next_internal();
  if (!output_.empty()) t = std::min(t, output_.front().t);
  return std::max(t, now_);
}

TimePoint Microcontroller::next_internal() const {
  TimePoint t = TimePoint::max();
  if (!edges_.empty()) t = std::min(t, edges_.begin()->first);
  if (!arrivals_.empty()) t = std::min(t, arrivals_.front().t);
  if (faults_.silent) return t;
  if (candidate_) t = std::min(t, candidate_->next_sample);
  if (self_test_until_) t = std::min(t, *self_test_until_);
  if (pulled_until_) t = std::min(t, *pulled_until_);
  if (armed()) t = std::min({t, arm_until_, keepalive_until_});
  TimePoint send = next_status_;
  if (trip_ || status_due_ || ident_nonce_ || !naks_.empty() || !pongs_.empty()) send = tx_free_;
  for (const PendingEvent& event : events_) send = std::min(send, event.due);
  return std::min(t, std::max(send, tx_free_));
}

void Microcontroller::advance(TimePoint t) {
  for (TimePoint next = next_internal(); next <= t; next = next_internal()) {
    now_ = std::max(now_, next);
    process(now_);
  }
  now_ = std::max(now_, t);
}

void Microcontroller::process(TimePoint t) {
  while (!edges_.empty() && edges_.begin()->first <= t) {
    const auto [when, closed] = *edges_.begin();
    // A sample due before the edge still sees the level from before it.
    while (candidate_ && candidate_->next_sample <= when) on_sample(candidate_->next_sample);
    edges_.erase(edges_.begin());
    closed_ = closed;
    on_edge(when);
  }
  while (candidate_ && candidate_->next_sample <= t) on_sample(candidate_->next_sample);
  while (!arrivals_.empty() && arrivals_.front().t <= t) on_wire_byte(arrivals_.front().t);
  if (faults_.silent) return;
  check_deadlines(t);
  transmit(t);
}

void Microcontroller::check_deadlines(TimePoint t) {
  if (pulled_until_ && *pulled_until_ <= t) {
    pulled_until_.reset();
    on_edge(t);
  }
  if (self_test_until_ && *self_test_until_ <= t) finish_self_test(t);
  if (armed() && (arm_until_ <= t || keepalive_until_ <= t)) {
    disarm();
    status_due_ = true;
  }
}

void Microcontroller::on_wire_byte(TimePoint t) {
  const std::uint8_t byte = arrivals_.front().byte;
  arrivals_.pop_front();
  if (faults_.silent) return;
  if (const ctp::Frame* frame = reader_.feed(byte)) on_frame(*frame, t);
}

// The touch circuit -------------------------------------------------------------------------------

void Microcontroller::on_edge(TimePoint t) {
  const bool now_closed = level();
  if (now_closed == seen_level_) return;
  seen_level_ = now_closed;
  if (faults_.silent) return;
  if (self_test_until_) {  // its own edge, or one that is looked at when the test is over
    self_test_saw_edge_ = true;
    return;
  }
  if (candidate_) {
    if (now_closed == candidate_->target) ++candidate_->bounces;
    return;
  }
  if (now_closed == contact_) return;
  candidate_ = Candidate{};
  candidate_->first = t;
  candidate_->target = now_closed;
  candidate_->next_sample = t + microseconds{config_.sample_us};
  if (!now_closed) {
    candidate_->arm_id = contact_arm_id_;
  } else if (armed()) {
    trip_ = ctp::Trip{arm_id_, ticks(t)};
    candidate_->arm_id = arm_id_;
    disarm();
    latched_ = true;
  }
}

void Microcontroller::on_sample(TimePoint t) {
  Candidate& c = *candidate_;
  c.next_sample += microseconds{config_.sample_us};
  if (seen_level_ == c.target) {
    ++c.hits;
    c.misses = 0;
  } else {
    ++c.misses;
    c.hits = 0;
  }
  const bool accepted = c.hits >= config_.confirm_samples;
  const bool dismissed = c.misses >= config_.confirm_samples || t - c.first > kMaxConfirm;
  if (!accepted && !dismissed) return;
  const Candidate done = c;
  candidate_.reset();
  if (accepted) {
    contact_ = done.target;
    if (contact_) contact_arm_id_ = done.arm_id;
    raise(done.target ? CTP_CONTACT : CTP_RELEASE, done, t);
  } else if (done.target && done.arm_id != 0) {
    raise(CTP_REVOKED, done, t);
  }
  status_due_ = true;
  // Dismissed after a long rattle the input may stand at the other level: begin anew.
  if (dismissed && !accepted && seen_level_ != contact_) {
    seen_level_ = contact_;
    on_edge(t);
  }
}

void Microcontroller::raise(std::uint8_t type, const Candidate& c, TimePoint t) {
  const auto dt = std::chrono::duration_cast<microseconds>(t - c.first).count();
  ctp::Event event;
  event.event = ++last_event_;
  event.arm_id = c.arm_id;
  event.t_first = ticks(c.first);
  event.dt_confirm_us = static_cast<std::uint16_t>(std::min<std::int64_t>(dt, 0xFFFF));
  event.bounces = static_cast<std::uint8_t>(std::min(c.bounces, 0xFF));
  event.level = seen_level_ ? 1 : 0;
  event.sense_mv = sense_mv();
  if (events_.size() >= kMaxEvents) events_.pop_front();
  events_.push_back({type, event, t, false});
}

void Microcontroller::disarm() {
  if (arm_id_ != 0) used_arm_id_ = arm_id_;
  arm_id_ = 0;
}

// Conversation ------------------------------------------------------------------------------------

void Microcontroller::nak(std::uint8_t of_type, std::uint8_t reason) {
  if (naks_.size() < kMaxNaks) naks_.push_back({of_type, reason});
}

void Microcontroller::on_frame(const ctp::Frame& frame, TimePoint t) {
  switch (frame.type) {
    case CTP_HELLO:
      on_hello(ctp::read<ctp::Hello>(frame));
      break;
    case CTP_CONFIG:
      on_config(ctp::read<ctp::Config>(frame));
      break;
    case CTP_ARM:
      on_arm(ctp::read<ctp::Arm>(frame), t);
      break;
    case CTP_DISARM:
      if (ctp::read<ctp::Disarm>(frame).arm_id == arm_id_) disarm();
      status_due_ = true;
      break;
    case CTP_ACK: {
      const std::uint16_t id = ctp::read<ctp::Ack>(frame).event;
      std::erase_if(events_, [id](const PendingEvent& e) { return e.sent && e.event.event == id; });
      break;
    }
    case CTP_PING:
      if (pongs_.size() < kMaxPongs) {
        pongs_.push_back({ctp::read<ctp::Ping>(frame).nonce, ticks(t)});
      }
      break;
    case CTP_SELFTEST:
      on_self_test(t);
      break;
    case CTP_KEEPALIVE:
      keepalive_until_ = t + kKeepAliveLimit;
      break;
    default:
      break;
  }
}

void Microcontroller::on_hello(const ctp::Hello& hello) {
  disarm();
  events_.clear();
  trip_.reset();
  used_arm_id_ = 0;
  latched_ = false;
  greeted_ = hello.min <= options_.version && options_.version <= hello.max;
  announce(hello.nonce);
  if (!greeted_) nak(CTP_HELLO, CTP_NAK_BAD_VERSION);
}

void Microcontroller::on_config(const ctp::Config& config) {
  const bool good = config.confirm_samples > 0 && config.sample_us > 0 && config.heartbeat_ms > 0 &&
                    config.open_mv > config.contact_mv && config.polarity <= CTP_CONTACT_IS_HIGH &&
                    // or nothing would ever be confirmed
                    config.confirm_samples * microseconds{config.sample_us} <= kMaxConfirm;
  if (!greeted_ || !good) {
    nak(CTP_CONFIG, greeted_ ? CTP_NAK_BAD_ARGUMENT : CTP_NAK_BAD_VERSION);
    return;
  }
  disarm();
  config_ = config;
  config_crc_ = ctp::config_crc(config);
  status_due_ = true;
}

void Microcontroller::on_arm(const ctp::Arm& arm, TimePoint t) {
  const bool again = armed() && arm.arm_id == arm_id_;
  if (!again) {
    const std::uint16_t mv = sense_mv();
    std::uint8_t reason = 0;
    if (!greeted_ || config_crc_ == CTP_CONFIG_NONE) {
      reason = greeted_ ? CTP_NAK_BAD_ARGUMENT : CTP_NAK_BAD_VERSION;
    } else if (arm.arm_id == 0 || arm.lifetime_ms == 0 || arm.arm_id == used_arm_id_) {
      reason = CTP_NAK_BAD_ARGUMENT;
    } else if (!loop_ok_ && self_test_at_ != TimePoint{}) {
      reason = CTP_NAK_LOOP_BROKEN;
    } else if (self_test_until_) {
      reason = CTP_NAK_SELF_TEST_OLD;
    } else if (seen_level_ || contact_ || mv <= config_.contact_mv) {
      reason = CTP_NAK_IN_CONTACT;
    } else if (mv > config_.contact_mv && mv < config_.open_mv) {
      reason = CTP_NAK_VOLTAGE_UNDEFINED;
    } else if (!self_test_ok_ || t - self_test_at_ > kSelfTestMaxAge) {
      reason = CTP_NAK_SELF_TEST_OLD;
    }
    if (reason != 0) {
      nak(CTP_ARM, reason);
      return;
    }
    disarm();
    arm_id_ = arm.arm_id;
    arm_until_ = t + milliseconds{arm.lifetime_ms};
    keepalive_until_ = t + kKeepAliveLimit;
    latched_ = false;
  }
  status_due_ = true;
}

void Microcontroller::on_self_test(TimePoint t) {
  if (armed() || self_test_until_ || candidate_) {
    nak(CTP_SELFTEST, CTP_NAK_BAD_ARGUMENT);
    return;
  }
  self_test_saw_edge_ = false;
  self_test_until_ = t + kSelfTest;
  if (!contact_) {
    pulled_until_ = t + kSelfTestPull;
    self_test_ok_ = false;
    on_edge(t);
  }
  status_due_ = true;
}

void Microcontroller::finish_self_test(TimePoint t) {
  self_test_until_.reset();
  self_test_at_ = t;
  loop_ok_ = !faults_.wire_broken;
  if (!contact_) self_test_ok_ = loop_ok_ && self_test_saw_edge_;
  if (!loop_ok_) self_test_ok_ = false;
  status_due_ = true;
  // What happened meanwhile is taken as an edge of this moment.
  seen_level_ = contact_;
  on_edge(t);
}

// Output ------------------------------------------------------------------------------------------

std::uint8_t Microcontroller::flags() const {
  unsigned f = 0;
  if (contact_) f |= CTP_FLAG_CONTACT;
  if (armed()) f |= CTP_FLAG_ARMED;
  if (latched_) f |= CTP_FLAG_LATCHED;
  if (loop_ok_) f |= CTP_FLAG_LOOP_OK;
  if (self_test_ok_) f |= CTP_FLAG_SELF_TEST_OK;
  return static_cast<std::uint8_t>(f);
}

template <class Payload>
void Microcontroller::start_frame(const Payload& payload, std::uint8_t type, TimePoint t) {
  const ctp::WireBytes wire = ctp::build(payload, tx_seq_++, type);
  tx_free_ = t + byte_time() * static_cast<std::int64_t>(wire.size);
  output_.push_back({tx_free_, wire});
}

void Microcontroller::transmit(TimePoint t) {
  if (t < tx_free_) return;  // only at a frame boundary
  if (trip_) {
    start_frame(*trip_, CTP_TRIP, t);
    trip_.reset();
    return;
  }
  for (PendingEvent& event : events_) {
    if (event.due > t) continue;
    start_frame(event.event, event.type, t);
    if (event.sent) ++repeats_;
    event.sent = true;
    event.due = t + repeat_time();
    return;
  }
  if (ident_nonce_) {
    ctp::Ident ident;
    ident.version = options_.version;
    ident.firmware = options_.firmware;
    ident.uid = options_.uid;
    ident.boot_id = boot_id_;
    ident.clock_hz = kClockHz;
    ident.reset_cause = reset_cause_;
    ident.nonce = *ident_nonce_;
    ident.config_crc = config_crc_;
    start_frame(ident, CTP_IDENT, t);
    ident_nonce_.reset();
    return;
  }
  if (!naks_.empty()) {
    start_frame(naks_.front(), CTP_NAK, t);
    naks_.pop_front();
    return;
  }
  if (!pongs_.empty()) {  // built for the instant at which it will begin
    const TimePoint begin = t + options_.turnaround;
    start_frame(ctp::Pong{pongs_.front().nonce, pongs_.front().t_rx, ticks(begin)}, CTP_PONG,
                begin);
    pongs_.pop_front();
    return;
  }
  if (status_due_ || t >= next_status_) {
    const auto& wire = reader_.counters();
    ctp::Status status;
    status.t = ticks(t);
    status.flags = flags();
    status.last_event = last_event_;
    status.errors = static_cast<std::uint8_t>(wire.crc_errors + wire.malformed + wire.oversize);
    status.sense_mv = sense_mv();
    status.config_crc = config_crc_;
    start_frame(status, CTP_STATUS, t);
    status_due_ = false;
    next_status_ = t + (armed() ? Duration{milliseconds{config_.heartbeat_ms}} : kIdleStatus);
  }
}

std::optional<Microcontroller::Output> Microcontroller::next_output() {
  if (output_.empty() || output_.front().t > now_) return std::nullopt;
  const Output output = output_.front();
  output_.pop_front();
  return output;
}

}  // namespace cellcal::sim
