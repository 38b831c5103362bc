#include "drivers/kuka/eki/eki_report.h"

#include <gtest/gtest.h>

namespace cellcal::drivers {
namespace {

TEST(EkiControllerRequests, TellsItsModeAndOverrideOnceItIsHeard) {
  EkiCoreState state;
  EXPECT_EQ(to_robot_state(state, "peer").mode, OperatingMode::kUnknown);
  EXPECT_FALSE(to_robot_state(state, "peer").override_percent);
  state.link = RobotLink::kNotReferenced;
  state.override_percent = 30;
  const std::pair<OperatingMode, OperatingMode> kModes[] = {
      {OperatingMode::kT1, OperatingMode::kT1},
      {OperatingMode::kT2, OperatingMode::kT2},
      {OperatingMode::kAut, OperatingMode::kAut},
      {OperatingMode::kExt, OperatingMode::kExt}};
  for (const auto& [number, mode] : kModes) {
    state.mode = number;
    EXPECT_EQ(to_robot_state(state, "peer").mode, mode);
  }
  EXPECT_EQ(to_robot_state(state, "peer").override_percent, 30);
  EXPECT_TRUE(to_robot_state(state, "peer").override_slows);
}

}  // namespace
}  // namespace cellcal::drivers
