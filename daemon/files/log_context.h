#pragma once
// What a line of the log belongs to, for a log that keeps fields beside its words. A thread that knows better
// than the daemon as a whole says so while it lives in a LogScope.

#include <cstdint>
#include <optional>
#include <string>

namespace cellcal::daemon {

/// Kinds of lines that a program may wait for, each with a MESSAGE_ID of its own (systemd/README.md).
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

/// The daemon's own, for all lines that nobody knows better about. Any thread.
void set_log_context(const LogContext& context);

/// While it lives, lines of this thread belong to `context`; what it leaves open is the daemon's.
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

/// Of a line that this thread writes now.
LogContext log_context();

}  // namespace cellcal::daemon
