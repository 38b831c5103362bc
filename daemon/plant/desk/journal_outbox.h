#pragma once
// The journal's outbox as messages for the plant.

#include <functional>
#include <memory>
#include <mutex>
#include <set>

#include "daemon/config/network_config.h"
#include "daemon/journal/journal.h"
#include "daemon/plant/desk/reporter.h"
#include "daemon/plant/messages/outbox.h"

namespace cellcal::daemon::plant {

class JournalOutbox final : public Outbox {
 public:
  struct Parts {
    Journal& journal;
    PlantConfig config;
    /// Something new waits. With the journal's lock held: waits for nobody.
    std::function<void()> waits = {};
  };
  /// Becomes the journal's reporter, replacing the previous one. Throws JournalError; the previous one is
  /// then kept.
  explicit JournalOutbox(Parts parts);
  ~JournalOutbox() override;
  JournalOutbox(const JournalOutbox&) = delete;
  JournalOutbox& operator=(const JournalOutbox&) = delete;

  // Thread-safe.
  WaitingCount count() override;
  std::vector<WaitingFact> facts(std::int64_t after, std::size_t most) override;
  void acknowledge(const std::vector<std::int64_t>& rows) override;

  const PlantConfig& config() const { return parts_.config; }

 private:
  WaitingFact composed(const WaitingReport& row);
  FactBody body_of(const WaitingReport& row);

  Parts parts_;
  std::shared_ptr<const PlantReporter> reporter_;
  std::mutex mutex_;                       ///< guards the members below
  std::set<std::int64_t> logged_damaged_;  ///< rows already logged as damaged
};

}  // namespace cellcal::daemon::plant
