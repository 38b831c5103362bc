#pragma once
// Published calibrations of a cell as versions: the one in use, activation, comparison.

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
  bool workspace = false;                  ///< scope; otherwise near the targets
  double predicted_m = 0.0;                ///< mean error over the scope
  std::optional<calib::InScope> in_scope;  ///< u95 over the scope
  bool active = false;
  /// Not empty: the record is altered, and its figures are unknown.
  std::string trouble{};
  std::optional<Activation> activated;  ///< most recent
};

using NotActivated = NotUsable;

/// Versions for the cell of that session, or for that of the calibration in use for 0; newest first, at most `most`, and the one in
/// use. Empty where nothing was published. Throws JournalError.
std::vector<Version> versions(Journal& journal, std::int64_t of_cell, std::size_t most);

/// The one in use, of any cell; none where it is unusable. Throws JournalError.
std::optional<Version> version_in_use(Journal& journal);

/// Puts this session's calibration into use, until the next is published or activated. Throws NotActivated,
/// JournalError.
void activate(Journal& journal, const Activation& wanted);
/// Reactivates the calibration that preceded the one in use, of the cell as in versions() (in_use_before());
/// one that was rolled back is skipped. Returns its session.
std::int64_t roll_back(Journal& journal, std::int64_t of_cell, Activation wanted);

struct Comparison {
  std::int64_t before = 0, after = 0;
  bool workspace = false;
  std::optional<calib::InScope> apart;  ///< empty: different nominal geometry or tools
  double expected_m = 0.0;              ///< mean, from the predicted errors of both; 0: unknown
  calib::ParameterDifferences parameters;
};
/// Over the narrower of the two scopes. Throws NotActivated (kNoSession, kWithheld, kDamaged), JournalError.
Comparison compare(Journal& journal, std::int64_t before, std::int64_t after);

}  // namespace cellcal::daemon
