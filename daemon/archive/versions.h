#pragma once
// The published calibrations of a cell as versions: which is in use, another put into use, two compared.

#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "calib/verdict/change.h"
#include "daemon/journal/journal.h"
#include "daemon/tasks/active_calibration.h"

namespace cellcal::daemon {

struct Version {
  std::int64_t session = 0;
  std::string ended, cell;
  bool workspace = false;                  ///< scope; else near the targets
  double predicted_m = 0.0;                ///< mean error over the scope
  std::optional<calib::InScope> in_scope;  ///< u95 over it
  bool active = false;
  std::string
      trouble{};  ///< not empty: it is not as it was written, and none of its figures is known
  std::optional<Activation> activated;  ///< the last time
};

using NotActivated = NotUsable;

/// Of the cell of that session, or of the calibration in use where it is 0; the newest first, `most` at most. Empty
/// where nothing was published. Throws JournalError.
std::vector<Version> versions(Journal& journal, std::int64_t of_cell, std::size_t most);

/// The one that is in use, of whichever cell; none where it cannot be used. Throws JournalError.
std::optional<Version> version_in_use(Journal& journal);

/// From now on this session's calibration is in use, until the next is published or activated. Throws NotActivated,
/// JournalError.
void activate(Journal& journal, const Activation& wanted);
/// The one that was in use before the one in use, of the cell as versions() has it (in_use_before()): not one that was given
/// back for it. Returns its session.
std::int64_t roll_back(Journal& journal, std::int64_t of_cell, Activation wanted);

struct Comparison {
  std::int64_t before = 0, after = 0;
  bool workspace = false;
  std::optional<calib::InScope> apart;  ///< empty: of different nominal geometry or tools
  double expected_m = 0.0;              ///< mean, by the predicted errors of both; 0: not known
  calib::ParameterDifferences parameters;
};
/// Over the narrower of the two scopes. Throws NotActivated (kNoSession, kWithheld, kDamaged), JournalError.
Comparison compare(Journal& journal, std::int64_t before, std::int64_t after);

}  // namespace cellcal::daemon
