#pragma once
// Which calibration of a cell is in use: the newest published one, unless somebody activated another since.
//
// Publications and activations are told apart by where they stand among all that was ever written, not by clocks:
// the last of them counts. One that is in use and not as it was written is not as if it were not there: whoever needs
// it is refused (NotUsable), until another is activated or published.

#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "calib/result/calibration.h"
#include "daemon/journal/journal.h"

namespace cellcal::daemon {

struct Published {
  SessionRecord record;  ///< with its texts
  calib::Calibration calibration;
};

/// A session's calibration is not used, and why: in words, with what to do.
struct NotUsable : std::runtime_error {
  enum class Why {
    kNoSession,
    kWithheld,       ///< it has no published calibration
    kDamaged,        ///< it is not as it was written, or cannot be read
    kForeign,        ///< of another journal, or of another robot than the cell's newest
    kActive,         ///< it is to be activated, and is in use
    kNothingBefore,  ///< nothing older to go back to
  };
  NotUsable(Why reason, const std::string& words) : std::runtime_error(words), why(reason) {}
  Why why;
};

/// None: it has none that is published. Throws NotUsable (kDamaged), JournalError.
std::optional<Published> published(Journal& journal, std::int64_t session);
/// Likewise, of whichever journal. Throws NotUsable, JournalError.
Published published_or_refused(Journal& journal, std::int64_t session);
/// What may be put into use and checked against: published by this journal, for the robot and tool of the cell's newest.
/// Throws NotUsable, JournalError.
Published usable(Journal& journal, std::int64_t session);

/// Sessions of this journal and cell that are done, and those that are damaged; the newest first. Throws JournalError.
std::vector<std::int64_t> done_or_damaged(Journal& journal, const std::string& cell_name);

struct InUse {
  std::int64_t session = 0;
  std::string cell;  ///< file
  std::optional<Published> calibration;
  std::string trouble;  ///< where there is none: why it cannot be used, and what to do
};
/// Of this cell file, or of whichever where none is given; of sessions of this journal's own. `before`: as it was
/// when that session was last written, without itself and those behind it; 0: as it is now. Throws JournalError.
std::optional<InUse> in_use(Journal& journal, const std::string& cell_name,
                            std::int64_t before = 0);
/// The same. Throws NotUsable where it cannot be used.
std::optional<Published> active_calibration(Journal& journal, const std::string& cell_name,
                                            std::int64_t before = 0);

/// The session whose calibration is in use once the one in use now is given back: what was published or activated
/// comes on a stack, and what is activated again takes all above it away. None: nothing was in use before.
std::optional<std::int64_t> in_use_before(Journal& journal, const std::string& cell_name);

}  // namespace cellcal::daemon
