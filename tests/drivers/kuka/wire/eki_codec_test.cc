#include "drivers/kuka/wire/eki_codec.h"

#include <gtest/gtest.h>

#include <array>
#include <string>

namespace cellcal::drivers {
namespace {

const std::string kState =
    "<RobotState Session=\"7\" Heard=\"12\" Time=\"123456\">"
    "<Axis A1=\"1.500000\" A2=\"-90.000000\" A3=\"90.250000\" A4=\"0\" A5=\"9e1\" A6=\"-0.1\"/>"
    "<Move Id=\"3\" State=\"2\" Outcome=\"2\"/>"
    "<Latch Id=\"3\" A1=\"1.4\" A2=\"-90.1\" A3=\"90.2\" A4=\"0\" A5=\"90\" A6=\"0\"/>"
    "<Status Ready=\"1\" Mode=\"1\" Drives=\"1\" Stopped=\"0\" Override=\"75\" Input=\"1\" "
    "Fault=\"0\" Bad=\"2\"/></RobotState>";

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  const auto at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return text.replace(at, what.size(), by);
}

EkiError parse(const std::string& text, EkiState& state) {
  static EkiParser parser;
  return parser.parse_state(text, state);
}
EkiError error_of(const std::string& text) {
  EkiState state;
  return parse(text, state);
}

TEST(EkiState, TellsWhatTheControllerAsksForAndNothingWhereItDoesNot) {
  EkiParser parser;
  EkiState state;
  ASSERT_EQ(parser.parse_state(kState, state), EkiError::kNone);
  EXPECT_EQ(state.request, ControllerRequest::kNone) << "files of earlier releases";
  const std::string with = replaced(kState, "Bad=\"2\"", "Bad=\"2\" Request=\"1\"");
  ASSERT_EQ(parser.parse_state(with, state), EkiError::kNone);
  EXPECT_EQ(state.request, ControllerRequest::kBrakeTest);
  for (const char* wrong : {"4", "-1", "1.5", "x", ""}) {
    const std::string value = std::string("Request=\"") + wrong + "\"";
    EXPECT_EQ(parser.parse_state(replaced(with, "Request=\"1\"", value), state),
              EkiError::kBadNumber)
        << wrong;
  }
}

TEST(EkiState, HasTheTcpWhereTheProgramsSendOneAndKnowIt) {
  EkiState state;
  ASSERT_EQ(parse(kState, state), EkiError::kNone);
  EXPECT_FALSE(state.sends_tcp || state.tcp) << "files of earlier releases";
  const std::string pos =
      "<Pos Known=\"1\" X=\"780.5\" Y=\"-1\" Z=\"1e3\" A=\"180\" B=\"0\" C=\"-90\"/><Move Id";
  const std::string with = replaced(kState, "<Move Id", pos);
  ASSERT_EQ(parse(with, state), EkiError::kNone);
  ASSERT_TRUE(state.tcp);
  EXPECT_EQ(*state.tcp, (EkiFrameValues{780.5, -1, 1000, 180, 0, -90}));
  for (const char* unknown : {"Known=\"0\"", "Known=\"\"", ""}) {
    ASSERT_EQ(parse(replaced(with, "Known=\"1\"", unknown), state), EkiError::kNone) << unknown;
    EXPECT_TRUE(state.sends_tcp);
    EXPECT_FALSE(state.tcp) << unknown;
  }
  EXPECT_EQ(error_of(replaced(with, "Z=\"1e3\"", "")), EkiError::kMissing);
  for (const char* wrong : {"nan", "inf", "1e9", "x", ""})
    EXPECT_EQ(error_of(replaced(with, "1e3", wrong)), EkiError::kBadNumber) << wrong;
  EXPECT_EQ(error_of(replaced(with, "Known=\"1\"", "Known=\"-1\"")), EkiError::kBadNumber);
}

TEST(EkiParser, ReadsAState) {
  EkiState state;
  ASSERT_EQ(parse(kState, state), EkiError::kNone);
  EXPECT_EQ(state.session, 7u);
  EXPECT_EQ(state.heard, 12u);
  EXPECT_EQ(state.time_ms, 123456u);
  EXPECT_EQ(state.axes_deg, (AxisAngles{1.5, -90, 90.25, 0, 90, -0.1}));
  EXPECT_EQ(state.decimals, 6);
  EXPECT_EQ(state.move_id, 3u);
  EXPECT_EQ(state.progress, EkiProgress::kDone);
  EXPECT_EQ(state.outcome, EkiOutcome::kInput);
  EXPECT_EQ(state.latch_id, 3u);
  EXPECT_EQ(state.latch_deg, (AxisAngles{1.4, -90.1, 90.2, 0, 90, 0}));
  EXPECT_TRUE(state.ready);
  EXPECT_EQ(state.mode, OperatingMode::kT1);
  EXPECT_EQ(state.override_percent, 75);
  EXPECT_TRUE(state.input);
  EXPECT_EQ(state.bad, 2u);
}

TEST(EkiParser, ToleratesOtherOrderCaseElementsAndMore) {
  EkiState state;
  ASSERT_EQ(
      parse("<robotstate><Extra a=\"1\"/><STATUS ready=\"1\"/><move><id>4</id><state>1</state>"
            "<outcome>0</outcome></move><session>7</session><HEARD> 3 </HEARD>"
            "<AXIS a2=\"2\" a1=\"+1.25\" A3=\"3\"/></robotstate>",
            state),
      EkiError::kNone);
  EXPECT_EQ(state.axes_deg, (AxisAngles{1.25, 2, 3}));
  EXPECT_EQ(state.move_id, 4u);
  EXPECT_EQ(state.heard, 3u);
  EXPECT_EQ(state.override_percent, 100);
  EXPECT_TRUE(state.drives);
  EXPECT_FALSE(state.time_ms.has_value());
}

TEST(EkiParser, RefusesWhatIsNoNumber) {
  for (const char* value : {"nan", "inf", "-INF", "1,5", "", "0x10", "1e999", "9e99", "1.5deg"}) {
    EXPECT_EQ(error_of(replaced(kState, "A1=\"1.500000\"", "A1=\"" + std::string(value) + "\"")),
              EkiError::kBadNumber)
        << value;
  }
  for (const char* value : {"1.5", "-1", "4294967296", "nan"}) {
    EXPECT_EQ(error_of(replaced(kState, "Heard=\"12\"", "Heard=\"" + std::string(value) + "\"")),
              EkiError::kBadNumber)
        << value;
  }
  EXPECT_EQ(error_of(replaced(kState, "State=\"2\"", "State=\"3\"")), EkiError::kBadNumber);
  EXPECT_EQ(error_of(replaced(kState, "Override=\"75\"", "Override=\"101\"")),
            EkiError::kBadNumber);
}

TEST(EkiParser, RefusesWhatIsMissingOrTwice) {
  for (const char* what : {"Session=\"7\"", "Heard=\"12\"", "Id=\"3\" ", "State=\"2\"",
                           "Outcome=\"2\"", "Ready=\"1\""}) {
    EXPECT_EQ(error_of(replaced(kState, what, "")), EkiError::kMissing) << what;
  }
  EXPECT_EQ(error_of(replaced(kState, "A1=\"1.500000\"", "")), EkiError::kNoAxes);
  EXPECT_EQ(error_of(replaced(kState, "<Move", "<Move/><Move")), EkiError::kDuplicate);
  EXPECT_EQ(error_of(replaced(kState, "Heard=", "HEARD=\"1\" Heard=")), EkiError::kDuplicate);
  EXPECT_EQ(error_of(replaced(kState, "Heard=\"12\"", "Heard=\"12\" Heard=\"13\"")),
            EkiError::kDuplicate);
}

TEST(EkiParser, RefusesOtherDocumentsAndPiecesOfThem) {
  EXPECT_EQ(error_of("<RobotCommand/>"), EkiError::kWrongRoot);
  EXPECT_EQ(error_of(""), EkiError::kNotXml);
  EXPECT_EQ(error_of(std::string(kMaxEkiDocument + 1, ' ')), EkiError::kOversized);
  for (std::size_t size = 0; size < kState.size(); ++size) {
    EXPECT_NE(error_of(kState.substr(0, size)), EkiError::kNone) << size;
  }
}

TEST(EkiParser, SurvivesTheDeepestAndTheFullestDocument) {
  std::string deep, wide = "<RobotState>";
  while (deep.size() + 3 < kMaxEkiDocument) deep += "<a>";
  while (wide.size() + 20 < kMaxEkiDocument) wide += "<a>b";
  EXPECT_NE(error_of(deep), EkiError::kNone);
  EXPECT_NE(error_of(wide), EkiError::kNone);
}

TEST(EkiCommand, HoldsEveryElementWithTagsThatOpenAndClose) {
  EkiCommand command;
  command.session = 2147483647;
  command.seq = 5;
  command.type = EkiType::kMove;
  command.id = 9;
  command.target_deg = {1.25, -90, 90, -1e-9, 5, 6, 700.5};
  command.guard = EkiGuard::kInput;
  command.path = EkiPath::kLin;
  command.percent = 20;
  command.duration_s = 2.4;
  std::array<char, kEkiTelegram> buffer{};
  EXPECT_EQ(format_command(command, buffer),
            "<RobotCommand Session=\"2147483647\" Seq=\"5\" Type=\"3\" Id=\"9\">"
            "<Axis A1=\"1.250000\" A2=\"-90.000000\" A3=\"90.000000\" A4=\"0.000000\" "
            "A5=\"5.000000\" A6=\"6.000000\"></Axis><Ext E1=\"700.500000\"></Ext>"
            "<Move Guard=\"1\" Path=\"2\" Percent=\"20\" Duration=\"2.4000\"></Move>"
            "</RobotCommand>");
}

TEST(EkiCommand, FitsTheBufferOrIsNotMade) {
  EkiCommand command;
  command.target_deg.assign(12, -179.123456);
  command.session = command.seq = command.id = 4294967295;
  std::array<char, kEkiTelegram> buffer{};
  EXPECT_FALSE(format_command(command, buffer).empty());
  EXPECT_TRUE(format_command(command, std::span(buffer).first(100)).empty());
}

}  // namespace
}  // namespace cellcal::drivers
