#pragma once
// Changes of a cell on its control chart, from the journal.

#include <cstdint>
#include <string>
#include <vector>

#include "calib/result/drift_event.h"
#include "daemon/journal/journal.h"

namespace cellcal::daemon {

/// Before it the calibration's own clock gives no age: that of an emulated cell starts at 2000-01-01.
inline constexpr double kYear2001S = 978'307'200.0;

/// At most this number of publications of a cell, the newest.
inline constexpr std::size_t kMostEvents = 30;

/// Calibrations of this cell file that came into use, by publication or activation; oldest first. A session whose cell
/// file is damaged or unreadable counts as unchanged. Throws JournalError.
std::vector<calib::DriftEvent> events_of(Journal& journal,
                                         const std::vector<SessionRecord>& newest_first,
                                         const std::string& cell_name);

}  // namespace cellcal::daemon
