#pragma once
// A journal's outbox and its publisher in one process.

#include <memory>
#include <mutex>
#include <utility>

#include "daemon/plant/desk/journal_outbox.h"
#include "daemon/plant/line/publisher.h"

namespace cellcal::daemon::testing {

class CellLine {
 public:
  /// Like Publisher::Parts, but with the journal instead of the outbox.
  struct Parts {
    Journal& journal;
    PlantConfig config;
    std::function<bool(const plant::Proposal&)> proposal = {};
    std::chrono::milliseconds first_wait{1000}, longest_wait{60000}, refused_wait{60000},
        journal_wait{5000}, stored_wait{600000};
    std::size_t most_unstored = 256;
    std::chrono::milliseconds farewell{2000};
    std::chrono::seconds keepalive{30};
  };
  explicit CellLine(const Parts& parts)
      : outbox_({parts.journal, parts.config, [this] { poke(); }}) {
    plant::Publisher::Parts all{outbox_, parts.config};
    all.proposal = parts.proposal;
    all.first_wait = parts.first_wait;
    all.longest_wait = parts.longest_wait;
    all.refused_wait = parts.refused_wait;
    all.journal_wait = parts.journal_wait;
    all.stored_wait = parts.stored_wait;
    all.most_unstored = parts.most_unstored;
    all.farewell = parts.farewell;
    all.keepalive = parts.keepalive;
    auto publisher = std::make_unique<plant::Publisher>(std::move(all));
    const std::lock_guard lock(mutex_);
    publisher_ = std::move(publisher);
  }
  ~CellLine() {
    std::unique_ptr<plant::Publisher> last;
    {
      const std::lock_guard lock(mutex_);
      last = std::move(publisher_);
    }
  }
  CellLine(const CellLine&) = delete;
  CellLine& operator=(const CellLine&) = delete;

  plant::LineStatus status() const { return publisher_->status(); }
  plant::Publisher& publisher() { return *publisher_; }

 private:
  /// Called with the journal's lock held: must not wait.
  void poke() {
    const std::lock_guard lock(mutex_);
    if (publisher_) publisher_->poke();
  }

  std::mutex mutex_;
  std::unique_ptr<plant::Publisher> publisher_;  // first: the outbox pokes it while it is constructed
  plant::JournalOutbox outbox_;
};

}  // namespace cellcal::daemon::testing
