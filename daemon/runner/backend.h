#pragma once
// Interface between a session and its devices: real hardware, emulated wires, or a cell in the same process.
// One per session; the destructor releases all devices.

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "calib/check/controller_model.h"
#include "calib/model/robot.h"
#include "calib/result/calibration.h"
#include "drivers/contact.h"
#include "drivers/robot.h"
#include "drivers/time.h"

namespace cellcal::daemon {

class Backend {
 public:
  virtual ~Backend() = default;

  virtual drivers::Robot& robot() = 0;
  virtual drivers::ContactSensor& contact() = 0;
  virtual drivers::Clock& clock() = 0;
  /// True: time passes only in clock().sleep_until(). The worker then runs inline, so that the same seed
  /// gives the same bits.
  virtual bool virtual_time() const { return false; }
  /// True for a cell emulated in this process. Recorded in the session's options and on its certificate.
  virtual bool emulated() const { return false; }
  /// True if the device threads have progressed since the last call. To be called from a single thread.
  virtual bool devices_alive() { return true; }
  /// Program to start on the pendant for a session; for messages.
  virtual calib::Phrase how_to_start() const { return {}; }
  /// Predicate for whether this wire can move the arm straight in joint space between two postures,
  /// regardless of obstacles; null: always. Outlives the backend; thread-safe.
  virtual calib::Passable passable() { return {}; }
  /// Travel limit of any axis from its position at the opening of the link; none: up to the axis limits.
  virtual std::optional<double> axis_reach_rad() { return {}; }
  /// $TOOL and $BASE of the controller, as far as known.
  virtual calib::StatedFrames stated_frames() { return {}; }
  /// Wall time, ISO 8601 UTC; on virtual time a function of the clock only.
  virtual std::string utc_now() = 0;
  /// Simulated cells only: deviations of this result from the hidden truth, for the report.
  virtual std::vector<std::pair<std::string, std::string>> truth(const calib::Calibration&) {
    return {};
  }
};

/// Wall time of this computer, ISO 8601 UTC with milliseconds.
std::string wall_clock_utc();

}  // namespace cellcal::daemon
