#include "drivers/kuka/moves/cause.h"

#include <cmath>
#include <utility>
#include <vector>

namespace cellcal::drivers {

namespace {

// Controllers number six axes A1..A6, then external ones E1..
std::string name(WireAxis axis) {
  return axis.place < kArmAxes ? "A" + std::to_string(axis.place + 1)
                               : "E" + std::to_string(axis.place - 5);
}

const char* unit(WireAxis axis) { return axis.linear ? "mm" : "say.unit.deg"; }

constexpr double kMsPerS = 1e3;
/// Whole milliseconds, rounded up, so that a value beyond its limit reads so.
double whole_ms(double seconds) { return std::ceil(kMsPerS * seconds); }

/// A value of an axis and its limit.
std::vector<SentenceValue> of_axis(WireAxis axis, const char* first, double a, const char* second,
                                   double b) {
  return {{"axis", name(axis)}, {"unit", unit(axis)}, {first, a}, {second, b}};
}

/// "way-point 3, ..." where the point of a move concerned is none of 0, its target.
Sentence at_point(std::uint8_t via, Sentence what) {
  return via == 0 ? what : Sentence("say.stop.way_point", {{"n", via}, {"what", std::move(what)}});
}

/// One overload per kind of cause: a missing one is a compile error.
struct Words {
  const CoreResult& result;  ///< link and type of correction, if needed

  /// Causes other than drives and obstacles (named by the session): the controller limits corrections
  /// without a message.
  Sentence checked(const char* what, WireAxis axis, double set_deg, double actual_deg) const {
    auto values = of_axis(axis, "set", set_deg, "actual", actual_deg);
    values.emplace_back("off", std::abs(set_deg - actual_deg));
    return {"say.stop.check_correction",
            {{"what", Sentence(what, std::move(values))},
             {"do", result.in_space ? "say.stop.check_correction.space"
                                    : "say.stop.check_correction.axes"}}};
  }

  Sentence operator()(const cause::None&) const { return {}; }

  // ---- before the move begins ------------------------------------------------------------------

  Sentence operator()(const cause::NotReferenced&) const { return "say.stop.not_referenced"; }
  Sentence operator()(const cause::Busy&) const { return "say.stop.busy"; }
  Sentence operator()(const cause::Closing&) const { return "say.stop.closing"; }
  Sentence operator()(const cause::AxisCount& c) const {
    return {c.via == 0 ? "say.stop.axis_count" : "say.stop.axis_count.way_point",
            {{"given", c.given}, {"expected", c.expected}, {"n", c.via}}};
  }
  Sentence operator()(const cause::NotFinite& c) const {
    return at_point(c.via, {c.axis.linear ? "say.stop.not_finite.linear" : "say.stop.not_finite",
                            {{"axis", name(c.axis)}, {"target", c.target}}});
  }
  Sentence operator()(const cause::BelowLimit& c) const {
    return at_point(c.via, {"say.stop.below_limit",
                            of_axis(c.axis, "target", c.target_deg, "limit", c.limit_deg)});
  }
  Sentence operator()(const cause::AboveLimit& c) const {
    return at_point(c.via, {"say.stop.above_limit",
                            of_axis(c.axis, "target", c.target_deg, "limit", c.limit_deg)});
  }
  Sentence operator()(const cause::CorrectionLimit& c) const {
    // No key sets a linear unit's: over RSI it is refused on a real controller.
    const char* const id = c.axis.linear     ? "say.stop.correction_limit.linear"
                           : result.in_space ? "say.stop.correction_limit.space"
                                             : "say.stop.correction_limit";
    return at_point(c.via,
                    {id, of_axis(c.axis, "correction", c.correction_deg, "limit", c.limit_deg)});
  }
  Sentence operator()(const cause::ShiftLimit& c) const {
    return at_point(c.via,
                    {"say.stop.shift_limit", {{"shift", c.shift_mm}, {"limit", c.limit_mm}}});
  }
  Sentence operator()(const cause::TurnLimit& c) const {
    return at_point(c.via, {"say.stop.turn_limit", {{"turn", c.turn_deg}, {"limit", c.limit_deg}}});
  }
  Sentence operator()(const cause::NearSingular& c) const {
    return at_point(c.via, {"say.stop.near_singular",
                            {{"axis", name(c.axis)}, {"gain", c.gain}, {"limit", c.limit}}});
  }
  Sentence operator()(const cause::BadCruise& c) const {
    return {"say.stop.bad_cruise", {{"s", c.cruise_s}}};
  }
  Sentence operator()(const cause::CruiseByWayPoints& c) const {
    return {"say.stop.cruise_by_way_points", {{"s", c.cruise_s}}};
  }
  Sentence operator()(const cause::SearchByWayPoints& c) const {
    return {"say.stop.search_by_way_points", {{"n", c.vias}}};
  }
  Sentence operator()(const cause::BadShare& c) const {
    return at_point(c.via, {"say.stop.bad_share", {{"share", c.share}, {"limit", c.limit}}});
  }
  Sentence operator()(const cause::StopAsked&) const { return "say.stop.asked"; }
  Sentence operator()(const cause::TravelAtTarget& c) const {
    return {"say.stop.travel_at_target",
            of_axis(c.axis, "travel", c.target_deg - c.from_deg, "from", c.from_deg)};
  }

