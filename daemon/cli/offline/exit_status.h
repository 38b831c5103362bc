#pragma once

namespace cellcal::daemon {

// A promise to scripts.
inline constexpr int kSuccess = 0;
inline constexpr int kJobFailed = 1;
inline constexpr int kWrongUsage = 2;
inline constexpr int kNotPublishable = 3;

}  // namespace cellcal::daemon
