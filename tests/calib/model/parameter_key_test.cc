// Parameters by key and by name: every name maps back to its key, and no other string to any.

#include "calib/model/parameter_key.h"

#include <gtest/gtest.h>

#include <map>
#include <stdexcept>
#include <vector>

namespace cellcal::calib {
namespace {

Cell cell_of(const std::vector<std::string>& joints, const std::vector<std::string>& tools,
             const std::vector<std::string>& targets) {
  Cell cell;
  for (const std::string& name : joints) cell.robot.joints.emplace_back().name = name;
  for (std::size_t k = 0; k < tools.size(); ++k)
    (k == 0 ? cell.tool : cell.other_tools.emplace_back()).id = tools[k];
  for (const std::string& id : targets) cell.targets.emplace_back().id = id;
  return cell;
}

/// Every key that a cell can have, waves up to the third order.
std::vector<ParameterKey> all_keys(const Cell& cell) {
  using Kind = ParameterKind;
  std::vector<ParameterKey> keys;
  for (std::size_t j = 0; j < cell.robot.joints.size(); ++j) {
    for (const Kind kind : {Kind::kTheta, Kind::kD, Kind::kA, Kind::kAlpha, Kind::kBeta,
                            Kind::kCompliance, Kind::kStiffening, Kind::kPlay})
      keys.push_back(joint_parameter(kind, j));
    for (std::size_t link = j; link < cell.robot.joints.size(); ++link)
      for (const int axis : {0, 1, 2}) keys.push_back(load_parameter(j, link, axis));
    for (const int order : {1, 2, 3})
      for (const Kind kind :
           {Kind::kCosine, Kind::kSine, Kind::kFunctionCosine, Kind::kFunctionSine})
        keys.push_back(wave_parameter(kind, j, order));
  }
  for (std::size_t k = 0; k <= cell.other_tools.size(); ++k) {
    keys.push_back(tool_parameter(Kind::kDeflection, k));
    keys.push_back(tool_parameter(Kind::kEffectiveRadius, k));
    for (const int axis : {0, 1, 2}) keys.push_back(tool_parameter(Kind::kTcp, k, axis));
  }
  keys.push_back(latch_delay_parameter());
  for (std::size_t t = 0; t < cell.targets.size(); ++t) {
    for (const Kind kind : {Kind::kCentre, Kind::kTurn, Kind::kProbeTurn})
      for (const int axis : {0, 1, 2}) keys.push_back(target_parameter(kind, t, axis));
    for (const int axis : {0, 1}) keys.push_back(target_parameter(Kind::kTilt, t, axis));
    keys.push_back(target_parameter(Kind::kShift, t));
    keys.push_back(target_parameter(Kind::kRadius, t));
  }
  return keys;
}

TEST(ParameterKey, EveryNameIsItsOwnAndLeadsBack) {
  for (const Cell& cell :
       {cell_of({"A1", "A2", "A3"}, {""}, {"S1", "S10"}),
        cell_of({"A1", "A1.x", "A"}, {"T1", "T2"}, {"bar.left", "bar", "A1.radius"}),
        cell_of({"axis 1", "load_"}, {"tool"}, {"touch", "x"})}) {
    std::map<std::string, ParameterKey> keys;
    for (const ParameterKey& key : all_keys(cell)) {
      const std::string name = parameter_name(cell, key);
      EXPECT_TRUE(keys.emplace(name, key).second) << name;
      EXPECT_EQ(parameter_key(cell, name), key) << name;
    }
  }
}

TEST(ParameterKey, NamesStandInFilesLetterForLetter) {
  using Kind = ParameterKind;
  const Cell one = cell_of({"A1", "A2", "A3", "A4"}, {""}, {"S1"});
  EXPECT_EQ(parameter_name(one, joint_parameter(Kind::kTheta, 1)), "A2.theta");
  EXPECT_EQ(parameter_name(one, joint_parameter(Kind::kCompliance, 1)), "A2.compliance");
  EXPECT_EQ(parameter_name(one, bearing_parameter(1, 1)), "A2.bearing_y");
  EXPECT_EQ(parameter_name(one, joint_parameter(Kind::kPlay, 1)), "A2.play");
  EXPECT_EQ(parameter_name(one, load_parameter(1, 3, 0)), "A2.load_A4_x");
  EXPECT_EQ(parameter_name(one, wave_parameter(Kind::kCosine, 2, 2)), "A3.cos2");
  EXPECT_EQ(parameter_name(one, wave_parameter(Kind::kSine, 2, 16)), "A3.sin16");
  EXPECT_EQ(parameter_name(one, wave_parameter(Kind::kFunctionCosine, 0, 17)), "A1.fcos17");
  EXPECT_EQ(parameter_name(one, tool_parameter(Kind::kDeflection, 0)), "tool.c_t");
  EXPECT_EQ(parameter_name(one, tool_parameter(Kind::kTcp, 0, 2)), "tool.z");
  EXPECT_EQ(parameter_name(one, tool_parameter(Kind::kEffectiveRadius, 0)), "touch.rho");
  EXPECT_EQ(parameter_name(one, latch_delay_parameter()), "latch_delay");
  EXPECT_EQ(parameter_name(one, target_parameter(Kind::kCentre, 0, 1)), "S1.y");
  EXPECT_EQ(parameter_name(one, target_parameter(Kind::kTilt, 0, 0)), "S1.tilt1");
  EXPECT_EQ(parameter_name(one, target_parameter(Kind::kTilt, 0, 1)), "S1.tilt2");
  EXPECT_EQ(parameter_name(one, target_parameter(Kind::kShift, 0)), "S1.shift");
  EXPECT_EQ(parameter_name(one, target_parameter(Kind::kTurn, 0, 2)), "S1.rz");
  EXPECT_EQ(parameter_name(one, target_parameter(Kind::kRadius, 0)), "S1.radius");
  EXPECT_EQ(parameter_name(one, target_parameter(Kind::kProbeTurn, 0, 0)), "S1.probe_rx");
  const Cell several = cell_of({"A1"}, {"torch", "probe"}, {});
  EXPECT_EQ(parameter_name(several, tool_parameter(Kind::kEffectiveRadius, 0)), "torch.rho");
  EXPECT_EQ(parameter_name(several, tool_parameter(Kind::kTcp, 1, 0)), "probe.x");
}

TEST(ParameterKey, OfNamesThatAreNoneThereIsNone) {
  const Cell cell = cell_of({"A1", "A2"}, {""}, {"S1"});
  for (const char* name : {"",
                           ".",
                           "A1",
                           "A1.",
                           ".theta",
                           "A1.Theta",
                           "A1.theta ",
                           " A1.theta",
                           "A1.theta.x",
                           "A3.theta",
                           "A1.cos",
                           "A1.cos0",
                           "A1.cos-1",
                           "A1.cos01",
                           "A1.cos+1",
                           "A1.cos1.0",
                           "A1.cos1x",
                           "A1.cos99999999999999999999",
                           "A1.tan1",
                           "A1.play1",
                           "tool.play",
                           "A1.load_",
                           "A1.load_A2",
                           "A1.load_A2_w",
                           "A2.load_A1_x",
                           "tool.rho",
                           "touch.c_t",
                           "touch.x",
                           "latch_delay.x",
                           "touch.latch_delay",
                           "S1",
                           "S1.w",
                           "S1.tilt3",
                           "S2.x",
                           "S1.probe_x",
                           "thermal.alpha"})
    EXPECT_FALSE(parameter_key(cell, name)) << name;
  EXPECT_FALSE(parameter_key(cell, std::string(100000, 'A')));
  EXPECT_FALSE(parameter_key(cell, std::string("A1.theta\0", 9)));
  EXPECT_FALSE(parameter_key(Cell{}, "A1.theta"));
}

TEST(ParameterKey, OfAPartThatTheCellDoesNotHaveHasNoName) {
  const Cell cell = cell_of({"A1"}, {""}, {"S1"});
  EXPECT_THROW((void)parameter_name(cell, joint_parameter(ParameterKind::kD, 1)),
               std::out_of_range);
  EXPECT_THROW((void)parameter_name(cell, load_parameter(0, 1, 0)), std::out_of_range);
  EXPECT_THROW((void)parameter_name(cell, tool_parameter(ParameterKind::kTcp, 1)),
               std::out_of_range);
  EXPECT_THROW((void)parameter_name(cell, target_parameter(ParameterKind::kCentre, 1)),
               std::out_of_range);
}

}  // namespace
}  // namespace cellcal::calib
