#pragma once
// The journal's outbox, to the plant's broker. Its thread; nobody waits for it.

#include <chrono>
#include <functional>
#include <memory>

#include "daemon/config/plant_config.h"
#include "daemon/journal/journal.h"
#include "daemon/plant/line/line_status.h"
#include "daemon/plant/messages/fact.h"
#include "daemon/plant/messages/proposal.h"

namespace cellcal::daemon::plant {

class Publisher {
 public:
  struct Parts {
    Journal& journal;
    PlantConfig config;
    bool mock = false;  ///< the cell is emulated
    /// Where a session's check.json is.
    std::function<std::filesystem::path(std::int64_t session)> results_dir = {};
    /// Told of every so often; none: never. On this thread.
    std::function<HealthFact()> health = {};
    /// What the plant proposes; true: it is answered, and may be taken away from the broker. On this thread.
    std::function<bool(const Proposal&)> proposal = {};
    std::chrono::milliseconds first_wait{1000},
        longest_wait{60000};  ///< until a line is opened again
    std::chrono::milliseconds refused_wait{60000};
    std::chrono::milliseconds journal_wait{5000};  ///< for the disk
    std::chrono::milliseconds stored_wait{
        600000};  ///< for the plant to have stored a result; then it is sent again
    std::size_t most_unstored =
        256;  ///< results that the broker has and nobody has stored; no more are sent
    std::chrono::milliseconds farewell{2000};
    std::chrono::seconds keepalive{30};
  };
  /// The journal reports to it from now on. `before`: whose place it takes, and whose line it ends first: the journal reports to one of
  /// the two all the while. Throws JournalError where the journal cannot report to it, and then `before` goes on as before.
  explicit Publisher(Parts parts, Publisher* before = nullptr);
  /// In order, as far as the broker is there.
  ~Publisher();
  Publisher(const Publisher&) = delete;
  Publisher& operator=(const Publisher&) = delete;

  LineStatus status() const;
  const PlantConfig& config() const;

 private:
  struct Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace cellcal::daemon::plant
