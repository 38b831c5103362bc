#include "drivers/kuka/eki/eki_core.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "drivers/kuka/eki/eki_mover.h"
#include "drivers/kuka/moves/move_queue.h"
#include "drivers/kuka/moves/position_record.h"
#include "drivers/kuka/wire/xml_values.h"
#include "drivers/units.h"

namespace cellcal::drivers {

namespace {

// The hello is repeated until it is obeyed; the connection is closed after this time.
constexpr std::chrono::seconds kHelloLimit{5};
// Angles with fewer decimals have a resolution of a hundredth of a degree or worse: 0.2 mm at 1.4
// m. A single round value may have few decimals; ten states in a row do not.
constexpr int kFewestDecimals = 3;
constexpr std::uint64_t kStatesToJudge = 10;
// The reference is taken at rest: the means of two windows agree.
constexpr std::size_t kReferenceWindow = 5;
// Tolerance of an axis without a move, whose kind the channel does not state: degrees or millimetres. Above the
// servo's noise.
constexpr double kUnusedStands = 0.1;
// Interval between requests to start the program: selecting it takes the controller some time.
constexpr std::chrono::seconds kRunEvery{2};

constexpr std::uint32_t kStopReserve = 3;

constexpr std::chrono::milliseconds kHelloPeriod{500};

}  // namespace

struct EkiCore::Impl {
  Impl(EkiConfig c, ContactGuard* guard)
      : config((c.validate(), std::move(c))), wire(config.limits), mover(config, guard, record) {
    state.axes = static_cast<std::uint8_t>(config.limits.size());
    state.wire_axes = static_cast<std::uint8_t>(config.wire_axes());
    state.linear_unit = wire.linear(0);
  }

  std::size_t axes() const { return config.limits.size(); }
  bool linked() const {
    return state.link == RobotLink::kNotReferenced || state.link == RobotLink::kReady;
  }

  // ---- connection ------------------------------------------------------------------------------

  void on_connected(std::uint32_t session, TimePoint now) {
    framer.reset();
    record.clear();
    spread.reset();
    state.connected = true;
    state.session = session;
    state.other_session = 0;
    state.decimals_seen = 0;
    state.longest_pass_ms = 0;
    next_id = 0;
    close = greeted = bye_sent = too_few_axes = false;
    states_here = 0;
    last_time_ms = time_turns = 0;
    connected_at = last_rx = now;
    sender.begin(session, now);
  }

  void on_closed() {
    if (linked()) lose(EkiLoss::kClosed, cause::LinkClosed{});
    state.connected = false;
    sender.drop();
    close = false;
  }

  /// The arm is stopped by the controller's dead man and its own detection of the lost connection.
  void lose(EkiLoss loss, const Cause& cause) {
    if (mover.busy()) finish(mover.abandon(cause));
    if (const auto move = queue.next_waiting_move()) refuse(*move, cause);
    rereference_asked = false;
    greeted = false;
    held.clear();
    state.loss = loss;
    state.link = RobotLink::kLost;
    close = state.connected;
  }

  // ---- telegrams -------------------------------------------------------------------------------

  void send_due(TimePoint now) {
    if (!state.connected || close) return;
    if (!greeted) return sender.repeat_hello(now);
    if (mover.wants_stop() && mover.wants_sending()) {
      if (const auto done = mover.cancel(now)) end_move(*done);
      return;
    }
    EkiCommand stop;
    stop.type = EkiType::kStop;
    stop.id = next_id;
    if (mover.wants_stop()) {
      if (sender.send(stop, now, true)) mover.stop_sent(now);
    }
    if (mover.wants_sending()) {
      EkiCommand command = mover.command();
      command.id = next_id + 1;
      if (sender.send(command, now)) mover.sent(++next_id);
    }
    ask_to_run(now);
    if (ending && !mover.busy() && !bye_sent) {
      EkiCommand bye;
      bye.type = EkiType::kBye;
      bye.id = next_id;
      bye_sent = sender.send(bye, now, true);
    }
    if (!bye_sent) sender.beat(mover.is_stopping() ? stop : EkiCommand{}, now);
  }

