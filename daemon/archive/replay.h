#pragma once
// Recomputation of a recorded session: identical to the bit, or the differences.

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>

#include "daemon/archive/archive.h"

namespace cellcal::daemon {

/// First value in which two results differ.
struct Difference {
  std::string where;  ///< JSON pointer into calibration.json, "/parameters/3/correction"
  std::string recorded, replayed;  ///< as JSON; "" where missing
  std::optional<double> by;        ///< replayed minus recorded, of numbers
};

struct Replay {
  std::string recorded_by, replayed_by;  ///< software versions
  std::size_t touches = 0;
  std::size_t values = 0;     ///< compared values
  std::size_t differing = 0;  ///< 0: identical to the bit
  std::optional<Difference> first;

  bool same() const { return differing == 0; }
};

/// Compares two calibrations' JSON value by value; software versions are reported, not compared.
Replay compare(const std::string& recorded, const std::string& replayed);

/// From its rows: inputs, touches, identification, verdict. Throws ArchiveError without a recorded
/// calibration, JournalError and calib::FileError where its rows cannot be read.
Replay replay(const Archive& archive, const std::string& from);

/// One or a few lines, for display.
std::string in_words(const Replay& replay);

}  // namespace cellcal::daemon
