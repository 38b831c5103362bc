#include "sim/emulator/options.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <fstream>

namespace cellcal::sim {
namespace {

class Options : public ::testing::Test {
 protected:
  void SetUp() override {
    file = std::filesystem::temp_directory_path() / ("cellcal_rsi_" + std::to_string(::getpid()));
    std::ofstream(file)
        << "<ROOT><CONFIG><PORT>59152</PORT><SENTYPE>Somebody</SENTYPE></CONFIG><SEND><ELEMENTS>"
           "<ELEMENT TAG=\"DEF_AIPos\" TYPE=\"DOUBLE\" "
           "INDX=\"INTERNAL\"/></ELEMENTS></SEND></ROOT>";
  }
  void TearDown() override { std::filesystem::remove(file); }

  EmulatorOptions parse(std::vector<std::string> words) {
    EmulatorOptions options;
    CLI::App app;
    add_options(app, options);
    words.insert(words.end(), {"--cell", file.string()});
    std::reverse(words.begin(), words.end());
    app.parse(words);
    return options;
  }

  std::filesystem::path file;
};

TEST_F(Options, WithoutAnyTheControllerIsTheUsualOne) {
  const EmulatorOptions options = parse({});
  EXPECT_EQ(options.pc_port, 49152);
  EXPECT_EQ(options.controller.precision, 4);
  EXPECT_EQ(options.controller.mode, RsiMode::kAbsolute);
  EXPECT_EQ(options.controller.stop_mode, RsiStop::kExitMoveCorr);
  EXPECT_FALSE(options.controller.channel);
}

TEST_F(Options, SetTheControllersRsi) {
  const ControllerConfig c =
      parse({"--mode", "relative", "--contact-tag", "Contact.R", "--clamp-deg", "5"}).controller;
  EXPECT_EQ(c.mode, RsiMode::kRelative);
  EXPECT_EQ(c.contact_tag, "Contact.R");
  EXPECT_EQ(c.clamp_deg, 5.0);
  EXPECT_EQ(c.monitor_deg, 5.0);
}

TEST_F(Options, Krc2HasItsCycleAndItsFirstPacket) {
  const ControllerConfig c = parse({"--krc2"}).controller;
  EXPECT_EQ(c.cycle_ms, 12);
  EXPECT_TRUE(c.first_frame_only_ipoc);
}

TEST_F(Options, EthernetFileGivesNamesAndPort) {
  const EmulatorOptions from_file = parse({"--rsi-xml", file.string()});
  ASSERT_TRUE(from_file.controller.channel);
  EXPECT_EQ(from_file.controller.channel->sentype, "Somebody");
  EXPECT_EQ(from_file.pc_port, 59152);
  EXPECT_EQ(parse({"--rsi-xml", file.string(), "--pc", "127.0.0.1:5000"}).pc_port, 5000);
}

TEST_F(Options, WhatRealArmsHaveIsAskedForInTheUnitsOfItsNames) {
  const TruthOptions plain = parse({}).truth;
  for (const double off : {plain.compliance_rad_per_nm, plain.play_arcsec, plain.tip_offset_m,
                           plain.growth, plain.contacts.noise_m, plain.contacts.bad_share})
    EXPECT_EQ(off, 0.0);
  const TruthOptions real =
      parse({"--compliance-sigma-rad-per-nm", "5e-6", "--play-arcsec", "10", "--tip-offset-mm",
             "0.5", "--growth-ppm", "25", "--warm-up-s", "90", "--contact-noise-mm", "0.03",
             "--bad-contact-percent", "1"})
          .truth;
  EXPECT_DOUBLE_EQ(real.compliance_rad_per_nm, 5e-6);
  EXPECT_DOUBLE_EQ(real.play_arcsec, 10.0);
  EXPECT_DOUBLE_EQ(real.tip_offset_m, 0.5e-3);
  EXPECT_DOUBLE_EQ(real.growth, 25e-6);
  EXPECT_DOUBLE_EQ(real.warm_up_s, 90.0);
  EXPECT_DOUBLE_EQ(real.contacts.noise_m, 0.03e-3);
  EXPECT_DOUBLE_EQ(real.contacts.bad_share, 0.01);
}

TEST_F(Options, NonsenseIsRefused) {
  for (const std::vector<std::string>& words : std::initializer_list<std::vector<std::string>>{
           {"--mode", "sideways"},
           {"--rsi-xml", file.string(), "--contact-tag", "Contact.R"},
           {"--rsi-xml", "/nowhere"},
           {"--compliance-sigma-rad-per-nm", "1"},
           {"--play-arcsec", "-1"},
           {"--tip-offset-mm", "11"},
           {"--growth-ppm", "much"},
           {"--growth-ppm", "nan"},
           {"--gear-arcsec", "nan"},
           {"--gear-arcsec", "inf"},
           {"--wave-arcsec", "-1"},
           {"--warm-up-s", "0"},
           {"--contact-noise-mm", "0.2"},
           {"--bad-contact-percent", "101"}})
    EXPECT_THROW(parse(words), CLI::ParseError) << words[0];
}

}  // namespace
}  // namespace cellcal::sim