  // ---- the contact sensor ----------------------------------------------------------------------

  Sentence operator()(const cause::NoSensor&) const { return "say.stop.no_sensor"; }
  Sentence operator()(const cause::NotArmed& c) const {
    return {"say.stop.not_armed", {{"wanted", c.wanted}}};
  }
  Sentence operator()(const cause::ArmedOtherwise& c) const {
    return {"say.stop.armed_otherwise", {{"wanted", c.wanted}, {"in_force", c.in_force}}};
  }
  Sentence operator()(const cause::TouchingAtStart&) const { return "say.stop.touching_at_start"; }
  Sentence operator()(const cause::TrippedAtStart&) const { return "say.stop.tripped_at_start"; }
  Sentence operator()(const cause::SensorDead&) const { return "say.stop.sensor_dead"; }
  Sentence operator()(const cause::SensorLate& c) const { return late_bytes(c.late_s, c.limit_s); }
  Sentence operator()(const cause::KeepAliveLate&) const { return "say.stop.keep_alive_late"; }
  Sentence operator()(const cause::ArmExpired& c) const {
    return c.paced_here ? "say.stop.arm_expired.here" : "say.stop.arm_expired";
  }
  Sentence operator()(const cause::TripUnconfirmed& c) const {
    return {"say.stop.trip_unconfirmed", {{"ms", kMsPerS * c.waited_s}}};
  }
  Sentence operator()(const cause::StampOutside& c) const {
    return {"say.stop.stamp_outside", {{"s", c.age_s}}};
  }
  Sentence operator()(const cause::StampDenied& c) const {
    return {"say.stop.stamp_denied", {{"ms", kMsPerS * c.denied_s}}};
  }
  Sentence operator()(const cause::OpeningUnheard& c) const {
    return {"say.stop.opening_unheard", {{"ms", whole_ms(c.unheard_s)}}};
  }
  Sentence operator()(const cause::TouchedOutsideSearch&) const {
    return "say.stop.touched_outside_search";
  }
  Sentence operator()(const cause::ContactNotOpen&) const { return "say.stop.contact_not_open"; }

  // ---- motion of the arm -----------------------------------------------------------------------

  Sentence operator()(const cause::AxisNotFollowing& c) const {
    return checked("say.stop.axis_not_following", c.axis, c.commanded_deg, c.actual_deg);
  }
  Sentence operator()(const cause::AxisStands& c) const {
    return checked("say.stop.axis_stands", c.axis, c.commanded_deg, c.actual_deg);
  }
  Sentence operator()(const cause::MovedUnasked& c) const {
    return {c.axis.linear ? "say.stop.moved_unasked.linear" : "say.stop.moved_unasked",
            {{"axis", name(c.axis)}, {"actual", c.actual_deg}, {"held", c.held_deg}}};
  }
  Sentence operator()(const cause::NotSettled& c) const {
    return {"say.stop.not_settled", of_axis(c.axis, "moved", c.moved_deg, "s", c.waited_s)};
  }

  // ---- RSI link --------------------------------------------------------------------------------

