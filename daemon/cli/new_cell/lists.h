#pragma once
// Spheres and their certificate from CSV files. All throw calib::FileError with file, line and column.

#include <filesystem>
#include <vector>

#include "daemon/cli/new_cell/cell_form.h"

namespace cellcal::daemon {

std::vector<SphereForm> load_spheres(const std::filesystem::path& csv);
std::vector<LengthForm> load_certificate(const std::filesystem::path& csv);

}  // namespace cellcal::daemon
