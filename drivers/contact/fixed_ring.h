#pragma once
// Single-threaded queue of fixed size. When it is full the oldest element is dropped: unread data
// is stale.

#include <array>
#include <cstddef>
#include <optional>

namespace cellcal::drivers {

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
