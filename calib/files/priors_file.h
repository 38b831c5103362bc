#pragma once
// "cellcal.priors/1": how far the arms of one robot model lie from their nominal geometry. Throws FileError.

#include <filesystem>
#include <string>
#include <string_view>

#include "calib/result/fleet_priors.h"

namespace cellcal::calib {

FleetPriors load_priors(const std::filesystem::path& path);
FleetPriors parse_priors(std::string_view text, const std::string& name);
std::string priors_to_toml(const FleetPriors& priors);

/// Of a kind, as users see it: "mm" with 1000.
struct SpreadUnit {
  const char* name;  ///< of the kind: "length"
  const char* unit;
  double per_si;
};
SpreadUnit unit_of(SpreadKind kind);

}  // namespace cellcal::calib
