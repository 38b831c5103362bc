#include "drivers/contact/contact_core.h"

#include <cmath>
#include <utility>

namespace cellcal::drivers {

namespace {

using std::chrono::milliseconds;

constexpr milliseconds kHelloPeriod{200};
/// Polling period of a refused or refusing sensor, to detect new firmware.
constexpr milliseconds kRefusedPeriod{2000};
constexpr milliseconds kConfigPeriod{100};
/// Uncertainty of an event before the clock map is valid.
constexpr double kNoClockSigmaS = 1.0;
/// Tolerance, in addition to the map's sigma, for a first edge in the future.
constexpr double kFutureSlackS = 1e-3;
constexpr double kFutureSigmas = 5.0;
/// An edge is visible in the heartbeats immediately, its level once confirmed; within this time
/// both may be outdated.
constexpr double kDeniedSlackS = 1e-3;
/// Weight of the newest heartbeat in the jitter.
constexpr double kJitterGain = 0.02;
constexpr int kAnswerFrames = 8;
constexpr int kLongestFrame = CTP_MAX_WIRE;
constexpr int kPingFrame = int{CTP_PING_SIZE} + int{CTP_OVERHEAD};
constexpr int kStatusFrame = int{CTP_STATUS_SIZE} + int{CTP_OVERHEAD};
constexpr milliseconds kAnswerFloor{20};
/// Maximum plausible delay in this computer; an older stamp belongs to another clock.
constexpr double kLatestPlausibleS = 10.0;
/// Sigmas of the clock map that are subtracted from a delay before it counts as late.
constexpr double kLateSigmas = 3.0;
/// A delay explains a silence only if it is this share of it: a sensor may be late as well.
constexpr double kLateShare = 1.0 / 3.0;
/// A sensor with the same baud rate is recognised long before: it sends ten times a second.
constexpr milliseconds kGarbageTimeout{1500};
constexpr std::uint64_t kGarbageBytes = 12;

double wire_seconds(int baud, int bytes) {
  return static_cast<double>(bytes * CTP_BITS_PER_BYTE) / baud;
}

BoardFlaws flaws_of(const ctp::Board& board) {
  // Fuses of the ATmega328P; programmed bits are 0.
  constexpr unsigned kStartsLoader = 0x01, kBrownOut = 0x07, kBrownOut4V3 = 0x04;
  constexpr int kFirstOptiboot = 4, kLastOptiboot = 9;  // major version, the upper byte
  const int major = board.loader >> 8;
  const bool optiboot = major >= kFirstOptiboot && major <= kLastOptiboot;
  BoardFlaws flaws;
  flaws.known = true;
  flaws.old_loader = (board.fuses_high & kStartsLoader) == 0 && !optiboot;
  flaws.weak_brown_out = (board.fuses_extended & kBrownOut) != kBrownOut4V3;
  return flaws;
}

}  // namespace

ContactCore::ContactCore(const ContactOptions& options, ByteSink sink)
    : options_(options),
      sink_(std::move(sink)),
      config_crc_(ctp::config_crc(options.wire)),
      answer_time_(kAnswerFloor +
                   from_seconds(kAnswerFrames * wire_seconds(options.baud, kLongestFrame))),
      reader_(ctp::Direction::kFromSensor,
              options.datagrams ? ctp::Order::kAnyhow : ctp::Order::kKept),
      clock_(wire_seconds(options.baud, kPingFrame)),
      clock_before_(clock_),
      status_wire_s_(wire_seconds(options.baud, kStatusFrame)) {}

std::uint32_t ContactCore::random() {  // xorshift32 (Marsaglia 2003): only needs to be irregular
  random_ ^= random_ << 13;
  random_ ^= random_ >> 17;
  random_ ^= random_ << 5;
  return random_;
}

void ContactCore::connect(TimePoint now) {
  forget_session();
  reader_.resync();
  ident_.reset();
  board_ = {};
  was_ready_ = heard_ = false;
  fault_ = ContactFault::kNone;
  bytes_ = late_count_ = 0;
  late_worst_s_ = 0.0;
  settle_delivery();
  clock_before_.reset();
  last_frame_ = now;
  random_ = static_cast<std::uint32_t>(now.time_since_epoch().count()) | 1u;
  // Terminates a partial frame left in the sensor's buffer.
  const std::uint8_t delimiter = 0;
  sink_({&delimiter, 1});
  enter(ContactStep::kHello, now);
  on_tick_but_ping(now);
}

void ContactCore::disconnect(TimePoint now) {
  if (options_.relay && step_ > ContactStep::kHello) send(ctp::Relay{0});
  end_arming(ArmEnd::kLinkLost, now);
  forget_session();
  fault_ = ContactFault::kNone;
  enter(ContactStep::kClosed, now);
}

void ContactCore::forget_session() {
  arming_ = Arming::kNone;
  waiting_.reset();
  test_ = Test::kNone;
  test_wanted_ = test_passed_ = touching_ = false;
  clock_.reset();
  ping_out_ = false;
  status_.reset();
  in_contact_.reset();
  said_ = {};
  said_late_s_ = 0.0;
  open_ticks_.reset();
  armed_ticks_.reset();
  relay_.reset();
  seen_.clear();
  newest_event_.reset();
  delay_mean_s_ = delay_var_s2_ = 0.0;
}

void ContactCore::enter(ContactStep step, TimePoint now) {
  step_ = step;
  step_since_ = next_send_ = next_test_ = now;
  if (step == ContactStep::kClock) next_ping_ = relay_asked_ = relay_next_ = now;
}

void ContactCore::identify_again(ContactFault fault, TimePoint now) {
  end_arming(ArmEnd::kLinkLost, now);
  forget_session();
  fault_ = fault;
  enter(ContactStep::kHello, now);
}

void ContactCore::lose_state(TimePoint now) {
  // Before the first ready state nothing is lost: opening the port resets some boards.
  identify_again(was_ready_ ? ContactFault::kLostState : ContactFault::kNone, now);
  reader_.resync();
}

void ContactCore::on_bytes(std::span<const std::uint8_t> bytes, TimePoint t_rx, TimePoint arrived) {
  if (step_ == ContactStep::kClosed) return;
  bytes_ += bytes.size();
  for (const std::uint8_t byte : bytes) {
    if (const ctp::Frame* frame = reader_.feed(byte)) on_frame(*frame, t_rx, arrived);
  }
  on_tick_but_ping(t_rx);
}

void ContactCore::on_frame(const ctp::Frame& frame, TimePoint t_rx, TimePoint arrived) {
  heard_ = true;
  last_frame_ = t_rx;
  switch (frame.type) {
    case CTP_IDENT: on_ident(ctp::read<ctp::Ident>(frame), t_rx); break;
    case CTP_STATUS: on_status(ctp::read<ctp::Status>(frame), t_rx); break;
    case CTP_TRIP: on_trip(ctp::read<ctp::Trip>(frame), frame.seq, t_rx); break;
    case CTP_CONTACT:
    case CTP_REVOKED:
    case CTP_RELEASE: on_event(frame, t_rx); break;
    case CTP_PONG: on_pong(ctp::read<ctp::Pong>(frame), t_rx, arrived); break;
    case CTP_NAK: on_nak(ctp::read<ctp::Nak>(frame), t_rx); break;
    case CTP_BOARD: board_ = flaws_of(ctp::read<ctp::Board>(frame)); break;
    case CTP_RELAY_STATE: on_relay(ctp::read<ctp::RelayState>(frame), t_rx); break;
    default:  // LOG: diagnostic text; shows only that the sensor is alive
      break;
  }
}

void ContactCore::on_ident(const ctp::Ident& ident, TimePoint now) {
  const bool other_boot = ident_ && ident_->boot_id != ident.boot_id;
  const bool asked = step_ == ContactStep::kHello && ident.nonce == hello_nonce_;
  if (fault_ == ContactFault::kLostState) {
    ident_ = ident;
    return;
  }
  if (!asked) {
    if (other_boot && step_ != ContactStep::kHello) {
      ident_ = ident;
      lose_state(now);
    }
    if (step_ == ContactStep::kHello && ident.nonce == 0) next_send_ = now;  // it has just started
    return;
  }
  ident_ = ident;
  if (ident.version != CTP_VERSION) {
    fault_ = ContactFault::kVersion;
    next_send_ = now + kRefusedPeriod;
    return;
  }
  if (other_boot && was_ready_) {
    lose_state(now);
    return;
  }
  fault_ = ContactFault::kNone;
  seen_.clear();
  newest_event_.reset();
  enter(ContactStep::kConfig, now);
}

/// The origin of the silence is not yet known: late bytes may still arrive, with their time of
/// transmission.
void ContactCore::time_out_silence(Duration limit, TimePoint now) {
  if (given_up_at_) return;
  given_up_at_ = now;
  silent_since_ = last_frame_;
  given_up_limit_ = limit;
  delivered_late_s_ = 0.0;  // of an earlier silence
  clock_before_ = clock_;
}

void ContactCore::settle_delivery() {
  given_up_at_.reset();
  delivered_late_s_ = 0.0;
}

void ContactCore::note_delivery(std::uint32_t ticks, TimePoint now) {
  const ClockMap& map = given_up_at_ ? clock_before_ : clock_;
  if (!map.valid()) return;
  const TimePoint sent = map.to_host(ticks) + from_seconds(status_wire_s_);
  const double late = std::max(0.0, seconds(now - sent));
  if (late > kLatestPlausibleS) return;
  late_s_[late_count_++ % kLateKept] = static_cast<float>(late);
  late_times_.add(late);
  late_worst_s_ = std::max(late_worst_s_, late);
  if (given_up_at_) {
    const double limit = seconds(given_up_limit_);
    if (sent < *given_up_at_ && late > kLateShare * limit) {
      ++deliveries_late_;
      delivered_late_s_ = std::max(late, seconds(now - silent_since_));
      late_limit_s_ = limit;
      if (last_end_ == ArmEnd::kSilence) note_end(ArmEnd::kDeliveredLate);
      if (fault_ == ContactFault::kSilent) fault_ = ContactFault::kDeliveredLate;
    } else {
      ++silences_;
    }
    given_up_at_.reset();
  } else if (const double sure = late - kLateSigmas * map.sigma_s(ticks);
             sure > seconds(kHeartbeatLimit)) {
    ++deliveries_late_;
    if (arming_ != Arming::kArmed || sure <= seconds(silence_limit_)) return;
    // Received data is old, however regularly it arrives: a trip would be equally late.
    delivered_late_s_ = late;
    late_limit_s_ = seconds(silence_limit_);
    end_arming(ArmEnd::kDeliveredLate, now);
    begin_disarm(now);
  }
}

void ContactCore::on_status(const ctp::Status& status, TimePoint now) {
  note_delivery(status.t, now);
  if (step_ == ContactStep::kConfig && status.config_crc == config_crc_) {
    enter(ContactStep::kClock, now);
  }
  if (step_ <= ContactStep::kConfig) return;
  if (status.config_crc != config_crc_) {  // restarted or reconfigured: IDENT will show
    identify_again(ContactFault::kNone, now);
    return;
  }
  status_ = status;
  const bool contact = (status.flags & CTP_FLAG_CONTACT) != 0;
  if (contact && in_contact_ != true) contact_since_ = now;
  in_contact_ = contact;
  newest_event_ = status.last_event;
  note_level(status.t, now);
  if (!contact) open_ticks_ = status.t;
  if ((status.flags & (CTP_FLAG_ARMED | CTP_FLAG_LATCHED)) == CTP_FLAG_ARMED)
    armed_ticks_ = status.t;
  if (clock_.valid()) {
    const double delay = seconds(now - clock_.to_host(status.t));
    const double off = delay - delay_mean_s_;
    if (delay_mean_s_ == 0.0) {
      delay_mean_s_ = delay;
    } else {
      delay_mean_s_ += kJitterGain * off;
      delay_var_s2_ += kJitterGain * (off * off - delay_var_s2_);
    }
  }
  on_status_arming((status.flags & CTP_FLAG_ARMED) != 0, (status.flags & CTP_FLAG_LATCHED) != 0,
                   now);
  on_status_test(status, now);
}

void ContactCore::on_trip(const ctp::Trip& trip, std::uint8_t sequence, TimePoint now) {
  use_up_arming(trip.arm_id, now);
  ContactRecord record;
  record.kind = ContactEventKind::kTrip;
  record.arm_id = trip.arm_id;
  record.sequence = sequence;
  record.ticks = trip.t;
  push_event(record, now);
}

void ContactCore::on_event(const ctp::Frame& frame, TimePoint now) {
  const ctp::Event event = ctp::read<ctp::Event>(frame);
  send(ctp::Ack{event.event});  // also for a known event: the first ACK may be lost
  if (seen_.contains(event.event)) return;
  seen_.push(event.event);
  bounces_ += event.bounces;
  // Repeated after a newer one, or after a heartbeat, it does not change the level.
  const bool newest = !newest_event_ || static_cast<std::int16_t>(event.event - *newest_event_) > 0;
  if (newest) newest_event_ = event.event;
  ContactRecord record;
  record.kind = ContactEventKind::kRevoked;
  record.arm_id = event.arm_id;
  record.sequence = frame.seq;
  record.event = event.event;
  record.ticks = event.t_first;
  record.confirmed_after_us = event.dt_confirm_us;
  record.bounces = event.bounces;
  record.sense_v = event.sense_mv * 1e-3;
  if (frame.type == CTP_CONTACT) {
    record.kind = ContactEventKind::kContact;
    contact_v_ = record.sense_v;
  } else if (frame.type == CTP_RELEASE) {
    record.kind = ContactEventKind::kRelease;
  }
  if (newest && record.kind != ContactEventKind::kRevoked) {
    in_contact_ = record.kind == ContactEventKind::kContact;
    if (*in_contact_) contact_since_ = now;
    note_level(event.t_first, now);
  }
  if (record.kind != ContactEventKind::kRelease) use_up_arming(event.arm_id, now);
  push_event(record, now);
}

void ContactCore::note_level(std::uint32_t ticks, TimePoint now) {
  said_ = clock_.valid() ? std::min(now, clock_.to_host(ticks)) : now;
  said_late_s_ = seconds(now - said_);
}

double ContactCore::denied_s(const ContactRecord& contact) const {
  const auto behind_s = [&](const std::optional<std::uint32_t>& ticks, double after_s) {
    if (!ticks) return 0.0;
    const auto since = static_cast<std::int32_t>(*ticks - contact.ticks);
    const double later_s = static_cast<double>(since) / CTP_TICKS_PER_S;
    return later_s - after_s > kDeniedSlackS ? later_s : 0.0;
  };
  const double confirmed_s = contact.confirmed_after_us * 1e-6;
  return std::max(behind_s(open_ticks_, confirmed_s), behind_s(armed_ticks_, 0.0));
}

void ContactCore::push_event(ContactRecord record, TimePoint now) {
  record.heard = record.first_edge = now;
  record.time_sigma_s = kNoClockSigmaS;
  if (clock_.valid()) {
    const TimePoint edge = clock_.to_host(record.ticks);
    const double sigma = clock_.sigma_s(record.ticks);
    const double ahead = seconds(edge - now);
    if (ahead <= kFutureSlackS + kFutureSigmas * sigma) {
      record.first_edge = edge;
      record.time_sigma_s = sigma;
    } else {
      record.time_sigma_s = std::max(sigma, ahead);
    }
  }
  record.lost = lost_records_;
  if (!records_.push(record)) ++lost_records_;
  const ContactEvent event{
      record.kind,       record.arm_id,
      record.first_edge, record.time_sigma_s,
      record.bounces,    record.kind == ContactEventKind::kContact ? denied_s(record) : 0.0};
  if (!events_.push(event)) ++lost_events_;
}

void ContactCore::on_nak(const ctp::Nak& nak, TimePoint now) {
  if (nak.of_type == CTP_HELLO && nak.reason == CTP_NAK_BAD_VERSION &&
      step_ == ContactStep::kHello) {
    fault_ = ContactFault::kVersion;
    next_send_ = now + kRefusedPeriod;
  } else if (nak.of_type == CTP_CONFIG && step_ == ContactStep::kConfig) {
    fault_ = ContactFault::kConfigRefused;
    next_send_ = now + kRefusedPeriod;
  } else if (nak.of_type == CTP_ARM && arming_ == Arming::kAsking) {
    ArmRefusal why = ArmRefusal::kUnknownReason;
    switch (nak.reason) {
      case CTP_NAK_IN_CONTACT: why = ArmRefusal::kInContact; break;
      case CTP_NAK_LOOP_BROKEN: why = ArmRefusal::kLoopBroken; break;
      case CTP_NAK_VOLTAGE_UNDEFINED: why = ArmRefusal::kVoltageUndefined; break;
      case CTP_NAK_SELF_TEST_OLD: why = ArmRefusal::kSelfTestOld; break;
      case CTP_NAK_BAD_ARGUMENT: why = ArmRefusal::kBadArgument; break;
      case CTP_NAK_BAD_VERSION: why = ArmRefusal::kBadVersion; break;
      default: break;
    }
    arming_ = Arming::kNone;
    answer(why, request_.arm_id, now);
  }
}

void ContactCore::on_tick(TimePoint now) {
  if (step_ == ContactStep::kClosed) return;
  tick_ping(now);  // first, so that nothing precedes it on the wire
  on_tick_but_ping(now);
}

void ContactCore::on_tick_but_ping(TimePoint now) {
  if (step_ == ContactStep::kClosed) return;
  if (arming_ == Arming::kArmed && now - last_frame_ > silence_limit_) {
    time_out_silence(silence_limit_, now);
    end_arming(ArmEnd::kSilence, now);
    begin_disarm(now);
  }
  if (step_ > ContactStep::kHello && now - last_frame_ > idle_limit()) {
    time_out_silence(idle_limit(), now);
    identify_again(ContactFault::kSilent, now);
  }
  const bool understood = heard_ || fault_ != ContactFault::kNone;
  if (step_ == ContactStep::kHello && !understood && !options_.datagrams &&
      bytes_ >= kGarbageBytes && now - step_since_ > kGarbageTimeout) {
    fault_ = ContactFault::kBaud;
  }
  const bool held = fault_ == ContactFault::kLostState;
  if (step_ == ContactStep::kHello && !held && now >= next_send_) {
    hello_nonce_ = random();
    send(ctp::Hello{CTP_VERSION, CTP_VERSION, hello_nonce_});
    next_send_ = now + (fault_ == ContactFault::kVersion ? kRefusedPeriod : kHelloPeriod);
  }
  if (step_ == ContactStep::kConfig && now >= next_send_) {
    send(options_.wire);
    next_send_ = now + (fault_ == ContactFault::kConfigRefused ? kRefusedPeriod : kConfigPeriod);
  }
  tick_relay(now);
  tick_test(now);
  tick_arming(now);
}

ContactQuality ContactCore::quality() const {
  ContactQuality q;
  if (clock_.samples() > 0)
    q.round_trip = {clock_.round_trip_min_s(), clock_.round_trip_p50_s(),
                    clock_.round_trip_p99_s()};
  if (clock_.valid()) {
    q.clock_sigma_s = clock_.sigma_s();
    q.clock_drift_ppm = clock_.drift_ppm();
  }
  q.heartbeat_jitter_s = std::sqrt(delay_var_s2_);
  if (const std::size_t kept = std::min(late_count_, kLateKept); kept > 0) {
    std::array<float, kLateKept> late = late_s_;
    const auto first = late.begin(), end = first + static_cast<std::ptrdiff_t>(kept);
    const auto middle = first + static_cast<std::ptrdiff_t>(kept / 2);
    std::nth_element(first, middle, end);
    q.late_p50_s = *middle;
    q.late_max_s = *std::max_element(middle, end);
    q.late_worst_s = late_worst_s_;
    q.late_times = late_times_;
  }
  const ctp::WireCounters& wire = reader_.counters();
  q.frames = wire.frames;
  q.crc_errors = damaged_frames();
  q.gaps = wire.gaps;
  q.overtaken = wire.overtaken;
  q.unknown_types = wire.unknown_types;
  q.bounces = bounces_;
  q.contact_voltage_v = contact_v_;
  return q;
}

std::uint64_t ContactCore::damaged_frames() const {
  const ctp::WireCounters& wire = reader_.counters();
  return wire.crc_errors + wire.malformed + wire.oversize;
}

ContactFacts ContactCore::facts(TimePoint now) const {
  ContactFacts f;
  f.step = step_;
  f.fault = fault_;
  f.heard = heard_;
  f.touching_at_self_test = touching_;
  f.in_contact = in_contact_;
  if (status_) {
    f.loop_flaw = loop_flaw(*status_);
    // Before the sensor's own first self-test the loop reads as broken.
    const bool whole = f.loop_flaw == LoopFlaw::kNone;
    if (whole || fault_ == ContactFault::kLoopBroken) f.loop_ok = whole;
    f.voltage_trip = (status_->flags & CTP_FLAG_VOLTAGE_TRIP) != 0;
    f.sense_v = status_->sense_mv * 1e-3;
    f.sensor_errors = status_->errors;
    f.config_crc = status_->config_crc;
  }
  f.self_test_ok = self_test_fresh(now);
  f.armed = arming_ == Arming::kArmed;
  f.arm_id = f.armed ? request_.arm_id : std::uint16_t{0};
  f.last_arm_end = last_end_;
  if (ident_) {
    f.version = ident_->version;
    f.firmware = ident_->firmware;
    f.uid = ident_->uid;
    f.boot_id = ident_->boot_id;
    f.board = board_;
  }
  if (relay_) {
    const bool closed = (relay_->flags & CTP_RELAY_CLOSED) != 0;
    f.relay = closed ? ContactRelay::kClosed : ContactRelay::kOpen;
  }
  f.waiting_s = seconds(now - step_since_);
  f.silent_s = seconds(now - last_frame_);
  f.clock_limit_s = options_.max_clock_sigma_s;
  f.unanswered_s = seconds(now - last_pong_);
  f.delivered_late_s = delivered_late_s_;
  f.late_limit_s = late_limit_s_;
  f.end_late_s = end_late_s_;
  f.end_limit_s = end_limit_s_;
  f.clock_ok = clock_good(now);
  f.delivery = {deliveries_late_, silences_, given_up_at_.has_value()};
  f.baud = options_.baud;
  f.datagrams = options_.datagrams;
  f.bytes = bytes_;
  f.lost_events = lost_events_;
  f.quality = quality();
  return f;
}

ContactSnapshot ContactCore::snapshot(TimePoint now) {
  ContactSnapshot s;
  s.armed = arming_ == Arming::kArmed;
  s.arm_id = s.armed ? request_.arm_id : std::uint16_t{0};
  s.in_contact = in_contact_ == true;
  s.last_end = last_end_;
  s.delivered_late_s = delivered_late_s_;
  s.late_limit_s = late_limit_s_;
  s.silence_open = given_up_at_.has_value();
  s.said = said_;
  s.said_late_s = said_late_s_;
  const Duration limit = s.armed ? silence_limit_ : idle_limit();
  // In contact no self-test can pass; with a tested loop the level still guards the retreat.
  const bool leaving =
      step_ == ContactStep::kSelfTest && touching_ && fault_ == ContactFault::kNone;
  s.alive = (step_ == ContactStep::kReady || leaving) && now - last_frame_ <= limit;
  return s;
}

}  // namespace cellcal::drivers
