#pragma once
// Tells who is not there, on a thread of its own: whoever has news waits for nothing.
//
// Each way (webhook, mail) is tried anew where it may succeed later, so often as configured, each time behind twice
// the wait. What is not delivered then is in the log. News beyond a bounded number that wait are dropped, the
// oldest first, and so are those that wait when the daemon ends.

#include <chrono>
#include <functional>
#include <memory>
#include <optional>

#include "daemon/config/notify_config.h"
#include "daemon/unattended/session_news.h"

namespace cellcal::daemon {

class Notifier {
 public:
  struct Parts {
    std::function<NotifyConfig()> config;  ///< the newest
    std::string host;                      ///< this computer's name
    std::chrono::milliseconds first_wait{5000};
    /// What else is done with each notice, on the notifier's thread; nothing returned: nothing now.
    std::function<std::function<void(const Notice&)>()> also = {};
  };
  explicit Notifier(Parts parts);
  /// A resolver that does not come back is not waited for longer than a second.
  ~Notifier();
  Notifier(const Notifier&) = delete;
  Notifier& operator=(const Notifier&) = delete;

  /// `notice` is called on the notifier's thread, and may wait there; nothing: no news after all.
  void tell(std::function<std::optional<Notice>()> notice);
  /// Until all that was told is delivered or given up; for tests.
  void drain();

 private:
  struct Shared;
  std::shared_ptr<Shared> shared_;
};

}  // namespace cellcal::daemon
