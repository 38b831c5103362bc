#pragma once
// Interface to the process with the line to the plant, by the current [plant]. No network code of that line
// runs in this process.

#include <atomic>
#include <chrono>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>

#include "daemon/api/http/server.h"
#include "daemon/archive/drift_watch.h"
#include "daemon/journal/journal.h"
#include "daemon/main/reload.h"
#include "daemon/plant/desk/desk.h"
#include "daemon/plant/desk/journal_outbox.h"
#include "daemon/plant/desk/proposal_box.h"
#include "daemon/plant/line/cell_metrics.h"
#include "daemon/plant/line/line_status.h"
#include "daemon/service/service.h"

namespace cellcal::daemon {

// State of the cell for a Sparkplug host: status at once, results of the journal periodically.

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

/// Socket for that process: in a folder of its own, so that it needs no access to the daemon's socket.
std::filesystem::path plant_socket(const std::filesystem::path& socket);

class PlantLine {
 public:
  PlantLine(SessionService& service, Journal& journal, LiveConfig& live);
  ~PlantLine();
  PlantLine(const PlantLine&) = delete;
  PlantLine& operator=(const PlantLine&) = delete;

  /// Starts answering that process. On failure the reason is logged and no line is established.
  void open(const std::filesystem::path& socket);
  void stop();

  /// Applies the current configuration. Throws JournalError; the previous state is then kept.
  void reload();
  /// Proposals of the plant; available without a configured plant, too.
  plant::ProposalBox& proposals() { return proposals_; }
  /// None: no plant configured.
  std::optional<plant::LinesStatus> status() const { return desk_.status(); }

 private:
  plant::ProposalBox::Parts proposal_parts();
  plant::Desk::Parts desk_parts();
  bool take(const plant::Proposal& proposal);
  void publish_health();

  SessionService& service_;
  Journal& journal_;
  LiveConfig& live_;
  plant::ProposalBox proposals_;
  CellSnapshotReader snapshots_;
  plant::Desk desk_;
  std::mutex reload_;
  std::shared_ptr<plant::JournalOutbox> outbox_;
  /// Declared last, destroyed first: it uses the other members.
  std::unique_ptr<ServerThread> listener_;
};

}  // namespace cellcal::daemon
