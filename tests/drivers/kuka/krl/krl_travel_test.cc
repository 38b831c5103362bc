// RSI's set for an arm on a linear unit, and for a positioner: external axes in the packets, their
// corrections, their limits, and refusals of --verify.

#include "drivers/error.h"
#include "drivers/kuka/krl/krl_read.h"
#include "krl_verdict.h"
#include "sim/krc/rsi_program.h"

namespace cellcal::drivers {
namespace {

/// E1 from -500 to 2500 mm.
RsiFilesConfig on_track(int version = 4) {
  RsiFilesConfig config = rsi_config(version);
  config.external_axes = 1;
  config.external = {{-500.0, 2500.0, true}};
  config.ranges_deg.assign(6, {-170.0, 170.0});
  return config;
}

std::size_t count(const std::string& text, const std::string& part) {
  std::size_t found = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1))
    ++found;
  return found;
}

TEST(RsiTravel, IsSoundInEachReleaseAndMode) {
  for (const int version : {3, 4, 5, 6})
    for (const CorrectionMode mode : {CorrectionMode::kAbsolute, CorrectionMode::kRelative}) {
      RsiFilesConfig config = on_track(version);
      config.mode = mode;
      EXPECT_EQ(verdict(rsi_files(config), config, mode), "") << version;
    }
}

TEST(RsiTravel, LeavesTheFilesOfSixAxesAsTheyAre) {
  for (const int version : {3, 4, 6})
    for (const auto& [name, text] : rsi_files(rsi_config(version)))
      for (const char* part : {"EIPos", "EK.", "CORREXT", "CorrExt", "_E1"})
        EXPECT_EQ(text.find(part), std::string::npos) << name << " " << part;
}

TEST(RsiTravel, IsAChannelBehindTheStopAndAnObjectOfItsOwn) {
  for (const int version : {3, 4, 6}) {
    const ControllerFiles files = rsi_files(on_track(version));
    const std::string name = version == 3 ? "cellcal_rsi.rsi.xml" : "cellcal_rsi.rsix";
    const RsiContextFile context = read_rsi_context(files.at(name), name);
    const RsiObject* object = context.only("AXISCORREXT");
    ASSERT_NE(object, nullptr) << version;
    const RsiInput* input = object->input(version == 3 ? 7 : 1);
    ASSERT_NE(input, nullptr) << version;
    EXPECT_EQ(input->from_index, 8);
    EXPECT_EQ(object->parameter("UpperLimE1")->value, "3001.0");
    EXPECT_EQ(context.only("AXISCORRMON")->parameter("MaxE1")->value, "3001.0");
    EXPECT_EQ(context.only("AXISCORRMON")->parameter("MaxE2")->value, "6.0");
    const RsiChannelFile channel = read_rsi_channel(files.at("cellcal_rsi_ethernet.xml"), "xml");
    EXPECT_EQ(channel.receive.back().tag, "EK.E1");
    EXPECT_EQ(channel.receive.back().index, 8);
    EXPECT_EQ(count(files.at("cellcal_rsi_ethernet.xml"), "DEF_E"), 2u) << "DEF_EIPos, DEF_ESPos";
  }
}

TEST(RsiTravel, IsFencedByItsSwitchesAndItsRangeInMillimetres) {
  for (const int version : {3, 4, 6}) {
    sim::RsiProgram program(rsi_files(on_track(version)).at("cellcal_rsi.src"));
    sim::RsiStart start;
    start.low_deg.assign(7, -5000.0);
    start.high_deg.assign(7, 5000.0);
    // The switch is nearer above, the range below.
    const std::vector<double> at{0, -90, 90, 0, 90, 0, 700.0};
    const std::vector<double> low{-185, -185, -185, -185, -185, -185, -1000.0};
    const std::vector<double> high{185, 185, 185, 185, 185, 185, 2400.0};
    ASSERT_TRUE(program.start(at, low, high, start)) << program.message();
    EXPECT_NEAR(start.low_deg[6], -1200.1, 1e-3);
    EXPECT_NEAR(start.high_deg[6], 1700.0, 1e-3);
    EXPECT_NEAR(start.low_deg[0], -90.0, 1e-9) << "correction_limit_deg";
    sim::RsiProgram outside(rsi_files(on_track(version)).at("cellcal_rsi.src"));
    std::vector<double> beyond = at;
    beyond[6] = 2500.2;
    EXPECT_FALSE(outside.start(beyond, low, high, start)) << "E1 stands beyond its range";
  }
}

