#pragma once
// The daemon's sessions as seen by the schedule.

#include <map>
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

}  // namespace cellcal::daemon
