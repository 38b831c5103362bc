#pragma once
// What is in quarantine, read a second time: by a newer program, or where there is more room.

#include <string>
#include <vector>

#include "daemon/fleet/store/store.h"

namespace cellcal::daemon::fleet {

struct Reread {
  std::size_t stored = 0;   ///< facts and presences that are now taken, and no longer in quarantine
  std::size_t twice = 0;    ///< facts that had come meanwhile; no longer in quarantine
  std::size_t refused = 0;  ///< still, and kept
  std::vector<std::string> cut;  ///< kept in part by an older program; of each its topic and bytes
};

/// Twice is as good as once, and beside collectors at work. Throws StoreAway; what was read by then is done.
Reread reread_quarantine(Store& store);

}  // namespace cellcal::daemon::fleet
