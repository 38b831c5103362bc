#include "drivers/kuka/rsi_core.h"

#include <algorithm>
#include <array>
#include <boost/container/static_vector.hpp>
#include <cmath>
#include <numbers>

#include "drivers/kuka/arrival_spread.h"
#include "drivers/kuka/move_check.h"
#include "drivers/kuka/position_record.h"
#include "drivers/kuka/rsi_mover.h"
#include "drivers/kuka/rsi_offset.h"
#include "drivers/kuka/rsi_stream.h"

namespace cellcal::drivers {
namespace {

constexpr double kDegPerRad = 180.0 / std::numbers::pi;
constexpr double kRadPerDeg = std::numbers::pi / 180.0;

// AIPos with fewer decimals is a hundredth of a degree or worse: 0.2 mm at 1.4 m.
constexpr int kFewestDecimals = 3;
// If all of this many replies and more count as late, they are refused, not late.
constexpr std::uint64_t kRefusedReplies = 10;
// The reference is the mean of AIPos over two windows that agree: the arm rests.
constexpr std::size_t kReferenceWindow = 12;
constexpr double kReferenceStillRad = 0.002 * kRadPerDeg;
// ASPos repeats itself to the last digit; this allows for one decimal less than is accepted.
constexpr double kSamePoseRad = 0.01 * kRadPerDeg;
constexpr std::size_t kResultDepth = 16;

double seconds(Duration d) { return std::chrono::duration<double>(d).count(); }

AxisAngles take_axes(const AxisAngles& first_deg, const AxisAngles& external_deg,
                     std::size_t count) {
  AxisAngles rad;
  for (std::size_t i = 0; i < first_deg.size() && rad.size() < count; ++i) {
    rad.push_back(first_deg[i] * kRadPerDeg);
  }
  for (std::size_t i = 0; i < external_deg.size() && rad.size() < count; ++i) {
    rad.push_back(external_deg[i] * kRadPerDeg);
  }
  return rad;
}

}  // namespace

struct RsiCore::Impl {
  Impl(RsiConfig c, ContactGuard* guard)
      : config((c.validate(), std::move(c))), mover(config, guard, record) {
    state.axes = static_cast<std::uint8_t>(config.limits.size());
    finder.begin(memory);
  }

  // ---- one packet ------------------------------------------------------------------------------

  std::string_view on_datagram(std::string_view bytes, TimePoint t_rx) {
    note_time(t_rx);
    check_silence();
    WireError error = parser.parse_rob(bytes, frame);
    if (error == WireError::kNone &&
        take_axes(frame.axes_deg, frame.external_deg, axes()).size() < axes()) {
      too_few_axes = true;
      error = WireError::kNoAxes;
    }
    if (error != WireError::kNone) return on_bad(error, bytes, t_rx);
    too_few_axes = false;

    if (state.link == RobotLink::kDown || state.link == RobotLink::kLost) begin_session();
    Arrival arrival = stream.push(frame, t_rx);
    if (arrival == Arrival::kRestart || (arrival == Arrival::kNext && start_pose_moved())) {
      lose(Cause::kSessionRestarted, 0.0);
      begin_session();
      arrival = stream.push(frame, t_rx);
    }
    if (arrival == Arrival::kStale) return {};
    ++state.packets;
    last_rx = t_rx;
    spread.add(t_rx);
    state.sends_setpoint = !frame.setpoint_axes_deg.empty();
    state.sends_delay = frame.delay.has_value();
    note_delay();
    const AxisAngles actual = take_axes(frame.axes_deg, frame.external_deg, axes());
    std::copy(actual.begin(), actual.end(), state.actual_rad);
    state.ipoc = frame.ipoc.value;
    state.decimals = stream.decimals();
    state.cycle_s = stream.cycle_s();
    mover.listen(t_rx);
    // The same packet twice is answered twice, but is one cycle.
    if (arrival == Arrival::kRepeat) return offset_known ? hold(t_rx) : std::string_view{};

    record.push(t_rx, frame.ipoc.value, actual, offset_known ? commanded : actual);
    if (!offset_known && !find_offset(actual, t_rx)) return {};
    if (state.link == RobotLink::kNotReferenced) {
      follow_actual();
      try_reference();
    }
    take_up_pending();
    if (const auto done = mover.step(mover_cycle(t_rx, true), commanded)) finish(*done);
    record.set_commanded(commanded);
    return reply();
  }

