#pragma once
// A session ready to begin: inputs read and checked, backend created. Nothing is opened or moved yet.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "calib/model/kinematics.h"
#include "calib/model/robot.h"
#include "calib/model/touch.h"
#include "daemon/journal/journal.h"
#include "daemon/runner/backend.h"
#include "daemon/runner/stated_poses.h"
#include "daemon/service/journal_recorder.h"
#include "daemon/session/phase.h"
#include "daemon/session/state.h"
#include "daemon/tasks/options.h"
#include "drivers/robot.h"
#include "drivers/time.h"

namespace cellcal::daemon {

// Validation of a request before any file is read.

/// A session is under way.
struct BusyError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The request cannot be carried out: wrong file, or nothing to resume.
struct RequestError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Throws RequestError.
void check(const RunRequest& request);

// Settings that a session takes from the configuration when it begins.

struct SessionSettings {
  TouchPolicy touch;
  Timeouts timeouts;
  int retries = 0;  ///< automatic continuations after harmless interruptions
  /// Limits of the current link: a resumed session keeps its own touch policy.
  SearchLimits search_limits{};
  BusyRepeats repeats{};        ///< after lateness of this computer; also of today's configuration
  double speed_fraction = 1.0;  ///< share of the robot file's axis speeds in transits
  double hand_speed_m_s = 0.0;  ///< HandSpeed::Bound; 0: none
  double positioner_speed_rad_s = 0.0;  ///< likewise; 0: the controller bounds it
};

/// `most_speed`: upper bound of the share of the robot file's axis speeds, whatever the configuration allows.
/// `load`: held by the emulated tools.
using MakeBackend = std::function<std::unique_ptr<Backend>(const calib::Cell&, double most_speed,
                                                           const std::string& load)>;

// Remaining time of a session, estimated from the pace of its touches so far.

class TimeLeft {
 public:
  /// Seconds; none before the first touch. Constant while a link is awaited. To be called after every step. `done` and
  /// `total` count touches.
  std::optional<double> update(Phase phase, std::size_t done, std::size_t total,
                               drivers::TimePoint now);

 private:
  std::size_t done_at_first_move_ = 0, last_done_ = 0;
  std::optional<drivers::TimePoint> first_move_;
  drivers::TimePoint last_touch_{};
  std::optional<double> left_s_;  ///< the last estimate
};

// Speed bound for operation with a person inside the cell: in T1 the controller stops an arm under RSI above
// 250 mm/s at the TCP or the flange, and the override does not scale RSI corrections.

class HandSpeed {
 public:
  struct Bound {
    double speed_m_s = 0.0;     ///< of flange, TCPs, joint origins, carried targets; 0: none
    bool mode_unknown = false;  ///< applies in T1, and also where the link does not report the mode
    double positioner_rad_s = 0.0;  ///< speed limit of its axes; 0: the controller bounds it
  };
  /// `speed_fraction`: share of the robot file's axis speeds, as configured for the link. `targets`: of the
  /// cell; those that a positioner carries count.
  HandSpeed(std::shared_ptr<const calib::ArmModel> arm, double speed_fraction, Bound bound,
            const std::vector<calib::Target>& targets = {});

  /// Share of each axis' speed limit for this move from the commanded position (Move::speed_share). 1 for
  /// moves with a speed of their own: searches, and straight lines with a duration.
  double share(const drivers::Move& move, const drivers::RobotState& robot) const;

 private:
  double share_of_leg(const std::vector<double>& from, const std::vector<double>& to) const;
  double share_of_turn(const std::vector<double>& from, const std::vector<double>& to) const;
  double fastest_carried_m(std::vector<double> at, const std::vector<double>& to) const;

  std::shared_ptr<const calib::ArmModel> arm_;
  double speed_fraction_;
  Bound bound_;
  struct Carried {
    std::size_t axes;
    Eigen::Vector3d place_m;  ///< in the frame of the last of them
  };
  std::vector<Carried> carried_;
};

/// Everything that one session owns until it has ended.
struct Job {
  std::int64_t session = 0;  ///< 0: not in the journal yet
  calib::Cell cell;
  SessionInputs inputs;
  SessionOptions options;
  SessionSettings settings;
  std::string started;
  std::string last_ended;     ///< of an update: end of the session that it is based on
  std::string expected_hash;  ///< of a resumed session's plan
  bool resumed = false;
  std::string unattended;
  std::vector<calib::Phrase> warnings;                ///< non-fatal findings in the cell file
  std::shared_ptr<const calib::SearchUnderWay> left;  ///< unfinished search of the previous session
  std::vector<calib::Touch> touches;                  ///< made before the session was resumed
  InterruptionCounts interruptions;                   ///< likewise
  std::unique_ptr<Backend> backend;
  std::shared_ptr<StatedPoses> stated_poses;  ///< by the controller's model of the arm
  std::optional<HandSpeed> hand_speed;        ///< none: an emulated cell
  TouchPublication news;
  TimeLeft time_left;
};

/// Throws RequestError, JournalError, calib::FileError, drivers::ConfigError, drivers::DriverError.
std::unique_ptr<Job> prepare(Journal& journal, const RunRequest& request, SessionSettings settings,
                             const MakeBackend& make_backend);

/// Initial state of the sequence.
State first_state(const Job& job);

}  // namespace cellcal::daemon
