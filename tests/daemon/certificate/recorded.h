#pragma once
// Sessions as a daemon would have recorded them: two calibrations of one arm, the second held against the first.

#include <filesystem>
#include <string>

#include "daemon/journal/journal.h"
#include "daemon/archive/archive.h"

namespace cellcal::daemon::testing {

struct Recording {
  std::string identity{};     ///< TOML behind the cell file's text
  std::string certificate{};  ///< of the first target
  bool interrupted = false;
  bool temperatures = false;
  bool publish = true;  ///< else withheld
  unsigned seed = 1;
};

/// The session's number.
std::int64_t record(Journal& journal, const Recording& what, bool against_the_last);

/// Both as exports, made once.
struct Recorded {
  Archive first;   ///< of the nominal arm: interrupted and resumed, with temperatures and serial numbers
  Archive second;  ///< held against the first; nothing is stated of it
};
const Recorded& recorded();

}  // namespace cellcal::daemon::testing
