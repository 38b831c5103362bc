#pragma once
// A few touches planned ahead with a calibration: offered one by one with a path from the arm's current
// position, and their results.

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "calib/result/calibration.h"
#include "daemon/journal/journal.h"
#include "daemon/tasks/tasks.h"

namespace cellcal::daemon {

/// Angles of all axes, as a session has them, for the planners: a positioner's as calib::resting_at().
struct PartedAxes {
  calib::JointVector arm_rad;
  std::vector<double> positioner_rad;
};
PartedAxes parted(const calib::Robot& robot, const calib::JointVector& all_rad);

/// Used by the worker only, job after job.
class PlannedRound {
 public:
  enum class Became { kOpen, kMade, kMissed, kSetAside };

  /// `calibration`: used for the paths. Obstacles are those currently in the cell.
  PlannedRound(std::shared_ptr<const TaskInputs> inputs, const calib::Calibration& calibration);

  /// Replaces the calibration used for the paths.
  void know(const calib::Calibration& calibration);
  const calib::Calibration& calibration() const { return calibration_; }
  const calib::Plan& plan() const { return plan_; }
  Became became(std::size_t planned) const { return became_[planned]; }
  /// Index of the touch made; none where none was made.
  std::optional<std::size_t> touch_of(std::size_t planned) const { return touch_of_[planned]; }
  bool all_done() const;

  /// Appends the touches. Throws calib::PlanError, without any change, where the controller's session cannot
  /// reach them.
  void add(calib::Plan plan);
  /// Records the result of the current touch.
  void learn(const ChooseTouch& how, const std::vector<calib::Touch>& touches);
  /// The next open touch, or the way home if the arm is at its beginning. `from`: angles of all axes.
  Tasks::Chosen offer(const calib::JointVector& from, bool in_contact);
  calib::Progress progress() const;

  /// The planned touch that matches, made in this session or another one with the same plan.
  std::optional<std::size_t> planned_of(const calib::Touch& touch) const;

 private:
  std::shared_ptr<const TaskInputs> inputs_;
  calib::Calibration calibration_;
  calib::Plan plan_;
  std::vector<Became> became_;
  std::vector<int> tries_;
  std::vector<std::optional<std::size_t>> touch_of_;
  std::size_t learnt_ = 0;
  std::optional<std::size_t> in_hand_;
  calib::JointVector begin_;  ///< position at the begin of the controller's session
};

// Reference calibration of a check, and the touches of earlier checks of it.

/// No calibration to check; the text gives reason and remedy.
struct NothingToCheck : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Session of the calibration: the given one, or the one in use (active_calibration.h), of this cell file
/// where given. Throws NothingToCheck; NotUsable where it exists but must not be used; JournalError.
SessionRecord published_session(Journal& journal, const std::filesystem::path& cell,
                                std::optional<std::int64_t> session);

/// Calibration of the session from published_session(). Throws NotUsable, JournalError.
calib::Calibration calibration_of(Journal& journal, std::int64_t session);

/// Touches of the checks of that calibration with this load, completed before this session, oldest first.
std::vector<std::vector<calib::Touch>> checks_before(Journal& journal, std::int64_t calibrated,
                                                     std::int64_t before, const std::string& load);

// Earlier calibration that a session's result is compared with.

/// Calibration of the same cell file in use before that session (active_calibration.h); `accepted`: option of
/// the session, with which an unusable one is skipped and logged. Throws NotUsable, JournalError.
std::optional<Compared> last_calibration(Journal& journal, const std::string& cell_name,
                                         std::int64_t before, bool accepted);

// File compared.json of an export.

std::string compared_to_json(const Compared& compared);
/// Throws std::runtime_error.
Compared compared_from_json(const std::string& text);

}  // namespace cellcal::daemon