TEST(RsiTravel, IsRefusedByFileAndWords) {
  constexpr const char *kChannel = "cellcal_rsi_ethernet.xml", *kFour = "cellcal_rsi.rsix",
                       *kThree = "cellcal_rsi.rsi.xml";
  const Spoiled cases[] = {
      {kChannel, "DEF_EIPos", "DEF_MECur", "SEND: DEF_EIPos is missing"},
      {kChannel, "DEF_ESPos\" TYPE=\"DOUBLE\" INDX=\"INTERNAL\"",
       "DEF_ESPos\" TYPE=\"DOUBLE\" INDX=\"9\"", "INDX of DEF_ESPos is 9"},
      {kChannel, "EK.E1", "EKorr.E1", "RECEIVE: EK.E1 is missing"},
      {kChannel, "INDX=\"8\" HOLDON=\"1\"", "INDX=\"8\" HOLDON=\"0\"", "EK.E1 has HOLDON=\"0\""},
      {kChannel, "INDX=\"8\" HOLDON", "INDX=\"9\" HOLDON",
       "input 1 comes from Ethernet_1 output 8"},
      {kFour, "OutIdx=\"7\"", "OutIdx=\"5\"", "input 1 comes from Ethernet_1 output 6"},
      {kThree, "InIdx=\"7\"", "InIdx=\"8\"", "input 7 is not connected. Connect EK.E1", 3},
      {kFour, "ObjType=\"AxisCorrExt\"", "ObjType=\"Comment\"",
       "the AXISCORREXT object is missing"},
      {kFour, "ObjType=\"AxisCorrExt\"", "ObjType=\"AXISCORREXT\"", "is spelled \"AxisCorrExt\""},
      {kFour, "ParamValue=\"-3001.0\"", "ParamValue=\"-900.0\"",
       "LowerLimE1 allows 900 mm from the start, the linear unit travels 3001"},
      {kThree, "Name=\"MaxE1\" ParamID=\"7\" ParamValue=\"3001.0\"",
       "Name=\"MaxE1\" ParamID=\"7\" ParamValue=\"6.0\"", "stop with KSS29000", 3},
      {kFour, "IsPublic=\"true\" Name=\"UpperLimE1\"", "Name=\"UpperLimE1\"",
       "UpperLimE1 of AxisCorrExt_1 lacks IsPublic"},
      {"cellcal_rsi.src", "CC_LOW_E1($SOFTN_END[7],-500.1", "CC_LOW_E1($SOFTN_END[7],-700.1",
       "LowerLimE1 is not LIMIT=CC_LOW_E1($SOFTN_END[7],-500.1,$AXIS_ACT_MEAS.E1)"},
  };
  expect_refused(cases, on_track);
}

/// E1 from -500 to 2500 mm, E2 from -60 to 60 deg, E3 from -185 to 185 deg.
RsiFilesConfig with_positioner(int version = 4, bool on_unit = true) {
  RsiFilesConfig config = rsi_config(version);
  if (on_unit) config.external.push_back({-500.0, 2500.0, true});
  config.external.insert(config.external.end(), {{-60.0, 60.0}, {-185.0, 185.0}});
  config.external_axes = static_cast<int>(config.external.size());
  config.ranges_deg.assign(6, {-170.0, 170.0});
  return config;
}

