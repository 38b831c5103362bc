#pragma once
// The seam between a session and what it drives: real hardware, emulated wires, or a cell in the
// same process. One per session; destroying it lets go of everything that it holds.

#include <optional>
#include <string>
#include <utility>
#include <vector>

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
  /// True: time passes only in clock().sleep_until(). The worker then runs inline, so that the
  /// same seed gives the same bits.
  virtual bool virtual_time() const { return false; }
  /// No real arm: a cell that is emulated in this process. Stands in the session's options, and on its certificate.
  virtual bool emulated() const { return false; }
  /// Whether the threads that drive the devices have gone on since the last call. From one thread,
  /// any.
  virtual bool devices_alive() { return true; }
  /// What the operator starts on the pendant for a session; for messages.
  virtual std::string how_to_start() const { return ""; }
  /// Whether this wire can lead the arm from one posture straight in joint space to the other,
  /// whatever stands in the way; null: always. Outlives the backend; any thread.
  virtual calib::Passable passable() { return {}; }
  /// How far any axis may go from where the arm stands when its link is opened; none: as far as its
  /// limits.
  virtual std::optional<double> axis_reach_rad() { return {}; }
  /// Wall time, ISO 8601 UTC; on virtual time a function of the clock alone.
  virtual std::string utc_now() = 0;
  /// Simulated cells only: figures of this result against the hidden truth, for the report.
  virtual std::vector<std::pair<std::string, std::string>> truth(const calib::Calibration&) {
    return {};
  }
};

/// The machine's wall time, ISO 8601 UTC with milliseconds.
std::string wall_clock_utc();

}  // namespace cellcal::daemon
