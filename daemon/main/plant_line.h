#pragma once
// Interface to the process with the line to the plant, by the current [plant]. No network code of that line
// runs in this process.

#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>

#include "daemon/main/cell_look.h"
#include "daemon/main/network_door.h"
#include "daemon/main/reload.h"
#include "daemon/plant/desk/desk.h"
#include "daemon/plant/desk/journal_outbox.h"
#include "daemon/plant/desk/proposal_box.h"
#include "daemon/service/service.h"

namespace cellcal::daemon {

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
  CellSnapshotReader look_;
  plant::Desk desk_;
  std::mutex reload_;
  std::shared_ptr<plant::JournalOutbox> outbox_;
  /// Declared last, destroyed first: it uses the other members.
  std::unique_ptr<NetworkServer> door_;
};

}  // namespace cellcal::daemon
