#include "drivers/kuka/wire/rsi_codec.h"

#include <gtest/gtest.h>

#include <array>
#include <clocale>
#include <locale>
#include <string>

#include "drivers/kuka/wire/xml_values.h"

namespace cellcal::drivers {
namespace {

// From KUKA's own unit test.
const std::string kGenuine =
    R"(<Rob Type="KUKA"><RIst X="0.00000" Y="0.00000" Z="0.00000" A="0.00000" B="0.00000" )"
    R"(C="0.00000"/><AIPos A1="1.00000" A2="-90.12345" A3="90.00000" A4="0.00000" A5="90.00000" )"
    R"(A6="0.50000"/><EIPos E1="0.00000" E2="0.00000" E3="0.00000" E4="0.00000" E5="0.00000" )"
    R"(E6="0.00000"/><Delay D="15"/><IPOC>357</IPOC></Rob>)";

TEST(RsiRob, GenuinePacketIsRead) {
  RsiParser parser;
  RobFrame frame;
  ASSERT_EQ(parser.parse_rob(kGenuine, frame), WireError::kNone);
  ASSERT_EQ(frame.axes_deg.size(), 6U);
  EXPECT_EQ(frame.axes_deg[1], -90.12345);
  EXPECT_EQ(frame.external_deg.size(), 6U);
  EXPECT_TRUE(frame.setpoint_axes_deg.empty());
  EXPECT_EQ(frame.decimals, 5);
  EXPECT_EQ(frame.delay, 15U);
  EXPECT_EQ(frame.ipoc.text.view(), "357");
  EXPECT_EQ(frame.ipoc.value, 357U);
}

TEST(RsiRob, NamesInAnyCaseOrderAndCompanyAreRead) {
  RsiParser parser;
  RobFrame frame;
  ASSERT_EQ(parser.parse_rob("<?xml version=\"1.0\"?>\r\n<ROB TYPE='KUKA' >\n <IPOC>0042</IPOC>"
                             "<Foo.Bar a='1'/><Delay D = \"0\" /><aspos a1='1.5' A2='2' />"
                             "<AIPOS A2=\"+2.5\" A1=\" 1.25E-3 \" /><Digout o1='0'/></ROB>\n",
                             frame),
            WireError::kNone);
  ASSERT_EQ(frame.axes_deg.size(), 2U);
  EXPECT_EQ(frame.axes_deg[0], 1.25e-3);
  EXPECT_EQ(frame.axes_deg[1], 2.5);
  EXPECT_EQ(frame.setpoint_axes_deg.size(), 2U);
  EXPECT_EQ(frame.decimals, 5);
  EXPECT_EQ(frame.ipoc.text.view(), "0042") << "leading zeros are part of the text";
}

struct Told {
  const char* elements;
  OperatingMode mode;
  std::optional<int> override_percent;
};

TEST(RsiRob, ModeAndOverrideAreReadWhereTheyAreSoundAndNeverAnError) {
  using Mode = OperatingMode;
  const std::string huge(400, '9');
  const std::string beyond = "<Mode R='" + huge + "'/><OvPro R='" + huge + "'/>";
  const Told cases[] = {
      {"<Mode R=\"1\"/><OvPro R=\"10.0000\"/>", Mode::kT1, 10},
      {"<OVPRO r=' 0 '/><mode R='2.0000'/>", Mode::kT2, 0},
      {"<Mode R='3' S='x'/><OvPro R='99.6'/>", Mode::kAut, 100},
      {"<Mode R='4'/><OvPro S='1'/>", Mode::kExt, {}},
      {"", Mode::kUnknown, {}},
      {"<Mode R=''/><OvPro R=''/>", Mode::kUnknown, {}},
      {"<Mode R='0'/><OvPro R='-0.1'/>", Mode::kUnknown, {}},
      {"<Mode R='5'/><OvPro R='100.1'/>", Mode::kUnknown, {}},
      {"<Mode R='1.5'/><OvPro R='1,5'/>", Mode::kUnknown, {}},
      {"<Mode R='nan'/><OvPro R='nan'/>", Mode::kUnknown, {}},
      {"<Mode R='inf'/><OvPro R='1e999'/>", Mode::kUnknown, {}},
      {"<Mode R='T1'/><OvPro R='#'/>", Mode::kUnknown, {}},
      {beyond.c_str(), Mode::kUnknown, {}},
      {"<Mode R='1'/><Mode R='3'/><OvPro R='5' R='6'/>", Mode::kUnknown, {}},
      {"<Mode>1</Mode><OvPro>50</OvPro>", Mode::kUnknown, {}},
  };
  RsiParser parser;
  RobFrame frame;
  for (const Told& c : cases) {
    const std::string text =
        std::string("<Rob><AIPos A1='1'/>") + c.elements + "<IPOC>4</IPOC></Rob>";
    ASSERT_EQ(parser.parse_rob(text, frame), WireError::kNone) << text;
    EXPECT_EQ(frame.mode, c.mode) << text;
    EXPECT_EQ(frame.override_percent, c.override_percent) << text;
  }
}

TEST(RsiRob, ModeAndOverrideHaveTheNamesOfTheConfiguration) {
  const std::string text =
      "<Rob><AIPos A1='1'/><Krc Op='2' Ov='30'/><BA>1</BA><Mode R='3'/><IPOC>4</IPOC></Rob>";
  RsiParser parser;
  RobFrame frame;
  ASSERT_EQ(parser.parse_rob(text, frame,
                             {.mode_tag = "Krc.Op", .override_tag = "Krc.Ov", .contact_tag = ""}),
            WireError::kNone);
  EXPECT_EQ(frame.mode, OperatingMode::kT2);
  EXPECT_EQ(frame.override_percent, 30);
  ASSERT_EQ(
      parser.parse_rob(text, frame, {.mode_tag = "BA", .override_tag = "", .contact_tag = ""}),
      WireError::kNone);
  EXPECT_EQ(frame.mode, OperatingMode::kT1) << "an element's text";
  EXPECT_FALSE(frame.override_percent) << "not read";
}

TEST(RsiRob, ContactInputIsReadWhereItIsOneBitAndNeverAnError) {
  const std::pair<const char*, std::optional<bool>> cases[] = {
      {"<Contact R=\"1\"/>", true},
      {"<contact r='0'/>", false},
      {"<Contact R='1.0000'/>", true},
      {"<Contact S='x' R=' 0 '/>", false},
      {"", {}},
      {"<Contact R=''/>", {}},
      {"<Contact R='2'/>", {}},
      {"<Contact R='-1'/>", {}},
      {"<Contact R='0.5'/>", {}},
      {"<Contact R='nan'/>", {}},
      {"<Contact R='1e999'/>", {}},
      {"<Contact R='1' R='1'/>", {}},
      {"<Contact R='1'/><Contact R='0'/>", {}},
      {"<Contact>1</Contact>", {}},
  };
  RsiParser parser;
  RobFrame frame;
  for (const auto& [element, on] : cases) {
    const std::string text = std::string("<Rob><AIPos A1='1'/>") + element + "<IPOC>4</IPOC></Rob>";
    ASSERT_EQ(parser.parse_rob(text, frame, {.contact_tag = "Contact.R"}), WireError::kNone)
        << text;
    EXPECT_EQ(frame.input_on, on) << text;
  }
  ASSERT_EQ(parser.parse_rob("<Rob><AIPos A1='1'/><Contact R='1'/><IPOC>4</IPOC></Rob>", frame),
            WireError::kNone);
  EXPECT_FALSE(frame.input_on) << "not read unless it is configured";
}

TEST(RsiRob, IpocBeyond32BitsKeepsItsTextAndWraps) {
  RsiParser parser;
  RobFrame frame;
  ASSERT_EQ(parser.parse_rob("<Rob><AIPos A1='1'/><IPOC>4294967300</IPOC></Rob>", frame),
            WireError::kNone);
  EXPECT_EQ(frame.ipoc.text.view(), "4294967300");
  EXPECT_EQ(frame.ipoc.value, 4U);
}

struct Damaged {
  const char* text;
  WireError error;
};

TEST(RsiRob, DamagedPacketsAreNamed) {
  const Damaged cases[] = {
      {"", WireError::kEmpty},
      {"garbage", WireError::kNotXml},
      {"<Rob><AIPos A1='1'/><IPOC>1</IPOC>", WireError::kNotXml},
      {"<Sen><AIPos A1='1'/><IPOC>1</IPOC></Sen>", WireError::kWrongRoot},
      {"<Rob><AIPos A1='1'/></Rob>", WireError::kNoIpoc},
      {"<Rob><AIPos A1='1'/><IPOC/></Rob>", WireError::kBadIpoc},
      {"<Rob><AIPos A1='1'/><IPOC>-1</IPOC></Rob>", WireError::kBadIpoc},
      {"<Rob><AIPos A1='1'/><IPOC>12x</IPOC></Rob>", WireError::kBadIpoc},
      {"<Rob><AIPos A1='1'/><IPOC>99999999999999999999999</IPOC></Rob>", WireError::kBadIpoc},
      {"<Rob><IPOC>1</IPOC></Rob>", WireError::kNoAxes},
      {"<Rob><AIPos/><IPOC>1</IPOC></Rob>", WireError::kNoAxes},
      {"<Rob><AIPos A1='nan'/><IPOC>1</IPOC></Rob>", WireError::kBadNumber},
      {"<Rob><AIPos A1='inf'/><IPOC>1</IPOC></Rob>", WireError::kBadNumber},
      {"<Rob><AIPos A1='1,5'/><IPOC>1</IPOC></Rob>", WireError::kBadNumber},
      {"<Rob><AIPos A1='1e999'/><IPOC>1</IPOC></Rob>", WireError::kBadNumber},
      {"<Rob><AIPos A1='9e99'/><IPOC>1</IPOC></Rob>", WireError::kBadNumber},
      {"<Rob><AIPos A1='-1000001'/><IPOC>1</IPOC></Rob>", WireError::kBadNumber},
      {"<Rob><AIPos A1=''/><IPOC>1</IPOC></Rob>", WireError::kBadNumber},
      {"<Rob><AIPos A1='1'/><Delay D='-1'/><IPOC>1</IPOC></Rob>", WireError::kBadNumber},
      {"<Rob><AIPos A1='1' A1='2'/><IPOC>1</IPOC></Rob>", WireError::kDuplicate},
      {"<Rob><AIPos A1='1'/><AIPos A1='2'/><IPOC>1</IPOC></Rob>", WireError::kDuplicate},
      {"<Rob><AIPos A1='1'/><IPOC>1</IPOC><IPOC>2</IPOC></Rob>", WireError::kDuplicate},
  };
  RsiParser parser;
  RobFrame frame;
  for (const Damaged& c : cases) EXPECT_EQ(parser.parse_rob(c.text, frame), c.error) << c.text;
}

TEST(RsiRob, EveryTruncationIsAnErrorAndNeverAnotherIpoc) {
  RsiParser parser;
  RobFrame frame;
  for (std::size_t size = 0; size < kGenuine.size(); ++size) {
    EXPECT_NE(parser.parse_rob(kGenuine.substr(0, size), frame), WireError::kNone) << size;
    if (frame.has_ipoc) {
      EXPECT_EQ(frame.ipoc.text.view(), "357") << size;
    }
  }
}

TEST(RsiRob, DamageOutsideOfIpocLeavesItAnswerable) {
  RsiParser parser;
  RobFrame frame;
  EXPECT_EQ(parser.parse_rob("<Rob><AIPos A1=1.0<<IPOC>4711</IPOC></Rob>", frame),
            WireError::kNotXml);
  ASSERT_TRUE(frame.has_ipoc);
  EXPECT_EQ(frame.ipoc.text.view(), "4711");
}

TEST(RsiRob, FirstFrameOfRsi2IsKnownForWhatItIs) {
  RsiParser parser;
  RobFrame frame;
  EXPECT_EQ(parser.parse_rob("<Rob TYPE=\"KUKA\"><IPOC>12</IPOC></Rob>", frame),
            WireError::kNoAxes);
  EXPECT_TRUE(frame.has_ipoc);
  EXPECT_TRUE(frame.only_ipoc);
}

TEST(RsiRob, OversizedAndDeeplyNestedInputIsRefusedWithinItsMemory) {
  RsiParser parser;
  RobFrame frame;
  EXPECT_EQ(parser.parse_rob(std::string(kMaxRsiDatagram + 1, ' '), frame), WireError::kOversized);
  std::string nested, flat = "<Rob>";
  while (nested.size() + 4 <= kMaxRsiDatagram) nested += "<a>b";
  EXPECT_EQ(parser.parse_rob(nested, frame), WireError::kNotXml);
  while (flat.size() + 10 <= kMaxRsiDatagram) flat += "<a/>";
  EXPECT_EQ(parser.parse_rob(flat + "</Rob>", frame), WireError::kNoIpoc);
  EXPECT_EQ(parser.parse_rob(kGenuine, frame), WireError::kNone) << "and the parser goes on";
}

TEST(RsiSen, ReplyHasTheFormOfTheControllersConfiguration) {
  std::array<char, kRsiBuffer> buffer{};
  const double correction[] = {0.0, -1.23456789, 1e-9, -1e-9, 90.0, 12.5};
  EXPECT_EQ(format_sen({}, correction, 6, 0, "0357", buffer),
            R"(<Sen Type="ImFree"><AK A1="0.000000" A2="-1.234568" A3="0.000000" A4="0.000000" )"
            R"(A5="90.000000" A6="12.500000"/><Stop>0</Stop><IPOC>0357</IPOC></Sen>)");
  const double eight[8] = {1, 2, 3, 4, 5, 6, 7, 8};
  EXPECT_EQ(format_sen({.sentype = "Kroshu",
                        .axis_tag = "AKorr",
                        .external_axis_tag = "EKorr",
                        .stop_tag = "",
                        .contact_tag = ""},
                       eight, 4, 1, "1", buffer),
            R"(<Sen Type="Kroshu"><AKorr A1="1.0000" A2="2.0000" A3="3.0000" A4="4.0000" )"
            R"(A5="5.0000" A6="6.0000"/><EKorr E1="7.0000" E2="8.0000"/><IPOC>1</IPOC></Sen>)");
}

TEST(RsiSen, WhatDoesNotFitIsNotSentAtAll) {
  std::array<char, 100> small{};
  const double correction[6] = {};
  EXPECT_TRUE(format_sen({}, correction, 6, 0, "1", small).empty());
}

TEST(RsiSen, NumbersHaveAPointWhateverTheLocale) {
  struct Comma : std::numpunct<char> {
    char do_decimal_point() const override { return ','; }
    char do_thousands_sep() const override { return '.'; }
    std::string do_grouping() const override { return "\3"; }
  };
  const std::locale before = std::locale::global(std::locale(std::locale(), new Comma));
  for (const char* name : {"de_DE.UTF-8", "fr_FR.UTF-8"}) std::setlocale(LC_NUMERIC, name);
  std::array<char, kRsiBuffer> buffer{};
  const double correction[] = {1234.5, -0.25};
  const std::string text(format_sen({}, correction, 6, 0, "4", buffer));
  double read = 0.0;
  const bool understood = wire::parse_number("1234.5", read);
  double comma = 0.0;
  const bool misread = wire::parse_number("1234,5", comma);
  std::locale::global(before);
  std::setlocale(LC_NUMERIC, "C");
  EXPECT_NE(text.find("A1=\"1234.500000\" A2=\"-0.250000\""), std::string::npos) << text;
  EXPECT_TRUE(understood);
  EXPECT_EQ(read, 1234.5);
  EXPECT_FALSE(misread);
}

}  // namespace
}  // namespace cellcal::drivers
