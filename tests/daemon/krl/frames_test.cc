#include "daemon/krl/frames.h"

#include <gtest/gtest.h>

#include "calib/model/error.h"
#include "daemon/krl/krl_data.h"
#include "tests/daemon/krl/fixture.h"

namespace cellcal::daemon::testing {
namespace {

using krl::FramesRequest;
using krl::propose_frames;

/// The tool's tip identified 0.2, -0.3 and 0.1 mm off, axis 3 off by 0.5 mrad.
calib::Calibration identified() {
  calib::Calibration c = calibration(1, 0.0);
  constexpr double kOff[] = {0.2e-3, -0.3e-3, 0.1e-3};
  for (int axis = 0; axis < 3; ++axis) {
    calib::ParameterResult one;
    one.key = calib::tool_parameter(calib::ParameterKind::kTcp, 0, axis);
    one.correction = kOff[axis];
    one.sigma = 0.02e-3;
    c.parameters.push_back(one);
  }
  for (calib::ParameterResult& one : c.parameters)
    if (one.key == calib::joint_parameter(calib::ParameterKind::kTheta, 3)) one.correction = 5e-4;
  return c;
}

FramesRequest request() {
  FramesRequest r;
  r.tool = 1;
  r.calibration = "cal\xc3\xa9.json";
  r.controller = {{"$config.dat",
                   "TOOL_DATA[1]={X 59.9,Y 50.5,Z 410.3,A 38.84,B 3.59,C 0.0}\r\n"
                   "BASE_DATA[3]={X 1.5,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0}\r\n"}};
  return r;
}

TEST(TheToolsFrame, IsWhatWasIdentifiedOfIt) {
  const auto result = propose_frames(identified(), request());
  ASSERT_EQ(result.frames.size(), 1U);
  EXPECT_EQ(result.frames[0].name, "TOOL_DATA[1]");
  EXPECT_NEAR(result.frames[0].frame.xyz_mm[1], 50.2, 1e-9);
  EXPECT_NEAR(result.frames[0].shift_mm, std::sqrt(0.14), 1e-6);
  EXPECT_NEAR(result.frames[0].sigma_mm[0], 0.02, 1e-12);
  EXPECT_EQ(result.config_lines,
            "TOOL_DATA[1]={X 60.1000,Y 50.2000,Z 410.4000,A 38.84000,B 3.59000,C 0.00000}\n");
}

TEST(TheToolsFrame, ReplacesAnEmptyOneAndNoOther) {
  FramesRequest asked = request();
  for (const auto& [text, same] : {std::pair("X 0.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0", true),
                                   std::pair("X 0.0,Y 0.0,Z 0.0,A 0.0,B 0.1,C 0.0", false)}) {
    asked.controller = {{"$config.dat", "TOOL_DATA[1]={" + std::string(text) + "}\n"}};
    if (same)
      EXPECT_EQ(propose_frames(identified(), asked).frames.size(), 1U);
    else
      EXPECT_THROW(propose_frames(identified(), asked), calib::FileError);
  }
}

TEST(TheFrames, OfAnArmBesideAPositionerAreThoseOfTargetsOnTheFloor) {
  calib::Calibration c = identified();
  for (int k = 0; k < 4; ++k) {
    calib::Target target;
    target.id = "P" + std::to_string(k);
    target.carried_by = k == 3 ? 1 : 0;
    c.cell.targets.push_back(target);
    c.targets.push_back({target.id, Eigen::Vector3d(k == 1, k >= 2, 0.0)});
  }
  FramesRequest asked = request();
  asked.bases = {{3, {"P0", "P1", "P2"}}};
  const auto before = propose_frames(c, asked);
  c.cell.robot.positioner.resize(1);
  c.cell.robot.positioner[0].name = "E1";
  EXPECT_EQ(propose_frames(c, asked).config_lines, before.config_lines);
  asked.bases = {{3, {"P0", "P1", "P3"}}};
  try {
    propose_frames(c, asked);
    FAIL();
  } catch (const calib::FileError& error) {
    EXPECT_NE(std::string(error.what()).find("P3 stands on E1"), std::string::npos) << error.what();
  }
}

TEST(TheFrames, OfTheTargetsOfAnArmOnALinearUnitAreRefusedByName) {
  calib::Calibration c = identified();
  calib::Joint track;
  track.name = "E1";
  track.guide.emplace();
  c.cell.robot.joints.insert(c.cell.robot.joints.begin(), track);
  FramesRequest r = request();
  EXPECT_EQ(propose_frames(c, r).frames.size(), 1U) << "its tool is that of any arm";
  r.bases = {{3, {"P1", "P2", "P3"}}};
  EXPECT_THROW(propose_frames(c, r), calib::LinearUnitError);
}

TEST(TheSnippet, SetsTheFramesAndKeepsTheOldOnesAsComments) {
  FramesRequest r = request();
  r.bases[3] = {"S1", "S2", "S3"};
  r.bases[4] = {"S2", "S1", "S4"};
  const auto result = propose_frames(identified(), r);
  EXPECT_NE(result.snippet.find(";   TOOL_DATA[1]={X 59.9,Y 50.5,Z 410.3,A 38.84,B 3.59,C 0}\r\n"
                                "TOOL_DATA[1]={X 60.1000"),
            std::string::npos)
      << result.snippet;
  EXPECT_NE(result.snippet.find(";   BASE_DATA[3]={X 1.5,"), std::string::npos);
  EXPECT_NE(result.snippet.find("; old value of BASE_DATA[4] not in the given files"),
            std::string::npos);
  for (const char c : result.snippet) EXPECT_LT(static_cast<unsigned char>(c), 0x80);
  // The text is read by KRL's own reader.
  krl::Data data;
  read_data({"s.src", result.snippet}, data);
  EXPECT_EQ(data.tools.size(), 1U);
  EXPECT_EQ(data.bases.size(), 2U);
  EXPECT_NEAR(data.tools.at(1).xyz_mm[2], 410.4, 1e-9);
}

TEST(ABaseOnTargets, HasItsOriginItsXAndItsSideInThem) {
  FramesRequest r = request();
  r.tool.reset();
  r.bases[3] = {"S1", "S2", "S4"};
  r.controller[0].text += "$ROBROOT={X 0.0,Y 0.0,Z 500.0,A 0.0,B 0.0,C 0.0}\r\n";
  const calib::Calibration c = identified();
  const auto result = propose_frames(c, r);
  ASSERT_EQ(result.frames.size(), 1U);
  EXPECT_TRUE(result.robroot_stated);
  Eigen::Isometry3d base = calib::to_isometry(result.frames[0].frame);
  base.translation().z() -= 0.5;
  const auto in_base = [&](std::size_t i) { return base.inverse() * c.targets[i].centre_m; };
  EXPECT_LT(in_base(0).norm(), 1e-12);
  EXPECT_LT(in_base(1).tail<2>().norm(), 1e-12);
  EXPECT_GT(in_base(1).x(), 0.0);
  EXPECT_NEAR(in_base(3).z(), 0.0, 1e-12);
  EXPECT_GT(in_base(3).y(), 0.0);
}

TEST(Mastering, IsProposedInTheControllersOwnSense) {
  const auto result = propose_frames(identified(), request());
  ASSERT_EQ(result.mastering.size(), 6U);
  EXPECT_EQ(result.mastering[3].joint, "A4");
  EXPECT_NEAR(result.mastering[3].offset_rad, -5e-4, 1e-14);
  EXPECT_EQ(result.snippet.find("MAMES"), std::string::npos);
}

TEST(Frames, ThatCannotBeAreRefused) {
  const auto refusal = [](const FramesRequest& r) -> std::string {
    try {
      propose_frames(identified(), r);
    } catch (const calib::FileError& error) {
      return error.what();
    }
    return "accepted";
  };
  FramesRequest r = request();
  r.bases[3] = {"S1", "S2", "S9"};
  EXPECT_NE(refusal(r).find("\"S9\""), std::string::npos);
  r.bases[3] = {"S1", "S2", "S2"};
  EXPECT_NE(refusal(r).find("on one line"), std::string::npos);
  r.bases[3] = {"S1", "S1", "S2"};
  EXPECT_NE(refusal(r).find("on one line"), std::string::npos);
  FramesRequest other = request();
  other.controller[0].text = "TOOL_DATA[1]={X 0.0,Y 0.0,Z 150.0,A 0.0,B 0.0,C 0.0}\n";
  EXPECT_NE(refusal(other).find("TOOL_DATA[1] is"), std::string::npos);
}

}  // namespace
}  // namespace cellcal::daemon::testing
