#include "drivers/kuka/rsi/rsi_core.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "drivers/kuka/moves/cause.h"
#include "drivers/kuka/moves/position_record.h"
#include "drivers/kuka/rsi/rsi_mover.h"
#include "drivers/kuka/rsi/rsi_setpoint.h"
#include "drivers/kuka/rsi/rsi_stream.h"
#include "drivers/kuka/wire/xml_values.h"
#include "drivers/units.h"

namespace cellcal::drivers {
namespace {

// If all of at least this many replies count as late, they are refused, not late. Controllers give
// up after ten consecutive ones: a refusal detected until then is reported when the link is lost.
constexpr std::uint64_t kRefusedReplies = 10, kRefusedWhenLost = 4;
// The reference is the mean of AIPos over two windows that agree: the arm is at rest.
constexpr std::size_t kReferenceWindow = 12;
// An identical packet after longer than this is not a network duplicate.
constexpr double kPeerWaitsS = 0.2;
// Time limit of repetitions by a peer that waits for replies before the first answer: its silence
// is caused by this adapter. Simulators take a second.
constexpr double kPeerTimeoutS = 2.5;
// Tolerance of an external axis without a move, degrees or millimetres: above the servo's noise.
constexpr double kUnusedStands = 0.1;
// Replies accepted in a row after which the controller holds the last correction at rest: one until it has
// it, one for its speed to be zero, one for its acceleration.
constexpr std::uint32_t kAcceptedAtRest = 3;
// A larger interval between ticks and packets shows that this thread was delayed.
constexpr double kHeldUpS = 0.02;

RsiConfig checked(RsiConfig config) {
  config.validate();
  config.limits = limits_within_wire(config);
  return config;
}

}  // namespace

struct RsiCore::Impl {
  Impl(RsiConfig c, ContactGuard* guard)
      : config(checked(std::move(c))),
        wire(config.limits),
        mover(config, guard, record),
        setpoint(config) {
    state.axes = static_cast<std::uint8_t>(config.limits.size());
    state.linear_unit = wire.linear(0);
    state.relative = relative();
  }

  // ---- one packet ------------------------------------------------------------------------------

  std::string_view on_datagram(std::string_view bytes, TimePoint t_rx) {
    note_time(t_rx);
    check_silence();
    WireError error = parser.parse_rob(bytes, frame, config);
    const AxisAngles actual = axes_of(frame.axes_deg, frame.external_deg, wire);
    if (error == WireError::kNone) {
      too_few_axes = actual.size() < axes();
      if (too_few_axes) error = WireError::kNoAxes;
    }
    if (error != WireError::kNone) return on_bad(error, bytes, t_rx);

    repeats.note(frame.ipoc.value, actual, t_rx);
    if (!linked()) {
      if (!pause.is_over(frame.ipoc.value, frame.delay, t_rx)) begin_other_session();
      begin_session();
    }
    Arrival arrival = stream.push(frame, t_rx);
    if (const auto restarted = restart_evidence(arrival, actual)) {
      lose(*restarted);
      begin_other_session();
      begin_session();
      arrival = stream.push(frame, t_rx);
    }
    if (arrival == Arrival::kStale) return {};
    ++state.packets;
    damaged_in_a_row = 0;
    // No packet of a controller is this late within a session.
    waited_unanswered = unanswered && state.waited_s >= kPeerWaitsS;
    last_rx = t_rx;
    held_up_s = slept_s = 0.0;
    spread.add(t_rx);
    state.sends_setpoint = !frame.setpoint_axes_deg.empty();
    state.sends_delay = frame.delay.has_value();
    state.mode = frame.mode;
    state.override_percent = frame.override_percent.value_or(-1);
    counted = {frame.ipoc.value, t_rx};
    const bool heard = note_delay() == 0 || relative();
    std::copy(actual.begin(), actual.end(), state.actual_rad);
    note_tcp();
    if (arrival == Arrival::kRepeat && answered == frame.ipoc.value) ++state.duplicates;
    state.ipoc = frame.ipoc.value;
    state.decimals = stream.decimals();
    state.decimals_unproven = stream.decimals_unproven();
    state.cycle_s = stream.cycle_s();
    mover.listen(t_rx, frame.input_on);
    // A duplicate packet is answered again, but is one cycle.
    if (arrival == Arrival::kRepeat && setpoint.known()) return hold_again(t_rx);
    if (arrival == Arrival::kRepeat && !peer_waits(t_rx)) return unknown_offset_reply();

    record.push(t_rx, frame.ipoc.value, actual,
                setpoint.known() ? setpoint.commanded_rad() : actual);
    if (!setpoint.known() && !setpoint.find(frame, actual, t_rx, peer_waits(t_rx)))
      return unknown_offset_reply();
    if (state.link == RobotLink::kReady && (coarse() || lacks_delay())) doubt();
    watch_external(actual);
    if (state.link == RobotLink::kNotReferenced) {
      setpoint.hold_at(actual);
      state.tcp_apart = setpoint.tcp_apart(frame, actual);
      try_reference();
    }
    start_waiting_move();
    if (const auto done = mover.step(mover_cycle(t_rx, true, heard), setpoint.commanded_rad())) {
      finish(*done);
    }
    return next_reply();
  }