  void ask_to_run(TimePoint now) {
    const bool startable = frame.mode == OperatingMode::kExt && frame.drives && !frame.stopped;
    if (!config.run_program || frame.ready || !startable || ending || mover.busy()) return;
    if (now - asked_to_run < kRunEvery) return;
    EkiCommand run;
    run.type = EkiType::kRun;
    run.id = next_id;
    if (sender.send(run, now)) asked_to_run = now;
  }

  // ---- states ----------------------------------------------------------------------------------

  void on_bytes(std::string_view bytes, TimePoint t_rx) {
    for (const char c : bytes) {
      if (close || !state.connected) return;
      switch (framer.push(c)) {
        case EkiFramer::Event::kNone: break;
        case EkiFramer::Event::kDocument: on_document(framer.document(), t_rx); break;
        case EkiFramer::Event::kOversized:
          note_bad(EkiError::kOversized, framer.document());
          lose(EkiLoss::kNotAStream, cause::LinkClosed{});
          return;
      }
    }
  }

  void note_bad(EkiError error, std::string_view bytes) {
    ++state.bad_documents;
    state.last_error = error;
    wire::show(bytes, state.last_bad);
  }

  void on_document(std::string_view document, TimePoint t_rx) {
    if (const EkiError error = parser.parse_state(document, received); error != EkiError::kNone) {
      return note_bad(error, document);
    }
    too_few_axes = received.axes_deg.size() < config.wire_axes();
    if (too_few_axes) return note_bad(EkiError::kNoAxes, document);
    ++state.states;
    last_rx = t_rx;
    spread.add(t_rx);
    if (received.session != state.session) return on_other_session();
    // A count above those sent on this connection belongs to an earlier one, left in a buffer.
    if (!sender.confirm(received.heard, t_rx)) return note_bad(EkiError::kBadNumber, document);
    unused_stand = states_here > 0 && stand(received.axes_deg, frame.axes_deg);
    std::swap(frame, received);
    state.other_session = 0;
    ++states_here;
    if (!greeted) {
      greeted = true;
      state.link = RobotLink::kNotReferenced;
    }
    note_status();
    record_position(t_rx);
    if (state.link == RobotLink::kReady && !frame.ready && !mover.busy()) {
      state.link = RobotLink::kNotReferenced;
    }
    watch_external(t_rx);
    if (const auto done = mover.on_state(frame, t_rx)) end_move(*done);
    if (state.link == RobotLink::kNotReferenced) try_reference();
  }

  void on_other_session() {
    state.other_session = received.session;
    // Until the hello is accepted the controller reports the preceding session.
    if (greeted) {
      lose(EkiLoss::kSessionTaken, cause::SessionTaken{received.session});
    }
  }

  void note_status() {
    state.ready = frame.ready;
    state.drives = frame.drives;
    state.stopped = frame.stopped;
    state.input = frame.input;
    state.mode = frame.mode;
    state.override_percent = frame.override_percent;
    state.fault = frame.fault;
    state.sends_tcp = frame.sends_tcp;
    state.states_tcp = frame.tcp.has_value();
    if (frame.tcp) state.tcp = *frame.tcp;
    state.request = frame.request;
    state.unread_by_controller = frame.bad;
    state.longest_pass_ms = std::max(state.longest_pass_ms, frame.pass_ms);
    state.decimals_seen = std::max(state.decimals_seen, frame.decimals);
  }

  /// $TIMER is a KRL INT of 31 bits, which wraps after 25 days. The record uses 32 bits.
  std::uint32_t unwrapped(std::uint32_t time_ms) {
    constexpr std::uint32_t kTurn = 0x80000000u, kHalf = 0x40000000u;
    if (time_ms < kTurn && last_time_ms > time_ms && last_time_ms - time_ms > kHalf) {
      time_turns += kTurn;
    }
    last_time_ms = time_ms;
    return time_ms + time_turns;
  }

