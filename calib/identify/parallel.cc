#include "calib/identify/parallel.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <system_error>
#include <thread>
#include <vector>

namespace cellcal::calib {

void in_parallel(std::size_t count, const std::function<void(std::size_t)>& task) {
  constexpr std::size_t kMostThreads = 8;
  const std::size_t threads =
      std::min({count, std::size_t{std::max(1u, std::thread::hardware_concurrency())}, kMostThreads});
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
      while (helpers.size() + 1 < threads) helpers.emplace_back(work);
    } catch (const std::system_error&) {
      // The machine grants no more of them: those that there are do the work.
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
