#pragma once
// Tables over all values of an enum: one place for names that are written and read.

#include <array>
#include <cstddef>
#include <optional>
#include <string_view>
#include <type_traits>

namespace cellcal {

/// False for a value without an enumerator, which GCC and Clang print as a cast.
template <auto kValue>
consteval bool is_enumerator() {
  return std::string_view(__PRETTY_FUNCTION__).find("= (") == std::string_view::npos;
}

/// Number of enumerators of an enum that counts from zero.
template <class E, std::size_t kCount = 0>
consteval std::size_t enumerators() {
  if constexpr (is_enumerator<E(kCount)>())
    return enumerators<E, kCount + 1>();
  else
    return kCount;
}

template <class E>
consteval auto all_values() {
  std::array<E, enumerators<E>()> all{};
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = E(i);
  return all;
}

/// A value for each enumerator of E; does not compile unless every one has exactly one row, in order.
template <class E, class T>
class EnumTable {
 public:
  struct Row {
    E key;
    T value;
  };
  static constexpr std::size_t kSize = enumerators<E>();

  template <std::size_t kRows>
    requires(kRows == kSize)
  consteval explicit(false) EnumTable(const Row (&rows)[kRows]) {
    for (std::size_t i = 0; i < kSize; ++i) {
      if (rows[i].key != E(i)) throw "rows in the order of the enumerators";
      values_[i] = rows[i].value;
    }
  }

  /// For a value without an enumerator: "unknown", or throws std::out_of_range where T is no text.
  constexpr T operator[](E key) const {
    const auto index = static_cast<std::size_t>(key);
    if constexpr (std::is_same_v<T, const char*>)
      if (index >= kSize) return "unknown";
    return values_.at(index);
  }
  constexpr std::optional<E> key_of(std::string_view name) const {
    for (std::size_t i = 0; i < kSize; ++i)
      if (values_[i] == name) return E(i);
    return std::nullopt;
  }

 private:
  std::array<T, kSize> values_{};
};

template <class E>
using EnumNames = EnumTable<E, const char*>;

}  // namespace cellcal
