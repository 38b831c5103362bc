#pragma once
// Newest value of one writer for several readers: a triple buffer. Writing never waits for readers;
// readers are serialised.

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <optional>

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

// Single-threaded queue of fixed size. When it is full the oldest element is dropped: unread data
// is stale.

template <class T, std::size_t kCapacity>
class FixedRing {
 public:
  /// False: the oldest element was dropped.
  bool push(const T& value) {
    const bool room = size_ < kCapacity;
    if (!room) {
      first_ = (first_ + 1) % kCapacity;
      --size_;
    }
    items_[(first_ + size_) % kCapacity] = value;
    ++size_;
    return room;
  }

  std::optional<T> pop() {
    if (size_ == 0) return std::nullopt;
    const T value = items_[first_];
    first_ = (first_ + 1) % kCapacity;
    --size_;
    return value;
  }

  bool contains(const T& value) const {
    for (std::size_t i = 0; i < size_; ++i) {
      if (items_[(first_ + i) % kCapacity] == value) return true;
    }
    return false;
  }

  bool empty() const { return size_ == 0; }
  void clear() { first_ = size_ = 0; }

 private:
  std::array<T, kCapacity> items_{};
  std::size_t first_ = 0, size_ = 0;
};

}  // namespace cellcal::drivers
