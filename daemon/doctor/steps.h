#pragma once
// Steps of the setup from nothing to a calibrated cell.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "calib/model/enum_table.h"
#include "daemon/doctor/examiner.h"
#include "daemon/journal/journal.h"

namespace cellcal::daemon {

enum class SetUpStep { kCell, kRobot, kSpheres, kDoctor, kQualify, kDryRun, kFirst, kCalibration };
inline constexpr auto kAllSteps = all_values<SetUpStep>();
/// "dry-run"
constexpr const char* to_string(SetUpStep step) { return own_name<'-'>(step); }

enum class StepState {
  kTodo,
  kDone,
  kWrong,  ///< attempted, and failed
};
constexpr const char* to_string(StepState state) { return own_name(state); }

/// Result of one inspection; none: not made yet.
struct StepEvidence {
  bool good = false;
  calib::Phrase words{};     ///< reason of a failure
  std::int64_t session = 0;  ///< its session; 0: none
};

/// Evidence for a cell.
struct Evidence {
  std::string cell;   ///< path of its file; empty: unknown
  std::string robot;  ///< name in the robot file, where it loads
  std::size_t spheres = 0, placed = 0, centred = 0, lengths = 0;
  std::optional<StepEvidence> cell_file, robot_file, targets, doctor, qualification, dry_run, first,
      calibration;
};

struct StepSeen {
  SetUpStep step = SetUpStep::kCell;
  StepState state = StepState::kTodo;
  calib::Phrase words{};
  std::int64_t session = 0;
};

/// All steps in order.
std::vector<StepSeen> steps_of(const Evidence& evidence);
/// First step that is not done; none: all done.
std::optional<SetUpStep> next_of(const std::vector<StepSeen>& steps);

// Evidence for a cell on this computer: its file, its sessions, the doctor's findings.

/// Current content of cell and robot file, concatenated; empty where unreadable.
std::string text_of_cell(const std::filesystem::path& cell);

/// For the cell of the examination or of the newest session, whichever is later.
Evidence evidence_of(const Examination& examination, Journal& journal);

}  // namespace cellcal::daemon
