#pragma once
// What a person or a program sees of the daemon at one moment.

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "calib/model/long_work.h"
#include "calib/model/touch.h"
#include "daemon/result/outcome.h"
#include "daemon/session/failure.h"
#include "daemon/session/interruption.h"
#include "daemon/session/phase.h"
#include "drivers/contact.h"
#include "drivers/robot.h"

namespace cellcal::daemon {

/// How good the links of a session are, as the devices saw it last.
struct LinkReport {
  bool open = false;  ///< the session holds its devices; false: as they were at its end
  drivers::RobotState robot;
  drivers::ContactStatus contact;
};

/// What the controller's newest packet shows of the arm.
enum class ArmMotion : std::uint8_t {
  kUnknown,  ///< no packet within the link's limit
  kAtRest,
  kMoving,
};
const char* to_string(ArmMotion motion);

struct ArmSeen {
  ArmMotion motion = ArmMotion::kUnknown;
  std::optional<double> packet_age_s;  ///< none: no packet since the daemon started
};

/// What the daemon before this one left in its midst, killed or powered off.
struct InterruptedSession {
  std::int64_t session = 0;
  int touches = 0, planned = 0;
  std::string started;
};

/// What a session waits for before its first move.
struct Waiting {
  bool robot = false, contact = false;  ///< the link that is missing
  double left_s = 0.0;                  ///< until it is given up
  std::string start;                    ///< what the operator starts on the pendant
};

/// A touch that is on disk, with what was known of it first.
struct MadeTouch {
  std::int64_t session = 0;
  std::size_t index = 0;  ///< within the session, from 0
  calib::Touch touch;
  std::optional<std::array<double, 3>> tip_m;  ///< where the nominal model has it, base frame
  std::optional<double> residual_m, u95_m;
};

struct Status {
  std::uint64_t seq = 0;           ///< counts up with every change
  std::int64_t session = 0;        ///< 0: none since the daemon started
  std::string kind = "calibrate";  ///< of the session, to_string(SessionKind)
  Phase phase = Phase::kIdle;
  std::string target;  ///< of the touch in hand
  std::size_t done = 0, total = 0;
  /// Of touches chosen one by one: u95 that was asked for, and what the touches so far are foreseen
  /// to give, means over the region.
  std::optional<double> goal_m, u95_m, mean_error_m;
  bool finding = false;                     ///< the touch in hand is made to find a sphere
  std::string stage;                        ///< what the touch in hand is for, in words
  std::optional<calib::WorkDone> planning;  ///< how far the plan is, while it is made
  std::string why_ended;                    ///< why no further touch was chosen
  /// Of cell file and plan, in words: nothing that keeps the session from beginning.
  std::vector<std::string> warnings;
  /// Of the newest touch, nothing before the first; once identified, the fit's mean.
  std::optional<double> residual_m;
  std::optional<double> time_left_s;  ///< touches and the way home; nothing before the first touch
  std::optional<Waiting> waiting;     ///< while connecting; newer than `seq` in service.status()
  InterruptionCounts interruptions;   ///< harmless ones, after which it goes on by itself
  std::optional<double> busy_left_s;  ///< a busy spell is waited for at most so long, arm at rest
  std::string robot_words, contact_words;
  std::optional<Failure> failure;
  std::optional<SessionOutcome> outcome;  ///< once identified
  std::vector<std::string> reasons;       ///< findings of a calibration, in words
  std::string results_dir;                ///< once written
  /// Told of with this status, each of a session once: when its residual is known, at the latest
  /// when the next one is made or the session ends.
  std::shared_ptr<const MadeTouch> made;
  std::optional<InterruptedSession> interrupted;  ///< until a session begins
  ArmSeen arm;                                    ///< newer than `seq` in service.status()
  /// Nothing before the first session has opened its devices. Newer than `seq` in service.status():
  /// figures that move all the time are no change that watchers are told of.
  std::shared_ptr<const LinkReport> links;
};

}  // namespace cellcal::daemon
