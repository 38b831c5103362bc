#pragma once
// The journal's outbox as messages for the plant.

#include <functional>
#include <memory>
#include <mutex>
#include <set>

#include "daemon/config/network_config.h"
#include "daemon/journal/journal.h"
#include "daemon/plant/messages/fact.h"

namespace cellcal::daemon::plant {

// Conversion of the journal's facts to bodies for the plant.

/// Row of a fact from elsewhere, for Journal::report().
Report report_of(const FactBody& body);
/// With another priority than usual: `worth` determines whether the outbox may drop it.
Report report_of(const FactBody& body, Worth worth);

class PlantReporter final : public Reporter {
 public:
  struct Parts {
    bool touches = false;
    std::int64_t most_bytes = 0;
    CellName name{};  ///< under which facts are written from now on
    /// "plant/cell": earlier names, whose facts are sent under the present one.
    std::vector<std::string> former{};
    std::function<void()> waits;
  };
  explicit PlantReporter(Parts parts) : parts_(std::move(parts)) {}

  std::vector<Report> session(const SessionRecord& session) const override;
  /// Reports `session.calibration`, with its predicted u95 near `touches`, the session's, and over the workspace.
  Report calibration(const SessionRecord& session, const std::vector<calib::Touch>& touches) const;
  std::vector<Report> touch(const RecordTouch& touch) const override;
  std::vector<Report> change(const RecordChange& change) const override;
  std::vector<Report> activation(const Activation& activation) const override;
  std::int64_t in_use(Journal& journal) const override;
  std::string address() const override;
  bool publishes_name(const std::string& address) const override;
  std::int64_t most_bytes() const override { return parts_.most_bytes; }
  void waits() const override {
    if (parts_.waits) parts_.waits();
  }

 private:
  Parts parts_;
};

class JournalOutbox final : public Outbox {
 public:
  struct Parts {
    Journal& journal;
    PlantConfig config;
    /// Called after facts were added, with the journal's lock held; must not block.
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
