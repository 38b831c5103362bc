#pragma once
// "cellcal.priors/1": deviation of the arms of one robot model from their nominal geometry. Throws
// FileError.

#include <filesystem>
#include <string>
#include <string_view>

#include "calib/result/fleet_priors.h"

namespace cellcal::calib {

FleetPriors load_priors(const std::filesystem::path& path);
FleetPriors parse_priors(std::string_view text, const std::string& name);
std::string priors_to_toml(const FleetPriors& priors);

/// Display unit of a kind: "mm" with 1000.
struct SpreadUnit {
  const char* name;  ///< name of the kind: "length"
  const char* unit;
  double per_si;
};
SpreadUnit unit_of(SpreadKind kind);

}  // namespace cellcal::calib
