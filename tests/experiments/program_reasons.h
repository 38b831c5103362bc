#pragma once
// Results of correcting programs in backups of other controllers.

#include <filesystem>

namespace cellcal::experiments {

/// Each folder below is a backup. Prints how many of its modules with motions are corrected together, for the arm of
/// its machine data, offline and at run time, and why the others are not; `verbose`: the line of each that is not
/// corrected at run time. Returns the exit status.
int print_reasons(const std::filesystem::path& folder, bool verbose);

}  // namespace cellcal::experiments
