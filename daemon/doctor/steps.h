#pragma once
// The way from nothing to a calibrated cell.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace cellcal::daemon {

enum class SetUpStep { kCell, kRobot, kSpheres, kDoctor, kQualify, kDryRun, kFirst, kCalibration };
inline constexpr SetUpStep kAllSteps[] = {
    SetUpStep::kCell,    SetUpStep::kRobot,  SetUpStep::kSpheres, SetUpStep::kDoctor,
    SetUpStep::kQualify, SetUpStep::kDryRun, SetUpStep::kFirst,   SetUpStep::kCalibration};
/// "cell", "robot", ...
const char* to_string(SetUpStep step);

enum class StepState {
  kTodo,
  kDone,
  kWrong,  ///< tried, and not as it has to be
};
/// "todo", "done", "wrong".
const char* to_string(StepState state);

/// What one look at something came to; nothing: not looked at yet.
struct Looked {
  bool good = false;
  std::string words{};       ///< why not
  std::int64_t session = 0;  ///< that it is of; 0: of none
};

/// What there is of a cell.
struct Evidence {
  std::string cell;   ///< path of its file; empty: none is known
  std::string robot;  ///< name in the robot file, where that loads
  std::size_t spheres = 0, placed = 0, centred = 0, lengths = 0;
  std::optional<Looked> cell_file, robot_file, targets, doctor, qualification, dry_run, first,
      calibration;
};

struct StepSeen {
  SetUpStep step = SetUpStep::kCell;
  StepState state = StepState::kTodo;
  std::string words{};
  std::int64_t session = 0;
};

/// All steps in their order.
std::vector<StepSeen> steps_of(const Evidence& evidence);
/// The first that is not done; nothing: all are.
std::optional<SetUpStep> next_of(const std::vector<StepSeen>& steps);

}  // namespace cellcal::daemon
