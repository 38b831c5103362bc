#pragma once
// Work on many touches, spread over the processors.

#include <cstddef>
#include <functional>

namespace cellcal::calib {

/// How many touches, or rows of touches, are a part of their own. Sessions have fewer: they start
/// no threads.
inline constexpr std::size_t kTouchesPerPart = 4096;

/// Parts of `count` touches: depends on nothing else, so that sums over parts, added in the parts'
/// order, have the same bits on any number of processors.
inline std::size_t parts_of(std::size_t count) {
  return count <= kTouchesPerPart ? 1 : (count + kTouchesPerPart - 1) / kTouchesPerPart;
}

/// Threads for so many tasks: as many as there are processors that this thread may run on, at most
/// eight.
std::size_t threads_for(std::size_t count);

/// Calls task(0) to task(count - 1), each once, in any order, on so many threads; a single
/// one on the caller's. What one of them throws is thrown on, when all that were begun have ended.
void in_parallel(std::size_t count, const std::function<void(std::size_t)>& task);

/// Calls task(part, first, behind) for each part of `count` touches, so.
void by_parts(std::size_t count,
              const std::function<void(std::size_t, std::size_t, std::size_t)>& task);

}  // namespace cellcal::calib
