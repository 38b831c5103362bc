#pragma once
// What the schedule knows of the sessions and asks of them. service_door.cc is the daemon's own.

#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>

#include "daemon/config/schedule_config.h"
#include "daemon/session/failure.h"

namespace cellcal::daemon {

/// How things stand behind the newest session that was recorded here.
struct Standing {
  enum class State { kNone, kDone, kFailed, kAborted, kLeft };
  bool busy = false;           ///< a session is under way, or lets its devices go
  std::int64_t session = 0;    ///< the newest; 0: none
  State state = State::kNone;  ///< of its newest end; of no meaning while busy
  std::string end;             ///< tells this end from others of the same session
  Failure failure;             ///< kFailed
  double left_share = 1.0;     ///< of its touches, still to be made
  std::uint64_t aborts = 0;    ///< given by somebody since the daemon started
};

/// It cannot begin now, and may a moment later.
struct NotNow : std::runtime_error {
  using std::runtime_error::runtime_error;
};

class CellDoor {
 public:
  virtual ~CellDoor() = default;
  virtual Standing standing() = 0;
  /// Begins a session, unless somebody has aborted since `aborts` was read; its number. `by`: evidence for its
  /// events, who answers for it. Throws NotNow, std::exception.
  virtual std::int64_t begin(const ScheduledSession& session, const std::string& by,
                             std::uint64_t aborts) = 0;
  /// The newest goes on, as by an operator. Likewise.
  virtual std::int64_t resume(const std::string& by, std::uint64_t aborts) = 0;
  /// Stops the arm and ends the session.
  virtual void stop() = 0;
  /// How long such a session takes, by those before it or a guess.
  virtual double foreseen_s(const ScheduledSession& session) = 0;
};

}  // namespace cellcal::daemon
