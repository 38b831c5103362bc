#pragma once
// What the plant proposed to this cell. Each returns its exit status and throws when it failed.

#include <cstdint>
#include <filesystem>
#include <string>

#include "daemon/cli/client.h"
#include "daemon/plant/messages/proposal.h"

namespace cellcal::daemon {

int list_proposals(const Connection& daemon);
int accept_proposal(const Connection& daemon, const std::string& id, const std::string& reason);
int refuse_proposal(const Connection& daemon, const std::string& id, const std::string& reason);

// From the plant to a cell: what its people may accept. Sent to the broker as whoever may propose there; nothing moves by it.

struct ProposeCommand {
  std::string cell;  ///< PLANT/CELL
  plant::ProposalKind kind = plant::ProposalKind::kCheck;
  std::string id;              ///< empty: one is made
  std::int64_t session = 0;    ///< kActivate
  std::filesystem::path file;  ///< kSchedule, kPriors
  std::string by, reason;
  // The broker.
  std::string broker;
  std::uint16_t port = 0;  ///< 0: as usual
  bool tls = true;
  std::filesystem::path ca, password_file;
  std::string user;
  bool json = false;
};

/// The id. Read as the cell reads it before it is sent; throws calib::FileError where the cell would refuse it,
/// std::runtime_error where the broker did not take it.
std::string send_proposal(const ProposeCommand& command);
int propose(const ProposeCommand& command);

}  // namespace cellcal::daemon
