#pragma once
// Confirmation 'the cell is clear' of an operator who starts motion remotely. Valid for that operator's next
// run, for five minutes, and void once a session has begun, failed or been aborted.

#include <chrono>
#include <functional>
#include <mutex>
#include <optional>
#include <string>

#include "daemon/service/status.h"

namespace cellcal::daemon {

inline constexpr std::chrono::seconds kClearanceLasts{300};

/// Thread-safe.
class Clearance {
 public:
  using Clock = std::function<std::chrono::steady_clock::time_point()>;
  explicit Clearance(Clock clock = std::chrono::steady_clock::now) : clock_(std::move(clock)) {}

  void acknowledge(const std::string& name);
  /// Consumes the confirmation for a run. False: not confirmed by this caller, or expired.
  bool take(const std::string& name);
  /// Restores the confirmation of a run that was refused before anything happened.
  void put_back(const std::string& name);
  void forget();
  /// To be called after each change of the status.
  void look(const Status& status);

 private:
  struct Acknowledgement {
    std::string name;
    std::chrono::steady_clock::time_point until;
  };
  Clock clock_;
  std::mutex mutex_;
  std::optional<Acknowledgement> acknowledged_, taken_;
};

}  // namespace cellcal::daemon
