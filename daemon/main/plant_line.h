#pragma once
// What the process that has the line to the plant is given, as [plant] says now. Nothing of that line is in this process.

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

/// Where the line's process asks: a folder of its own, so that it need not see the daemon's socket.
std::filesystem::path plant_socket(const std::filesystem::path& socket);

class PlantLine {
 public:
  PlantLine(SessionService& service, Journal& journal, LiveConfig& live);
  ~PlantLine();
  PlantLine(const PlantLine&) = delete;
  PlantLine& operator=(const PlantLine&) = delete;

  /// From now on the line's process is answered. Where that cannot be, the log says why, and no line comes of it.
  void open(const std::filesystem::path& socket);
  void stop();

  /// What the configuration says now. Throws JournalError, and then it is as before.
  void reload();
  /// What the plant has proposed; also where none is named any more.
  plant::ProposalBox& proposals() { return proposals_; }
  /// None: no plant is named.
  std::optional<plant::LinesStatus> status() const { return desk_.status(); }

 private:
  plant::ProposalBox::Parts proposal_parts();
  plant::Desk::Parts desk_parts();
  bool take(const plant::Proposal& proposal);
  void tell_health();

  SessionService& service_;
  Journal& journal_;
  LiveConfig& live_;
  plant::ProposalBox proposals_;
  CellLook look_;
  plant::Desk desk_;
  std::mutex reload_;
  std::shared_ptr<plant::JournalOutbox> outbox_;
  std::unique_ptr<NetworkDoor> door_;  ///< goes first: it uses the others
};

}  // namespace cellcal::daemon
