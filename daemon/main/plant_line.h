#pragma once
// The line to the plant while the daemon runs, as [plant] says now.

#include <memory>
#include <mutex>
#include <optional>

#include "daemon/main/cell_look.h"
#include "daemon/main/reload.h"
#include "daemon/plant/proposals/proposal_box.h"
#include "daemon/plant/publisher/publisher.h"
#include "daemon/plant/sparkplug/edge_node.h"
#include "daemon/service/service.h"

namespace cellcal::daemon {

class PlantLine {
 public:
  PlantLine(SessionService& service, Journal& journal, LiveConfig& live);
  ~PlantLine();
  PlantLine(const PlantLine&) = delete;
  PlantLine& operator=(const PlantLine&) = delete;

  /// What the configuration says now: another line where it is another, behind the farewell of the one before, which is waited
  /// for. Throws JournalError, and then the one before goes on.
  void reload();
  /// What the plant has proposed; also where none is named any more.
  plant::ProposalBox& proposals() { return proposals_; }
  /// None: no plant is named.
  std::optional<plant::LinesStatus> status() const;

 private:
  plant::Publisher::Parts parts(const PlantConfig& config);
  std::shared_ptr<plant::sparkplug::EdgeNode> node_of(const PlantConfig& config);
  plant::ProposalBox::Parts proposal_parts();
  bool take(const plant::Proposal& proposal);

  SessionService& service_;
  Journal& journal_;
  LiveConfig& live_;
  plant::ProposalBox proposals_;
  std::mutex reload_;
  mutable std::mutex mutex_;  ///< never held while the broker is waited for
  CellLook look_;
  std::shared_ptr<plant::Publisher> publisher_;
  std::shared_ptr<plant::sparkplug::EdgeNode> node_;  ///< none: not asked for
};

}  // namespace cellcal::daemon
