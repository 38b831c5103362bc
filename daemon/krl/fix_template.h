#pragma once
// cellcal_fix.src.in, and what follows it for external axes, as the build has them, so that the command needs no other
// file.

#include <string_view>

namespace cellcal::daemon::krl {

extern const std::string_view kFixTemplate, kFixExternalTemplate;
/// cellcal's version.
extern const char* const kFixRelease;

}  // namespace cellcal::daemon::krl