  void record_position(TimePoint t_rx) {
    const AxisAngles actual = wire.inside(frame.axes_deg);
    // Falls back to the arrival time without the controller's clock.
    const auto arrival = static_cast<std::uint32_t>(
        std::chrono::duration_cast<std::chrono::milliseconds>(t_rx - connected_at).count());
    record.push(t_rx, frame.time_ms ? unwrapped(*frame.time_ms) : arrival, actual, actual);
    std::copy(actual.begin(), actual.end(), state.actual_rad);
    if (!mover.busy()) std::copy(actual.begin(), actual.end(), state.commanded_rad);
    const std::size_t last = std::min<std::size_t>(record.size(), 50) - 1;
    if (last > 0) {
      state.cycle_s =
          seconds(record.newest().t_rx - record.newest(last).t_rx) / static_cast<double>(last);
    }
  }

  bool coarse() const {
    return states_here >= kStatesToJudge && state.decimals_seen < kFewestDecimals;
  }

  void try_reference() {
    if (!rereference_asked || !frame.ready || coarse() || mover.busy()) return;
    if (frame.progress == EkiProgress::kMoving || states_here < kStatesToJudge) return;
    if (!record.rests(kReferenceWindow) || !unused_stand) return;
    rereference_asked = false;
    held = frame.axes_deg;
    const auto used = static_cast<std::ptrdiff_t>(axes());
    const auto all = static_cast<std::ptrdiff_t>(config.wire_axes());
    mover.hold_unused(AxisAngles(held.begin() + used, held.begin() + all));
    state.unasked.reset();
    state.link = RobotLink::kReady;
  }

  // ---- external axes ---------------------------------------------------------------------------

  /// True if the axes without a limit, which the record does not have, are at rest.
  bool stand(const AxisAngles& now, const AxisAngles& before) const {
    for (std::size_t i = axes(); i < now.size(); ++i)
      if (i >= before.size() || std::abs(now[i] - before[i]) > kUnusedStands) return false;
    return true;
  }

  /// Farthest external axis from where a move may have it, or where it was left; empty: within the
  /// tolerance.
  std::optional<cause::MovedUnasked> moved_unasked() const {
    for (std::size_t place = kArmAxes; place < frame.axes_deg.size(); ++place) {
      const std::size_t axis = wire.at_place(place);
      const bool used = axis < axes();
      double low = place < held.size() ? held[place] : frame.axes_deg[place], high = low;
      if (used && mover.busy()) {
        const EkiMover::Span span = mover.asked(axis);
        low = wire.shown(axis, span.min);
        high = wire.shown(axis, span.max);
      }
      const double actual = frame.axes_deg[place], nearest = std::clamp(actual, low, high);
      const double tolerance =
          used ? wire.shown(axis, config.follow_tolerance_deg * kRadPerDeg) : kUnusedStands;
      if (std::abs(actual - nearest) > tolerance)
        return cause::MovedUnasked{
            {static_cast<std::uint8_t>(place), used && wire.linear(axis)}, nearest, actual};
    }
    return std::nullopt;
  }

  /// At every state: an external axis that moves unasked stops the arm, and requires inspection.
  void watch_external(TimePoint now) {
    if (state.link != RobotLink::kReady) return;
    const auto moved = moved_unasked();
    if (!moved) return;
    state.unasked = moved;
    if (mover.busy()) return mover.condemn(MoveOutcome::kNotFollowing, *moved, now);
    state.link = RobotLink::kNotReferenced;
  }

  // ---- moves -----------------------------------------------------------------------------------

  void begin(const Move& move) {
    if (queue.waiting() || mover.busy()) {
      refuse(move, cause::Busy{});
    } else {
      queue.wait(move);
    }
  }

  AxisAngles actual() const { return {state.actual_rad, state.actual_rad + axes()}; }

  void start_waiting_move(TimePoint now) {
    const auto move = queue.next_waiting_move();
    if (!move) return;
    if (ending) return refuse(*move, cause::Closing{});
    if (!linked()) return refuse(*move, cause::NotConnected{state.waited_s});
    if (!state.ready) return refuse(*move, cause::ControllerNotReady{});
    if (state.link != RobotLink::kReady && state.unasked) return refuse(*move, *state.unasked);
    if (state.link != RobotLink::kReady) return refuse(*move, cause::NotReferenced{});
    if (const auto objection = object_to(*move, config.limits)) return refuse(*move, *objection);
    if (const auto refusal = mover.start(*move, actual(), now)) return finish(*refusal);
    std::copy(move->target_rad.begin(), move->target_rad.end(), state.commanded_rad);
  }

