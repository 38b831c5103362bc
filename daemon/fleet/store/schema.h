#pragma once
// The migrations, oldest first; what was released is never changed, only followed by another.

namespace cellcal::daemon::fleet {

extern const char* const kTables;    ///< 1
extern const char* const kViews;     ///< 2
extern const char* const kKept;      ///< 3
extern const char* const kNewest;    ///< 4
extern const char* const kOutcomes;  ///< 5

}  // namespace cellcal::daemon::fleet
