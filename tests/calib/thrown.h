#pragma once
// What was thrown, as a value: tests ask for its kind and what it is about.

#include <gtest/gtest.h>

#include <stdexcept>

namespace cellcal::calib::testing {

/// The Error that `act` throws. Where it throws none the test has failed and ends.
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
