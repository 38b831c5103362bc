#pragma once
// Newest value of one writer for several readers: a triple buffer. Writing never waits for readers;
// readers are serialised.

#include <array>
#include <atomic>
#include <cstdint>
#include <mutex>

namespace cellcal::drivers {

template <class T>
class LatestValue {
 public:
  /// One thread only.
  void write(const T& value) {
    slots_[writing_] = value;
    writing_ =
        middle_.exchange(static_cast<std::uint8_t>(writing_ | kFresh), std::memory_order_acq_rel) &
        kIndex;
  }

  /// Any thread except the writer's.
  T read() const {
    const std::lock_guard lock(readers_);
    if ((middle_.load(std::memory_order_relaxed) & kFresh) != 0) {
      reading_ = middle_.exchange(reading_, std::memory_order_acq_rel) & kIndex;
    }
    return slots_[reading_];
  }

 private:
  static constexpr std::uint8_t kIndex = 0x03, kFresh = 0x04;

  std::array<T, 3> slots_{};
  std::uint8_t writing_ = 0;
  mutable std::atomic<std::uint8_t> middle_{1};
  mutable std::uint8_t reading_ = 2;
  mutable std::mutex readers_;
};

}  // namespace cellcal::drivers
