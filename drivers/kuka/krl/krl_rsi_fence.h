#pragma once
// Limits set by CELLCAL_RSI at each start: AXISCORR's limits in the context are those of
// correction_limit_deg, symmetric and equal for all axes; the program narrows them to the software
// limit switches and the cell's ranges, relative to the current position.

#include <cstddef>
#include <string>
#include <vector>

#include "drivers/kuka/krl/krl_findings.h"

namespace cellcal::drivers::krl {

/// Calls of CC_LOW and CC_HIGH, in the order of the axes, required in a program.
struct FenceLimit {
  std::string object;     ///< "AXISCORR1"
  std::string parameter;  ///< "LowerLimA1"
  std::string value;      ///< "CC_LOW($SOFTN_END[1],-155.1,$AXIS_ACT_MEAS.A1)"
  bool lower = true;
};
/// Ending of the functions for an external axis, in its unit: "_E1" of the first.
std::string travel_fence(std::size_t axis);
std::vector<FenceLimit> fence_limits(const RsiFilesConfig& config);

/// Body of CC_FENCE, which sets them.
std::string fence_axes(const RsiFilesConfig& config);

/// Limits set by a program have to be public in the context.
void check_public(const ControllerFiles& files, const RsiContextFile& context,
                  const RsiFilesConfig& config, Findings& findings);
/// Warns if a program sets none of them, or no range of the cell; refuses ranges that differ from
/// the configuration.
void check_fence(const std::string& name, const std::string& text, const RsiFilesConfig& config,
                 Findings& findings);

}  // namespace cellcal::drivers::krl
