#pragma once

#include <memory>
#include <utility>

namespace cellcal::calib {

/// Owns a class that is complete only where make_hidden() is called, so that its owner can leave destructor and moves to
/// the compiler.
template <class T>
using Hidden = std::unique_ptr<T, void (*)(T*)>;

template <class T, class... Arguments>
Hidden<T> make_hidden(Arguments&&... arguments) {
  return {new T(std::forward<Arguments>(arguments)...), [](T* it) { delete it; }};
}

}  // namespace cellcal::calib
