#pragma once
// Proposals of a plant to a cell, "cellcal.proposal/1". A proposal has no effect by itself: an operator of
// the cell, or a policy in its configuration, accepts or rejects it, and neither causes motion.

#include <string>
#include <string_view>

#include "daemon/plant/messages/text_fields.h"

namespace cellcal::daemon::plant {

enum class ProposalKind {
  kCalibrate,  ///< the cell should be calibrated
  kCheck,      ///< the cell should be checked
  kActivate,   ///< a calibration of this cell's journal should be reactivated
  kSchedule,   ///< replacement for [schedule] of its configuration
  kPriors,     ///< tolerances for its robot file
  kWithdraw    ///< the proposal of this id is obsolete
};
const char* to_string(ProposalKind kind);

struct Proposal {
  CellName of;
  std::string id;  ///< a name; identifies repeated messages
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
