#pragma once
// Context fields of a log line, for logs that store fields besides the text. A thread sets a more specific
// context than the daemon's by a LogScope.

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

namespace cellcal::daemon {

/// Log events that programs may wait for, each with a MESSAGE_ID of its own (systemd/README.md).
enum class LogEvent {
  kNone,
  kSessionBegins,
  kTouch,
  kSessionDone,
  kSessionAborted,
  kSessionFailed,
  kHangs
};

struct LogContext {
  std::int64_t session = 0;             ///< 0: none
  std::optional<std::int64_t> touch{};  ///< counted from 1, as on the page
  std::string phase{};
  std::string failure{};  ///< kind of the failure that ended the session
  LogEvent event = LogEvent::kNone;
};

/// Default context of all lines. Thread-safe.
void set_log_context(const LogContext& context);

/// Sets the context of this thread's lines during its lifetime; fields left empty are taken from the default.
class LogScope {
 public:
  explicit LogScope(LogContext context);
  ~LogScope();
  LogScope(const LogScope&) = delete;
  LogScope& operator=(const LogScope&) = delete;

 private:
  LogContext context_;
  const LogContext* outer_;
};

/// Effective context of this thread.
LogContext log_context();

// Rate limit for log messages that a peer can provoke: one a minute, with the number of occurrences.

class OccurrenceLimit {
 public:
  /// Counts one occurrence. Returns the occurrences since the last message if one is due now.
  std::optional<std::uint64_t> count(std::chrono::steady_clock::time_point now) {
    ++times_;
    if (said_ && now - *said_ < kPause) return std::nullopt;
    said_ = now;
    return std::exchange(times_, 0);
  }

 private:
  static constexpr std::chrono::minutes kPause{1};
  std::optional<std::chrono::steady_clock::time_point> said_;
  std::uint64_t times_ = 0;
};

}  // namespace cellcal::daemon