  std::string_view on_bad(WireError error, std::string_view bytes, TimePoint t_rx) {
    ++state.bad_packets;
    state.last_error = error;
    const std::size_t shown = std::min(bytes.size(), sizeof state.last_bad - 1);
    for (std::size_t i = 0; i < shown; ++i) {
      state.last_bad[i] = bytes[i] >= ' ' && bytes[i] <= '~' ? bytes[i] : '.';
    }
    state.last_bad[shown] = '\0';
    if (!frame.has_ipoc) return {};
    if (frame.only_ipoc && !linked()) {
      // RSI 2 opens a session so; its correction is 0, and it wants an answer.
      session_start = true;
      const std::array<double, kMaxAxes> zeros{};
      return format_sen(names(), std::span(zeros).first(axes()), config.decimals, stop_value(),
                        frame.ipoc.text.view(), buffer);
    }
    if (!offset_known || !linked()) return {};
    // The sensor is heard, whatever the packet was like; the move does not advance.
    mover.listen(t_rx);
    return hold(t_rx);
  }

  std::string_view hold(TimePoint t_rx) {
    if (const auto done = mover.step(mover_cycle(t_rx, false), commanded)) finish(*done);
    return reply();
  }

  std::string_view reply() {
    std::array<double, kMaxAxes> correction_deg{};
    for (std::size_t i = 0; i < axes(); ++i) {
      correction_deg[i] = (commanded[i] - base[i]) * kDegPerRad;
    }
    const std::optional<int> stop = stop_value();
    const std::string_view text = format_sen(names(), std::span(correction_deg).first(axes()),
                                             config.decimals, stop, frame.ipoc.text.view(), buffer);
    if (text.empty()) return text;
    ++state.replies;
    ++session_replies;
    stop_sent = stop_sent || (stop && *stop == 1);
    memory.known = true;
    for (std::size_t i = 0; i < axes(); ++i) sent[i] = commanded[i] - base[i];
    return text;
  }

  // ---- session ---------------------------------------------------------------------------------

  void begin_session() {
    silence_before_s = state.waited_s;
    start_pose.clear();
    stream.reset();
    spread.reset();
    record.clear();
    offset_known = false;
    rereference_asked = false;
    first_delay.reset();
    session_replies = 0;
    finder.begin(memory);
    state.link = RobotLink::kNotReferenced;
  }

  /// Packets have stopped, or are another session's.
  void lose(Cause cause, double a) {
    if (mover.busy()) finish(mover.abandon(cause, a));
    if (pending) refuse(*pending, {cause, 0, a, 0.0});
    pending.reset();
    if (memory.known && offset_known) {
      memory.sent_rad = sent;
      memory.ipoc = state.ipoc;
      memory.step = stream.step();
      memory.seconds_per_ipoc = stream.seconds_per_ipoc();
      memory.t_rx = last_rx;
      memory.delay = last_delay;
      memory.delay_counts = delay_counts;
    }
    rereference_asked = false;
    offset_known = false;
    state.link = RobotLink::kLost;
  }

  /// ASPos is the pose at RSI_ON: where it changes, a new session began, or the KRL program moves
  /// the arm itself. Either way the correction means something else now.
  bool start_pose_moved() {
    const AxisAngles setpoint =
        take_axes(frame.setpoint_axes_deg, frame.setpoint_external_deg, axes());
    if (setpoint.size() != axes()) return false;
    if (start_pose.empty()) start_pose = setpoint;
    for (std::size_t i = 0; i < axes(); ++i) {
      if (std::abs(setpoint[i] - start_pose[i]) > kSamePoseRad) return true;
    }
    return false;
  }

  bool find_offset(const AxisAngles& actual, TimePoint t_rx) {
    OffsetEvidence evidence;
    evidence.t_rx = t_rx;
    evidence.ipoc = frame.ipoc.value;
    evidence.actual_rad = actual;
    const AxisAngles setpoint =
        take_axes(frame.setpoint_axes_deg, frame.setpoint_external_deg, axes());
    if (setpoint.size() == axes()) evidence.setpoint_rad = setpoint;
    evidence.delay = frame.delay;
    evidence.silence_before_s = silence_before_s;
    evidence.session_start = session_start;
    verdict = finder.look(evidence);
    if (verdict != OffsetVerdict::kKnown) return false;
    session_start = false;
    offset_known = true;
    sent = finder.offset_rad();
    first_delay = frame.delay;
    follow_actual();
    return true;
  }

