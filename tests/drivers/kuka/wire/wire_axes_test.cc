// Order and units of the axes on the wires.

#include "drivers/kuka/wire/wire_axes.h"

#include <gtest/gtest.h>

namespace cellcal::drivers {
namespace {

TEST(WireAxes, WithoutALinearUnitKeepOrderAndAreDegrees) {
  const WireAxes axes(8, false);
  for (std::size_t i = 0; i < 8; ++i) {
    EXPECT_EQ(axes.place(i), i);
    EXPECT_EQ(axes.at_place(i), i);
    EXPECT_EQ(axes.shown(i, 1.0), kDegPerRad);
    EXPECT_EQ(axes.inside(i, 1.0), kRadPerDeg);
    EXPECT_FALSE(axes.name(i).linear);
  }
}

TEST(WireAxes, OfALinearUnitHaveItAsE1InMillimetresBehindA6) {
  const WireAxes axes(8, true);
  EXPECT_EQ(axes.place(0), 6u);
  for (std::size_t i = 1; i <= 6; ++i) EXPECT_EQ(axes.place(i), i - 1);
  EXPECT_EQ(axes.place(7), 7u) << "E2";
  for (std::size_t i = 0; i < 8; ++i) EXPECT_EQ(axes.at_place(axes.place(i)), i);
  EXPECT_EQ(axes.shown(0, 1.25), 1250.0);
  EXPECT_EQ(axes.inside(0, 1250.0), 1.25);
  EXPECT_TRUE(axes.name(0).linear);
  EXPECT_EQ(axes.shown(7, 1.0), kDegPerRad);
}

TEST(WireAxes, AreTakenFromAPacketInTheRobotsOrder) {
  const AxisAngles inside = WireAxes(7, true).inside({1, 2, 3, 4, 5, 6, 2500, 99});
  ASSERT_EQ(inside.size(), 7u);
  EXPECT_EQ(inside[0], 2.5);
  EXPECT_EQ(inside[1], kRadPerDeg);
  EXPECT_EQ(inside[6], 6 * kRadPerDeg);
}

}  // namespace
}  // namespace cellcal::drivers
