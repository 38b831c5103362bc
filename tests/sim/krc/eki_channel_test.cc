#include "sim/krc/eki_channel.h"

#include <gtest/gtest.h>

#include <stdexcept>

#include "drivers/kuka/krl/krl_files.h"

namespace cellcal::sim {
namespace {

std::string installed() { return drivers::eki_files({}).at("CellcalEki.xml"); }

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  const auto at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return text.replace(at, what.size(), by);
}

const std::string kBeat =
    "<RobotCommand Session=\"1\" Seq=\"1\" Type=\"2\" Id=\"0\"><Axis A1=\"1.1\" A2=\"2\" A3=\"3\" "
    "A4=\"4\" A5=\"5\" A6=\"6\"/><Move Guard=\"0\" Path=\"1\" Percent=\"1\" Duration=\"0\"/>"
    "</RobotCommand>";

class Channel : public ::testing::Test {
 protected:
  void SetUp() override {
    channel.open();
    ASSERT_TRUE(channel.connect());
  }
  EkiChannel channel{EkiChannelConfig::parse(installed())};
};

TEST(EkiChannelFile, TellsPortLimitsAndElements) {
  const EkiChannelConfig config = EkiChannelConfig::parse(installed());
  EXPECT_EQ(config.port, 54600);
  EXPECT_EQ(config.limit, 16u);
  EXPECT_EQ(config.alive_flag, 901);
  EXPECT_TRUE(config.survives_reset);
  EXPECT_EQ(config.receive.size(), 4u + 6u + 4u);
  EXPECT_EQ(config.send.size(), 3u + 6u + 7u + 3u + 1u + 6u + 10u);
}

TEST(EkiChannelFile, IsRefusedWithWhatIsWrong) {
  const std::string xml = installed();
  const std::pair<const char*, std::string> wrong[] = {
      {"no XML", "<ETHERNETKRL>"},
      {"INTERNAL is missing", "<ETHERNETKRL/>"},
      {"server", replaced(xml, "<TYPE>Client</TYPE>", "<TYPE>Server</TYPE>")},
      {"TCP", replaced(xml, "<PROTOCOL>TCP", "<PROTOCOL>XDP")},
      {"PORT", replaced(xml, "<PORT>54600</PORT>", "")},
      {"BUFFERING", replaced(xml, "Limit=\"16\"", "Limit=\"513\"")},
      {"BUFFSIZE", replaced(xml, "Limit=\"16384\"", "Limit=\"0\"")},
      {"\"DOUBLE\"", replaced(xml, "\"REAL\"", "\"DOUBLE\"")},
  };
  for (const auto& [word, text] : wrong) {
    try {
      EkiChannelConfig::parse(text);
      ADD_FAILURE() << word << " was accepted";
    } catch (const std::invalid_argument& error) {
      EXPECT_NE(std::string(error.what()).find(word), std::string::npos) << error.what();
    }
  }
}

TEST_F(Channel, QueuesEachElementOfTelegramsThatArriveInPieces) {
  const std::string two = kBeat + "\r\n" + replaced(kBeat, "Seq=\"1\"", "Seq=\"2\"");
  for (const char c : two) channel.receive({&c, 1});
  EXPECT_EQ(channel.waiting("RobotCommand/@Seq"), 2u);
  EXPECT_EQ(channel.get("RobotCommand/@Seq"), 1.0);
  EXPECT_EQ(channel.get("RobotCommand/@Seq"), 2.0);
  EXPECT_EQ(channel.get("RobotCommand/@Seq"), std::nullopt);
  EXPECT_EQ(channel.get("RobotCommand/Axis/@A1"), static_cast<double>(1.1F)) << "KRL's REAL";
}

TEST_F(Channel, TakesTelegramsInOtherOrderCaseAndWithMoreInThem) {
  channel.receive(
      "<?xml version=\"1.0\"?><robotcommand more=\"1\"><move GUARD=\"1\" duration=\"2.5\">"
      "<path>2</path></move><New/><axis a1=\"7\"/><seq>9</seq></robotcommand>");
  EXPECT_EQ(channel.get("RobotCommand/@Seq"), 9.0);
  EXPECT_EQ(channel.get("RobotCommand/Move/@Path"), 2.0);
  EXPECT_EQ(channel.get("RobotCommand/Move/@Duration"), 2.5);
  EXPECT_EQ(channel.get("RobotCommand/Axis/@A1"), 7.0);
  EXPECT_EQ(channel.get("RobotCommand/Axis/@A2"), std::nullopt);
}

TEST_F(Channel, ClosesWhenABufferOverflowsAndKeepsWhatWasReceived) {
  for (int i = 0; i < 17; ++i) channel.receive(kBeat);
  EXPECT_FALSE(channel.connected());
  EXPECT_EQ(channel.waiting("RobotCommand/@Seq"), 16u);
  ASSERT_EQ(channel.messages().size(), 1u);
  EXPECT_NE(channel.messages()[0].find("is full"), std::string::npos);
  EXPECT_FALSE(channel.connect()) << "KRL has to open it again";
  channel.open();
  EXPECT_TRUE(channel.connect());
  EXPECT_EQ(channel.waiting("RobotCommand/@Seq"), 16u) << "stale";
  channel.clear();
  EXPECT_EQ(channel.waiting("RobotCommand/@Seq"), 0u);
}

TEST_F(Channel, TakesOneClientAlone) {
  EXPECT_FALSE(channel.connect());
  channel.disconnect();
  EXPECT_TRUE(channel.connect());
}

TEST_F(Channel, ClosesOnATelegramWithoutAnEndOrLongerThanItsBuffer) {
  channel.receive("<RobotCommand>" + std::string(20000, 'x'));
  EXPECT_FALSE(channel.connected());
}

TEST_F(Channel, IgnoresWhatIsNoXmlOrOfAnotherTypeAndSaysSo) {
  channel.receive("<RobotCommand Seq=></RobotCommand>");
  channel.receive("<RobotCommand Seq=\"1.5\" Session=\"x\"><Axis A1=\"nan\"/></RobotCommand>");
  EXPECT_TRUE(channel.connected());
  EXPECT_EQ(channel.waiting("RobotCommand/@Seq"), 0u);
  EXPECT_EQ(channel.waiting("RobotCommand/Axis/@A1"), 0u);
  EXPECT_EQ(channel.messages().size(), 4u);
}

TEST_F(Channel, SendsTheElementsOfItsFileInTheirOrder) {
  channel.set("RobotState/@Session", "5");
  channel.set("RobotState/Axis/@A2", "-90.5");
  channel.send("RobotState");
  const std::string sent = channel.drain_output();
  EXPECT_EQ(sent.find("<RobotState Session=\"5\" Heard=\"\" Time=\"\"><Axis A1=\"\" A2=\"-90.5\""),
            0u)
      << sent;
  EXPECT_EQ(channel.drain_output(), "");
}

}  // namespace
}  // namespace cellcal::sim
