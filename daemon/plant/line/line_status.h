#pragma once
// How the line to the plant stands.

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace cellcal::daemon::plant {

enum class LineProblem {
  kNone,
  kNotRunning,   ///< the process that has the line is not heard
  kFiles,        ///< of the configuration: they cannot be read
  kNoName,       ///< the broker's is not known
  kUnreachable,  ///< nobody answers there
  kCertificate,  ///< one of the two does not take the other's, or it is no TLS
  kLogin,        ///< user, password or client refused
  kRefused,      ///< a fact was: no right, quota
  kTooLarge,     ///< a fact is, for this broker, and waits
  kNobody,       ///< nobody collects at this broker
  kTakenOver,    ///< another cell has the same name
  kUnstored,     ///< the broker has as many results as it is given that nobody has stored
  kRenamed,      ///< what waits was written under another name
  kLost,
  kJournal  ///< cannot be read or written
};
/// Hyphenated.
const char* to_string(LineProblem problem);
const std::vector<std::pair<LineProblem, const char*>>& line_problems();

struct LineStatus {
  bool connected = false;
  LineProblem problem = LineProblem::kNone;
  std::string words;               ///< of the problem, with what to do; empty: none
  std::string since;               ///< connected or not, ISO 8601 UTC
  std::uint64_t acknowledged = 0;  ///< facts since the process started
};

/// Of both of a cell's lines.
struct LinesStatus {
  LineStatus facts;
  std::optional<LineStatus> sparkplug{};  ///< none: not asked for
  std::uint64_t restarts = 0;  ///< of the process that has them, since it was first started
};

}  // namespace cellcal::daemon::plant