  Sentence operator()(const cause::NoPackets& c) const {
    return {"say.stop.no_packets", {{"s", c.waited_s}}};
  }
  Sentence operator()(const cause::NotAccepted&) const { return "say.stop.not_accepted"; }
  Sentence operator()(const cause::Silence& c) const {
    return {"say.stop.silence", {{"ms", kMsPerS * c.silent_s}, {"ipoc", result.ipoc}}};
  }
  Sentence operator()(const cause::SessionRestarted& c) const {
    using Sign = cause::SessionRestarted::Sign;
    if (c.sign == Sign::kIpoc) return {"say.stop.restarted", {{"ipoc", result.ipoc}}};
    auto values = of_axis(c.axis, "before", c.before, "after", c.after);
    values.emplace_back("ipoc", result.ipoc);
    return {c.sign == Sign::kDelay ? "say.stop.restarted.delay" : "say.stop.restarted.setpoint",
            std::move(values)};
  }
  Sentence operator()(const cause::DamagedPackets& c) const {
    return {"say.stop.damaged_packets", {{"packets", c.packets}, {"ipoc", result.ipoc}}};
  }
  Sentence operator()(const cause::ReplyBeyondLimit& c) const {
    using Of = cause::ReplyBeyondLimit::Of;
    auto values = of_axis(c.axis, "value", c.value, "limit", c.limit);
    values.emplace_back("per", c.of == Of::kSpeed          ? "/s"
                               : c.of == Of::kAcceleration ? "/s2"
                                                           : "/s3");
    return {"say.stop.reply_beyond_limit", std::move(values)};
  }
  Sentence operator()(const cause::HeldUp& c) const {
    return {"say.stop.held_up",
            {{"ms", whole_ms(c.silent_s)},
             {"limit", kMsPerS * c.limit_s},
             {"slept", kMsPerS * c.slept_s},
             {"ipoc", result.ipoc}}};
  }
  Sentence operator()(const cause::LateReplies& c) const {
    return {"say.stop.late_replies", {{"replies", c.replies}, {"ipoc", result.ipoc}}};
  }
  Sentence operator()(const cause::IncrementLost& c) const {
    return {"say.stop.increment_lost", {{"replies", c.replies}, {"ipoc", result.ipoc}}};
  }
  Sentence operator()(const cause::DelayGone&) const { return "say.stop.delay_gone"; }
  Sentence operator()(const cause::TooCoarse& c) const {
    return {"say.stop.too_coarse", {{"decimals", c.decimals}}};
  }

  // ---- EKI link --------------------------------------------------------------------------------

  Sentence operator()(const cause::NotConnected& c) const {
    return {"say.stop.not_connected", {{"s", c.waited_s}}};
  }
  Sentence operator()(const cause::ControllerNotReady&) const {
    return "say.stop.controller_not_ready";
  }
  Sentence operator()(const cause::CommandNotTaken& c) const {
    return {"say.stop.command_not_taken", {{"s", c.waited_s}}};
  }
  Sentence operator()(const cause::LinkClosed&) const { return "say.stop.link_closed"; }
  Sentence operator()(const cause::SessionTaken& c) const {
    return {"say.stop.session_taken", {{"session", c.session}}};
  }
  Sentence operator()(const cause::DeadMan&) const { return "say.stop.dead_man"; }
  Sentence operator()(const cause::ProgramAborted& c) const {
    return {"say.stop.program_aborted", {{"fault", c.fault}}};
  }
  Sentence operator()(const cause::EndWithdrawn&) const { return "say.stop.end_withdrawn"; }
  Sentence operator()(const cause::InputAtStart&) const { return "say.stop.input_at_start"; }
  Sentence operator()(const cause::InputTouched&) const { return "say.stop.input_touched"; }
  Sentence operator()(const cause::InputMissed&) const { return "say.stop.input_missed"; }
  Sentence operator()(const cause::InputAlone& c) const {
    return {"say.stop.input_alone", {{"ms", kMsPerS * c.waited_s}}};
  }
  Sentence operator()(const cause::OutsideSoftLimits&) const {
    return "say.stop.outside_soft_limits";
  }
  Sentence operator()(const cause::NotFeasible&) const { return "say.stop.not_feasible"; }
  Sentence operator()(const cause::LatchMissing&) const { return "say.stop.latch_missing"; }
  Sentence operator()(const cause::LatchOutOfRange& c) const {
    return {"say.stop.latch_out_of_range",
            of_axis(c.axis, "latched", c.latched_deg, "measured", c.measured_deg)};
  }
  Sentence operator()(const cause::TooFastForFlag& c) const {
    return {"say.stop.too_fast_for_flag",
            of_axis(c.axis, "speed", c.speed_deg_s, "limit", c.limit_deg_s)};
  }
  Sentence operator()(const cause::NotMoving& c) const {
    return {"say.stop.not_moving", {{"s", c.still_s}, {"percent", c.override_percent}}};
  }
  Sentence operator()(const cause::NotAtTarget& c) const {
    return {"say.stop.not_at_target",
            of_axis(c.axis, "target", c.target_deg, "actual", c.actual_deg)};
  }
};

}  // namespace

Sentence words(const CoreResult& result) { return std::visit(Words{result}, result.cause); }

Sentence words(const Cause& cause) {
  CoreResult result;
  result.cause = cause;
  return words(result);
}

MoveResult to_move_result(const CoreResult& r) {
  return {r.id, r.outcome, words(r), r.interruption, r.at_rad, r.latch};
}

}  // namespace cellcal::drivers