TEST(RsiPositionerFiles, AreSoundInEachReleaseAndModeWithAndWithoutALinearUnit) {
  for (const int version : {3, 4, 5, 6})
    for (const bool on_unit : {true, false})
      for (const CorrectionMode mode : {CorrectionMode::kAbsolute, CorrectionMode::kRelative}) {
        RsiFilesConfig config = with_positioner(version, on_unit);
        config.mode = mode;
        EXPECT_EQ(verdict(rsi_files(config), config, mode), "") << version << on_unit;
      }
}

TEST(RsiPositionerFiles, HaveAChannelAndLimitsOfTheirOwnForEachAxis) {
  for (const int version : {3, 4, 6}) {
    const ControllerFiles files = rsi_files(with_positioner(version));
    const std::string name = version == 3 ? "cellcal_rsi.rsi.xml" : "cellcal_rsi.rsix";
    const RsiContextFile context = read_rsi_context(files.at(name), name);
    const RsiObject* object = context.only("AXISCORREXT");
    ASSERT_NE(object, nullptr) << version;
    constexpr const char* kLimits[] = {"3001.0", "121.0", "371.0"};
    const RsiChannelFile channel = read_rsi_channel(files.at("cellcal_rsi_ethernet.xml"), "xml");
    ASSERT_EQ(channel.receive.size(), 10u);
    for (int i = 0; i < 3; ++i) {
      const RsiInput* input = object->input((version == 3 ? 7 : 1) + i);
      ASSERT_NE(input, nullptr) << version << " " << i;
      EXPECT_EQ(input->from_index, 8 + i);
      const std::string axis = "E" + std::to_string(i + 1), limit = kLimits[i];
      EXPECT_EQ(object->parameter("LowerLim" + axis)->value, "-" + limit);
      EXPECT_EQ(object->parameter("UpperLim" + axis)->value, limit);
      EXPECT_EQ(context.only("AXISCORRMON")->parameter("Max" + axis)->value, limit);
      EXPECT_EQ(channel.receive[7 + static_cast<std::size_t>(i)].tag, "EK." + axis);
      EXPECT_EQ(channel.receive[7 + static_cast<std::size_t>(i)].index, 8 + i);
    }
    EXPECT_EQ(object->input((version == 3 ? 7 : 1) + 3), nullptr);
    EXPECT_EQ(context.only("AXISCORRMON")->parameter("MaxE4")->value, "6.0");
  }
}

TEST(RsiPositionerFiles, NumberTheLimitsAsTheObjectDoes) {
  const std::string three = rsi_files(with_positioner(3)).at("cellcal_rsi.rsi.xml");
  const std::string four = rsi_files(with_positioner(4)).at("cellcal_rsi.rsix");
  EXPECT_EQ(count(three, "Name=\"LowerLimE3\" ParamID=\"9\""), 1u);
  EXPECT_EQ(count(three, "Name=\"UpperLimE3\" ParamID=\"21\""), 1u);
  EXPECT_EQ(count(four, "Name=\"LowerLimE3\" ParamId=\"2\""), 1u);
  EXPECT_EQ(count(four, "Name=\"UpperLimE3\" ParamId=\"8\""), 1u);
}

TEST(RsiPositionerFiles, FenceEachAxisByItsSwitchesAndItsRange) {
  for (const int version : {3, 4, 6}) {
    sim::RsiProgram program(rsi_files(with_positioner(version)).at("cellcal_rsi.src"));
    sim::RsiStart start;
    start.low_deg.assign(9, -5000.0);
    start.high_deg.assign(9, 5000.0);
    // For E2 the range is nearer, for E3 the switches.
    const std::vector<double> at{0, -90, 90, 0, 90, 0, 700.0, 10.0, -20.0};
    const std::vector<double> low{-185, -185, -185, -185, -185, -185, -1000.0, -90.0, -100.0};
    const std::vector<double> high{185, 185, 185, 185, 185, 185, 2600.0, 90.0, 100.0};
    ASSERT_TRUE(program.start(at, low, high, start)) << program.message();
    EXPECT_NEAR(start.low_deg[7], -70.1, 1e-3);
    EXPECT_NEAR(start.high_deg[7], 50.1, 1e-3);
    EXPECT_NEAR(start.low_deg[8], -80.0, 1e-3);
    EXPECT_NEAR(start.high_deg[8], 120.0, 1e-3);
    sim::RsiProgram outside(rsi_files(with_positioner(version)).at("cellcal_rsi.src"));
    std::vector<double> beyond = at;
    beyond[8] = 100.5;
    EXPECT_FALSE(outside.start(beyond, low, high, start)) << "E3 stands beyond its switch";
  }
}

