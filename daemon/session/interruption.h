#pragma once
// Classification of failures into harmless ones, after which a session may continue by itself, and all
// others, which are never retried, however rare. One table, with the reason of each row.
//
// A failure is harmless only where the controller keeps running and the arm rests where it was commanded.
// After lateness of this computer, with robot and sensor sound, the session continues by default, a bounded
// number of times (BusyRepeats); after anything else only where the configuration allows it ([session]
// retries). Before anything moves it is verified each time: same session of the controller, no further gap,
// late reply or late heartbeat within Timeouts::watching, a valid clock map of the sensor, a passed self-test
// (or the arm in the contact that it was making), the position referenced anew, and the arm where it was
// left.

#include <array>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "calib/model/touch.h"
#include "calib/plan/plan.h"
#include "daemon/session/action.h"
#include "daemon/session/failure.h"
#include "daemon/session/touch_policy.h"
#include "drivers/robot.h"

namespace cellcal::daemon {

enum class GoesOn {
  kNever,
  kRetries,  ///< up to [session] retries times, where configured
  kRepeats,  ///< by default: this computer was late
};

struct InterruptionRule {
  FailureKind failure;
  /// Cause of the failure; none: any.
  std::optional<drivers::Interruption> by;
  GoesOn goes_on;
  const char* reason;
};

/// Every kind of failure with its possible causes.
std::span<const InterruptionRule> interruption_rule_table();

GoesOn goes_on(FailureKind failure, drivers::Interruption by);

/// Failure kind of a session for the cause of a silent move or a lost link reference.
FailureKind failure_by(drivers::Interruption by, FailureKind otherwise);

/// Cause of harmless interruptions, after which a session continues by itself.
struct CountedCause {
  drivers::Interruption by;
  const char* name;   ///< in journal, API and metrics
  const char* words;  ///< sentence with the number
  bool of_computer;   ///< this computer was late
};
inline constexpr std::array kCountedCauses{
    CountedCause{drivers::Interruption::kLateBytes, "sensor-data-late",
                 "say.interruption.sensor_data_late", true},
    CountedCause{drivers::Interruption::kLateReplies, "robot-replies-late",
                 "say.interruption.robot_replies_late", true},
    CountedCause{drivers::Interruption::kPacketsStopped, "packets-stopped",
                 "say.interruption.packets_stopped", false}};

/// Number of interruptions by cause, in the order of kCountedCauses.
struct InterruptionCounts {
  std::array<int, kCountedCauses.size()> of{};

  int total() const;
  int of_computer() const;  ///< this computer was late
  void count(drivers::Interruption by);
  bool operator==(const InterruptionCounts&) const = default;
};
/// Name of a counted cause; empty for any other.
const char* name_of_cause(drivers::Interruption by);
/// Inverse of name_of_cause(); none for a name that is not counted.
std::optional<drivers::Interruption> cause_of(std::string_view name);
/// "5 sensor data late (this computer was busy), 1 controller packets stopped"; empty without any.
calib::Phrase phrase(const InterruptionCounts& counts);
std::string words(const InterruptionCounts& counts);

/// Tolerance per axis within which the arm counts as not moved: at 40 deg/s, three cycles whose replies were
/// lost leave 0.5 deg, and the arm cannot be jogged while RSI runs.
inline constexpr double kLeftThereRad = 0.0175;  // 1 deg

// Geometry along one search, and agreement of the readings of one touch.
//
// A search is a straight line in joint space from the stand-off to the end; over its 18 mm the tip deviates
// from a straight line in space by micrometres only. Travel along it is the fraction of the joint distance
// times the plan's tip path.

/// Angles of all driven axes: those of a positioner follow those of the arm.
drivers::AxisAngles axis_angles(const calib::JointVector& joint_rad,
                                const std::vector<double>& positioner_rad = {});
calib::JointVector joint_vector(const drivers::AxisAngles& axes_rad);

/// Tip travel [m] from the stand-off to the point of the search line nearest to these joints.
double travel_m(const calib::PlannedTouch& planned, const drivers::AxisAngles& axes_rad);
/// Angles [rad] of all axes at this travel [m].
drivers::AxisAngles at_travel(const calib::PlannedTouch& planned, double travel_m);

/// Travel [m] at which the search for the expected contact begins: 0 (the stand-off) without an expectation,
/// and never beyond the nominal surface.
double approach_m(const calib::PlannedTouch& planned, const calib::ExpectedContact& expected,
                  const TouchPolicy& policy);
/// True if one fast contact is not sufficient; see TouchPolicy.
bool is_surprising(const Reading& reading, const calib::ExpectedContact& expected,
                   const TouchPolicy& policy);

/// Agreeing readings, ordered by travel.
struct Agreement {
  std::vector<Reading> readings;
  double spread_m = 0.0;
};

/// The closest `policy.readings` of all, if they lie within the tolerance.
std::optional<Agreement> find_agreement(std::vector<Reading> readings, const TouchPolicy& policy);

/// The touch: joints of the middle reading, or the mean of the two middle ones. `speed_m_s`: search speed of
/// the readings.
calib::Touch touch_of(const calib::PlannedTouch& planned, const Agreement& agreement,
                      double speed_m_s);

}  // namespace cellcal::daemon
