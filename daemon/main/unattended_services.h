#pragma once
// Unattended functions of the daemon, on threads of their own: schedule, notification, retention.

#include <atomic>
#include <functional>
#include <vector>

#include "daemon/archive/archive.h"
#include "daemon/main/reload.h"
#include "daemon/service/service.h"
#include "daemon/unattended/notifier.h"
#include "daemon/unattended/schedule.h"
#include "daemon/unattended/service_session_gateway.h"

namespace cellcal::daemon {

/// Alarms in the transaction of a session's end, where an operator would be notified and [plant] is
/// configured.
std::function<std::vector<Report>(std::int64_t session, const RecordEnd& end)> alarms_with_end(
    Journal& journal, LiveConfig& live);

class UnattendedServices {
 public:
  UnattendedServices(SessionService& service, Journal& journal, LiveConfig& live);
  ~UnattendedServices() { stop(); }
  UnattendedServices(const UnattendedServices&) = delete;
  UnattendedServices& operator=(const UnattendedServices&) = delete;

  Schedule& schedule() { return schedule_; }
  /// By the current configuration.
  RetentionRule retention() const;
  /// To be called after each change of the status and of the configuration. Do not block.
  void update(const Status& status);
  void poke();
  /// No session begins afterwards.
  void stop() { updates_.stop(); }

 private:
  Journal& journal_;
  LiveConfig& live_;
  Notifier notifier_;
  ServiceSessionGateway gateway_;
  Schedule schedule_;
  OnRequest updates_;                  ///< of the schedule
  OnRequest housekeeping_;             ///< applies the retention rule
  std::atomic<bool> reported_{false};  ///< end of the newest session
};

}  // namespace cellcal::daemon
