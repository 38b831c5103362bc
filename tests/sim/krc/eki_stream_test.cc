// Channel files other than cellcal's, each with typical names and conventions.

#include "sim/krc/eki_stream.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "drivers/kuka/krl/krl_files.h"
#include "drivers/units.h"

namespace cellcal::sim {
namespace {

using namespace std::chrono_literals;

std::string file(const std::string& protocol, const std::string& receive, const std::string& send) {
  return "<ETHERNETKRL><CONFIGURATION><EXTERNAL><TYPE>Client</TYPE></EXTERNAL><INTERNAL>"
         "<ENVIRONMENT>Program</ENVIRONMENT><BUFFERING Limit=\"8\" /><PORT>54600</PORT><PROTOCOL>" +
         protocol + "</PROTOCOL></INTERNAL></CONFIGURATION><RECEIVE><XML>" + receive +
         "</XML></RECEIVE><SEND><XML>" + send + "</XML></SEND></ETHERNETKRL>";
}
std::string elements(const std::string& parent, const std::string& names, const char* type) {
  std::string text;
  for (std::size_t at = 0; at < names.size(); at += 3) {
    text += "<ELEMENT Tag=\"" + parent + names.substr(at, 2) + "\"";
    if (type != nullptr) text += std::string(" Type=\"") + type + "\"";
    text += "/>";
  }
  while (text.find(" \"") != std::string::npos) text.erase(text.find(" \""), 1);
  return text;
}
const std::string kAxes = "A1 A2 A3 A4 A5 A6";
const std::string kFrame = "X  Y  Z  A  B  C ";

/// Positions streamed over UDP, with the number of queued ones.
std::string streaming() {
  return file("UDP", elements("RobotCommand/Pos/@", kAxes, "REAL"),
              elements("RobotState/Pos/@", kAxes, nullptr) +
                  elements("RobotState/Vel/@", kAxes, nullptr) +
                  elements("RobotState/Eff/@", kAxes, nullptr) +
                  "<ELEMENT Tag=\"RobotState/RobotCommand/@Size\"/>");
}
/// Typed commands on one TCP channel ...
std::string typed() {
  return file("TCP",
              "<ELEMENT Tag=\"RobotCommand/Type\" Type=\"INT\"/>" +
                  elements("RobotCommand/Axis/@", kAxes, "REAL") +
                  elements("RobotCommand/Cart/@", kFrame, "REAL") +
                  "<ELEMENT Tag=\"RobotCommand/Velocity\" Type=\"REAL\"/>",
              "");
}
/// ... and states on another.
std::string states() {
  return file("TCP", "",
              elements("RobotState/Axis/@", kAxes, nullptr) +
                  elements("RobotState/Pos/@", kFrame + " S  T ", nullptr));
}

/// An arm whose TCP is its first three angles.
class BoxArm final : public CartesianArm {
 public:
  KukaFrame frame(std::span<const double> q) const override {
    return {q[0] * 1000, q[1] * 1000, q[2] * 1000, 0, 0, 0};
  }
  std::optional<std::vector<double>> axes(const KukaFrame& tcp,
                                          const std::vector<double>& near) const override {
    std::vector<double> q = near;
    for (std::size_t i = 0; i < 3; ++i) q[i] = tcp[i] / 1000;
    if (std::abs(q[0]) > 3.0) return std::nullopt;
    return q;
  }
  std::optional<std::vector<double>> corrected(std::span<const double> start, const KukaFrame& by,
                                               CorrectionFrame,
                                               const std::vector<double>& near) const override {
    KukaFrame tcp = frame(start);
    for (std::size_t i = 0; i < 3; ++i) tcp[i] += by[i];
    return axes(tcp, near);
  }
};

class Stream : public ::testing::Test {
 protected:
  void make(std::vector<std::string> files) {
    EkiStreamConfig config;
    config.channel_xml = std::move(files);
    config.arm = std::make_shared<BoxArm>();
    krc = std::make_unique<EkiStream>(config);
    run(40ms);
  }
  void run(drivers::Duration duration) {
    for (const auto end = now + duration; now < end;) krc->tick(now += krc->cycle());
  }
  void to_rest() {
    for (int i = 0; i < 10000 && (i < 2 || !krc->at_rest()); ++i) run(4ms);
    run(500ms);
  }
  double a(std::size_t axis) const { return krc->actual_rad_at(now)[axis] / drivers::kRadPerDeg; }

