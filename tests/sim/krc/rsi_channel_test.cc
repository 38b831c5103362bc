#include "sim/krc/rsi_channel.h"

#include <gtest/gtest.h>

#include <array>
#include <stdexcept>

#include "drivers/kuka/krl/krl_files.h"
#include "drivers/kuka/wire/rsi_codec.h"
#include "sim/krc/controller.h"

namespace cellcal::sim {
namespace {

using namespace std::chrono_literals;

/// An ethernet file with all elements that occur in practice.
std::string file(const std::string& send, const std::string& receive,
                 const std::string& only_send = "FALSE") {
  return "<ROOT><CONFIG><IP_NUMBER>ip.of.the.pc</IP_NUMBER><PORT>59152</PORT>"
         "<SENTYPE>Somebody</SENTYPE><ONLYSEND>" +
         only_send + "</ONLYSEND></CONFIG><SEND><ELEMENTS>" + send +
         "</ELEMENTS></SEND><RECEIVE><ELEMENTS>" + receive + "</ELEMENTS></RECEIVE></ROOT>";
}
std::string sent(const std::string& tag, const std::string& type = "DOUBLE") {
  return "<ELEMENT TAG=\"" + tag + "\" TYPE=\"" + type + "\" INDX=\"1\" /> <!-- what it is -->";
}
std::string received(const std::string& tag, const std::string& type = "DOUBLE",
                     const std::string& hold_on = "1") {
  return "<ELEMENT TAG=\"" + tag + "\" TYPE=\"" + type + "\" INDX=\"1\" HOLDON=\"" + hold_on +
         "\"/>";
}
std::string six(const std::string& element) {
  std::string text;
  for (int i = 1; i <= 6; ++i) text += received(element + ".A" + std::to_string(i));
  return text;
}

TEST(RsiEthernetFile, CellcalsOwnIsUnderstood) {
  drivers::RsiFilesConfig files;
  files.pc_address = "10.0.0.5";
  const RsiChannelConfig channel =
      RsiChannelConfig::parse(drivers::rsi_files(files).at("cellcal_rsi_ethernet.xml"));
  EXPECT_EQ(channel.port, 49152);
  EXPECT_EQ(channel.sentype, "ImFree");
  EXPECT_FALSE(channel.only_send);
  ASSERT_EQ(channel.receive.size(), 7u);
  EXPECT_EQ(channel.receive[5].element, "AK");
  EXPECT_EQ(channel.receive[5].role, RsiRole::kAxis);
  EXPECT_EQ(channel.receive[5].index, 5u);
  EXPECT_TRUE(channel.receive[5].hold_on);
  EXPECT_EQ(channel.receive[6].role, RsiRole::kStop);
  EXPECT_FALSE(channel.receive[6].hold_on);
}

TEST(RsiEthernetFile, PacketHoldsTheFilesElementsInItsOrder) {
  const RsiChannelConfig channel = RsiChannelConfig::parse(
      file(sent("DEF_Delay", "LONG") + sent("DEF_RIst") + sent("DEF_EIPos") + sent("DEF_AIPos") +
               sent("DEF_ASPos") + sent("DEF_RSol") + sent("Digout.o1", "BOOL") +
               sent("Digout.o2", "BOOL") + sent("DiL", "LONG") + sent("OvPro.R") +
               sent("ProgStatus.R", "LONG") + sent("Name", "STRING"),
           six("AK")));
  const std::array<double, 7> actual{1, 2, 3, 4, 5, 6, 70}, setpoint{0, -90, 90, 0, 90, -1e-9, 71};
  RsiValues values;
  values.actual_deg = actual;
  values.setpoint_deg = setpoint;
  values.actual_frame = {100.25, 0, 0, 180, 0, 0};
  values.delay = 15;
  values.ipoc = 357;
  EXPECT_EQ(format_packet(channel, values, 2),
            "<Rob Type=\"KUKA\"><Delay D=\"15\"/>"
            "<RIst X=\"100.25\" Y=\"0.00\" Z=\"0.00\" A=\"180.00\" B=\"0.00\" C=\"0.00\"/>"
            "<EIPos E1=\"70.00\" E2=\"0.00\" E3=\"0.00\" E4=\"0.00\" E5=\"0.00\" E6=\"0.00\"/>"
            "<AIPos A1=\"1.00\" A2=\"2.00\" A3=\"3.00\" A4=\"4.00\" A5=\"5.00\" A6=\"6.00\"/>"
            "<ASPos A1=\"0.00\" A2=\"-90.00\" A3=\"90.00\" A4=\"0.00\" A5=\"90.00\" A6=\"0.00\"/>"
            "<RSol X=\"0.00\" Y=\"0.00\" Z=\"0.00\" A=\"0.00\" B=\"0.00\" C=\"0.00\"/>"
            "<Digout o1=\"0\" o2=\"0\"/><DiL>0</DiL><OvPro R=\"100.00\"/><ProgStatus R=\"3\"/>"
            "<Name></Name><IPOC>357</IPOC></Rob>");
}

TEST(RsiEthernetFile, CellcalsOwnTellsModeAndOverride) {
  drivers::RsiFilesConfig files;
  files.pc_address = "10.0.0.5";
  ControllerConfig config;
  config.channel =
      RsiChannelConfig::parse(drivers::rsi_files(files).at("cellcal_rsi_ethernet.xml"));
  Controller krc(config);
  krc.mode(OperatingMode::kT2);
  krc.set_override(30);
  krc.rsi_on();
  drivers::RsiParser parser;
  drivers::RobFrame frame;
  ASSERT_EQ(parser.parse_rob(krc.tick(drivers::TimePoint{1s}), frame), drivers::WireError::kNone);
  EXPECT_EQ(frame.mode, drivers::OperatingMode::kT2);
  EXPECT_EQ(frame.override_percent, 30);
}

TEST(RsiEthernetFile, TechAndCurrentsAreThere) {
  const RsiChannelConfig channel =
      RsiChannelConfig::parse(file(sent("DEF_Tech.C1") + sent("DEF_MACur"), ""));
  EXPECT_EQ(format_packet(channel, {}, 4),
            "<Rob Type=\"KUKA\"><Tech C11=\"0.0\" C12=\"0.0\" C13=\"0.0\" C14=\"0.0\" C15=\"0.0\" "
            "C16=\"0.0\" C17=\"0.0\" C18=\"0.0\" C19=\"0.0\" C110=\"0.0\"/><MACur A1=\"0.0\" "
            "A2=\"0.0\" A3=\"0.0\" A4=\"0.0\" A5=\"0.0\" A6=\"0.0\"/><IPOC>0</IPOC></Rob>");
}

TEST(RsiEthernetFile, WhatIsMissingOrUnknownIsNamed) {
  const auto why = [](const std::string& xml) {
    try {
      RsiChannelConfig::parse(xml);
    } catch (const std::invalid_argument& e) {
      return std::string(e.what());
    }
    return std::string("taken");
  };
  EXPECT_NE(why("<ROOT").find("no XML"), std::string::npos);
  EXPECT_NE(why("<ROOT/>").find("ROOT/CONFIG"), std::string::npos);
  EXPECT_NE(why("<ROOT><CONFIG><PORT>1</PORT></CONFIG></ROOT>").find("SENTYPE"), std::string::npos);
  EXPECT_NE(why(file("", "")).find("SEND/ELEMENTS"), std::string::npos);
  EXPECT_NE(why(file(sent("X.Y", "REAL"), "")).find("\"REAL\""), std::string::npos);
}

TEST(RsiReplies, AreReadByNameWhateverElseTheyHold) {
  const RsiChannelConfig channel = RsiChannelConfig::parse(
      file(sent("DEF_AIPos"), received("DEF_EStr", "STRING") + received("RKorr.Z") + six("AKorr") +
                                  received("MoveStop", "BOOL", "0")));
  std::string text =
      "<Sen Type=\"Somebody\">\n  <EStr>hello</EStr>\n"
      "<AKorr A6=\"-1.5\" A2=\"+2e-05\" A1=\"1\" /> <Tech T21=\"1.09\"/><DiO>125</DiO>"
      "<RKorr X=\"9\" Z=\" 0.25 \"/><MoveStop>TRUE</MoveStop><IPOC> 17 </IPOC>\n</Sen>\n";
  text.push_back('\0');  // as some senders terminate theirs
  const auto reply = parse_reply(channel, text);
  ASSERT_TRUE(reply);
  EXPECT_EQ(reply->type, "Somebody");
  EXPECT_EQ(reply->ipoc, "17");
  ASSERT_EQ(reply->values.size(), 8u);
  EXPECT_EQ(reply->values[0], 0.25);
  EXPECT_EQ(reply->values[1], 1.0);
  EXPECT_EQ(reply->values[2], 2e-5);
  EXPECT_EQ(reply->values[3], std::nullopt);
  EXPECT_EQ(reply->values[6], -1.5);
  EXPECT_EQ(reply->values[7], 1.0);
}

TEST(RsiReplies, HostileOnesAreNone) {
  const RsiChannelConfig channel = RsiChannelConfig::parse(file(sent("DEF_AIPos"), six("AK")));
  for (const char* text :
       {"", "<Sen", "<Rob Type=\"Somebody\"><IPOC>1</IPOC></Rob>", "<Sen Type=\"Somebody\"></Sen>",
        "<Sen Type=\"Somebody\"><AK A1=\"nan\"/><IPOC>1</IPOC></Sen>",
        "<Sen Type=\"Somebody\"><AK A1=\"1,5\"/><IPOC>1</IPOC></Sen>",
        "<Sen Type=\"Somebody\"><AK A1=\"\"/><IPOC>1</IPOC></Sen>"}) {
    EXPECT_FALSE(parse_reply(channel, text)) << text;
  }
  EXPECT_FALSE(parse_reply(channel, std::string(10000, ' ')));
}

TEST(RsiReplies, OfAForeignFileMoveTheArm) {
  ControllerConfig config;
  config.channel = RsiChannelConfig::parse(
      file(sent("DEF_AIPos"), six("AKorr") + received("MoveStop", "BOOL", "0")));
  Controller krc(config);
  krc.rsi_on();
  drivers::TimePoint now{10s};
  const auto answer = [&](const std::string& inside) {
    krc.tick(now += krc.cycle());
    krc.receive("<Sen Type=\"Somebody\">" + inside + "<IPOC>" + std::to_string(krc.ipoc()) +
                "</IPOC></Sen>");
  };
  answer("<AK A1=\"3\"/>");
  answer("<AKorr A1=\"1.5\"/>");
  answer("<AKorr A2=\"0.5\"/>");
  krc.tick(now += krc.cycle());
  EXPECT_EQ(krc.correction_deg()[0], 1.5) << "what a reply leaves out stays";
  EXPECT_EQ(krc.correction_deg()[1], 0.5);
  EXPECT_EQ(krc.late(), 0u);
  answer("<MoveStop>1</MoveStop>");
  krc.tick(now += krc.cycle());
  EXPECT_EQ(krc.phase(), RsiPhase::kEnded);
}

TEST(RsiReplies, AreNotExpectedWhereTheFileSaysOnlySend) {
  ControllerConfig config;
  config.channel = RsiChannelConfig::parse(file(sent("DEF_AIPos"), six("AK"), "TRUE"));
  Controller krc(config);
  krc.rsi_on();
  drivers::TimePoint now{10s};
  for (int i = 0; i < 500; ++i) EXPECT_FALSE(krc.tick(now += krc.cycle()).empty());
  EXPECT_EQ(krc.late(), 0u);
}

}  // namespace
}  // namespace cellcal::sim