  /// Not referenced: what is commanded is where the arm is, and the correction stays what it is.
  void follow_actual() {
    set_base(record.newest().actual_rad);
    record.set_commanded(commanded);
  }

  void set_base(const AxisAngles& at_rad) {
    commanded = base = at_rad;
    for (std::size_t i = 0; i < axes(); ++i) base[i] -= sent[i];
  }

  void try_reference() {
    if (!rereference_asked || !fit_for_reference() || record.size() < 2 * kReferenceWindow) return;
    const AxisAngles late = record.mean_actual_rad(0, kReferenceWindow);
    const AxisAngles early = record.mean_actual_rad(kReferenceWindow, kReferenceWindow);
    for (std::size_t i = 0; i < axes(); ++i) {
      if (std::abs(late[i] - early[i]) > kReferenceStillRad) return;
    }
    set_base(late);
    rereference_asked = false;
    state.link = RobotLink::kReady;
  }

  bool fit_for_reference() const {
    return stream.learnt() && stream.decimals() >= kFewestDecimals && !not_accepted();
  }

  void note_delay() {
    if (!frame.delay) return;
    if (last_delay && *frame.delay > *last_delay) {
      const std::uint32_t more = *frame.delay - *last_delay;
      delay_counts = true;
      state.late += more;
      if (mover.busy()) {
        state.late_while_moving += more;
        if (state.late_while_moving >= static_cast<std::uint32_t>(config.late_replies_limit)) {
          mover.halt(MoveOutcome::kRobotSilent, Cause::kLateReplies, state.late_while_moving);
        }
      }
    }
    last_delay = frame.delay;
  }

  bool not_accepted() const {
    return session_replies >= kRefusedReplies && first_delay && last_delay &&
           *last_delay >= *first_delay &&
           *last_delay - *first_delay + 2 >= session_replies;  // two are on their way
  }

  // ---- moves -----------------------------------------------------------------------------------

  void begin(const Move& move) {
    if (pending || mover.busy()) {
      refuse(move, {Cause::kBusy, 0, 0.0, 0.0});
    } else {
      pending = move;
    }
  }

  void take_up_pending() {
    if (!pending) return;
    const Move move = *pending;
    pending.reset();
    if (ending) return refuse(move, {Cause::kClosing, 0, 0.0, 0.0});
    if (!linked()) return refuse(move, {Cause::kNoPackets, 0, state.waited_s, 0.0});
    if (not_accepted()) return refuse(move, {Cause::kNotAccepted, 0, 0.0, 0.0});
    if (state.link != RobotLink::kReady) return refuse(move, {Cause::kNotReferenced, 0, 0.0, 0.0});
    if (const auto objection = object_to(move, config, base)) return refuse(move, *objection);
    state.late_while_moving = 0;
    if (const auto refusal = mover.start(move, commanded)) finish(*refusal);
  }

  void refuse(const Move& move, const Objection& why, MoveOutcome outcome = MoveOutcome::kRefused) {
    CoreResult refusal;
    refusal.id = move.id;
    refusal.outcome = outcome;
    refusal.cause = why.cause;
    refusal.axis = why.axis;
    refusal.a = why.a;
    refusal.b = why.b;
    refusal.at_rad = commanded;
    finish(refusal);
  }

  void finish(CoreResult result) {
    result.ipoc = state.ipoc;
    // The pose is no longer what was commanded: somebody has to look before it moves again.
    if (result.outcome == MoveOutcome::kNotFollowing && state.link == RobotLink::kReady) {
      state.link = RobotLink::kNotReferenced;
    }
    if (results.size() == results.capacity()) results.erase(results.begin());
    results.push_back(result);
  }

  void stop() {
    if (pending) {
      refuse(*pending, {Cause::kStopAsked, 0, 0.0, 0.0}, MoveOutcome::kStopped);
      pending.reset();
    }
    mover.halt(MoveOutcome::kStopped, Cause::kStopAsked);
  }