  void note_tcp() {
    constexpr auto kIsZero = [](double v) { return v == 0.0; };
    state.states_tcp = frame.tcp && !std::all_of(frame.tcp->begin(), frame.tcp->end(), kIsZero);
    if (state.states_tcp) state.tcp = *frame.tcp;
  }

  /// Evidence that the session is not the preceding one, if any.
  std::optional<cause::SessionRestarted> restart_evidence(Arrival arrival,
                                                          const AxisAngles& actual) {
    using Sign = cause::SessionRestarted::Sign;
    if (arrival == Arrival::kNext) {
      const auto moved = setpoint.start_pose_moved(frame, actual, mover.busy());
      if (!moved || !mover.moves()) return moved;
      // RSI_ON takes the pose of the arm, except for its lag. No session begins elsewhere: a running
      // one brings the arm to rest first.
      const double lag_rad = config.longest_lag_s * mover.fastest_axis_rad_s() +
                             config.follow_tolerance_deg * kRadPerDeg;
      if (setpoint.start_distance_rad(frame, actual) <= lag_rad) return moved;
      mover.halt(MoveOutcome::kRobotSilent, *moved);
      return std::nullopt;
    }
    if (arrival != Arrival::kRestart) return std::nullopt;
    if (!stream.delay_fell()) return cause::SessionRestarted{Sign::kIpoc};
    return cause::SessionRestarted{Sign::kDelay, static_cast<double>(delay.last().value_or(0)),
                                   static_cast<double>(frame.delay.value_or(0))};
  }

  /// The correction for the commanded pose; if it exceeds the limits, the arm holds.
  std::string_view next_reply() {
    const auto values = setpoint.next(stream.motion_cycle_s(), mover.stops());
    record.set_commanded(setpoint.commanded_rad());
    if (const auto beyond = setpoint.beyond()) {
      if (mover.busy()) finish(mover.abandon(*beyond, MoveOutcome::kNotFollowing));
      if (state.link == RobotLink::kReady) state.link = RobotLink::kNotReferenced;
    }
    return reply(values);
  }

  std::string_view on_bad(WireError error, std::string_view bytes, TimePoint t_rx) {
    ++state.bad_packets;
    state.last_error = error;
    wire::show(bytes, state.last_bad);
    if (!frame.has_ipoc) return {};
    if (frame.only_ipoc && !linked()) {
      // RSI 2 opens a session with this frame; its correction is 0, and it requires an answer.
      if (!setpoint.session_starts(state.waited_s)) return {};
      const std::array<double, kMaxAxes> zeros{};
      return written(std::span(zeros).first(axes()));
    }
    if (!linked()) return {};
    if (!setpoint.known()) return unknown_offset_reply();
    const Arrival arrival = stream.push_damaged(frame.ipoc.value, t_rx);
    if (arrival != Arrival::kNext && arrival != Arrival::kRepeat) return {};
    // The sensor is polled regardless of the packet.
    mover.listen(t_rx);
    if (arrival == Arrival::kRepeat) return hold(t_rx);
    // Counts as a cycle of the controller: the move advances, since stopping for one cycle and
    // continuing at full speed exceeds any drive, unless Delay shows that the arm did stop. After
    // several consecutive ones it is brought to rest.
    if (++damaged_in_a_row >= static_cast<std::uint32_t>(config.silence_cycles))
      mover.halt(MoveOutcome::kRobotSilent, cause::DamagedPackets{damaged_in_a_row});
    if (mover.moves()) last_rx = t_rx;
    MoverCycle cycle = mover_cycle(t_rx, true, heard_if_damaged(t_rx));
    cycle.sound = false;
    if (const auto done = mover.step(cycle, setpoint.commanded_rad())) finish(*done);
    return next_reply();
  }

