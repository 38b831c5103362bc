#pragma once
// Enumerators and their names in files, both ways by one table.

#include <array>
#include <cstddef>
#include <optional>
#include <string>

namespace cellcal::calib {

template <class T>
struct Named {
  T value;
  const char* name;
};
template <class T>
Named(T, const char*) -> Named<T>;  // clang 14, used for the fuzzers, has no CTAD for aggregates

template <class T, std::size_t N>
const char* name_of(const std::array<Named<T>, N>& all, T value) {
  for (const Named<T>& one : all)
    if (one.value == value) return one.name;
  return "";
}

template <class T, std::size_t N>
std::optional<T> named(const std::array<Named<T>, N>& all, const std::string& name) {
  for (const Named<T>& one : all)
    if (name == one.name) return one.value;
  return std::nullopt;
}

}  // namespace cellcal::calib
