#pragma once

namespace cellcal::drivers {

/// Calls of operator new in this program so far.
long allocation_count();

}  // namespace cellcal::drivers