  /// False: Delay of the damaged packet shows late replies. It may be damaged itself, and counts only
  /// if it neither fell nor rose by more than one per cycle.
  bool heard_if_damaged(TimePoint t_rx) {
    const auto last = delay.last();
    if (!frame.delay || !last || *frame.delay < *last) return true;
    const std::uint32_t cycles = (frame.ipoc.value - counted.ipoc) / stream.step();
    if (*frame.delay - *last > cycles) return true;
    counted = {frame.ipoc.value, t_rx};
    return note_delay() == 0 || relative();
  }

  std::string_view hold(TimePoint t_rx) {
    if (const auto done = mover.step(mover_cycle(t_rx, false, true), setpoint.commanded_rad())) {
      finish(*done);
    }
    return reply(answered && *answered == frame.ipoc.value ? setpoint.again() : setpoint.hold());
  }

  /// The position of the arm is unknown while the same packet is repeated.
  std::string_view hold_again(TimePoint t_rx) {
    const std::string_view text = hold(t_rx);
    const bool over = repeats.same_s(t_rx) > std::max(kPeerWaitsS, stream.silence_limit_s());
    if (over && (mover.busy() || queue.waiting())) lose(cause::Silence{repeats.same_s(t_rx)});
    return text;
  }

  /// A wrong correction is a jump of the arm; a zero increment never is.
  std::string_view unknown_offset_reply() {
    start_waiting_move();  // refuses it, so that the caller gets a result
    unanswered = true;
    return setpoint.can_hold_unknown() ? reply(setpoint.hold()) : std::string_view{};
  }

  std::string_view reply(std::span<const double> values) {
    const std::optional<int> stop = stop_value();
    const std::string_view text = values.empty() ? std::string_view() : written(values);
    if (text.empty()) return text;
    ++state.replies;
    unanswered = false;
    if (delay.replies() == 0) delay.begin_answers(frame.delay);
    delay.replied();
    if (answered != frame.ipoc.value && counted.ipoc != frame.ipoc.value) ++counted.answered_since;
    answered = frame.ipoc.value;
    stop_low_sent = stop_low_sent || (stop && *stop == 0);
    stop_sent = stop_sent || (stop && *stop == 1);
    return text;
  }

  // ---- session ---------------------------------------------------------------------------------

  void begin_session() {
    stream.reset();
    spread.reset();
    record.clear();
    delay.begin_session();
    setpoint.begin_session(state.waited_s);
    answered.reset();
    delay_ipoc.reset();
    unanswered = waited_unanswered = false;
    rereference_asked = stop_low_sent = state.refused_when_lost = false;
    damaged_in_a_row = 0;
    state.link = RobotLink::kNotReferenced;
  }

  /// The controller's session is not proven to be the preceding one.
  void begin_other_session() {
    mover.forget_input();
    ++state.session;
    if (state.interruption != Interruption::kNone) state.interruption = Interruption::kOther;
  }

  void interrupt(Interruption by) {
    state.interruption = by;
    ++state.interruptions;
  }

