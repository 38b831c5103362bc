#include "calib/estimate/parallel.h"

#include <sched.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <system_error>
#include <thread>
#include <vector>

#include "calib/model/long_work.h"

namespace cellcal::calib {

std::size_t threads_for(std::size_t count) {
  constexpr std::size_t kMost = 8;
  cpu_set_t ours;
  std::size_t processors = 1;  // also on a machine with more processors than the set has
  if (sched_getaffinity(0, sizeof ours, &ours) == 0)
    processors = static_cast<std::size_t>(CPU_COUNT(&ours));
  return std::clamp(processors, std::size_t{1}, std::min(std::max(count, std::size_t{1}), kMost));
}

void in_parallel(std::size_t count, const std::function<void(std::size_t)>& task) {
  const std::size_t threads = threads_for(count);
  if (threads <= 1) {
    for (std::size_t i = 0; i < count; ++i) task(i);
    return;
  }
  std::atomic<std::size_t> next{0};
  std::mutex mutex;
  std::exception_ptr first;
  const auto work = [&] {
    try {
      for (std::size_t i = next++; i < count; i = next++) task(i);
    } catch (...) {
      next = count;
      const std::lock_guard lock(mutex);
      if (!first) first = std::current_exception();
    }
  };
  {
    std::vector<std::jthread> helpers;
    try {
      while (helpers.size() + 1 < threads)
        helpers.emplace_back([&work, watch = Watch::current_watch()] {
          const HelperScope helped(watch);
          work();
        });
    } catch (const std::system_error&) {
      // The system grants no more threads: the existing ones do the work.
    }
    work();
  }
  if (first) std::rethrow_exception(first);
}

void by_parts(std::size_t count,
              const std::function<void(std::size_t, std::size_t, std::size_t)>& task) {
  in_parallel(parts_of(count), [&](std::size_t part) {
    const std::size_t begin = part * kTouchesPerPart;
    task(part, begin, std::min(begin + kTouchesPerPart, count));
  });
}

}  // namespace cellcal::calib
