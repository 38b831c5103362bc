#pragma once
// Sessions as a daemon would have recorded them: two calibrations of one arm, the second held against the first.

#include <filesystem>
#include <string>

#include "daemon/archive/archive.h"
#include "daemon/journal/journal.h"

namespace cellcal::daemon::testing {

struct Recording {
  std::string identity{};     ///< TOML behind the cell file's text
  std::string certificate{};  ///< of the first target
  bool interrupted = false;
  bool phases = false;  ///< the change of phase that it began with is recorded
  bool temperatures = false;
  bool publish = true;  ///< else withheld
  /// What is stored is another than what was found: published though it was withheld, and figures a tenth of it.
  bool forged_publish = false, forged_figures = false;
  Ending ending = Ending::kDone;
  std::string stands_on{};      ///< it is an update, of that session
  double remastered_rad = 0.0;  ///< A2 reads more by this
  double longer_tool_m = 0.0;   ///< than the demo's
  bool lengths = true;          ///< certified ones; else the scope is near the targets
  bool check_length = false;    ///< the last certified length is a check
  bool as_fit = false;  ///< the journal has the check touches as fit touches: none for 'as found'
  bool gross_check = false;  ///< the last check touch, by some millimetres
  bool emulated = false;     ///< of a daemon's own emulated cell
  bool positioner = false;   ///< the result states an axis E1 of one
  bool linear_unit = false;  ///< the result states one, E1
  std::string untouched{};   ///< target of which no touch is made
  int fit = 32;              ///< touches
  int repeats = 0;           ///< of the first touch, behind all others
  unsigned seed = 1;
};

/// The session's number.
std::int64_t record(Journal& journal, const Recording& what, bool against_the_last);

/// Both as exports, made once.
struct Recorded {
  Archive
      first;  ///< of the nominal arm: interrupted and resumed, with temperatures and serial numbers
  Archive second;  ///< held against the first; nothing is stated of it
};
const Recorded& recorded();

}  // namespace cellcal::daemon::testing
