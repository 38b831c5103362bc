#pragma once
// Which calibration of a cell is in use: the newest published one, unless somebody activated another since.
//
// Publications and activations are told apart by where they stand among all that was ever written, not by clocks:
// the last of them counts. One that cannot be read, or is not as it was written, counts for nothing, and the log
// says so; the one before it is in use then.

#include <cstdint>
#include <optional>
#include <string>

#include "calib/result/calibration.h"
#include "daemon/journal/journal.h"

namespace cellcal::daemon {

struct Published {
  SessionRecord record;  ///< with its texts
  calib::Calibration calibration;
};
/// None: it has none that is published, or it cannot be read, which the log says.
std::optional<Published> published(Journal& journal, std::int64_t session);

/// Of this cell file, or of whichever where none is given; of sessions of this journal's own. `before`: as it was
/// when that session was last written, without itself and those behind it; 0: as it is now. Throws JournalError.
std::optional<Published> active_calibration(Journal& journal, const std::string& cell_name,
                                            std::int64_t before = 0);

/// The session whose calibration is in use once the one in use now is given back: what was published or activated
/// comes on a stack, and what is activated again takes all above it away. None: nothing was in use before.
std::optional<std::int64_t> in_use_before(Journal& journal, const std::string& cell_name);

}  // namespace cellcal::daemon
