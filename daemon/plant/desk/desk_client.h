#pragma once
// The cell's daemon as the process sees it that has its line to the plant.

#include <filesystem>
#include <string>

#include "daemon/api/http/http.h"
#include "daemon/plant/desk/desk_words.h"
#include "daemon/plant/messages/outbox.h"
#include "daemon/plant/messages/proposal.h"

namespace cellcal::daemon::plant {

/// Says how the lines stand, and is told which there are to be. Throws SocketError where no daemon answers, OutboxError where it
/// answers something else.
Orders report_to_desk(const std::filesystem::path& socket, const LinesStatus& lines);

/// The outbox of a cell of this name. One thread.
class DeskClient final : public Outbox {
 public:
  DeskClient(std::filesystem::path socket, const PlantConfig& as);

  WaitingCount count() override;
  std::vector<WaitingFact> facts(std::int64_t after, std::size_t most) override;
  void acknowledge(const std::vector<std::int64_t>& rows) override;
  /// Whether it is answered. Throws OutboxError.
  bool propose(const Proposal& proposal);

 private:
  std::filesystem::path socket_;
  std::string as_;  ///< of a query
};

}  // namespace cellcal::daemon::plant
