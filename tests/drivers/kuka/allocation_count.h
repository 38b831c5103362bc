#pragma once

namespace cellcal::drivers {

/// Calls of operator new in this program so far.
long allocation_count();
/// Calls by the current thread.
long allocations_of_this_thread();

}  // namespace cellcal::drivers