TEST(RsiPositionerFiles, AreRefusedByFileAndWords) {
  constexpr const char *kChannel = "cellcal_rsi_ethernet.xml", *kFour = "cellcal_rsi.rsix",
                       *kThree = "cellcal_rsi.rsi.xml";
  const Spoiled cases[] = {
      {kChannel, "EK.E2", "EKorr.E2", "RECEIVE: EK.E2 is missing ([rsi] external_axis_tag"},
      {kChannel, "INDX=\"10\" HOLDON=\"1\"", "INDX=\"10\" HOLDON=\"0\"", "EK.E3 has HOLDON=\"0\""},
      {kFour, "OutIdx=\"9\"", "OutIdx=\"7\"", "input 3 comes from Ethernet_1 output 8"},
      {kThree, "InIdx=\"9\"", "InIdx=\"10\"", "input 9 is not connected. Connect EK.E3", 3},
      {kThree, "InIdx=\"9\"", "InIdx=\"10\"", "corrects E4, which the robot file does not move", 3},
      {kFour, "ParamValue=\"-121.0\"", "ParamValue=\"-90.0\"",
       "LowerLimE2 allows 90 deg from the start, E2 of the positioner turns by up to 121"},
      {kThree, "Name=\"MaxE3\" ParamID=\"9\" ParamValue=\"371.0\"",
       "Name=\"MaxE3\" ParamID=\"9\" ParamValue=\"6.0\"", "stop with KSS29000", 3},
      {kFour, "IsPublic=\"true\" Name=\"UpperLimE3\"", "Name=\"UpperLimE3\"",
       "UpperLimE3 of AxisCorrExt_1 lacks IsPublic"},
      {"cellcal_rsi.src", "CC_LOW_E2($SOFTN_END[8],-60.1", "CC_LOW_E2($SOFTN_END[8],-90.1",
       "LowerLimE2 is not LIMIT=CC_LOW_E2($SOFTN_END[8],-60.1,$AXIS_ACT_MEAS.E2)"},
  };
  expect_refused(cases, [](int version) { return with_positioner(version); });
  EXPECT_NE(verdict(rsi_files(on_track()), with_positioner()).find("refused"), std::string::npos);
  EXPECT_NE(verdict(rsi_files(with_positioner()), on_track()).find("corrects E2, which"),
            std::string::npos);
}

TEST(RsiTravel, OfFilesWithoutACellFileIsRefusedByNameEitherWay) {
  EXPECT_NE(verdict(rsi_files(on_track()), rsi_config())
                .find("neither a linear unit nor a positioner is known. Give the cell file"),
            std::string::npos);
  EXPECT_NE(verdict(rsi_files(rsi_config()), on_track()).find("the AXISCORREXT object is missing"),
            std::string::npos);
  RsiFilesConfig stands = rsi_config();
  stands.external_axes = 2;
  EXPECT_EQ(verdict(rsi_files(stands), stands), "") << "axes that stand are in the packets alone";
  EXPECT_NE(verdict(rsi_files(rsi_config()), stands).find("warned"), std::string::npos);
}

TEST(RsiTravel, IsRefusedWithCorrectionsInSpace) {
  RsiFilesConfig config = on_track();
  config.space.on = true;
  EXPECT_THROW(rsi_files(config), ConfigError);
  config = with_positioner(4, false);
  config.space.on = true;
  EXPECT_THROW(rsi_files(config), ConfigError);
}

}  // namespace
}  // namespace cellcal::drivers
