#pragma once
// Interface of a robot as required for touching: move its axes, stop, and report the position.
// Angles are the controller's axis angles in radians, base to flange; time is drivers::TimePoint. No
// geometry. A linear unit that carries the arm is the first axis: metres where a name has radians.
//
// Threads: all functions are called from one thread (the session's). An implementation may run its
// own thread for the controller's cycle. Nothing blocks.
//
// The robot's safe state is 'holds still'. Silence is a failed move, never 'no contact'. After a
// loss of the link nothing moves until rereference() was called and the link is up again.

#include <array>
#include <boost/container/static_vector.hpp>
#include <cstdint>
#include <optional>
#include <vector>

#include "drivers/sentence.h"
#include "drivers/time.h"

namespace cellcal::drivers {

inline constexpr std::size_t kMaxAxes = 12;  // six plus six external, as transmitted

/// Axis angles [rad], of a linear unit its position [m], without allocation, for the cycle.
using AxisAngles = boost::container::static_vector<double, kMaxAxes>;

struct AxisLimit {
  double min_rad = 0.0, max_rad = 0.0;
  double max_speed_rad_s = 0.0;
  double max_acceleration_rad_s2 = 0.0;
  double max_jerk_rad_s3 = 0.0;
  bool linear = false;  ///< a linear unit's, in metres; first
};

enum class MoveKind {
  kTransit,  ///< contact is an error and stops the arm
  kSearch,   ///< guarded: ends at contact; requires an armed contact sensor
  /// Starts in contact, which must have opened by its end. With way-points: by the end of the first
  /// leg, where the arm leaves it at the latest; from then on as in a transit.
  kRetreat,
};

/// A way-point passed without a stop.
struct Via {
  AxisAngles at_rad;
  /// Shares (0..0.5) of the legs before and after. The arm may leave the first one by this share
  /// before the way-point and joins the second by this share after it; in between it stays within
  /// the triangle (convex hull) of those two points and the way-point. 0 for either: it comes to
  /// rest here (and continues immediately).
  double in_share = 0.0, out_share = 0.0;
};

inline constexpr std::size_t kMaxVias = 12;
using Vias = boost::container::static_vector<Via, kMaxVias>;

/// A move is one straight line in joint space, or several with way-points between them. It is
/// atomic: limits of every point are checked before any motion. A stop brings the arm to rest on
/// the path.
struct Move {
  std::uint32_t id = 0;  ///< chosen by the caller, returned in the result
  MoveKind kind = MoveKind::kTransit;
  AxisAngles target_rad;
  /// Duration at constant speed, ramps excluded; the axis limits may make it slower, never faster.
  /// 0: as fast as the limits allow; required with way-points.
  double cruise_s = 0.0;
  std::uint16_t arm_id = 0;  ///< kSearch: the contact sensor's arming that guards this move
  /// Before target_rad, in order; empty: straight to the target. Not for searches. A robot that
  /// cannot keep to the triangles comes to rest at each way-point.
  Vias via{};
  /// Share of each axis' speed limit, above 0 and at most 1: for additional speed limits on this
  /// path.
  double speed_share = 1.0;
};

enum class MoveOutcome {
  kArrived,            ///< target reached and settled (kSearch: end of travel, no contact at all)
  kContact,            ///< kSearch: confirmed contact, arm stopped and settled, latch is filled
  kRevoked,            ///< kSearch: stopped by a trip that was noise
  kStopped,            ///< stop() was called
  kUnexpectedContact,  ///< contact outside an armed search
  kStillInContact,     ///< kRetreat: contact did not open (in time)
  kContactSilent,      ///< contact sensor's heartbeat missing or its link broken: arm stopped
  kRobotSilent,        ///< no packets from the controller: the arm's own time-out stops it
  kRefused,            ///< not started: outside limits, not referenced, not armed, busy
  kNotFollowing,       ///< commanded, but the arm does not follow: clamped, or drives off
};

const char* to_string(MoveOutcome outcome);

/// Interruption of a link that failed a move or invalidated the reference, as far as causes need to
/// be distinguished. The sentences are MoveResult::detail and RobotState::words.
enum class Interruption : std::uint8_t {
  kNone,
  kLateReplies,     ///< the controller continues, and has counted late replies
  kPacketsStopped,  ///< none for some cycles; RobotState::session shows whether it was a pause
  kOther,           ///< program ended or stopped, connection closed, another session began
  // Contact sensor; in MoveResult only.
  kLateBytes,  ///< sent in time, but processed late by this computer
  kUnheard,    ///< silent, with its origin not yet known from stamps
};

/// Position of the arm at the instant of contact.
struct Latch {
  /// Interpolated at the sensor's time stamp of the first edge, or latched by the controller's own
  /// interrupt.
  AxisAngles contact_rad;
  AxisAngles settled_rad;     ///< at rest after the stop
  TimePoint contact_time{};   ///< first edge, host clock
  double time_sigma_s = 0.0;  ///< 1 sigma of the instant of contact_rad
  double reaction_s = 0.0;    ///< first edge to the first frozen reply, or to the stop command
  int bounces = 0;
};

struct MoveResult {
  std::uint32_t id = 0;
  MoveOutcome outcome = MoveOutcome::kRefused;
  Sentence detail;  ///< event, location, and remedy; empty on success
  Interruption interruption = Interruption::kNone;  ///< kRobotSilent, kContactSilent, kRefused
  /// Commanded position. The arm is at rest, or, after a transit or a retreat that arrived, within
  /// the following tolerance and coming to rest.
  AxisAngles at_rad;
  std::optional<Latch> latch;
};

enum class RobotLink {
  kDown,           ///< no packet yet
  kNotReferenced,  ///< packets arrive; nothing moves before rereference()
  kReady,
  kLost,  ///< packets stopped
};

/// Operating mode of the controller's mode selector.
enum class OperatingMode : std::uint8_t {
  kUnknown,  ///< not reported by the link
  kT1,       ///< manual, enabling switch pressed
  kT2,       ///< manual, fast
  kAut,
  kExt,
};

const char* to_string(OperatingMode mode);

/// Second stop path: the controller's input connected to the contact sensor's output, read in the
/// robot's own cycle.
enum class InputPath : std::uint8_t {
  kNone,      ///< not configured, or not supported by this link
  kUntold,    ///< configured, but absent from the newest packet
  kUnproven,  ///< it has not followed a touch recently: only the sensor's bytes can report no contact
  kFollows,
  kMissed,  ///< a touch was not visible at it: no stop path
};

const char* to_string(InputPath path);

/// Request of the controller, if reported by its link.
enum class ControllerRequest : std::uint8_t {
  kNone,
  kBrakeTest,      ///< due: the controller stops some time later
  kMasteringTest,  ///< likewise
  kCollision,      ///< detected by the controller; requires inspection
};

const char* to_string(ControllerRequest request);

/// A TCP in a base: X Y Z [m], A B C [rad], turned by Rz(A) Ry(B) Rx(C).
using StatedTcp = std::array<double, 6>;

/// Link quality, for the status page and the log. 0 if not available.
struct RobotQuality {
  double jitter_s = 0.0;       ///< 1 sigma of the intervals between packets
  double longest_gap_s = 0.0;  ///< longest interval
  std::uint64_t gaps = 0;      ///< missing packets by the controller's own count
  std::uint64_t bad_packets = 0;
  std::uint64_t duplicates = 0;  ///< packets received again
  std::uint64_t replies = 0;
  /// From a packet's arrival to its reply.
  double reply_p50_s = 0.0, reply_p99_s = 0.0, reply_p999_s = 0.0, reply_max_s = 0.0;
  TimeHistogram reply_times;  ///< likewise, since the link was opened
};

struct RobotState {
  RobotLink link = RobotLink::kDown;
  bool linear_unit = false;  ///< the first axis is a linear unit's
  AxisAngles actual_rad;
  AxisAngles commanded_rad;
  /// The controller's active TCP in its active base at actual_rad, by its own model of the arm;
  /// empty: not sent. While the arm moves it may belong to another instant.
  std::optional<StatedTcp> stated_tcp;
  bool moving = false;
  double cycle_s = 0.0;  ///< learned from the controller's packets
  std::uint64_t packets = 0;
  std::uint64_t late = 0;  ///< late replies counted by the controller, if it does
  /// Reason why the link is no longer ready; kNone while it is, and before it was.
  Interruption interruption = Interruption::kNone;
  std::uint32_t interruptions = 0;  ///< number of interruptions
  /// The controller's session: incremented unless proven to be the preceding one.
  std::uint32_t session = 0;
  OperatingMode mode = OperatingMode::kUnknown;
  bool override_slows = false;          ///< the controller's override slows moves down
  std::optional<int> override_percent;  ///< of the programmed speed; empty: not reported
  InputPath input_path = InputPath::kNone;
  std::uint32_t stops_by_input = 0;  ///< by the contact input, before the sensor's bytes
  ControllerRequest request = ControllerRequest::kNone;
  bool needs_operator = false;  ///< the link is up, but drives or program have to be started
  bool unsettled = false;       ///< the link is up, but not yet ready for rereference()
  Sentence words;               ///< fault and what to check
  RobotQuality quality;
};

class Robot {
 public:
  virtual ~Robot() = default;

  /// Opens the link. Throws DriverError (port taken, wrong address).
  virtual void open() = 0;
  virtual RobotState state() const = 0;
  /// Takes the arm's actual position as the starting point of all further moves.
  virtual void rereference() = 0;
  /// Starts a move; one at a time. Its result is returned by poll(), also if it is refused.
  virtual void begin(const Move& move) = 0;
  /// Brings the arm to rest as fast as the link can: at searching speed in the very next reply;
  /// above it, or if the controller moves autonomously, on a ramp.
  virtual void stop() = 0;
  /// Result of a move, returned once.
  virtual std::optional<MoveResult> poll() = 0;
  /// Ends the controller's session (arm at rest) and closes the link.
  virtual void close() = 0;
};

}  // namespace cellcal::drivers
