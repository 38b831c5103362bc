#pragma once
// Calibration of a cell in use: the newest published one, unless another was activated since.
//
// Publications and activations are ordered by their position in the journal, not by clocks: the last one
// takes precedence. A damaged calibration in use is not skipped: its use is refused (NotUsable) until another
// is activated or published.

#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "calib/result/calibration.h"
#include "daemon/journal/journal.h"

namespace cellcal::daemon {

struct Published {
  SessionRecord record;  ///< including its texts
  calib::Calibration calibration;
};

/// A session's calibration is not used; the text gives reason and remedy.
struct NotUsable : std::runtime_error {
  enum class Why {
    kNoSession,
    kWithheld,       ///< it has no published calibration
    kDamaged,        ///< altered or unreadable
    kForeign,        ///< of another journal, or of another robot than the cell's newest
    kActive,         ///< already in use
    kNothingBefore,  ///< no earlier one to return to
  };
  NotUsable(Why reason, const std::string& words) : std::runtime_error(words), why(reason) {}
  Why why;
};

/// None: no published calibration. Throws NotUsable (kDamaged), JournalError.
std::optional<Published> published(Journal& journal, std::int64_t session);
/// Likewise, from any journal. Throws NotUsable, JournalError.
Published published_or_refused(Journal& journal, std::int64_t session);
/// A calibration that may be activated and checked against: published by this journal, for the robot and tool
/// of the cell's newest. Throws NotUsable, JournalError.
Published usable(Journal& journal, std::int64_t session);

/// Completed and damaged sessions of this journal and cell, newest first. Throws JournalError.
std::vector<std::int64_t> done_or_damaged(Journal& journal, const std::string& cell_name);

struct InUse {
  std::int64_t session = 0;
  std::string cell;  ///< its file
  std::optional<Published> calibration;
  std::string trouble;  ///< without a usable calibration: reason and remedy
};
/// For this cell file, or for any where none is given; sessions of this journal only. `before`: state at the
/// last write of that session, excluding itself and later ones; 0: current state. Throws JournalError.
std::optional<InUse> in_use(Journal& journal, const std::string& cell_name,
                            std::int64_t before = 0);
/// The same. Throws NotUsable where it is unusable.
std::optional<Published> active_calibration(Journal& journal, const std::string& cell_name,
                                            std::int64_t before = 0);

/// Session whose calibration is in use after rolling back the current one: publications and activations are
/// pushed on a stack, except that an activation of the one before removes the top: a step back. None: nothing was in use before.
std::optional<std::int64_t> in_use_before(Journal& journal, const std::string& cell_name);

}  // namespace cellcal::daemon
