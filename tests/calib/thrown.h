#pragma once
// Thrown errors as values: tests check kind and subject.

#include <gtest/gtest.h>

#include <stdexcept>

namespace cellcal::calib::testing {

/// The Error thrown by `act`. The test fails and ends if nothing is thrown.
template <class Error, class Act>
Error thrown(const Act& act) {
  try {
    act();
  } catch (const Error& error) {
    return error;
  }
  ADD_FAILURE() << "was not refused";
  throw std::logic_error("nothing was thrown");
}

}  // namespace cellcal::calib::testing
