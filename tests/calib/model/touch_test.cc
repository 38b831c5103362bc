// A touch that was printed twice is recognised whatever the digits; one that was made again is not.

#include "calib/model/touch.h"

#include <gtest/gtest.h>

#include <cmath>

#include "calib/model/units.h"

namespace cellcal::calib {
namespace {

double rounded(double value, double step) { return std::round(value / step) * step; }

Touch made() {
  Touch touch;
  for (const double deg :
       {-3.9320074, -72.4794413, 119.6173781, -86.6664964, 67.7144681, 99.1191294})
    touch.joint_rad.push_back(deg * kRadPerDeg);
  touch.tracker_m[0] = 1.0341237;
  touch.tracker_m[1] = -0.2219046;
  touch.tracker_m[2] = 0.7768152;
  return touch;
}

Touch printed(int digits) {
  Touch touch = made();
  const double step = std::pow(10.0, -digits);
  for (double& angle : touch.joint_rad) angle = rounded(angle, step * kRadPerDeg);
  for (double& length : touch.tracker_m) length = rounded(length, step / kMmPerM);
  return touch;
}

TEST(SameReading, IsOneTouchInAnyTwoNumbersOfDigits) {
  for (const int one : {2, 3, 4, 6, 7})
    for (const int other : {2, 3, 5, 7}) {
      EXPECT_TRUE(same_reading(printed(one), printed(other))) << one << " and " << other;
      EXPECT_TRUE(same_reading(made(), printed(other)));
    }
}

TEST(SameReading, IsNotOneThatWasMadeAgain) {
  Touch again = made();
  again.joint_rad[4] += 2e-4 * kRadPerDeg;
  EXPECT_FALSE(same_reading(made(), again));
  EXPECT_FALSE(same_reading(printed(4), again))
      << "off by more than half of the last of four digits";
  again = made();
  again.tracker_m[2] += 3e-6;
  EXPECT_FALSE(same_reading(made(), again));
  Touch without = made();
  without.joint_rad.pop_back();
  EXPECT_FALSE(same_reading(made(), without));
  Touch turned = made();
  turned.tracker_abc_rad = {0.1, 0.2, 0.3};
  EXPECT_FALSE(same_reading(made(), turned));
}

}  // namespace
}  // namespace cellcal::calib
