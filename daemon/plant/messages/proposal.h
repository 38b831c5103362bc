#pragma once
// What a plant proposes to a cell, "cellcal.proposal/1". Nothing happens by it: the cell's operator, or a policy in
// its configuration, accepts it or not, and no arm moves because of either.

#include <string>
#include <string_view>

#include "daemon/plant/messages/names.h"

namespace cellcal::daemon::plant {

enum class ProposalKind {
  kCalibrate,  ///< somebody at the cell should calibrate it
  kCheck,      ///< likewise check it
  kActivate,   ///< a calibration of this cell's journal should be used again
  kSchedule,   ///< [schedule] of its configuration should be this one
  kPriors,     ///< its robot file should take these tolerances
  kWithdraw    ///< the proposal of this id need not be answered any more
};
const char* to_string(ProposalKind kind);

struct Proposal {
  CellName of;
  std::string id;  ///< a name; the same one twice is the same proposal
  ProposalKind kind = ProposalKind::kCalibrate;
  std::int64_t session = 0;  ///< kActivate
  std::string text;          ///< kSchedule, kPriors: TOML
  std::string by, reason;
  std::string time;  ///< ISO 8601 UTC

  bool operator==(const Proposal&) const = default;
};

std::string to_json(const Proposal& proposal);
/// Throws calib::FileError.
Proposal proposal_from_json(std::string_view json, const Topic& topic);

}  // namespace cellcal::daemon::plant
