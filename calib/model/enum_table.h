#pragma once
// Tables over all values of an enum: one place for names that are written and read.

#include <array>
#include <cstddef>
#include <optional>
#include <string_view>
#include <type_traits>
#include <utility>

namespace cellcal {

/// As GCC and Clang print it: "cellcal::Colour::kDarkBlue"; "(cellcal::Colour)7" without an enumerator.
template <auto kValue>
consteval std::string_view printed() {
  std::string_view text(__PRETTY_FUNCTION__);
  text.remove_prefix(text.find("kValue = ") + std::string_view("kValue = ").size());
  return text.substr(0, text.find_first_of(";]"));
}

template <auto kValue>
consteval bool is_enumerator() {
  return !printed<kValue>().starts_with('(');
}

/// "dark_blue" of kDarkBlue for '_' between words, with the zero at its end.
template <auto kValue, char kBetween>
consteval auto lower_case() {
  constexpr std::string_view kPrinted = printed<kValue>();
  std::array<char, 2 * kPrinted.size()> name{};
  std::size_t length = 0;
  for (const char c : kPrinted.substr(kPrinted.rfind(':') + 2)) {
    const bool capital = c >= 'A' && c <= 'Z';
    if (capital && length > 0) name[length++] = kBetween;
    name[length++] = capital ? static_cast<char>(c - 'A' + 'a') : c;
  }
  return name;
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
  requires(kRows == kSize) consteval explicit(false) EnumTable(const Row (&rows)[kRows]) {
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

template <auto kValue, char kBetween>
inline constexpr auto kOwnName = lower_case<kValue, kBetween>();

/// The enumerators' own names: another enumerator is another name in files (tests/calib/result/names_test.cc,
/// tests/daemon/result/names_test.cc).
template <class E, char kBetween = '_'>
inline constexpr EnumNames<E> kOwnNames = [
]<std::size_t... kIndex>(std::index_sequence<kIndex...>) {
  return EnumNames<E>({{E(kIndex), kOwnName<E(kIndex), kBetween>.data()}...});
}
(std::make_index_sequence<enumerators<E>()>());

/// "touch_scatter" of FindingKind::kTouchScatter, "touch-scatter" with '-', and back; empty for an unknown name.
template <char kBetween = '_', class E>
constexpr const char* own_name(E value) {
  return kOwnNames<E, kBetween>[value];
}
template <class E, char kBetween = '_'>
constexpr std::optional<E> by_own_name(std::string_view name) {
  return kOwnNames<E, kBetween>.key_of(name);
}

}  // namespace cellcal