  /// Packets have stopped, or belong to another session.
  void lose(const Cause& cause) {
    const bool held_up = is<cause::HeldUp>(cause);
    const bool silent = is<cause::Silence, cause::DamagedPackets>(cause) || held_up;
    const auto* silence = std::get_if<cause::Silence>(&cause);
    state.silent_s = silence != nullptr ? silence->silent_s : state.waited_s;
    interrupt(held_up  ? Interruption::kLateReplies
              : silent ? Interruption::kPacketsStopped
                       : Interruption::kOther);
    pause.forget();
    if (silent) pause.begin(counted.ipoc, stream.seconds_per_ipoc(), delay.last(), counted.t_rx);
    if (mover.busy()) finish(mover.abandon(cause));
    if (const auto move = queue.next_waiting_move()) refuse(*move, cause);
    OffsetMemory link;
    link.ipoc = counted.ipoc;
    link.step = stream.step();
    link.seconds_per_ipoc = stream.seconds_per_ipoc();
    link.t_rx = counted.t_rx;
    link.answered_since = counted.answered_since;
    link.delay = delay.last();
    link.delay_counts = delay.counts();
    link.counts_packets = stream.counts_packets();
    if (record.size() > 0) link.actual_rad = record.newest().actual_rad;
    setpoint.remember(link);
    rereference_asked = false;
    state.refused_when_lost = delay.refused(kRefusedWhenLost);
    state.link = RobotLink::kLost;
  }

  bool peer_waits(TimePoint t_rx) const {
    return waited_unanswered || repeats.same_s(t_rx) >= kPeerWaitsS;
  }
  /// The peer may send packets only when answered; not yet disproven.
  bool peer_may_wait() const { return !setpoint.known() && !stream.counts_milliseconds(); }

  void try_reference() {
    if (!rereference_asked || !fit_for_reference() || !record.rests(kReferenceWindow)) return;
    setpoint.hold_at(record.mean_actual_rad(0, kReferenceWindow));
    rereference_asked = false;
    held_external = frame.external_deg;
    state.unasked.reset();
    state.interruption = Interruption::kNone;
    state.link = RobotLink::kReady;
  }

  /// An external axis not where it was left; one that the move drives is watched as every axis is.
  std::optional<cause::MovedUnasked> moved_unasked(const AxisAngles& actual) const {
    for (std::size_t i = 0; i < frame.external_deg.size(); ++i) {
      const std::size_t axis = wire.at_place(kArmAxes + i);
      const bool used = axis < axes();
      if (used ? mover.drives(axis) : i >= held_external.size()) continue;
      const double at = used ? wire.shown(axis, actual[axis]) : frame.external_deg[i];
      const double left =
          used ? wire.shown(axis, setpoint.commanded_rad()[axis]) : held_external[i];
      const double tolerance =
          used ? wire.shown(axis, config.follow_tolerance_deg * kRadPerDeg) : kUnusedStands;
      if (std::abs(at - left) > tolerance)
        return cause::MovedUnasked{
            {static_cast<std::uint8_t>(kArmAxes + i), used && wire.linear(axis)}, left, at};
    }
    return std::nullopt;
  }

  /// At every packet: an external axis that moves unasked stops the arm, and requires inspection.
  void watch_external(const AxisAngles& actual) {
    if (state.link != RobotLink::kReady) return;
    const auto moved = moved_unasked(actual);
    if (!moved) return;
    state.unasked = moved;
    if (mover.busy()) return mover.condemn(MoveOutcome::kNotFollowing, *moved);
    state.link = RobotLink::kNotReferenced;
  }

  bool fit_for_reference() const {
    return stream.learnt() && !coarse() && !not_accepted() && !lacks_delay() &&
           !state.tcp_apart.much();
  }
  bool coarse() const { return fitness_of_decimals(state) == Fitness::kUnfit; }
  bool not_accepted() const { return delay.refused(kRefusedReplies); }
  bool lacks_delay() const {
    return setpoint.known() && fitness_of_elements(state) == Fitness::kUnfit;
  }
  bool relative() const { return config.mode == CorrectionMode::kRelative; }

  /// The packets no longer carry enough information for motion.
  void doubt() {
    if (coarse()) mover.halt(MoveOutcome::kNotFollowing, cause::TooCoarse{stream.decimals()});
    if (lacks_delay()) mover.halt(MoveOutcome::kRobotSilent, cause::DelayGone{});
    increments_lost = mover.busy();  // or possibly: referenced anew in both cases
    if (!mover.busy()) state.link = RobotLink::kNotReferenced;
  }

