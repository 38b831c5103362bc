#pragma once
// What becomes of the programs of other controllers' backups when they are corrected.

#include <filesystem>

namespace cellcal::experiments {

/// Each folder below is a backup. Prints how many of its modules with motions are corrected together, on the
/// arm of its machine data, offline and at run time, and why the others are not; `verbose`: the line of each that is
/// not at run time. Exit status.
int print_reasons(const std::filesystem::path& folder, bool verbose);

}  // namespace cellcal::experiments
