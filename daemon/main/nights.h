#pragma once
// What the daemon does when nobody is there: the schedule, telling those who are elsewhere, dropping what is old; on threads of
// their own.

#include <functional>
#include <memory>
#include <vector>

#include "daemon/archive/retention.h"
#include "daemon/main/reload.h"
#include "daemon/service/service.h"
#include "daemon/unattended/schedule.h"

namespace cellcal::daemon {

/// With the session's end, where a person would be told of it and [plant] says whom.
std::function<std::vector<Report>(std::int64_t session, const RecordEnd& end)> alarms_with_end(
    Journal& journal, LiveConfig& live);

class Nights {
 public:
  Nights(SessionService& service, Journal& journal, LiveConfig& live);
  ~Nights();
  Nights(const Nights&) = delete;
  Nights& operator=(const Nights&) = delete;

  Schedule& schedule();
  /// What the configuration says now.
  RetentionRule retention() const;
  /// After each change of the status, and of the configuration. Wait for nothing.
  void look(const Status& status);
  void poke();
  /// Nothing begins any more.
  void stop();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace cellcal::daemon
