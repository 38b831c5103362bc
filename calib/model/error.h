#pragma once
// What calib throws.

#include <stdexcept>
#include <string>

namespace cellcal::calib {

/// A file that cannot be used. The message names the file and, where they exist, line and key or
/// column, and says what to do.
struct FileError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Touches and cell are well formed but do not determine a calibration (no touches of a target,
/// no touches at all, a solver that did not converge).
struct IdentifyError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// No plan can be made; the message names target, direction and limit.
struct PlanError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace cellcal::calib
