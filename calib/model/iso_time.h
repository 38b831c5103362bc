#pragma once
// Times as tables of touches hold them.

#include <optional>
#include <string_view>

namespace cellcal::calib {

/// Seconds since 1970 of an ISO 8601 date and time ("2024-09-24T10:00:00.125Z",
/// "2024-09-24 12:00:00+02:00", "20240924T100000Z", "2024-09-24"); UTC where no zone is stated.
/// Nothing where it is none.
std::optional<double> seconds_of(std::string_view iso);

}  // namespace cellcal::calib