  bool too_many_late() const {
    return state.late_while_moving >= static_cast<std::uint32_t>(config.late_replies_limit);
  }

  /// From the last packet with a Delay to this one.
  std::uint32_t cycles_of_delay() const {
    if (!delay_ipoc || stream.step() == 0) return 1;
    return std::max((frame.ipoc.value - *delay_ipoc) / stream.step(), 1U);
  }

  /// Number of further late replies. Before the first reply none can be late.
  std::uint32_t note_delay() {
    const std::uint32_t more = delay.note(frame.delay);
    if (delay.replies() == 0) return 0;
    state.late += more;
    // Of several cycles the last reply may be one of those accepted: a lost packet had none.
    taken = relative() || more < cycles_of_delay();
    if (frame.delay) delay_ipoc = frame.ipoc.value;
    if (more > 0 && !relative()) setpoint.stopped(taken);
    if (more == 0 || !(mover.busy() || queue.waiting())) return more;
    state.late_while_moving += more;
    if (!mover.busy()) return more;
    if (relative()) {
      // The arm differs from the accumulator, and does not converge to it.
      increments_lost = true;
      mover.halt(MoveOutcome::kRobotSilent, cause::IncrementLost{state.late_while_moving});
    } else if (too_many_late()) {
      mover.halt(MoveOutcome::kRobotSilent, cause::LateReplies{state.late_while_moving});
    }
    return more;
  }

  // ---- moves -----------------------------------------------------------------------------------

  void begin(const Move& move) {
    if (queue.waiting() || mover.busy()) {
      refuse(move, cause::Busy{});
    } else {
      queue.wait(move);
      state.late_while_moving = 0;
    }
  }

  /// The input may lag the sensor that has just reported free: the arm waits.
  bool waits_for_input() {
    if (!linked() || !queue.waiting() || !mover.input_alone()) {
      input_due.reset();
      return false;
    }
    if (!input_due) input_due = last_rx + kInputFollows;
    return last_rx < *input_due;
  }

  void start_waiting_move() {
    if (waits_for_input()) return;
    // After late replies the controller may hold an earlier correction than the commanded one.
    const bool late =
        state.link == RobotLink::kReady && delay.accepted_in_a_row() < kAcceptedAtRest;
    if (late && !too_many_late()) return;
    const auto move = queue.next_waiting_move();
    if (!move) return;
    if (ending) return refuse(*move, cause::Closing{});
    if (!linked()) return refuse(*move, cause::NoPackets{std::max(state.waited_s, state.silent_s)});
    if (not_accepted()) return refuse(*move, cause::NotAccepted{});
    if (state.link != RobotLink::kReady && state.unasked) return refuse(*move, *state.unasked);
    if (state.link != RobotLink::kReady) return refuse(*move, cause::NotReferenced{});
    if (const auto objection = setpoint.object_to(*move)) return refuse(*move, *objection);
    if (late)
      return refuse(*move, cause::LateReplies{state.late_while_moving}, MoveOutcome::kRobotSilent);
    state.late_while_moving = 0;
    if (const auto refusal = mover.start(*move, setpoint.commanded_rad())) finish(*refusal);
  }

  void refuse(const Move& move, const Cause& why, MoveOutcome outcome = MoveOutcome::kRefused) {
    finish(refusal_of(move, why, setpoint.commanded_rad(), outcome));
  }

  void finish(CoreResult result) {
    result.ipoc = state.ipoc;
    result.in_space = config.space.on;
    const bool of_the_sensor = result.interruption != Interruption::kNone;
    if (result.outcome != MoveOutcome::kArrived && !of_the_sensor)
      result.interruption = interruption_by(result.cause);
    // The pose differs from the commanded one: requires inspection before further motion.
    const bool lost_increments = increments_lost && !mover.busy();
    if ((result.outcome == MoveOutcome::kNotFollowing || lost_increments) &&
        state.link == RobotLink::kReady) {
      state.link = RobotLink::kNotReferenced;
    }
    increments_lost = increments_lost && mover.busy();
    if (state.unasked && !mover.busy() && state.link == RobotLink::kReady)
      state.link = RobotLink::kNotReferenced;
    queue.add(result);
  }