  void refuse(const Move& move, const Cause& why, MoveOutcome outcome = MoveOutcome::kRefused) {
    finish(refusal_of(move, why, actual(), outcome));
  }

  void finish(CoreResult result) {
    // The dead man has stopped the controller's program by then: no silence is a harmless pause.
    if (result.outcome == MoveOutcome::kRobotSilent) result.interruption = Interruption::kOther;
    // The arm's position, or the source of its motion, is uncertain: requires inspection.
    const bool doubtful =
        result.outcome == MoveOutcome::kNotFollowing || result.outcome == MoveOutcome::kRobotSilent;
    if (doubtful && state.link == RobotLink::kReady) state.link = RobotLink::kNotReferenced;
    if (state.unasked && state.link == RobotLink::kReady) state.link = RobotLink::kNotReferenced;
    queue.add(result);
  }

  /// The move is over, and has left the axes where they are.
  void end_move(const CoreResult& result) {
    if (held.size() == frame.axes_deg.size())
      for (std::size_t i = 0; i < axes(); ++i) held[wire.place(i)] = frame.axes_deg[wire.place(i)];
    finish(result);
  }

  void stop() {
    if (const auto move = queue.next_waiting_move()) {
      refuse(*move, cause::StopAsked{}, MoveOutcome::kStopped);
    }
    mover.halt(MoveOutcome::kStopped, cause::StopAsked{});
  }

  // ---- time ------------------------------------------------------------------------------------

  void on_tick(TimePoint now) {
    if (!heard_time) {
      heard_time = true;
      last_rx = now;
    }
    state.waited_s = seconds(now - last_rx);
    mover.listen(now);
    if (greeted && state.waited_s > config.silence_s) {
      lose(EkiLoss::kSilence, cause::NotConnected{state.waited_s});
    }
    if (state.connected && !greeted && now - connected_at > kHelloLimit) close = true;
    if (const auto done = mover.on_tick(now)) {
      const bool cut = is<cause::CommandNotTaken>(done->cause);
      end_move(*done);
      // The move could still begin later; closing the connection prevents it.
      if (cut) lose(EkiLoss::kNotTaken, done->cause);
    }
    start_waiting_move(now);
    send_due(now);
    refresh(now);
  }

  EkiTrouble trouble(TimePoint now) const {
    if (!state.connected) return EkiTrouble::kNotConnected;
    if (too_few_axes) return EkiTrouble::kTooFewAxes;
    if (state.waited_s > config.silence_s) return EkiTrouble::kNoState;
    if (!greeted) {
      return state.other_session != 0 ? EkiTrouble::kOtherSession : EkiTrouble::kNotHeard;
    }
    if (coarse()) return EkiTrouble::kCoarse;
    if (sender.unread(now)) return EkiTrouble::kUnread;
    return state.ready ? EkiTrouble::kNone : EkiTrouble::kNotReady;
  }

  void refresh(TimePoint now) {
    state.trouble = trouble(now);
    state.moving = mover.busy();
    state.rereference_pending = rereference_asked;
    state.jitter_s = spread.sigma_s();
    state.longest_gap_s = spread.longest_s();
  }

  EkiConfig config;
  const WireAxes wire;
  EkiFramer framer;
  EkiParser parser;
  EkiState frame, received;  ///< accepted; not yet accepted
  AxisAngles held;           // on the wire: at the reference, or where a move has left them
  PositionRecord record;
  EkiMover mover;

  ArrivalSpread spread;

  EkiCoreState state;
  EkiSender sender{config};

