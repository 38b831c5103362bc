#pragma once
// The daemon's sessions as seen by the schedule.

#include <condition_variable>
#include <map>
#include <mutex>
#include <stop_token>
#include <thread>
#include <vector>

#include "daemon/service/service.h"
#include "daemon/unattended/schedule.h"

namespace cellcal::daemon {

class ServiceSessionGateway final : public SessionGateway {
 public:
  ServiceSessionGateway(SessionService& service, Journal& journal)
      : service_(service), journal_(journal) {}

  Standing standing() override;
  std::int64_t begin(const ScheduledSession& session, const std::string& by,
                     std::uint64_t aborts) override;
  std::int64_t resume(const std::string& by, std::uint64_t aborts) override;
  void stop() override;
  void show(const ScheduleSeen& schedule) override { service_.show(schedule); }
  double foreseen_s(const ScheduledSession& session) override;

 private:
  std::int64_t start(const RunRequest& request);
  /// Reread after a new session or an end.
  const std::vector<SessionRecord>& records(const Status& status);
  /// Duration of a completed session, without pauses; none: not known.
  std::optional<double> duration_s(const SessionRecord& record);

  SessionService& service_;
  Journal& journal_;
  std::optional<std::uint64_t> read_at_;  ///< status of the records read
  std::vector<SessionRecord> records_;
  std::map<std::int64_t, std::optional<double>> took_s_;  ///< by session
};

// Thread that evaluates the schedule every few seconds, and immediately after events.

class ScheduleThread {
 public:
  explicit ScheduleThread(Schedule& schedule);
  /// Signals an event. Does not block.
  void poke();
  /// Returns when no pass is in progress and none will follow.
  void stop();

 private:
  std::mutex mutex_;
  std::condition_variable_any asked_;
  bool pending_ = false;
  std::jthread thread_;
};

}  // namespace cellcal::daemon
