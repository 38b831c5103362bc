#pragma once
// The daemon's own sessions as the schedule sees them.

#include <vector>

#include "daemon/service/service.h"
#include "daemon/unattended/cell_door.h"

namespace cellcal::daemon {

class ServiceDoor final : public CellDoor {
 public:
  ServiceDoor(SessionService& service, Journal& journal) : service_(service), journal_(journal) {}

  Standing standing() override;
  std::int64_t begin(const ScheduledSession& session, const std::string& by,
                     std::uint64_t aborts) override;
  std::int64_t resume(const std::string& by, std::uint64_t aborts) override;
  void stop() override;
  double foreseen_s(const ScheduledSession& session) override;

 private:
  std::int64_t start(const RunRequest& request);
  /// Read anew where the newest session is another one, or has ended.
  const std::vector<SessionRecord>& records(const Status& status);

  SessionService& service_;
  Journal& journal_;
  std::optional<std::uint64_t> read_at_;  ///< status whose records these are
  std::vector<SessionRecord> records_;
};

}  // namespace cellcal::daemon
