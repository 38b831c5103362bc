#pragma once
// What any robot can do, as far as touching needs it: move its axes, stop, and say where it is.
// Angles are the controller's axis angles in radians; time is drivers::TimePoint. No geometry.
//
// Threads: one thread (the session's) calls everything here. An implementation may run its own
// thread for the controller's cycle. Nothing here blocks.
//
// The robot's safe state is 'holds still'. Silence is a failed move, never 'no contact'. After the
// link was lost nothing moves until rereference() was called and the link is up again.

#include <boost/container/static_vector.hpp>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "drivers/time.h"
#include "drivers/time_histogram.h"

namespace cellcal::drivers {

inline constexpr std::size_t kMaxAxes = 12;  // six and six external, as on the wire

/// Axis angles [rad] without allocation, for the cycle.
using AxisAngles = boost::container::static_vector<double, kMaxAxes>;

struct AxisLimit {
  double min_rad = 0.0, max_rad = 0.0;
  double max_speed_rad_s = 0.0;
  double max_acceleration_rad_s2 = 0.0;
  double max_jerk_rad_s3 = 0.0;
};

enum class MoveKind {
  kTransit,  ///< contact is an error and stops the arm
  kSearch,   ///< guarded: contact is what the move is for; needs an armed contact sensor
  /// Starts in contact, which must have opened by its end. With way-points: by the end of the first
  /// leg, where the arm leaves it at the latest; from then on as in a transit.
  kRetreat,
};

/// A way-point that is passed without a stop.
struct Via {
  AxisAngles at_rad;
  /// Shares (0..0.5) of the leg that leads here and of the one that leads on. The arm may leave the
  /// first by so much before the way-point and joins the second by so much behind it; in between it
  /// stays within the triangle (convex hull) of those two points and the way-point. 0 for either:
  /// it comes to rest here (and goes on at once).
  double in_share = 0.0, out_share = 0.0;
};

inline constexpr std::size_t kMaxVias = 12;
using Vias = boost::container::static_vector<Via, kMaxVias>;

/// A move is one straight line in joint space, or several with way-points between them. It is all
/// of it or nothing: limits of every point are checked before anything moves. A stop brings the arm
/// to rest on the path.
struct Move {
  std::uint32_t id = 0;  ///< chosen by the caller, returned in the result
  MoveKind kind = MoveKind::kTransit;
  AxisAngles target_rad;
  /// The move's duration at constant speed, as if it had no ramps; the axis limits may make it
  /// slower, never faster. 0: as fast as the limits allow; the only one with way-points.
  double cruise_s = 0.0;
  std::uint16_t arm_id = 0;  ///< kSearch: the contact sensor's arming that guards this move
  /// Before target_rad, in order; none: straight to the target. Not for searches. A robot that
  /// cannot keep to the triangles comes to rest at each way-point.
  Vias via{};
  /// Of each axis' speed limit, above 0 and at most 1: what else bounds the speed on this way.
  double speed_share = 1.0;
};

enum class MoveOutcome {
  kArrived,            ///< target reached and settled (kSearch: end of travel, never any contact)
  kContact,            ///< kSearch: confirmed contact, arm stopped and settled, latch is filled
  kRevoked,            ///< kSearch: arm stopped on a trip that was noise
  kStopped,            ///< stop() was called
  kUnexpectedContact,  ///< contact outside an armed search
  kStillInContact,     ///< kRetreat: contact did not open (in time)
  kContactSilent,      ///< contact sensor's heartbeat missing or its link broken: arm stopped
  kRobotSilent,        ///< no packets from the controller: the arm's own time-out stops it
  kRefused,            ///< not begun: outside limits, not referenced, not armed, busy
  kNotFollowing,       ///< commanded, but the arm does not follow: clamped, or its drives are off
};

const char* to_string(MoveOutcome outcome);

/// What made a link fail a move, or the controller's lose its reference, as far as such causes have
/// to be told apart. Words are in MoveResult::detail and RobotState::words.
enum class Interruption : std::uint8_t {
  kNone,
  kLateReplies,     ///< the controller runs on, and has counted replies that came late
  kPacketsStopped,  ///< none for some cycles; RobotState::session says whether it was a pause
  kOther,           ///< program ended or stopped, connection closed, another session began
  // Of the contact sensor; in MoveResult alone.
  kLateBytes,  ///< it sent in time, and this computer delivered its bytes late
  kUnheard,    ///< silent, and its stamps do not tell yet whose silence it was
};

/// Where the arm was at the instant of contact.
struct Latch {
  /// Interpolated at the sensor's time stamp of the first edge, or latched by the controller's own
  /// interrupt.
  AxisAngles contact_rad;
  AxisAngles settled_rad;     ///< at rest after the stop
  TimePoint contact_time{};   ///< first edge, host clock
  double time_sigma_s = 0.0;  ///< 1 sigma of the instant that contact_rad belongs to
  double reaction_s = 0.0;    ///< first edge to the first frozen reply, or to the word of a stop
  int bounces = 0;
};

struct MoveResult {
  std::uint32_t id = 0;
  MoveOutcome outcome = MoveOutcome::kRefused;
  std::string detail;  ///< what happened, where, and what to do next; empty on success
  Interruption interruption = Interruption::kNone;  ///< kRobotSilent, kContactSilent, kRefused
  /// Commanded position. The arm is at rest, or, behind a transit or a retreat that arrived, within
  /// the following tolerance and about to be.
  AxisAngles at_rad;
  std::optional<Latch> latch;
};

enum class RobotLink {
  kDown,           ///< no packet yet
  kNotReferenced,  ///< packets arrive; nothing moves before rereference()
  kReady,
  kLost,  ///< packets stopped
};

/// How the controller may be moved, as its mode selector stands.
enum class OperatingMode : std::uint8_t {
  kUnknown,  ///< the link does not tell
  kT1,       ///< by hand, enabling switch pressed
  kT2,       ///< likewise, fast
  kAut,
  kExt,
};

const char* to_string(OperatingMode mode);

/// The second stop path: the controller's input that the contact sensor's output is wired to, read in
/// the robot's own cycle.
enum class InputPath : std::uint8_t {
  kNone,    ///< not configured, or this link has none
  kUntold,  ///< configured, and the newest packet does not have it
  kUnproven,  ///< it has not followed a touch lately: the sensor's bytes alone say that nothing is touched
  kFollows,
  kMissed,  ///< a touch did not show at it: it stops nothing
};

const char* to_string(InputPath path);

/// What the controller asks for, as far as its link tells.
enum class ControllerRequest : std::uint8_t {
  kNone,
  kBrakeTest,      ///< due: it stops by itself some time later
  kMasteringTest,  ///< likewise
  kCollision,      ///< it has detected one: somebody has to look
};

const char* to_string(ControllerRequest request);

/// Link quality, for the status page and the log. 0 where a link has no such figure.
struct RobotQuality {
  double jitter_s = 0.0;       ///< 1 sigma of the times from packet to packet
  double longest_gap_s = 0.0;  ///< longest of them
  std::uint64_t gaps = 0;      ///< packets missing by the controller's own count
  std::uint64_t bad_packets = 0;
  std::uint64_t replies = 0;
  /// From a packet's arrival to its reply.
  double reply_p50_s = 0.0, reply_p99_s = 0.0, reply_p999_s = 0.0, reply_max_s = 0.0;
  TimeHistogram reply_times;  ///< the same, since the link was opened
};

struct RobotState {
  RobotLink link = RobotLink::kDown;
  AxisAngles actual_rad;
  AxisAngles commanded_rad;
  bool moving = false;
  double cycle_s = 0.0;  ///< learnt from the controller: from packet to packet
  std::uint64_t packets = 0;
  std::uint64_t late = 0;  ///< late replies that the controller has counted, if it does
  /// Why the link is not ready any more; kNone while it is, and before it was.
  Interruption interruption = Interruption::kNone;
  std::uint32_t interruptions = 0;  ///< how often it was not
  /// The controller's session: another number where it is not proven to be the one before.
  std::uint32_t session = 0;
  OperatingMode mode = OperatingMode::kUnknown;
  std::optional<int> override_percent;  ///< of the programmed speed; none: the link does not tell
  InputPath input_path = InputPath::kNone;
  std::uint32_t stops_by_input = 0;  ///< by it, before the sensor's bytes
  ControllerRequest request = ControllerRequest::kNone;
  bool needs_operator = false;  ///< the link is up; drives or program have to be started
  bool unsettled = false;       ///< the link is up, and not yet fit for rereference()
  std::string words;            ///< for people: what is wrong and what to check
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
  /// Begins a move; one at a time. Its result appears in poll(), also when it is refused.
  virtual void begin(const Move& move) = 0;
  /// Brings the arm to rest, as fast as the link can: at searching speed in the very next reply,
  /// above it, or where the controller moves by itself, on a ramp.
  virtual void stop() = 0;
  /// The result of a move, once.
  virtual std::optional<MoveResult> poll() = 0;
  /// Ends the controller's session (arm at rest) and closes the link.
  virtual void close() = 0;
};

}  // namespace cellcal::drivers
