#pragma once
// State of the cell for a Sparkplug host: status at once, results of the journal periodically.

#include <atomic>
#include <chrono>
#include <optional>

#include "daemon/archive/drift_watch.h"
#include "daemon/journal/journal.h"
#include "daemon/plant/line/cell_metrics.h"
#include "daemon/service/service.h"

namespace cellcal::daemon {

class CellSnapshotReader {
 public:
  CellSnapshotReader(SessionService& service, Journal& journal);

  void emulated(bool yes) { emulated_ = yes; }
  /// From one thread at a time. The journal is read after a session has begun or ended, and every half minute
  /// to detect activations. Throws JournalError.
  plant::sparkplug::CellNow now();

 private:
  void read_results();

  SessionService& service_;
  Journal& journal_;
  DriftWatch drift_;
  std::atomic<bool> emulated_{false};
  plant::sparkplug::CellNow results_;  ///< calibration, check, drift
  std::int64_t of_session_ = -1;
  bool of_running_ = false;
  std::chrono::steady_clock::time_point read_at_;
};

}  // namespace cellcal::daemon
