#pragma once
// Time stamps in files.

#include <chrono>
#include <optional>
#include <string>
#include <string_view>

namespace cellcal::calib {

/// Seconds since 1970 of an ISO 8601 date and time ("2024-09-24T10:00:00.125Z", "2024-09-24
/// 12:00:00,5+02:00", "20240924T100000Z", "2024-09-24"); UTC if no zone is stated. Empty if invalid.
std::optional<double> seconds_of(std::string_view iso);

/// "2024-09-24T10:00:00Z".
std::string utc_text(std::chrono::sys_seconds time);
/// "2024-09-24T10:00:00.125Z".
std::string utc_text(std::chrono::sys_time<std::chrono::milliseconds> time);

}  // namespace cellcal::calib
