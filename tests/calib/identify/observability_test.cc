#include "calib/identify/observability.h"

#include <gtest/gtest.h>

#include <cmath>

namespace cellcal::calib {
namespace {

TEST(Observability, IsWhatTheLiteratureDefines) {
  const Observability o = observability(Eigen::Vector4d(8.0, 4.0, 2.0, 1e-9), 1, 16);
  EXPECT_EQ(o.directions, 3);
  EXPECT_NEAR(o.o1, 4.0 / 4.0, 1e-12);  // cube root of 64 over the root of 16
  EXPECT_NEAR(o.o2, 0.25, 1e-12);
  EXPECT_NEAR(o.o3, 2.0, 1e-12);
  EXPECT_NEAR(o.o4, 0.5, 1e-12);
  EXPECT_NEAR(o.o5, 1.0 / (1.0 / 8.0 + 1.0 / 4.0 + 1.0 / 2.0), 1e-12);
  EXPECT_NEAR(o.condition, 4.0, 1e-12);
}

TEST(Observability, OfADirectionThatNoTouchSeesIsNothing) {
  const Observability o = observability(Eigen::Vector3d(8.0, 4.0, 0.0), 0, 10);
  EXPECT_EQ(o.directions, 3);
  EXPECT_EQ(o.o1, 0.0);
  EXPECT_EQ(o.condition, 0.0);
}

TEST(Observability, WithoutTouchesOrDirectionsIsNothing) {
  EXPECT_EQ(observability({}, 0, 10).directions, 0);
  EXPECT_EQ(observability(Eigen::Vector2d(1.0, 1.0), 2, 10).directions, 0);
  EXPECT_EQ(observability(Eigen::Vector2d(1.0, 1.0), 0, 0).o1, 0.0);
}

TEST(Observability, OfManyTouchesDoesNotOverflow) {
  const Observability o = observability(Eigen::VectorXd::Constant(200, 1e6), 0, 1000000);
  EXPECT_NEAR(o.o1, 1e3, 1e-6);
}

}  // namespace
}  // namespace cellcal::calib
