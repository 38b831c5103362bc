#pragma once
// Metrics of a cell as a Sparkplug node.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "daemon/plant/line/edge_node.h"

namespace cellcal::daemon::plant::sparkplug {

/// State of the cell. SI units; times in seconds since 1970, UTC; unknown values are none.
struct CellNow {
  std::string software;
  bool emulated = false;

  std::string phase;     ///< to_string(Phase)
  bool running = false;  ///< motion possible
  struct Session {
    std::int64_t number = 0;
    std::string kind;  ///< to_string(SessionKind)
    std::int64_t touches = 0, planned = 0;
    std::optional<std::string> failure;  ///< to_string(FailureKind)
  };
  std::optional<Session> session;

  struct InUse {
    std::int64_t session = 0;
    std::optional<double> time_s;
    bool workspace = false;  ///< scope; otherwise near the targets
    double predicted_m = 0.0;
    std::optional<double> u95_m;
  };
  std::optional<InUse> calibration;

  struct Check {
    std::int64_t session = 0;
    double time_s = 0.0;
    std::optional<bool> holds;
    std::optional<double> shift_m;
  };
  std::optional<Check> check;
  std::optional<std::string> drift_state, drift_advice;

  struct Link {
    bool open = false;
    std::int64_t late = 0, missing = 0;  ///< packets of the robot
    std::int64_t damaged = 0;            ///< frames of the sensor
  };
  std::optional<Link> link;
};

/// Always the same names in the same order.
std::vector<Metric> metrics_of(const CellNow& now);

}  // namespace cellcal::daemon::plant::sparkplug
