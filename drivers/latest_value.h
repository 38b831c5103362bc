#pragma once
// Newest value of one writer for any number of readers, without locks. The value is stored in
// atomic words, so that a torn read is not a data race, only a reason to retry.

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <type_traits>

namespace cellcal::drivers {

template <typename T>
class Seqlock {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  Seqlock() { store(T{}); }

  void store(const T& value) {
    std::array<std::uint64_t, kWords> words{};
    std::memcpy(words.data(), &value, sizeof value);
    const std::uint64_t turn = turn_.load(std::memory_order_relaxed);
    turn_.store(turn + 1, std::memory_order_relaxed);
    // Release on each word orders it after the odd sequence number, in place of a fence.
    for (std::size_t i = 0; i < kWords; ++i) words_[i].store(words[i], std::memory_order_release);
    turn_.store(turn + 2, std::memory_order_release);
  }

  T load() const {
    std::array<std::uint64_t, kWords> words{};
    std::uint64_t before = 0, after = 0;
    do {
      before = turn_.load(std::memory_order_acquire);
      for (std::size_t i = 0; i < kWords; ++i) words[i] = words_[i].load(std::memory_order_acquire);
      after = turn_.load(std::memory_order_relaxed);
    } while (before != after || before % 2 != 0);
    T value;
    std::memcpy(static_cast<void*>(&value), words.data(), sizeof value);
    return value;
  }

 private:
  static constexpr std::size_t kWords = (sizeof(T) + 7) / 8;
  std::atomic<std::uint64_t> turn_{0};
  std::array<std::atomic<std::uint64_t>, kWords> words_{};
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