  /// Interruption of the link; a move refused for a missing reference is caused by the loss of the
  /// link.
  Interruption interruption_by(const Cause& cause) {
    if (is<cause::LateReplies, cause::IncrementLost>(cause)) {
      interrupt(Interruption::kLateReplies);
      return state.interruption;
    }
    if (is<cause::DamagedPackets>(cause)) interrupt(Interruption::kPacketsStopped);
    if (is<cause::Silence, cause::HeldUp, cause::NoPackets, cause::SessionRestarted,
           cause::NotReferenced, cause::DamagedPackets>(cause))
      return state.interruption;
    return is<cause::DelayGone, cause::NotAccepted>(cause) ? Interruption::kOther
                                                           : Interruption::kNone;
  }

  void stop() {
    if (const auto move = queue.next_waiting_move()) {
      refuse(*move, cause::StopAsked{}, MoveOutcome::kStopped);
    }
    mover.halt(MoveOutcome::kStopped, cause::StopAsked{});
  }

  // ---- helpers ---------------------------------------------------------------------------------

  std::size_t axes() const { return config.limits.size(); }
  bool linked() const {
    return state.link == RobotLink::kNotReferenced || state.link == RobotLink::kReady;
  }
  std::string_view written(std::span<const double> values) {
    return format_sen(config, values, config.decimals, stop_value(), frame.ipoc.text.view(), buffer,
                      config.space.on ? config.space.tag : std::string_view());
  }
  /// The STOP object acts on a rising edge: the controller has to see it low first.
  std::optional<int> stop_value() const {
    if (config.stop_tag.empty()) return std::nullopt;
    return ending && stop_low_sent && !mover.busy() ? 1 : 0;
  }
  MoverCycle mover_cycle(TimePoint now, bool advance, bool heard) const {
    const IpocClock clock{stream.seconds_per_ipoc(), stream.counts_milliseconds()};
    return {now, stream.motion_cycle_s(), clock, advance, heard, true, taken};
  }

  void note_time(TimePoint now) {
    if (!heard_time) {
      heard_time = true;
      last_rx = last_sample = now;
    }
    if (const double since_sample_s = seconds(now - last_sample); since_sample_s > kHeldUpS) {
      held_up_s += since_sample_s;
    }
    slept_s = std::max(slept_s, seconds(now - last_sample));
    last_sample = now;
    state.waited_s = seconds(now - last_rx);
  }

  void check_silence() {
    if (!linked()) return;
    // The arm of a peer that counts packets waited as well while this thread was delayed.
    const double own_s = stream.counts_packets() ? std::min(held_up_s, kPeerTimeoutS) : 0.0;
    const double limit_s =
        std::max(stream.silence_limit_s(), peer_may_wait() ? kPeerTimeoutS : 0.0);
    if (state.waited_s - own_s <= limit_s) return;
    // This thread ran for less than a cycle of the wait: no packet is known to be missing.
    if (stream.learnt() && state.waited_s - slept_s <= stream.cycle_s())
      return lose(cause::HeldUp{state.waited_s, limit_s, slept_s});
    if (damaged_in_a_row > 1) return lose(cause::DamagedPackets{damaged_in_a_row});
    lose(cause::Silence{state.waited_s});
  }

  void on_tick(TimePoint now) {
    note_time(now);
    check_silence();
    if (!linked()) start_waiting_move();
    refresh();
  }

  Trouble trouble() const {
    if (too_few_axes) return Trouble::kTooFewAxes;
    if (!linked()) return state.refused_when_lost ? Trouble::kNotAccepted : Trouble::kNone;
    if (not_accepted()) return Trouble::kNotAccepted;
    if (!setpoint.known()) {
      if (setpoint.waits_for_rest()) return Trouble::kWaitingForRest;
      if (setpoint.denied()) return Trouble::kCorrectionDenied;
      return relative() ? Trouble::kUnknownSum : Trouble::kUnknownOffset;
    }
    if (stream.odd_cycle()) return Trouble::kOddCycle;
    if (!stream.learnt()) return Trouble::kLearning;
    if (coarse()) return Trouble::kCoarse;
    if (lacks_delay()) return Trouble::kNoDelay;
    if (state.tcp_apart.much()) return Trouble::kTcpDiffers;
    return Trouble::kNone;
  }