  // ---- small things ----------------------------------------------------------------------------

  std::size_t axes() const { return config.limits.size(); }
  bool linked() const {
    return state.link == RobotLink::kNotReferenced || state.link == RobotLink::kReady;
  }
  SenNames names() const {
    return {config.sentype, config.axis_tag, config.external_axis_tag, config.stop_tag};
  }
  std::optional<int> stop_value() const {
    if (config.stop_tag.empty()) return std::nullopt;
    return ending && !mover.busy() ? 1 : 0;
  }
  MoverCycle mover_cycle(TimePoint now, bool advance) const {
    return {now, stream.cycle_s(), stream.seconds_per_ipoc(), advance};
  }

  void note_time(TimePoint now) {
    if (!heard_time) {
      heard_time = true;
      last_rx = now;
    }
    state.waited_s = seconds(now - last_rx);
  }

  void check_silence() {
    if (linked() && state.waited_s > stream.silence_limit_s()) {
      lose(Cause::kSilence, state.waited_s);
    }
  }

  void on_tick(TimePoint now) {
    note_time(now);
    check_silence();
    if (!linked()) take_up_pending();
    refresh();
  }

  Trouble trouble() const {
    if (too_few_axes) return Trouble::kTooFewAxes;
    if (!linked()) return Trouble::kNone;
    if (!offset_known) {
      return verdict == OffsetVerdict::kWaitForRest ? Trouble::kWaitingForRest
                                                    : Trouble::kUnknownOffset;
    }
    if (not_accepted()) return Trouble::kNotAccepted;
    if (stream.odd_cycle()) return Trouble::kOddCycle;
    if (!stream.learnt()) return Trouble::kLearning;
    if (stream.decimals() < kFewestDecimals) return Trouble::kCoarse;
    return Trouble::kNone;
  }

  void refresh() {
    state.trouble = trouble();
    state.moving = mover.busy();
    state.rereference_pending = rereference_asked;
    state.gaps = stream.gaps();
    state.ipoc_step = stream.step();
    state.jitter_s = spread.sigma_s();
    state.longest_gap_s = spread.longest_s();
    std::copy(commanded.begin(), commanded.end(), state.commanded_rad);
  }

  RsiConfig config;
  RsiParser parser;
  RsiStream stream{config.silence_cycles};
  ArrivalSpread spread;
  PositionRecord record;
  Mover mover;
  OffsetFinder finder;
  OffsetMemory memory;
  OffsetVerdict verdict = OffsetVerdict::kUnknown;

  RobFrame frame;
  std::array<char, kRsiBuffer> buffer{};
  CoreState state;
  bool heard_time = false;
  TimePoint last_rx{};
  double silence_before_s = 0.0;

  bool offset_known = false;
  bool session_start = false;
  bool rereference_asked = false;
  bool too_few_axes = false;
  AxisAngles start_pose;                                         // ASPos of this session
  AxisAngles sent = AxisAngles(config.limits.size(), 0.0);       // correction in the last reply
  AxisAngles base = AxisAngles(config.limits.size(), 0.0);       // pose at correction 0
  AxisAngles commanded = AxisAngles(config.limits.size(), 0.0);  // base + correction

  std::optional<std::uint32_t> last_delay, first_delay;
  bool delay_counts = false;
  std::uint64_t session_replies = 0;

  std::optional<Move> pending;
  bool ending = false, stop_sent = false;
  boost::container::static_vector<CoreResult, kResultDepth> results;
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

void RsiCore::end_session() {
  impl_->stop();
  impl_->ending = true;
}

bool RsiCore::end_sent() const { return impl_->stop_sent; }

std::optional<CoreResult> RsiCore::take_result() {
  auto& results = impl_->results;
  if (results.empty()) return std::nullopt;
  const CoreResult oldest = results.front();
  results.erase(results.begin());
  return oldest;
}

std::optional<MoveResult> RsiCore::poll() {
  const auto result = take_result();
  if (!result) return std::nullopt;
  return to_move_result(*result);
}

const CoreState& RsiCore::core_state() const { return impl_->state; }

RobotState RsiCore::state() const {
  return to_robot_state(impl_->state,
                        {"UDP port " + std::to_string(impl_->config.port), impl_->config.sentype});
}

}  // namespace cellcal::drivers
