#pragma once
// What was proposed and said, as the file `proposals.json` ("cellcal.proposals/1").

#include <string>
#include <string_view>

#include "daemon/plant/proposals/proposal_box.h"

namespace cellcal::daemon::plant {

std::string proposals_to_json(const KeptProposals& kept);
/// Throws calib::FileError.
KeptProposals proposals_from_json(std::string_view json, const std::string& name);

}  // namespace cellcal::daemon::plant
