// ContactCore: arming, clock synchronisation and self-test.

#include <algorithm>
#include <array>

#include "drivers/contact/contact_core.h"

namespace cellcal::drivers {

namespace {

using std::chrono::milliseconds;

constexpr milliseconds kKeepAlivePeriod{CTP_KEEPALIVE_MS};
/// Time limit for the answer to an arming, unless answers may take longer: below the 100 ms after
/// which a sensor with firmware 1.1 without a keep-alive ends it.
constexpr milliseconds kArmTimeout{80};
constexpr milliseconds kMaxLifetime{0xFFFF};
/// The sensor ends an arming itself, by its own clock; the host does so only after this additional time, and takes an
/// end by the sensor less than this time before it for the same.
constexpr milliseconds kLifetimeGrace{100};

constexpr milliseconds kRelayPeriod{100}, kRelayTimeout{1000}, kRelaySettle{CTP_RELAY_MS / 2};
constexpr milliseconds kTestTimeout{60};
constexpr milliseconds kTestRetry{1000};
constexpr int kTestTries = 3;
/// A status stamped this long after the request contains the result of the self-test.
constexpr milliseconds kTestSettle{CTP_SELF_TEST_MS};
/// Contact of this duration outside an arming triggers a test: touch or broken wire.
constexpr milliseconds kContactSuspicious{1000};

/// First firmware version that monitors wire E.
constexpr std::array<std::uint8_t, 3> kWatchesEarth{1, 1, 0};

/// Irregular intervals, so that nothing periodic is aliased; short until the map is good.
constexpr std::size_t kFastPings = 24;
constexpr unsigned kFastPingMs = 10, kFastPingSpreadMs = 10;
constexpr unsigned kPingMs = 150, kPingSpreadMs = 200;
/// Without a sample for this time the map's drift is no longer monitored.
constexpr milliseconds kClockStale{3000};
/// Two unanswered pings at their longest intervals.
constexpr milliseconds kDeafAfter{2 * (kPingMs + kPingSpreadMs)};

}  // namespace

// Arming ------------------------------------------------------------------------------------------

ArmRefusal ContactCore::refusal(const Request& request, TimePoint now) const {
  if (request.arm_id == 0 || request.lifetime <= milliseconds{0} ||
      request.lifetime > kMaxLifetime) {
    return ArmRefusal::kBadArgument;
  }
  if (step_ != ContactStep::kReady || !status_ || now - last_frame_ > idle_limit()) {
    return ArmRefusal::kNotReady;
  }
  if (loop_flaw(*status_) != LoopFlaw::kNone) return ArmRefusal::kLoopBroken;
  if (in_contact_ != false) return ArmRefusal::kInContact;
  const bool running = test_ == Test::kRunning;  // the sense line is pulled: judged afterwards
  const bool undefined =
      status_->sense_mv > options_.wire.contact_mv && status_->sense_mv < options_.wire.open_mv;
  if (undefined && !running) return ArmRefusal::kVoltageUndefined;
  if (!clock_good(now)) return ArmRefusal::kClockNotSynchronised;
  if (!self_test_fresh(now) && !running && !test_wanted_) return ArmRefusal::kSelfTestOld;
  return ArmRefusal::kNone;
}

void ContactCore::arm(std::uint16_t arm_id, milliseconds lifetime, TimePoint now) {
  const Request request{arm_id, lifetime};
  ArmRefusal why = refusal(request, now);
  if (why == ArmRefusal::kNone && (arming_ == Arming::kAsking || waiting_)) why = ArmRefusal::kBusy;
  if (why != ArmRefusal::kNone) {
    answer(why, arm_id, now);
    return;
  }
  waiting_ = request;
  // 2 ms, so that a break on the way here is detected before the arm relies on the loop.
  if (test_ == Test::kNone) test_wanted_ = true;
  if (arming_ == Arming::kArmed) {
    end_arming(ArmEnd::kDisarmed, now);
    begin_disarm(now);
  }
  on_tick_but_ping(now);
}

void ContactCore::ask(const Request& request, TimePoint now) {
  request_ = request;
  arming_ = Arming::kAsking;
  asked_at_ = now;
  next_try_ = now + answer_time_;
  next_keepalive_ = now + kKeepAlivePeriod;
  send(ctp::Arm{request.arm_id, static_cast<std::uint16_t>(request.lifetime.count())});
}

void ContactCore::answer(ArmRefusal refusal, std::uint16_t arm_id, TimePoint now) {
  answers_.push(ArmAnswer{arm_id, refusal, facts(now)});
}

void ContactCore::disarm(TimePoint now) {
  if (waiting_) {
    answer(ArmRefusal::kWithdrawn, waiting_->arm_id, now);
    waiting_.reset();
  }
  if (arming_ == Arming::kAsking) answer(ArmRefusal::kWithdrawn, request_.arm_id, now);
  if (arming_ == Arming::kArmed) end_arming(ArmEnd::kDisarmed, now);
  if (arming_ != Arming::kNone) begin_disarm(now);
}

void ContactCore::begin_disarm(TimePoint now) {
  arming_ = Arming::kDisarming;
  next_try_ = now + answer_time_;
  send(ctp::Disarm{request_.arm_id});
}

void ContactCore::note_end(ArmEnd end) {
  last_end_ = end;
  end_late_s_ = delivered_late_s_;
  end_limit_s_ = late_limit_s_;
}

void ContactCore::end_arming(ArmEnd end, TimePoint now) {
  if (arming_ == Arming::kArmed) {
    arming_ = Arming::kNone;
    note_end(end);
  }
  if (end == ArmEnd::kLinkLost) {
    if (arming_ == Arming::kAsking) answer(ArmRefusal::kLinkLost, request_.arm_id, now);
    if (waiting_) answer(ArmRefusal::kLinkLost, waiting_->arm_id, now);
    arming_ = Arming::kNone;
    waiting_.reset();
  }
}

void ContactCore::use_up_arming(std::uint16_t arm_id, TimePoint now) {
  if (arm_id != request_.arm_id) return;
  if (arming_ == Arming::kAsking) {
    arming_ = Arming::kNone;
    last_end_ = ArmEnd::kTripped;
    answer(ArmRefusal::kTrippedAtOnce, arm_id, now);
  }
  end_arming(ArmEnd::kTripped, now);
}

void ContactCore::on_status_arming(bool armed_flag, bool latched, TimePoint now) {
  switch (arming_) {
    case Arming::kNone:
      if (armed_flag) begin_disarm(now);  // unexpected arming: disarm
      break;
    case Arming::kAsking:
      if (!armed_flag) break;  // sent before the sensor received the request
      arming_ = Arming::kArmed;
      next_keepalive_ = now;
      expires_ = now + request_.lifetime + kLifetimeGrace;
      last_end_ = ArmEnd::kNone;
      settle_delivery();
      answer(ArmRefusal::kNone, request_.arm_id, now);
      break;
    case Arming::kArmed:
      if (armed_flag) break;
      if (latched) {  // the TRIP was damaged; CONTACT or REVOKED follows
        end_arming(ArmEnd::kTripped, now);
      } else {
        const bool lived = now + 2 * kLifetimeGrace >= expires_;
        end_arming(lived ? ArmEnd::kExpired : ArmEnd::kSensorDisarmed, now);
      }
      break;
    case Arming::kDisarming:
      if (!armed_flag) arming_ = Arming::kNone;
      break;
  }
}

bool ContactCore::keeps_alive() const {
  const bool answer_may_be_late = silence_limit_ > kHeartbeatLimit;
  return arming_ == Arming::kArmed || (arming_ == Arming::kAsking && answer_may_be_late);
}

void ContactCore::tick_arming(TimePoint now) {
  if (waiting_ && arming_ == Arming::kNone && test_ == Test::kNone && !test_wanted_) {
    const Request request = *waiting_;
    waiting_.reset();
    const ArmRefusal why = refusal(request, now);
    if (why == ArmRefusal::kNone) {
      ask(request, now);
    } else {
      answer(why, request.arm_id, now);
    }
  }
  if (arming_ == Arming::kArmed && now >= expires_) {
    end_arming(ArmEnd::kExpired, now);
    begin_disarm(now);
  }
  if (keeps_alive() && now >= next_keepalive_) {
    send(ctp::KeepAlive{});
    next_keepalive_ = now + kKeepAlivePeriod;
  }
  if ((arming_ == Arming::kAsking || arming_ == Arming::kDisarming) && now >= next_try_) {
    if (arming_ == Arming::kDisarming) {
      begin_disarm(now);
    } else if (now - asked_at_ > std::max<Duration>(kArmTimeout, silence_limit_)) {
      answer(ArmRefusal::kNoAnswer, request_.arm_id, now);
      begin_disarm(now);
    } else {
      next_try_ = now + answer_time_;
      send(ctp::Arm{request_.arm_id, static_cast<std::uint16_t>(request_.lifetime.count())});
    }
  }
}

// Clock -------------------------------------------------------------------------------------------

void ContactCore::tick_ping(TimePoint now) {
  if (step_ < ContactStep::kClock || now < next_ping_) return;
  ping_nonce_ = random();
  ping_sent_ = now;
  ping_out_ = true;
  send(ctp::Ping{ping_nonce_});
  const bool fast = clock_.samples() < kFastPings;
  const unsigned ms =
      fast ? kFastPingMs + random() % kFastPingSpreadMs : kPingMs + random() % kPingSpreadMs;
  next_ping_ = now + milliseconds{ms} + std::chrono::microseconds{random() % 1000};
}

void ContactCore::on_pong(const ctp::Pong& pong, TimePoint now, TimePoint arrived) {
  if (!ping_out_ || pong.nonce != ping_nonce_ || step_ < ContactStep::kClock) return;
  ping_out_ = false;
  last_pong_ = now;
  if (clock_.add(ping_sent_, arrived, pong.t_rx, pong.t_tx) == ClockMap::Sample::kJumped) {
    identify_again(ContactFault::kClockJumped, now);
    return;
  }
  if (step_ == ContactStep::kClock && clock_good(now)) enter(ContactStep::kSelfTest, now);
}

bool ContactCore::clock_good(TimePoint now) const {
  return clock_.valid() && clock_.sigma_s() <= options_.max_clock_sigma_s &&
         now - last_pong_ <= kClockStale;
}

// Self-test ---------------------------------------------------------------------------------------

void ContactCore::self_test(TimePoint now) {
  if (step_ == ContactStep::kClosed) return;
  if (fault_ == ContactFault::kLostState) {  // acknowledged: restart
    fault_ = ContactFault::kNone;
    was_ready_ = false;
    enter(ContactStep::kHello, now);
  } else {
    test_wanted_ = true;
    test_passed_ = false;
  }
  on_tick_but_ping(now);
}

LoopFlaw ContactCore::loop_flaw(const ctp::Status& status) const {
  const auto is_set = [&](int flag) { return (status.flags & flag) != 0; };
  // LOOP_OK alone is not sufficient: older firmware does not report EARTH_OK, and its LOOP_OK covers
  // the gun's wires only.
  if (is_set(CTP_FLAG_EARTH_OK)) {
    if (is_set(CTP_FLAG_LOOP_OK)) return LoopFlaw::kNone;
    return is_set(CTP_FLAG_SHORTED) ? LoopFlaw::kGunShort : LoopFlaw::kGunBreak;
  }
  if (ident_ && ident_->firmware < kWatchesEarth) {
    return is_set(CTP_FLAG_LOOP_OK) ? LoopFlaw::kEarthUnwatched : LoopFlaw::kGunBreak;
  }
  return is_set(CTP_FLAG_SHORTED) ? LoopFlaw::kEarthShort : LoopFlaw::kEarthBreak;
}

bool ContactCore::self_test_fresh(TimePoint now) const {
  return test_passed_ && now - test_passed_at_ <= options_.self_test_max_age;
}

void ContactCore::begin_test(TimePoint now) {
  test_ = Test::kRunning;
  test_sent_ = now;
  heard_since_test_ = false;
  // A pass counts only after the flag was seen cleared: it may be left from the preceding test.
  test_saw_clear_ = !status_ || (status_->flags & CTP_FLAG_SELF_TEST_OK) == 0;
  send(ctp::SelfTest{});
}

bool ContactCore::relay_to_ask() const {
  if (!options_.relay || step_ < ContactStep::kClock) return false;
  // Welded: it is not closed again.
  return !relay_ || (relay_->flags & (CTP_RELAY_WANTED | CTP_RELAY_FAULT)) == 0;
}

bool ContactCore::relay_closed() const {
  return relay_ && relay_->flags == (CTP_RELAY_WANTED | CTP_RELAY_CLOSED);
}

/// Repeats the request until the sensor reports the coil driven; boards without a relay do not
/// report it.
void ContactCore::tick_relay(TimePoint now) {
  const ContactFault found = relay_fault();
  if (found != ContactFault::kNone && found != fault_) fail_test(found, now);
  const bool named = fault_ == ContactFault::kRelayStaysOpen ||
                     fault_ == ContactFault::kRelayWelded || fault_ == ContactFault::kNoRelay;
  if (named && relay_closed()) fault_ = ContactFault::kNone;
  if (!relay_to_ask() || now < relay_next_) return;
  if (!relay_ && now - relay_asked_ > kRelayTimeout && step_ == ContactStep::kSelfTest)
    fault_ = ContactFault::kNoRelay;
  send(ctp::Relay{1});
  relay_next_ = now + kRelayPeriod;
}

void ContactCore::on_relay(const ctp::RelayState& state, TimePoint now) {
  if (!relay_ || relay_->flags != state.flags) relay_since_ = now;
  relay_ = state;
}

/// Compares its mirror contact with its coil.
ContactFault ContactCore::relay_fault() const {
  if (!options_.relay || !relay_ || step_ < ContactStep::kSelfTest) return ContactFault::kNone;
  const bool closed = (relay_->flags & CTP_RELAY_CLOSED) != 0;
  if ((relay_->flags & CTP_RELAY_FAULT) != 0)
    return closed ? ContactFault::kRelayWelded : ContactFault::kRelayStaysOpen;
  const bool lost = step_ == ContactStep::kReady && !closed;
  return lost ? ContactFault::kRelayStaysOpen : ContactFault::kNone;
}

/// Closed for long enough that no pole bounces.
bool ContactCore::relay_ready(TimePoint now) const {
  return !options_.relay || (relay_closed() && now - relay_since_ >= kRelaySettle);
}

bool ContactCore::test_due(TimePoint now) const {
  if (!relay_ready(now)) return false;
  if (step_ < ContactStep::kSelfTest || arming_ != Arming::kNone) return false;
  if (test_wanted_) return true;
  if (now < next_test_) return false;
  if (step_ == ContactStep::kSelfTest) return true;
  if (in_contact_ == true) return now - contact_since_ > kContactSuspicious;
  return !test_passed_ || now - test_passed_at_ > options_.self_test_renew;
}

/// It neither started the test, which clears its flag, nor answered a ping.
bool ContactCore::deaf(TimePoint now) const {
  return !test_saw_clear_ || (ping_out_ && now - last_pong_ > kDeafAfter);
}

void ContactCore::tick_test(TimePoint now) {
  // An answer is missing only if later heartbeats have arrived; before that it may be in transit,
  // and a sensor without any data is silent.
  if (test_ == Test::kRunning && heard_since_test_ &&
      now - test_sent_ > kTestTimeout + answer_time_) {
    if (++test_tries_ < kTestTries) {
      begin_test(now);
    } else {
      const bool loop_ok = status_ && loop_flaw(*status_) == LoopFlaw::kNone;
      if (damaged_frames() - damaged_before_test_ >= kTestTries) {
        fail_test(ContactFault::kDamaged, now);
      } else if (deaf(now)) {
        fail_test(ContactFault::kDeaf, now);
      } else {
        fail_test(loop_ok ? ContactFault::kSelfTestFailed : ContactFault::kLoopBroken, now);
      }
    }
  }
  if (test_ == Test::kNone && test_due(now)) {
    test_wanted_ = false;
    test_tries_ = 0;
    damaged_before_test_ = damaged_frames();
    begin_test(now);
  }
}

void ContactCore::fail_test(ContactFault fault, TimePoint now) {
  test_ = Test::kNone;
  test_passed_ = false;
  fault_ = fault;
  enter(ContactStep::kSelfTest, now);
  next_test_ = now + kTestRetry;
}

void ContactCore::on_status_test(const ctp::Status& status, TimePoint now) {
  const bool ok = (status.flags & CTP_FLAG_SELF_TEST_OK) != 0;
  const bool after = clock_.valid() && clock_.to_host(status.t) > test_sent_ + kTestSettle;
  if (after) heard_since_test_ = true;
  const bool loop_ok = loop_flaw(status) == LoopFlaw::kNone;
  if (test_ == Test::kNone) {
    // A passed test can be invalidated later; every heartbeat reports it.
    if (!ok) test_passed_ = false;
    if (!loop_ok && step_ == ContactStep::kReady) fail_test(ContactFault::kLoopBroken, now);
    return;
  }
  if (!ok) test_saw_clear_ = true;
  if (ok && loop_ok && test_saw_clear_) {
    test_ = Test::kNone;
    test_passed_ = true;
    test_passed_at_ = now;
    touching_ = false;
    if (step_ == ContactStep::kSelfTest) {
      fault_ = ContactFault::kNone;
      was_ready_ = true;
      settle_delivery();
      enter(ContactStep::kReady, now);
    }
    return;
  }
  // In contact no edge can be observed, only the loop tested.
  if (in_contact_ == true && after) {
    if (!loop_ok) {
      fail_test(ContactFault::kLoopBroken, now);
      return;
    }
    test_ = Test::kNone;
    touching_ = true;
    if (step_ == ContactStep::kSelfTest) fault_ = ContactFault::kNone;
    next_test_ = now + kTestRetry;
  }
}

// Next wake-up ------------------------------------------------------------------------------------

TimePoint ContactCore::next_wake() const {
  if (step_ == ContactStep::kClosed) return TimePoint::max();
  TimePoint t = last_frame_ + idle_limit() + milliseconds{1};
  if (step_ == ContactStep::kHello) {
    // Waits for silence here; a persistent fault waits for the operator.
    t = fault_ == ContactFault::kLostState ? TimePoint::max() : next_send_;
  }
  if (step_ == ContactStep::kConfig) t = std::min(t, next_send_);
  if (step_ >= ContactStep::kClock) t = std::min(t, next_ping_);
  if (relay_to_ask()) t = std::min(t, relay_next_);
  if (test_ == Test::kRunning) {
    if (heard_since_test_)
      t = std::min(t, test_sent_ + kTestTimeout + answer_time_ + milliseconds{1});
  } else if (step_ >= ContactStep::kSelfTest && arming_ == Arming::kNone) {
    // Without a closed relay there is no test, and its state has its own wake-up.
    const TimePoint test = std::max(next_test_, relay_since_ + kRelaySettle);
    if (step_ != ContactStep::kSelfTest)
      t = std::min(t, next_ping_);
    else if (!options_.relay)
      t = std::min(t, next_test_);
    else if (relay_closed())
      t = std::min(t, test);
  }
  if (arming_ == Arming::kArmed) {
    t = std::min({t, last_frame_ + silence_limit_ + milliseconds{1}, expires_});
  }
  if (arming_ == Arming::kAsking || arming_ == Arming::kDisarming) t = std::min(t, next_try_);
  return keeps_alive() ? std::min(t, next_keepalive_) : t;
}

}  // namespace cellcal::drivers
