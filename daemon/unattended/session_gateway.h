#pragma once
// Interface of the schedule to the sessions; implemented for the daemon by service_session_gateway.cc.

#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>

#include "daemon/config/unattended_config.h"
#include "daemon/session/failure.h"

namespace cellcal::daemon {

/// Situation after the newest session recorded by this installation.
struct Standing {
  enum class State { kNone, kDone, kFailed, kAborted, kLeft };
  bool busy = false;           ///< a session is under way, or releasing its devices
  std::int64_t session = 0;    ///< the newest; 0: none
  State state = State::kNone;  ///< of its newest end; undefined while busy
  std::string end;             ///< distinguishes this end from others of the same session
  Failure failure;             ///< kFailed
  double left_share = 1.0;     ///< share of its touches still to be made
  std::uint64_t aborts = 0;    ///< requested by a person since the daemon started
};

/// Temporarily impossible.
struct NotNow : std::runtime_error {
  using std::runtime_error::runtime_error;
};

class SessionGateway {
 public:
  virtual ~SessionGateway() = default;
  virtual Standing standing() = 0;
  /// Begins a session, unless an abort was requested since `aborts` was read; returns its number. `by`:
  /// responsible person, recorded in its events. Throws NotNow, std::exception.
  virtual std::int64_t begin(const ScheduledSession& session, const std::string& by,
                             std::uint64_t aborts) = 0;
  /// Resumes the newest session, as an operator would. Likewise.
  virtual std::int64_t resume(const std::string& by, std::uint64_t aborts) = 0;
  /// Stops the arm and ends the session.
  virtual void stop() = 0;
  /// Expected duration, from earlier sessions or a default.
  virtual double foreseen_s(const ScheduledSession& session) = 0;
};

}  // namespace cellcal::daemon
