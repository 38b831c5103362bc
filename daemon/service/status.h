#pragma once
// Status of the daemon at one moment, as seen by operators and programs.

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "calib/model/enum_table.h"
#include "calib/model/long_work.h"
#include "calib/model/touch.h"
#include "daemon/journal/records.h"
#include "daemon/result/outcome.h"
#include "daemon/session/failure.h"
#include "daemon/session/interruption.h"
#include "daemon/session/phase.h"
#include "drivers/contact.h"
#include "drivers/robot.h"
#include "drivers/time.h"

namespace cellcal::daemon {

/// Link quality of a session, as last reported by the devices.
struct LinkReport {
  bool open = false;  ///< the session holds its devices; false: values at its end
  drivers::RobotState robot;
  drivers::ContactStatus contact;
  std::size_t positioner_axes = 0;  ///< last ones of the robot's axes
};

/// Motion of the arm according to the controller's newest packet.
enum class ArmMotion : std::uint8_t {
  kUnknown,  ///< no packet within the link's limit
  kAtRest,
  kMoving,
};
/// "at rest"
constexpr const char* to_string(ArmMotion motion) { return own_name<' '>(motion); }

struct ArmSeen {
  ArmMotion motion = ArmMotion::kUnknown;
  std::optional<double> packet_age_s;  ///< none: no packet since the daemon started
};

/// Newest session, left unfinished by an earlier daemon process.
struct InterruptedSession {
  std::int64_t session = 0;
  int touches = 0, planned = 0;
  std::string started;
  RecordState ending = RecordState::kInterrupted;  ///< or aborted, failed
  std::string anew;                                ///< as Status::anew
  std::string kind = "calibrate";                  ///< likewise
  std::optional<FailureKind> failure{};            ///< none: interrupted, or aborted by a person

  bool resumable() const { return anew.empty() && !(failure && fails_again(*failure)); }
};

/// Links that a session waits for before its first move.
struct Waiting {
  bool robot = false, contact = false;  ///< the missing link
  double left_s = 0.0;                  ///< time until the timeout [s]
  calib::Phrase start;                  ///< program to start on the pendant
};

/// A touch that is on disk, with its first residual.
struct MadeTouch {
  std::int64_t session = 0;
  std::size_t index = 0;  ///< within the session, from 0
  calib::Touch touch;
  bool linear_unit = false;                    ///< the touch's first joint is a linear unit's
  std::optional<std::array<double, 3>> tip_m;  ///< by the nominal model [m, base frame]
  std::optional<double> residual_m, u95_m;
};

/// Sessions that begin without a person, as far as they concern a person at the cell.
struct ScheduleSeen {
  calib::Phrase held;  ///< why none begins, and the remedy; empty: not held
  bool open = false;   ///< one may begin or be resumed at any moment
  /// Next window [s since 1970]; none while a person has to release.
  std::optional<std::int64_t> next_utc_s;
  bool operator==(const ScheduleSeen&) const = default;
};

struct Status {
  std::uint64_t seq = 0;           ///< increases with every change
  std::int64_t session = 0;        ///< 0: none since the daemon started
  std::string kind = "calibrate";  ///< of the session, to_string(SessionKind)
  std::string load;                ///< held in its touches; empty: none
  std::string anew;  ///< command of a new one of a kind that is not resumed; empty: it is resumed
  Phase phase = Phase::kIdle;
  std::string target;  ///< of the current touch
  std::size_t done = 0, total = 0;
  /// With touches chosen one by one: requested u95, and the values predicted from the touches so far, means
  /// over the region.
  std::optional<double> goal_m, u95_m, mean_error_m;
  bool finding = false;                     ///< the current touch serves to locate a sphere
  calib::Phrase stage;                      ///< purpose of the current touch
  std::optional<calib::WorkDone> planning;  ///< progress of planning
  calib::Phrase why_ended;                  ///< why no further touch was chosen
  /// Non-fatal findings in cell file and plan, in words.
  std::vector<calib::Phrase> warnings;
  /// Residual of the newest touch, none before the first; after identification, the mean of the fit.
  std::optional<double> residual_m;
  std::optional<double> time_left_s;  ///< touches and the way home; none before the first touch
  /// While connecting; in service.status() it may be newer than `seq`.
  std::optional<Waiting> waiting;
  /// Harmless interruptions, after which the session continues by itself.
  InterruptionCounts interruptions;
  /// Remaining wait for a busy spell of this computer, arm at rest.
  std::optional<double> busy_left_s;
  calib::Phrase robot_words, contact_words;
  std::optional<Failure> failure;
  std::optional<SessionOutcome> outcome;  ///< after identification
  std::vector<std::string> reasons;       ///< findings of a calibration, in words
  std::string results_dir;                ///< set once the files are written
  /// Published once per touch: when its residual is known, at the latest with the next touch or the end of
  /// the session.
  std::shared_ptr<const MadeTouch> made;
  std::optional<InterruptedSession> interrupted;  ///< until a session begins
  std::optional<ScheduleSeen> schedule;           ///< none: not known yet
  ArmSeen arm;  ///< in service.status() it may be newer than `seq`
  /// None before the first session has opened its devices. In service.status() newer than `seq`: continuously
  /// varying figures do not count as a change.
  std::shared_ptr<const LinkReport> links;

  /// `session` ended unfinished, and a resume goes on with it.
  bool resumable() const {
    const bool unfinished = phase == Phase::kFailed || phase == Phase::kAborted;
    return unfinished && session > 0 && anew.empty() && !(failure && fails_again(failure->kind));
  }
};

// Motion of the arm as reported by the newest controller packet; nothing is extrapolated beyond that packet.

/// Accumulates successive samples of the robot state. Not thread-safe.
class ArmWatch {
 public:
  void update(const drivers::RobotState& robot, drivers::TimePoint now);
  ArmSeen seen(drivers::TimePoint now) const;

 private:
  drivers::AxisAngles posture_;  ///< reference for the next sample
  drivers::TimePoint posture_at_{};
  /// Time of the sample that brought the newest packet.
  std::optional<drivers::TimePoint> packet_at_;
  std::uint64_t packets_ = 0;
  bool driven_ = false;         ///< moved by a command, at the previous sample
  std::optional<bool> moving_;  ///< none: link lost, or a single packet, which shows no motion
};

}  // namespace cellcal::daemon
