#pragma once
// Status of the line to the plant.

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "daemon/plant/line/edge_node.h"

namespace cellcal::daemon::plant {

enum class LineProblem {
  kNone,
  kNotRunning,   ///< the process with the line is not running
  kFiles,        ///< unreadable files of the configuration
  kNoName,       ///< the broker's name is unknown
  kUnreachable,  ///< no answer from the broker
  kCertificate,  ///< a certificate was rejected by either side, or no TLS
  kLogin,        ///< user, password or client refused
  kRefused,      ///< a fact was refused: no permission, quota
  kTooLarge,     ///< a fact exceeds the broker's limit and waits
  kNobody,       ///< no collector at this broker
  kTakenOver,    ///< another cell uses the same name
  kUnstored,     ///< the broker's limit of results not yet stored is reached
  kRenamed,      ///< pending facts were recorded under another name
  kLost,
  kJournal  ///< cannot be read or written
};
/// Hyphenated.
const char* to_string(LineProblem problem);
const std::vector<std::pair<LineProblem, const char*>>& line_problems();

struct LineStatus {
  bool connected = false;
  LineProblem problem = LineProblem::kNone;
  std::string words;               ///< text of the problem with its remedy; empty: none
  std::string since;               ///< time of the last connect or disconnect, ISO 8601 UTC
  std::uint64_t acknowledged = 0;  ///< facts since the process started
};

/// Status of both lines of a cell.
struct LinesStatus {
  LineStatus facts;
  std::optional<LineStatus> sparkplug{};  ///< none: disabled
  std::uint64_t restarts = 0;             ///< of the process with the lines, since its first start
};

}  // namespace cellcal::daemon::plant

namespace cellcal::daemon::plant::sparkplug {

// Metrics of a cell as a Sparkplug node.

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
