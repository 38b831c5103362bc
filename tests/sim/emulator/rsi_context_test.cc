// The emulated controller reads the same settings from cellcal's files as a real one.

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "calib/files/input_file.h"
#include "drivers/kuka/krl/krl_files.h"
#include "sim/emulator/options.h"

namespace cellcal::sim {
namespace {

class InstalledFiles : public ::testing::TestWithParam<int> {
 protected:
  void SetUp() override {
    folder = std::filesystem::temp_directory_path() / ("cellcal_files_" + std::to_string(getpid()));
    std::filesystem::create_directories(folder);
  }
  void TearDown() override { std::filesystem::remove_all(folder); }

  ControllerConfig loaded(drivers::RsiFilesConfig config, const std::string& from = "",
                          const std::string& to = "") {
    config.pc_address = "10.0.0.5";
    config.rsi_version = GetParam();
    const std::string context = GetParam() == 3 ? "cellcal_rsi.rsi.xml" : "cellcal_rsi.rsix";
    for (auto [name, text] : drivers::rsi_files(config)) {
      if (name == context && !from.empty()) {
        const std::size_t at = text.find(from);
        EXPECT_NE(at, std::string::npos) << from;
        text.replace(at, from.size(), to);
      }
      std::ofstream(folder / name, std::ios::binary) << text;
    }
    EmulatorOptions options;
    options.rsi_xml = folder / "cellcal_rsi_ethernet.xml";
    options.rsi_context = folder / context;
    options.controller.channel = RsiChannelConfig::parse(calib::read_file(options.rsi_xml));
    load_rsi_context(options);
    return options.controller;
  }

