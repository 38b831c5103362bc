#pragma once
// Work on many touches, distributed over the processors.

#include <cstddef>
#include <functional>

namespace cellcal::calib {

/// Number of touches, or rows of touches, in a part. Sessions have fewer and start no threads.
inline constexpr std::size_t kTouchesPerPart = 4096;

/// Number of parts for `count` touches: depends on nothing else, so that sums over parts, added in
/// the parts' order, are bit-identical for any number of processors.
inline std::size_t parts_of(std::size_t count) {
  return count <= kTouchesPerPart ? 1 : (count + kTouchesPerPart - 1) / kTouchesPerPart;
}

/// Number of threads for `count` tasks: at most the processors available to this thread, and at
/// most eight.
std::size_t threads_for(std::size_t count);

/// Calls task(0) to task(count - 1), each once, in any order, on threads_for(count) threads; on the
/// calling thread if that is one. Rethrows an exception of a task after all started tasks have
/// ended.
void in_parallel(std::size_t count, const std::function<void(std::size_t)>& task);

/// Calls task(part, begin, end) in parallel for each part of `count` touches.
void by_parts(std::size_t count,
              const std::function<void(std::size_t, std::size_t, std::size_t)>& task);

}  // namespace cellcal::calib
