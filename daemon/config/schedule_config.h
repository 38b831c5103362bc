#pragma once
// [schedule]: sessions that begin without a person, and when.

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "calib/files/toml.h"

namespace cellcal::daemon {

/// From a time of day to another, on local clocks, on the days of the week on which it begins. One that ends
/// at an earlier time of day ends on the day after.
struct WeeklyWindow {
  std::array<bool, 7> days{true, true, true, true, true, true, true};  ///< Sunday first
  int from_min = 0, to_min = 0;  ///< since midnight, as the clock on the wall shows it

  bool operator==(const WeeklyWindow&) const = default;
};

/// What is begun in such a window.
struct ScheduledSession {
  std::string name;  ///< by which it is known in the log and on request
  /// A kind of session, as POST /v1/run has it.
  std::string kind = "calibrate";
  std::filesystem::path cell;
  WeeklyWindow window;
  bool on_request = false;  ///< begun when it is asked for, within the window; else once per window
  std::optional<int> touches;
  std::optional<int> check;
  std::optional<double> goal_mm;
  std::optional<double> minutes;  ///< how long it takes; none: as long as those before it took

  bool operator==(const ScheduledSession&) const = default;
};

/// How the controller's program comes to run without a person.
enum class ProgramStart {
  kNone,         ///< it does not: nothing begins unattended
  kLeftRunning,  ///< EKI: somebody leaves CELLCAL_EKI running in AUT or EXT
  kCell,         ///< CELL.SRC in EXT calls it, as the PLC tells
  kRun           ///< EKI: the submit program starts it in EXT, where its files permit it
};

struct ScheduleConfig {
  bool unattended = false;  ///< somebody answers for it that the cell is clear within the windows
  std::string responsible;  ///< who; not empty where unattended
  ProgramStart program_start = ProgramStart::kNone;
  int resumes = 0;          ///< of one session, after harmless failures
  double resume_wait_s = 120.0;
  std::vector<ScheduledSession> sessions;

  bool operator==(const ScheduleConfig&) const = default;
};

/// Throws calib::FileError.
ScheduleConfig read_schedule(const calib::TomlTable& table);

}  // namespace cellcal::daemon
