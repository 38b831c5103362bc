#pragma once
// Proposals of the plant to this cell. Each function returns its exit status and throws on failure.

#include <cstdint>
#include <filesystem>
#include <string>

#include "daemon/cli/client.h"
#include "daemon/plant/messages/proposal.h"

namespace cellcal::daemon {

int list_proposals(const Connection& daemon);
int accept_proposal(const Connection& daemon, const std::string& id, const std::string& reason);
int refuse_proposal(const Connection& daemon, const std::string& id, const std::string& reason);

// Proposal from the plant to a cell, to be accepted by its operators. Published with the broker account of
// the proposer; causes no motion.

struct ProposeCommand {
  std::string cell;  ///< PLANT/CELL
  plant::ProposalKind kind = plant::ProposalKind::kCheck;
  std::string id;              ///< empty: generated
  std::int64_t session = 0;    ///< kActivate
  std::filesystem::path file;  ///< kSchedule, kPriors
  std::string by, reason;
  // The broker.
  std::string broker;
  std::uint16_t port = 0;  ///< 0: default
  bool tls = true;
  std::filesystem::path ca, password_file;
  std::string user;
  bool json = false;
};

/// Returns the id. Parsed before sending as the cell parses it; throws calib::FileError where the cell would
/// reject it, std::runtime_error where the broker did not accept it.
std::string send_proposal(const ProposeCommand& command);
int propose(const ProposeCommand& command);

}  // namespace cellcal::daemon