  TimePoint connected_at{}, last_rx{}, asked_to_run{};
  std::uint32_t next_id = 0;
  std::uint32_t last_time_ms = 0, time_turns = 0;
  std::uint64_t states_here = 0;
  bool heard_time = false, greeted = false, close = false, too_few_axes = false;
  bool unused_stand = false;  ///< in the two newest states
  bool rereference_asked = false;
  bool ending = false, bye_sent = false;
  MoveQueue queue;
};

EkiCore::EkiCore(EkiConfig config, ContactGuard* guard)
    : impl_(std::make_unique<Impl>(std::move(config), guard)) {}
EkiCore::~EkiCore() = default;

void EkiCore::on_connected(std::uint32_t session, TimePoint now) {
  impl_->on_connected(session, now);
}
void EkiCore::on_closed(TimePoint now) {
  impl_->on_closed();
  impl_->refresh(now);
}
void EkiCore::on_bytes(std::string_view bytes, TimePoint t_rx) {
  impl_->on_bytes(bytes, t_rx);
  impl_->refresh(t_rx);
}
void EkiCore::on_tick(TimePoint now) { impl_->on_tick(now); }

std::string_view EkiCore::output() const { return impl_->sender.output(); }
void EkiCore::sent(std::size_t count) { impl_->sender.sent(count); }
bool EkiCore::wants_close() const { return impl_->close; }
void EkiCore::begin(const Move& move) { impl_->begin(move); }
void EkiCore::stop() { impl_->stop(); }

void EkiCore::rereference() {
  if (impl_->mover.busy() || !impl_->linked()) return;
  impl_->rereference_asked = true;
  impl_->state.link = RobotLink::kNotReferenced;
}

void EkiCore::close() {
  impl_->stop();
  impl_->ending = true;
}

bool EkiCore::ended() const {
  return impl_->ending && (!impl_->state.connected || !impl_->greeted ||
                           (impl_->bye_sent && impl_->sender.output().empty()));
}

std::optional<CoreResult> EkiCore::next_result() { return impl_->queue.next_result(); }

const EkiCoreState& EkiCore::core_state() const { return impl_->state; }

std::optional<MoveResult> EkiCore::poll() {
  const auto result = next_result();
  if (!result) return std::nullopt;
  return to_move_result(*result);
}

RobotState EkiCore::state() const {
  return to_robot_state(impl_->state,
                        impl_->config.address + ":" + std::to_string(impl_->config.port));
}

void EkiSender::begin(std::uint32_t session, TimePoint now) {
  session_ = session;
  seq_ = confirmed_ = 0;
  size_ = 0;
  last_hello_ = now - kHelloPeriod;
  repeat_hello(now);
}

bool EkiSender::send(EkiCommand command, TimePoint now, bool urgent) {
  if (unconfirmed() >= static_cast<std::uint32_t>(config_.window) + (urgent ? kStopReserve : 0)) {
    return false;
  }
  command.session = session_;
  command.seq = seq_ + 1;
  command.target_deg.resize(config_.wire_axes(), 0.0);
  const std::string_view text =
      format_command(command, std::span(bytes_).subspan(size_, bytes_.size() - size_));
  if (text.empty()) return false;
  if (unconfirmed() == 0) last_progress_ = now;
  size_ += text.size();
  ++seq_;
  last_sent_ = now;
  return true;
}

void EkiSender::repeat_hello(TimePoint now) {
  if (now - last_hello_ < kHelloPeriod) return;
  EkiCommand hello;
  hello.type = EkiType::kHello;
  send(hello, now);
  last_hello_ = now;
}

void EkiSender::beat(const EkiCommand& command, TimePoint now) {
  if (now - last_sent_ >= from_seconds(config_.beat_s)) send(command, now);
}

bool EkiSender::confirm(std::uint32_t seq, TimePoint now) {
  if (seq > seq_ || seq < confirmed_) return false;
  if (seq > confirmed_) last_progress_ = now;
  confirmed_ = seq;
  return true;
}

bool EkiSender::unread(TimePoint now) const {
  return unconfirmed() > 0 && now - last_progress_ > from_seconds(config_.silence_s);
}

void EkiSender::sent(std::size_t count) {
  count = std::min(count, size_);
  std::copy(bytes_.data() + count, bytes_.data() + size_, bytes_.data());
  size_ -= count;
}

}  // namespace cellcal::drivers
