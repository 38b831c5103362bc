#pragma once
// The fence that CELLCAL_RSI sets at each start: AXISCORR's limits in the context are those of
// correction_limit_deg, the same on both sides and for all axes; the program narrows them to the
// software limit switches and the cell's ranges, from where the arm stands.

#include <string>
#include <vector>

#include "drivers/kuka/krl/krl_findings.h"

namespace cellcal::drivers::krl {

/// CC_LOW's and CC_HIGH's call, in the order of the axes: what a program has to hold.
struct FenceLimit {
  std::string parameter;  ///< "LowerLimA1"
  std::string value;      ///< "CC_LOW($SOFTN_END[1],-155.1,$AXIS_ACT_MEAS.A1)"
  bool lower = true;
};
std::vector<FenceLimit> fence_limits(const RsiFilesConfig& config);

/// The body of CC_FENCE that sets them.
std::string fence_axes(const RsiFilesConfig& config);

/// The limits that a program sets have to be public in the context.
void check_public(const ControllerFiles& files, const RsiContextFile& context,
                  const RsiFilesConfig& config, Findings& findings);
/// Warns where a program sets none of them, or no range of the cell; refuses other ranges than the
/// configuration's.
void check_fence(const std::string& name, const std::string& text, const RsiFilesConfig& config,
                 Findings& findings);

}  // namespace cellcal::drivers::krl