  std::filesystem::path folder;
};

TEST_P(InstalledFiles, OfAxisCorrectionsGiveTheirLimits) {
  drivers::RsiFilesConfig config;
  config.correction_limit_deg = 45.0;
  const ControllerConfig controller = loaded(config);
  EXPECT_EQ(controller.clamp_deg, 45.0);
  EXPECT_EQ(controller.monitor_deg, 45.0);
  EXPECT_EQ(controller.precision, 5);
}

TEST_P(InstalledFiles, OfALinearUnitGiveItsLimitsAndWithoutItNoExternalAxisIsCorrected) {
  drivers::RsiFilesConfig config;
  EXPECT_EQ(loaded(config).clamp_external.at(0), 0.0);
  config.external_axes = 1;
  config.external = {{0.0, 3000.0, true}};
  const ControllerConfig controller = loaded(config);
  EXPECT_EQ(controller.clamp_external.at(0), 3001.0);
  EXPECT_EQ(controller.monitor_external.at(0), 3001.0);
  EXPECT_EQ(controller.clamp_external.at(1), 0.0);
  EXPECT_THROW(loaded(config, GetParam() == 3 ? "OutIdx=\"8\"" : "OutIdx=\"7\"", "OutIdx=\"3\""),
               std::invalid_argument);
}

TEST_P(InstalledFiles, OfAPositionerBehindALinearUnitGiveTheLimitsOfEachAxis) {
  drivers::RsiFilesConfig config;
  config.external_axes = 3;
  config.external = {{0.0, 3000.0, true}, {-60.0, 60.0}, {-185.0, 185.0}};
  const ControllerConfig controller = loaded(config);
  EXPECT_EQ(controller.clamp_external, (std::vector<double>{3001.0, 121.0, 371.0, 0.0, 0.0, 0.0}));
  EXPECT_EQ(controller.monitor_external,
            (std::vector<double>{3001.0, 121.0, 371.0, 6.0, 6.0, 6.0}));
  // E3's input, from the channel of E2.
  EXPECT_THROW(loaded(config, GetParam() == 3 ? "OutIdx=\"10\"" : "OutIdx=\"9\"",
                      GetParam() == 3 ? "OutIdx=\"9\"" : "OutIdx=\"8\""),
               std::invalid_argument);
}

TEST_P(InstalledFiles, OfCorrectionsInSpaceGiveTheirFrameAndLimits) {
  drivers::RsiFilesConfig config;
  config.space.on = true;
  config.space.frame = drivers::CorrectionFrame::kTool;
  config.space.limit_mm = 321.5;
  config.space.turn_limit_deg = 75.0;
  const ControllerConfig controller = loaded(config);
  EXPECT_EQ(controller.cartesian_system, CorrectionFrame::kTool);
  EXPECT_EQ(controller.clamp_mm, 321.5);
  EXPECT_EQ(controller.monitor_mm, 321.5);
  EXPECT_EQ(controller.clamp_turn_deg, 75.0);
  EXPECT_EQ(controller.monitor_turn_deg, 75.0);
  config.space.frame = drivers::CorrectionFrame::kRobRoot;
  EXPECT_EQ(loaded(config).cartesian_system, CorrectionFrame::kBase);
}

TEST_P(InstalledFiles, WithoutAMonitorStopAtWhatItHasByItself) {
  drivers::RsiFilesConfig config;
  config.space.on = true;
  const ControllerConfig controller = GetParam() == 3
                                          ? loaded(config, "\"POSCORRMON\"", "\"OTHER\"")
                                          : loaded(config, "\"PosCorrMon\"", "\"Other\"");
  EXPECT_EQ(controller.monitor_mm, 6.0);
  EXPECT_EQ(controller.monitor_turn_deg, 6.0);
}

TEST_P(InstalledFiles, WiredCrosswiseAreNotEmulated) {
  drivers::RsiFilesConfig config;
  config.space.on = true;
  const std::string from = GetParam() == 3 ? "InIdx=\"2\" OutObjID=\"ETHERNET1\" OutIdx=\"2\""
                                           : "InIdx=\"1\" OutObjId=\"Ethernet_1\" OutIdx=\"1\"";
  const std::string to = GetParam() == 3 ? "InIdx=\"2\" OutObjID=\"ETHERNET1\" OutIdx=\"3\""
                                         : "InIdx=\"1\" OutObjId=\"Ethernet_1\" OutIdx=\"2\"";
  EXPECT_THROW(loaded(config, from, to), std::invalid_argument);
}

/// The elements that a controller at 40 % in T1, with its input on, sends besides its position.
std::string sent_by(const ControllerConfig& controller) {
  RsiValues values;
  values.mode = 1;
  values.override_percent = 40.0;
  values.input_on = true;
  const std::string packet = format_packet(*controller.channel, values, 1);
  const std::size_t delay = packet.find("<Delay"), begin = packet.find('>', delay) + 1;
  return packet.substr(begin, packet.find("<IPOC>") - begin);
}

std::size_t stops(const ControllerConfig& controller) {
  return static_cast<std::size_t>(
      std::ranges::count(controller.channel->receive, RsiRole::kStop, &RsiReceived::role));
}

TEST_P(InstalledFiles, AreWiredByTheContextWhateverTheNames) {
  drivers::RsiFilesConfig config;
  config.stop_tag = "Halt";
  config.mode_tag = "Betrieb.Art";
  config.override_tag = "Betrieb.Ov";
  config.contact_tag = "Kontakt.In";
  config.input = 7;
  EXPECT_EQ(sent_by(loaded(config)), R"(<Betrieb Art="1" Ov="40.0"/><Kontakt In="1"/>)");
  EXPECT_EQ(stops(loaded(config)), 1U);
  // The mode's channel from OV_PRO.
  const ControllerConfig crossed =
      GetParam() == 3 ? loaded(config, "\"STATUS1\" OutIdx", "\"OV_PRO1\" OutIdx")
                      : loaded(config, "\"Status_1\" OutIdx", "\"OV_PRO_1\" OutIdx");
  EXPECT_EQ(sent_by(crossed), R"(<Betrieb Art="40.0" Ov="40.0"/><Kontakt In="1"/>)");
  config.stop_tag = "StopNow";
  const ControllerConfig unwired = GetParam() == 3
                                       ? loaded(config, "ObjType=\"STOP\"", "ObjType=\"OTHER\"")
                                       : loaded(config, "ObjType=\"Stop\"", "ObjType=\"Other\"");
  EXPECT_EQ(stops(unwired), 0U);
}

TEST_P(InstalledFiles, GiveTheModeOfTheStopObject) {
  const std::string mode = GetParam() == 3 ? "Name=\"Mode\" ParamID=\"1\" ParamValue=\""
                                           : "Name=\"Mode\" ParamId=\"0\" ParamValue=\"";
  EXPECT_EQ(loaded({}).stop_mode, RsiStop::kExitMoveCorr);
  EXPECT_EQ(loaded({}, mode + "4", mode + "1").stop_mode, RsiStop::kPathStop);
  EXPECT_THROW(loaded({}, mode + "4", mode + "5"), std::invalid_argument);
}

TEST_P(InstalledFiles, OfAnotherReleaseAreRefused) {
  drivers::RsiFilesConfig config;
  EXPECT_EQ(loaded(config).clamp_deg, 90.0);
  EmulatorOptions options;
  options.rsi_xml = folder / "cellcal_rsi_ethernet.xml";
  options.rsi_context = folder / (GetParam() == 3 ? "cellcal_rsi.rsi.xml" : "cellcal_rsi.rsix");
  for (const int release : {3, 4, 5, 6}) {
    options.rsi_version = release;
    if (drivers::rsi_format(release) == drivers::rsi_format(GetParam())) {
      EXPECT_NO_THROW(load_rsi(options));
    } else {
      EXPECT_THROW(load_rsi(options), std::invalid_argument) << release;
    }
  }
}

TEST_P(InstalledFiles, OfRsi6RunIn4MillisecondsAlone) {
  EmulatorOptions options;
  options.rsi_version = GetParam();
  options.controller.cycle_ms = 12;
  if (GetParam() == 6) {
    EXPECT_THROW(load_rsi(options), std::invalid_argument);
  } else {
    EXPECT_NO_THROW(load_rsi(options));
  }
}

INSTANTIATE_TEST_SUITE_P(Rsi, InstalledFiles, ::testing::Values(3, 4, 5, 6));

}  // namespace
}  // namespace cellcal::sim
