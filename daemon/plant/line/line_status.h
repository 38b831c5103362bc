#pragma once
// Status of the line to the plant.

#include <cstdint>
#include <optional>
#include <string>

#include "calib/model/enum_table.h"

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
  kNoCollector,  ///< no collector at this broker
  kTakenOver,    ///< another cell uses the same name
  kNotStored,    ///< the broker's limit of results not yet stored is reached
  kRenamed,      ///< pending facts were recorded under another name
  kLost,
  kJournal  ///< cannot be read or written
};
/// "not-running"
constexpr const char* to_string(LineProblem problem) { return own_name<'-'>(problem); }

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
