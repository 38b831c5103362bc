#pragma once
// Spheres and their certificate from CSV files. All functions throw calib::FileError with file, line and
// column.

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/cell_form/cell_form.h"

namespace cellcal::daemon {

/// `name`: of the text, for error messages.
std::vector<SphereForm> spheres_in(std::string_view csv, const std::string& name);
std::vector<LengthForm> certificate_in(std::string_view csv, const std::string& name);
std::vector<SphereForm> load_spheres(const std::filesystem::path& csv);
std::vector<LengthForm> load_certificate(const std::filesystem::path& csv);

}  // namespace cellcal::daemon
