#pragma once
// Client of the daemon in the process with the line to the plant.

#include <filesystem>
#include <string>

#include "daemon/api/http/http.h"
#include "daemon/plant/desk/desk_words.h"
#include "daemon/plant/messages/outbox.h"
#include "daemon/plant/messages/proposal.h"

namespace cellcal::daemon::plant {

/// Reports the status of the lines and returns the current orders. Throws SocketError where no daemon
/// answers, OutboxError for an unexpected answer.
Orders report_to_desk(const std::filesystem::path& socket, const LinesStatus& lines);

/// Outbox of a cell of this name. From one thread.
class DeskClient final : public Outbox {
 public:
  DeskClient(std::filesystem::path socket, const PlantConfig& as);

  WaitingCount count() override;
  std::vector<WaitingFact> facts(std::int64_t after, std::size_t most) override;
  void acknowledge(const std::vector<std::int64_t>& rows) override;
  /// True if the proposal is answered. Throws OutboxError.
  bool propose(const Proposal& proposal);

 private:
  std::filesystem::path socket_;
  std::string as_;  ///< as a query parameter
};

}  // namespace cellcal::daemon::plant
