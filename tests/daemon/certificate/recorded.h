#pragma once
// Sessions as recorded by a daemon: two calibrations of one arm, the second compared with the first.

#include <filesystem>
#include <string>

#include "daemon/archive/archive.h"
#include "daemon/journal/journal.h"

namespace cellcal::daemon::testing {

struct Recording {
  std::string identity{};     ///< TOML after the cell file's text
  std::string certificate{};  ///< of the first target
  bool interrupted = false;
  bool phases = false;  ///< the initial change of phase is recorded
  bool temperatures = false;
  bool publish = true;  ///< otherwise withheld
  /// Stored values differ from the results: published although withheld, and figures of a tenth.
  bool forged_publish = false, forged_figures = false;
  Ending ending = Ending::kDone;
  std::string stands_on{};      ///< an update, based on that session
  double remastered_rad = 0.0;  ///< A2 reads more by this
  double longer_tool_m = 0.0;   ///< than the demo's
  bool lengths = true;          ///< certified ones; else the scope is near the targets
  bool check_length = false;    ///< the last length is a check; it and the first name certificates
  bool as_fit = false;          ///< check touches are recorded as fit touches: none for 'as found'
  bool gross_check = false;     ///< the last check touch is off by some millimetres
  bool emulated = false;        ///< from a daemon's emulated cell
  bool positioner = false;      ///< the result states a positioner axis E1
  bool linear_unit = false;     ///< the result states a linear unit E1
  std::string untouched{};      ///< target without touches
  int fit = 32;                 ///< touches
  int repeats = 0;              ///< of the first touch, after all others
  unsigned seed = 1;
};

/// The number of the session.
std::int64_t record(Journal& journal, const Recording& what, bool against_the_last);

/// Both as exports, created once.
struct Recorded {
  Archive
      first;  ///< of the nominal arm: interrupted and resumed, with temperatures and serial numbers
  Archive second;  ///< compared with the first; without any statements
};
const Recorded& recorded();

}  // namespace cellcal::daemon::testing
