#pragma once
// Histogram of reply times in buckets of one microsecond. One writer, any number of readers,
// lock-free.

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>

#include "drivers/time_histogram.h"

namespace cellcal::drivers {

class ReplyHistogram {
 public:
  static constexpr std::size_t kBuckets = 20'000;  // 20 ms: five cycles of 4 ms; longer: 'over'

  void add(std::chrono::nanoseconds reply_time) {
    const auto us =
        static_cast<std::uint64_t>(reply_time.count() < 0 ? 0 : reply_time.count()) / 1000;
    counts_[us < kBuckets ? us : kBuckets].fetch_add(1, std::memory_order_relaxed);
    if (us > max_us_.load(std::memory_order_relaxed)) {
      max_us_.store(us, std::memory_order_relaxed);
    }
    total_.fetch_add(1, std::memory_order_relaxed);
    sum_us_.fetch_add(us, std::memory_order_relaxed);
    coarse_[TimeHistogram::bucket(1e-6 * static_cast<double>(us))].fetch_add(
        1, std::memory_order_relaxed);
  }

  std::uint64_t count() const { return total_.load(std::memory_order_relaxed); }
  /// Largest time [s].
  double max_s() const {
    return 1e-6 * static_cast<double>(max_us_.load(std::memory_order_relaxed));
  }

  TimeHistogram coarse() const {
    TimeHistogram times;
    for (std::size_t i = 0; i < coarse_.size(); ++i)
      times.counts[i] = coarse_[i].load(std::memory_order_relaxed);
    times.sum_s = 1e-6 * static_cast<double>(sum_us_.load(std::memory_order_relaxed));
    return times;
  }

  /// Number of replies within this time.
  std::uint64_t within(std::chrono::microseconds time) const {
    const auto last =
        std::min(static_cast<std::size_t>(std::max<std::int64_t>(time.count(), 0)), kBuckets);
    std::uint64_t seen = 0;
    for (std::size_t us = 0; us < last; ++us) seen += counts_[us].load(std::memory_order_relaxed);
    return seen;
  }

  /// Quantile p (0..1) of all reply times [s]; 0 without replies.
  double quantile_s(double p) const {
    const auto wanted = static_cast<double>(count()) * p;
    std::uint64_t seen = 0;
    for (std::size_t us = 0; us < kBuckets; ++us) {
      seen += counts_[us].load(std::memory_order_relaxed);
      if (seen > 0 && static_cast<double>(seen) >= wanted)
        return 1e-6 * static_cast<double>(us + 1);
    }
    return max_s();
  }

 private:
  std::array<std::atomic<std::uint32_t>, kBuckets + 1> counts_{};
  std::atomic<std::uint64_t> max_us_{0};
  std::array<std::atomic<std::uint64_t>, TimeHistogram{}.counts.size()> coarse_{};
  std::atomic<std::uint64_t> total_{0}, sum_us_{0};
};

}  // namespace cellcal::drivers
