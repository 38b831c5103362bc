#pragma once
// Rows written with the next transaction: log, changes of phase, sensor events. Adding one does not
// wait for the disk.

#include <cstdint>
#include <mutex>
#include <string>
#include <variant>
#include <vector>

#include "daemon/journal/chain.h"
#include "daemon/journal/outbox_rows.h"
#include "daemon/session/action.h"

namespace cellcal::daemon {

struct Words {
  std::string utc, words;
};

struct PendingRow {
  std::int64_t session = 0;
  std::variant<Words, RecordChange, RecordContact, RecordCause, AssessedTouch> what;
};

class PendingRows {
 public:
  void take(PendingRow row) {
    const std::lock_guard lock(mutex_);
    rows_.push_back(std::move(row));
  }
  std::vector<PendingRow> all() const {
    const std::lock_guard lock(mutex_);
    return rows_;
  }
  /// Removes the first `count` rows, which are on disk.
  void written(std::size_t count) {
    const std::lock_guard lock(mutex_);
    rows_.erase(rows_.begin(), rows_.begin() + static_cast<std::ptrdiff_t>(count));
  }

 private:
  mutable std::mutex mutex_;  ///< never held during disk access
  std::vector<PendingRow> rows_;
};

/// Inserts the row, within a transaction.
void insert(Database& database, Chain& chain, const PendingRow& row);

}  // namespace cellcal::daemon