  void refresh() {
    state.trouble = trouble();
    state.moving = mover.busy();
    state.input_path = mover.input_path();
    state.input_contact = mover.input_contact();
    state.stops_by_input = mover.stops_by_input();
    state.rereference_pending = rereference_asked;
    state.gaps = stream.gaps();
    state.ipoc_step = stream.step();
    state.jitter_s = spread.sigma_s();
    state.longest_gap_s = spread.longest_s();
    const AxisAngles& commanded = setpoint.commanded_rad();
    std::copy(commanded.begin(), commanded.end(), state.commanded_rad);
  }

  RsiConfig config;
  const WireAxes wire;
  RsiParser parser;
  RsiStream stream{config.silence_cycles};
  ArrivalSpread spread;
  PositionRecord record;
  Mover mover;
  RsiSetpoint setpoint;
  DelayWatch delay;
  RepeatWatch repeats;
  PauseWatch pause;
  MoveQueue queue;

  RobFrame frame;
  AxisAngles held_external;  // EIPos at the reference
  std::array<char, kRsiBuffer> buffer{};
  CoreState state;
  TimePoint last_rx{}, last_sample{};
  /// Newest packet whose Delay is known, or would be if sent, and replies to later (damaged) ones.
  struct {
    std::uint32_t ipoc = 0;
    TimePoint t_rx{};
    std::uint32_t answered_since = 0;
  } counted;
  double held_up_s = 0.0;                 // since the last packet
  double slept_s = 0.0;                   // longest delay of this thread since then
  std::optional<TimePoint> input_due;     // a move waits for the contact input until then
  std::optional<std::uint32_t> answered;  // IPOC of the last reply
  bool rereference_asked = false, too_few_axes = false;
  std::uint32_t damaged_in_a_row = 0;       // with a valid IPOC only
  bool increments_lost = false;             // relative: a reply of this move was not accepted
  bool unanswered = false;                  // the newest packet was not answered
  bool taken = true;                        // the controller accepted the last reply, by its Delay
  std::optional<std::uint32_t> delay_ipoc;  // IPOC of the last packet with a Delay
  bool waited_unanswered = false;  // it arrived after a pause, with the preceding one unanswered
  bool heard_time = false, ending = false, stop_low_sent = false, stop_sent = false;
};

RsiCore::RsiCore(RsiConfig config, ContactGuard* guard)
    : impl_(std::make_unique<Impl>(std::move(config), guard)) {}
RsiCore::~RsiCore() = default;

std::string_view RsiCore::on_datagram(std::string_view bytes, TimePoint t_rx) {
  const std::string_view reply = impl_->on_datagram(bytes, t_rx);
  impl_->refresh();
  return reply;
}

void RsiCore::on_tick(TimePoint now) { impl_->on_tick(now); }
void RsiCore::begin(const Move& move) { impl_->begin(move); }
void RsiCore::stop() { impl_->stop(); }

void RsiCore::rereference() {
  if (impl_->mover.busy() || !impl_->linked()) return;
  impl_->rereference_asked = true;
  impl_->state.link = RobotLink::kNotReferenced;
}

void RsiCore::close() {
  impl_->stop();
  impl_->ending = true;
}

bool RsiCore::end_sent() const { return impl_->stop_sent; }
std::optional<CoreResult> RsiCore::next_result() { return impl_->queue.next_result(); }

std::optional<MoveResult> RsiCore::poll() {
  const auto result = next_result();
  if (!result) return std::nullopt;
  return to_move_result(*result);
}

const CoreState& RsiCore::core_state() const { return impl_->state; }

RobotState RsiCore::state() const {
  return to_robot_state(impl_->state,
                        {"UDP port " + std::to_string(impl_->config.port), impl_->config.sentype});
}

}  // namespace cellcal::drivers
