#pragma once
// 'The cell is clear': what somebody has said who is about to start motion from afar. It counts for his
// next run, for five minutes, and for nothing once a session has begun, failed or been aborted.

#include <chrono>
#include <functional>
#include <mutex>
#include <optional>
#include <string>

#include "daemon/service/status.h"

namespace cellcal::daemon {

inline constexpr std::chrono::seconds kClearanceLasts{300};

/// From any thread.
class Clearance {
 public:
  using Clock = std::function<std::chrono::steady_clock::time_point()>;
  explicit Clearance(Clock clock = std::chrono::steady_clock::now) : clock_(std::move(clock)) {}

  void acknowledge(const std::string& name);
  /// Takes it away for a run; false: this one has said nothing, or it no longer counts.
  bool take(const std::string& name);
  /// The run that it was taken for was refused and nothing has happened: it counts again.
  void put_back(const std::string& name);
  void forget();
  /// After each change of the status.
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
