#pragma once
// The journal's outbox as messages for the plant.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "daemon/config/plant_config.h"
#include "daemon/journal/journal.h"
#include "daemon/plant/messages/fact.h"
#include "daemon/plant/outbox/reporter.h"

namespace cellcal::daemon::plant {

// What waits for the plant, as its line sees it: the journal's outbox, or the daemon that has it.

/// It cannot be read or written now. Nothing is lost by that.
struct OutboxError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct WaitingFact {
  std::int64_t row = 0;
  std::string source;  ///< whose numbers these are
  std::int64_t number = 0, session = 0;
  std::string kind;  ///< of its body
  Worth worth = Worth::kResult;
  std::string text;  ///< the message, one line of JSON; kLargestMessage at most
};

struct WaitingCount {
  std::string source;       ///< of the next fact
  std::int64_t newest = 0;  ///< number under that source
  std::int64_t rows = 0;
  std::int64_t elsewhere =
      0;  ///< of these: written under another name, which nobody is told of now
  std::string elsewhere_address;  ///< of these the oldest: "plant/cell"

  bool operator==(const WaitingCount&) const = default;
};

/// All throw OutboxError.
class Outbox {
 public:
  virtual ~Outbox() = default;
  virtual WaitingCount count() = 0;
  /// The oldest behind this row: so many at most, fewer where they are large.
  virtual std::vector<WaitingFact> facts(std::int64_t after, std::size_t most) = 0;
  /// Somebody has them: they wait no longer.
  virtual void acknowledge(const std::vector<std::int64_t>& rows) = 0;
};

class JournalOutbox final : public Outbox {
 public:
  struct Parts {
    Journal& journal;
    PlantConfig config;
    /// Where a session's check.json is.
    std::function<std::filesystem::path(std::int64_t session)> results_dir = {};
    /// Something new waits. With the journal's lock held: waits for nobody.
    std::function<void()> waits = {};
  };
  /// The journal reports to it from now on, instead of to the one before. Throws JournalError, and then that one is reported to as
  /// before.
  explicit JournalOutbox(Parts parts);
  ~JournalOutbox() override;
  JournalOutbox(const JournalOutbox&) = delete;
  JournalOutbox& operator=(const JournalOutbox&) = delete;

  // Any thread.
  WaitingCount count() override;
  std::vector<WaitingFact> facts(std::int64_t after, std::size_t most) override;
  void acknowledge(const std::vector<std::int64_t>& rows) override;

  const PlantConfig& config() const { return parts_.config; }

 private:
  WaitingFact composed(const WaitingReport& row);
  FactBody body_of(const WaitingReport& row);

  Parts parts_;
  std::shared_ptr<const PlantReporter> reporter_;
  std::mutex mutex_;                       ///< of what follows
  std::set<std::int64_t> logged_damaged_;  ///< rows of which the log has it
};

}  // namespace cellcal::daemon::plant
