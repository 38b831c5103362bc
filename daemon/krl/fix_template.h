#pragma once
// cellcal_fix.src.in as the build has it, so that the command needs no other file.

#include <string_view>

namespace cellcal::daemon::krl {

extern const std::string_view kFixTemplate;
/// cellcal's version.
extern const char* const kFixRelease;

}  // namespace cellcal::daemon::krl