  std::unique_ptr<EkiStream> krc;
  drivers::TimePoint now{10s};
};

std::string pos(double a1) {
  return "<RobotCommand><Pos A1=\"" + std::to_string(a1) +
         "\" A2=\"-90\" A3=\"90\" A4=\"0\" A5=\"90\" A6=\"0\"></Pos></RobotCommand>";
}

std::string command(int type, const std::string& axes, const std::string& cart,
                    const std::string& velocity = "1.0") {
  return "<RobotCommand><Type>" + std::to_string(type) + "</Type><Axis " + axes +
         " /><Cart S=\"0\" T=\"0\" " + cart + " /><Velocity>" + velocity +
         "</Velocity></RobotCommand>";
}
const std::string kHome = "A1=\"0\" A2=\"-90\" A3=\"90\" A4=\"0\" A5=\"90\" A6=\"0.0\"";
const std::string kNowhere = "X=\"0.0\" Y=\"0.0\" Z=\"0.0\" A=\"0\" B=\"0\" C=\"0\"";

TEST_F(Stream, UdpClientIsKnownByItsFirstDatagramAndGetsFiftyStatesASecond) {
  make({streaming()});
  run(1s);
  EXPECT_EQ(krc->channel(0).drain_output(), "");
  krc->datagram(0, "0");  // any byte
  run(1s);
  const std::string states = krc->channel(0).drain_output();
  std::size_t count = 0;
  for (std::size_t at = states.find("<RobotState>"); at != std::string::npos;
       at = states.find("<RobotState>", at + 1))
    ++count;
  EXPECT_EQ(count, 50u);
  const std::string zeros =
      "A1=\"0.000000\" A2=\"0.000000\" A3=\"0.000000\" A4=\"0.000000\" "
      "A5=\"0.000000\" A6=\"0.000000\"/>";
  EXPECT_EQ(states.substr(0, states.find("</RobotState>")),
            "<RobotState><Pos A1=\"0.000000\" A2=\"-90.000000\" A3=\"90.000000\" A4=\"0.000000\" "
            "A5=\"90.000000\" A6=\"0.000000\"/><Vel " +
                zeros + "<Eff " + zeros + "<RobotCommand Size=\"0\"/>");
}

TEST_F(Stream, StreamedPositionsAreBlendedAndTheLastIsReached) {
  make({streaming()});
  krc->datagram(0, "0");
  bool stood = false;
  for (int i = 1; i <= 100; ++i) {
    if (krc->channel(0).waiting("RobotCommand/Pos/@A1") < 5) krc->datagram(0, pos(0.2 * i));
    run(20ms);
    stood = stood || (i > 5 && krc->at_rest());
  }
  EXPECT_FALSE(stood) << "it moved on without stops";
  krc->datagram(0, pos(20));
  to_rest();
  EXPECT_NEAR(a(0), 20.0, 1e-6);
  EXPECT_NEAR(a(1), -90.0, 1e-6);
}

TEST_F(Stream, TypedCommandsAreCarriedOutOneAfterTheOther) {
  make({typed(), states()});
  ASSERT_EQ(krc->channels(), 2u);
  ASSERT_TRUE(krc->channel(0).connect());
  ASSERT_TRUE(krc->channel(1).connect());
  krc->channel(0).receive(
      command(1, "A1=\"10.0\" A2=\"-90\" A3=\"90\" A4=\"0\" A5=\"90\" A6=\"0\"", kNowhere) +
      command(4, "A1=\"-2.5\" A2=\"0\" A3=\"0\" A4=\"0\" A5=\"0\" A6=\"0\"", kNowhere));
  run(100ms);
  EXPECT_EQ(krc->moves(), 1u) << "the second waits for the first";
  to_rest();
  EXPECT_EQ(krc->moves(), 2u);
  EXPECT_NEAR(a(0), 7.5, 1e-4);
  krc->channel(0).receive(
      command(2, kHome, "X=\"500\" Y=\"-1000\" Z=\"1000\" A=\"0\" B=\"0\" C=\"0\""));
  to_rest();
  EXPECT_NEAR(a(0) * drivers::kRadPerDeg, 0.5, 1e-6);
  krc->channel(0).receive(command(5, kHome, "X=\"-100\" Y=\"0\" Z=\"0\" A=\"0\" B=\"0\" C=\"0\""));
  to_rest();
  EXPECT_NEAR(a(0) * drivers::kRadPerDeg, 0.4, 1e-6);
  krc->channel(1).drain_output();
  run(20ms);
  const std::string state = krc->channel(1).drain_output();
  EXPECT_NE(state.find("<Pos X=\"400.000"), std::string::npos) << state;
  EXPECT_NE(state.find("S=\"2\" T=\"2\""), std::string::npos) << state;
}

TEST_F(Stream, FrameWithoutATypeIsATargetOfTheTcp) {
  std::string xml = file("TCP",
                         "<ELEMENT Tag=\"Sensor/Key\" Type=\"STRING\"/>"
                         "<ELEMENT Tag=\"Sensor/Frame\" Type=\"FRAME\"/>"
                         "<ELEMENT Tag=\"Sensor\" Set_Flag=\"4\"/>",
                         elements("Robot/Data/ActPos/@", kFrame, nullptr));
  const std::string protocol = "<PROTOCOL>TCP</PROTOCOL>";
  xml.erase(xml.find(protocol), protocol.size());  // TCP is the default
  make({xml});
  ASSERT_TRUE(krc->channel(0).connect());
  krc->channel(0).receive(
      "<Sensor><Key>go</Key><Frame X=\"250.0\" Y=\"0\" Z=\"0\" A=\"0\" B=\"0\" C=\"0\" "
      "/></Sensor>");
  to_rest();
  EXPECT_NEAR(a(0) * drivers::kRadPerDeg, 0.25, 1e-6);
}

TEST_F(Stream, ATypeOfAnotherNameMovesNothing) {
  // Codes of others: there 2 is a stop, a tool change, a speed, and here it would be a PTP to 0.
  const std::string frame = elements("RobotCommand/Cart/@", kFrame, "REAL");
  const std::string axes = elements("RobotCommand/Axis/@", kAxes, "REAL");
  const std::string at = " A1=\"10\" A2=\"-90\" A3=\"90\" A4=\"0\" A5=\"90\" A6=\"0\"";
  const struct {
    std::string receive, telegram;
  } others[] = {
      {"<ELEMENT Tag=\"RobotCommand/@Type\" Type=\"INT\"/>" + axes + frame,
       "<RobotCommand Type=\"2\"><Axis" + at + "/><Cart " + kNowhere + "/></RobotCommand>"},
      {"<ELEMENT Tag=\"Ext/Msg/@Type\" Type=\"INT\"/>" + elements("Ext/Pos/@", kFrame, "REAL"),
       "<Ext><Msg Type=\"2\"/><Pos " + kNowhere + "/></Ext>"},
      {"<ELEMENT Tag=\"RobotCommand/Type\" Type=\"INT\"/>" +
           elements("RobotCommand/Target/@", kAxes, "REAL"),
       "<RobotCommand><Type>1</Type><Target" + at + "/></RobotCommand>"},
  };
  for (const auto& other : others) {
    make({file("TCP", other.receive, "")});
    ASSERT_TRUE(krc->channel(0).connect());
    krc->channel(0).receive(other.telegram);
    to_rest();
    EXPECT_EQ(krc->moves(), 0u) << other.telegram;
    EXPECT_NEAR(a(0), 0.0, 1e-9);
    EXPECT_NE(krc->message().find("Type"), std::string::npos) << krc->message();
  }
}

TEST_F(Stream, VelocityScalesAsAFractionOrInPercent) {
  double after[3];
  int at = 0;
  for (const char* velocity : {"1.0", "0.1", "10"}) {
    make({typed()});
    ASSERT_TRUE(krc->channel(0).connect());
    krc->channel(0).receive(command(1, "A1=\"80\" A2=\"-90\" A3=\"90\" A4=\"0\" A5=\"90\" A6=\"0\"",
                                    kNowhere, velocity));
    run(600ms);
    after[at++] = a(0);
  }
  EXPECT_GT(after[0], 3 * after[1]);
  EXPECT_NEAR(after[1], after[2], 1e-5);
}

TEST_F(Stream, WhatCannotBeReachedIsLeftOutAndSaid) {
  make({typed()});
  ASSERT_TRUE(krc->channel(0).connect());
  krc->channel(0).receive(command(3, kHome, "X=\"9000\" Y=\"0\" Z=\"0\" A=\"0\" B=\"0\" C=\"0\""));
  to_rest();
  EXPECT_EQ(krc->moves(), 0u);
  EXPECT_EQ(krc->message(), "Work envelope exceeded");
  krc->channel(0).receive(command(9, kHome, kNowhere));
  to_rest();
  EXPECT_NE(krc->message().find("Type 9"), std::string::npos);
}

TEST_F(Stream, ClientThatGoesLeavesNothingBehind) {
  make({typed()});
  ASSERT_TRUE(krc->channel(0).connect());
  const std::string far =
      command(1, "A1=\"80\" A2=\"-90\" A3=\"90\" A4=\"0\" A5=\"90\" A6=\"0\"", kNowhere);
  krc->channel(0).receive(far + command(1, kHome, kNowhere));
  run(40ms);
  krc->channel(0).disconnect();
  run(4ms);
  EXPECT_FALSE(krc->channel(0).connect()) << "closed for a moment";
  to_rest();
  EXPECT_EQ(krc->moves(), 1u);
  EXPECT_TRUE(krc->channel(0).connect());
  to_rest();
  EXPECT_NEAR(a(0), 80.0, 1e-6) << "the motion that had begun was carried out, the queue was not";
}

TEST_F(Stream, OverflowClosesTheConnection) {
  make({typed()});
  ASSERT_TRUE(krc->channel(0).connect());
  for (int i = 0; i < 9; ++i) krc->channel(0).receive(command(1, kHome, kNowhere));
  EXPECT_FALSE(krc->channel(0).connected());
}

TEST(EkiStreamFile, TellsCellcalsOwnFromOthers) {
  EXPECT_TRUE(
      is_cellcal_channel(EkiChannelConfig::parse(drivers::eki_files({}).at("CellcalEki.xml"))));
  EXPECT_FALSE(is_cellcal_channel(EkiChannelConfig::parse(streaming())));
  EXPECT_FALSE(is_cellcal_channel(
      EkiChannelConfig::parse(file("TCP",
                                   "<ELEMENT Tag=\"RobotCommand/@Seq\" Type=\"INT\"/>"
                                   "<ELEMENT Tag=\"RobotCommand/@Type\" Type=\"INT\"/>" +
                                       elements("RobotCommand/Axis/@", kAxes, "REAL"),
                                   ""))))
      << "numbered commands of others are not ours";
  EkiStreamConfig config;
  EXPECT_THROW(EkiStream{config}, std::invalid_argument);
  config.channel_xml = {file("TCP", "", "")};
  EXPECT_THROW(EkiStream{config}, std::invalid_argument);
}

}  // namespace
}  // namespace cellcal::sim
