#pragma once
// Changes of a cell that its chart of checks is read with.

#include <cstdint>
#include <optional>
#include <string>

#include "calib/model/enum_table.h"
#include "calib/words/phrase.h"

namespace cellcal::calib {

enum class DriftEventKind {
  kCalibrated,
  kUpdated,    ///< a few touches on top of the calibration before
  kActivated,  ///< an earlier calibration put into use again
};

const char* to_string(DriftEventKind kind);

/// A calibration that came into use, and what differs from the cell file of the one published before.
struct DriftEvent {
  DriftEventKind kind = DriftEventKind::kCalibrated;
  std::int64_t session = 0;  ///< of the calibration
  double time_s = 0.0;       ///< since 1970, UTC; 0: unknown
  bool cell_changed = false, robot_changed = false;
  std::optional<double> tcp_moved_m = {};  ///< another tool: distance of its TCP from the one before
  bool accepted = false;                   ///< a change of the arm, by an operator
  std::string by = {}, reason = {};        ///< kActivated
};

/// "update (session 12): tool changed, TCP moved by 1.250 mm"
Phrase phrase(const DriftEvent& event);

}  // namespace cellcal::calib
