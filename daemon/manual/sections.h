#pragma once
// What the manual pages say besides options.

#include <vector>

#include "daemon/manual/man_page.h"

namespace cellcal::daemon {

std::vector<ManSection> cellcal_sections();
std::vector<ManSection> cellcald_sections();
std::vector<ManSection> cellcal_fleet_sections();
std::vector<ManSection> cellcal_plant_sections();

}  // namespace cellcal::daemon
