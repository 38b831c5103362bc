#pragma once
// Work on many touches, spread over the processors.

#include <cstddef>
#include <functional>

namespace cellcal::calib {

/// How many touches are a part of their own. Sessions have fewer: they start no threads.
inline constexpr std::size_t kTouchesPerPart = 4096;

/// Parts of `count` touches: depends on nothing else, so that sums over parts, added in the parts'
/// order, have the same bits on every machine.
inline std::size_t parts_of(std::size_t count) {
  return count <= kTouchesPerPart ? 1 : (count + kTouchesPerPart - 1) / kTouchesPerPart;
}

/// Calls task(0) to task(count - 1), each once, in any order, on as many threads as there are
/// processors; a single one on the caller's. What the first of them throws is thrown on, when all
/// that were begun have ended.
void in_parallel(std::size_t count, const std::function<void(std::size_t)>& task);

/// Calls task(part, first, behind) for each part of `count` touches, so.
void by_parts(std::size_t count,
              const std::function<void(std::size_t, std::size_t, std::size_t)>& task);

}  // namespace cellcal::calib
