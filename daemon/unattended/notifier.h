#pragma once
// Notification of absent operators, on a thread of its own: callers never block.
//
// Each channel (webhook, mail) is retried where it may succeed later, up to the configured number, each time
// after twice the wait. Failed deliveries are logged. Notices beyond a bounded queue are dropped, the oldest
// first, as are those pending when the daemon ends.

#include <chrono>
#include <functional>
#include <memory>
#include <optional>

#include "daemon/config/unattended_config.h"
#include "daemon/unattended/notice.h"

namespace cellcal::daemon {

class Notifier {
 public:
  struct Parts {
    std::function<NotifyConfig()> config;  ///< current configuration
    std::string host;                      ///< name of this computer
    std::chrono::milliseconds first_wait{5000};
    /// Additional handling of each notice, on the notifier's thread; empty result: none.
    std::function<std::function<void(const Notice&)>()> also = {};
  };
  explicit Notifier(Parts parts);
  /// Waits at most one second for a hanging resolver.
  ~Notifier();
  Notifier(const Notifier&) = delete;
  Notifier& operator=(const Notifier&) = delete;

  /// `notice` is called on the notifier's thread, where it may block; none: nothing to report.
  void notify(std::function<std::optional<Notice>()> notice);
  /// Waits until all notices are delivered or given up; for tests.
  void drain();

 private:
  struct Shared;
  std::shared_ptr<Shared> shared_;
};

}  // namespace cellcal::daemon
