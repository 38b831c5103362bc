#pragma once
// What becomes of the programs of other controllers' backups when they are corrected.

#include <filesystem>

namespace cellcal::experiments {

/// Each folder below is a backup. Prints how many of its modules with motions are corrected, and why the
/// others are not. Exit status.
int print_reasons(const std::filesystem::path& folder);

}  // namespace cellcal::experiments
