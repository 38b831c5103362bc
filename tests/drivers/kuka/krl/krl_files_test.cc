// The controller files: checked statically, since no controller reads them here.

#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <functional>
#include <map>
#include <pugixml.hpp>
#include <regex>
#include <set>

#include "drivers/error.h"
#include "drivers/kuka/krl/krl_template.h"
#include "sim/krc/eki_channel.h"
#include "sim/krc/eki_controller.h"
#include "tests/drivers/kuka/krl/krl_checker.h"

namespace cellcal::drivers {
namespace {

using krl::body;
using krl::check_krl;
using krl::code_lines;
using krl::line_of;

EkiFilesConfig two_external() {
  EkiFilesConfig config;
  config.address = "10.0.0.7";
  config.port = 54601;
  config.external_axes = 2;
  config.input = 17;
  config.tool = 3;
  config.base = 4;
  config.load = 5;
  return config;
}

std::string all(const ControllerFiles& files) {
  std::string text;
  for (const auto& [name, one] : files) text += one;
  return text;
}

TEST(EkiFiles, TakeTheInputAsItsLevelSaysEverywhere) {
  const auto count = [](const std::string& text, const std::string& what) {
    int found = 0;
    for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) {
      ++found;
    }
    return found;
  };
  EkiFilesConfig config = two_external();
  const std::string on = all(eki_files(config));
  config.contact_is_on = false;
  const std::string off = all(eki_files(config));
  EXPECT_EQ(count(on, "$IN[17]==TRUE"), 3);
  EXPECT_EQ(count(on, "$IN[17]==FALSE") + count(on, "NOT $IN[17]"), 0);
  EXPECT_EQ(count(off, "$IN[17]==FALSE"), 3);
  EXPECT_EQ(count(off, "CC_BIT(NOT $IN[17])"), 1);
  EXPECT_EQ(count(off, "$IN[17]==TRUE") + count(off, "CC_BIT($IN[17])"), 0);
}

TEST(KrlChecker, SeesWhatIsWrong) {
  const std::pair<const char*, const char*> cases[] = {
      {"CR LF", "DEF A ( )\nEND\n"},
      {";FOLD has no end", "DEF A ( )\r\n;FOLD x\r\nEND\r\n"},
      {"ASCII", "DEF A ( )\r\n;\xe4\r\nEND\r\n"},
      {"HALT outside of LOOP", "DEF A ( )\r\nIF X THEN\r\nHALT\r\nENDIF\r\nEND\r\n"},
  };
  for (const auto& [word, text] : cases) {
    const auto complaints = check_krl(text);
    EXPECT_TRUE(std::any_of(complaints.begin(), complaints.end(), [&](const std::string& one) {
      return one.find(word) != std::string::npos;
    })) << word;
  }
  EXPECT_TRUE(
      check_krl("DEF A ( )\r\n;FOLD \"\r\nIF X==\"IF\" THEN\r\nENDIF\r\n;ENDFOLD\r\nEND\r\n")
          .empty());
}

EkiFilesConfig with_frames() {
  EkiFilesConfig config = two_external();
  config.write_frames = true;
  return config;
}

TEST(EkiFiles, HoldNothingThatSetsAFrameUnlessAsked) {
  for (const auto& [name, text] : eki_files(two_external())) {
    EXPECT_EQ(text.find("FRAME_"), std::string::npos) << name;
    EXPECT_EQ(text.find("/Frame"), std::string::npos) << name;
    EXPECT_EQ(text.find("_DATA[CC_"), std::string::npos) << name;
    EXPECT_EQ(text.find("\r\n\r\n\r\n"), std::string::npos) << name;
  }
  const std::string sub = eki_files(with_frames()).at("cellcal_sub.sub");
  EXPECT_NE(sub.find("TOOL_DATA[CC_FRAME_NO]=CC_FRAME_AIM"), std::string::npos);
  EXPECT_NE(sub.find("CC_FRAME_NO<=16"), std::string::npos);
  const auto last = sub.find("EKI_CheckBuffer(\"CellcalEki\",\"RobotCommand/Frame/@C\")");
  EXPECT_LT(last, sub.find("RobotCommand/Frame/@Do")) << "before anything but @Ask is read";
  EXPECT_NE(sub.find("(ABS($AXIS_ACT_MEAS.E2-CC_FRAME_REST.E2)<0.01)"), std::string::npos);
}

EkiFilesConfig with_advice(bool frames) {
  EkiFilesConfig config = two_external();
  config.write_frames = frames;
  config.write_advice = true;
  return config;
}

TEST(EkiFiles, HoldTheAdviceWhereItIsAskedForAndNothingThatSetsAFrameWithIt) {
  const std::string alone = eki_files(with_advice(false)).at("cellcal_sub.sub");
  EXPECT_EQ(alone.find("_DATA[CC_"), std::string::npos);
  EXPECT_NE(alone.find("CELLCAL_ADVICE=CC_FRAME_AIM.Y"), std::string::npos);
  EXPECT_NE(alone.find("CC_ADVICE ( )"), std::string::npos);
  const std::string both = eki_files(with_advice(true)).at("cellcal_sub.sub");
  EXPECT_NE(both.find("CELLCAL_ADVICE=CC_FRAME_AIM.Y"), std::string::npos);
  EXPECT_NE(both.find("TOOL_DATA[CC_FRAME_NO]=CC_FRAME_AIM"), std::string::npos);
  for (const auto& [name, text] : eki_files(with_frames()))
    EXPECT_EQ(text.find("ADVICE"), std::string::npos) << name;
}

TEST(EkiFiles, AreSoundKrl) {
  for (const EkiFilesConfig& config :
       {EkiFilesConfig(), two_external(), with_frames(), with_advice(false), with_advice(true)}) {
    const ControllerFiles files = eki_files(config);
    EXPECT_EQ(files.size(), 5u);
    sim::EkiControllerConfig controller;
    controller.files = files;
    EXPECT_NO_THROW(sim::EkiController{controller}) << "the interpreter loads them";
    for (const auto& [name, text] : files) {
      EXPECT_LE(name.substr(0, name.find('.')).size(), 24u);
      EXPECT_EQ(text.substr(text.size() - 2), "\r\n");
      EXPECT_FALSE(std::regex_search(text, std::regex("@[A-Z_]+@"))) << name;
      if (name.ends_with(".xml")) continue;
      for (const std::string& complaint : check_krl(text))
        ADD_FAILURE() << name << ": " << complaint;
    }
  }
}

TEST(EkiFiles, HoldAChannelFileThatTheEmulatorLoads) {
  for (const EkiFilesConfig& config : {EkiFilesConfig(), two_external()}) {
    const std::string xml = eki_files(config).at("CellcalEki.xml");
    pugi::xml_document document;
    ASSERT_TRUE(document.load_buffer(xml.data(), xml.size()));
    const sim::EkiChannelConfig channel = sim::EkiChannelConfig::parse(xml);
    EXPECT_EQ(channel.port, config.port);
    EXPECT_EQ(channel.alive_flag, config.alive_flag);
    EXPECT_EQ(channel.receive.size(), 14u + static_cast<std::size_t>(config.external_axes));
    EXPECT_NE(xml.find("<IP>" + config.address + "</IP>"), std::string::npos);
  }
}

TEST(EkiFiles, ReadAndWriteEveryElementOnceWithItsType) {
  const ControllerFiles files = eki_files(with_frames());
  const sim::EkiChannelConfig channel = sim::EkiChannelConfig::parse(files.at("CellcalEki.xml"));
  const std::string& sub = files.at("cellcal_sub.sub");
  std::map<std::string, std::vector<std::string>> calls;  // path: functions
  const std::regex call("EKI_(Get|Set)(Int|Real)\\(\"CellcalEki\",\"([^\"]+)\"");
  for (std::sregex_iterator it(sub.begin(), sub.end(), call), end; it != end; ++it) {
    calls[(*it)[3]].push_back((*it)[1].str() + (*it)[2].str());
  }
  for (const auto& [path, type] : channel.receive) {
    const bool real = type == sim::EkiElementType::kReal;
    EXPECT_EQ(calls[path], std::vector<std::string>{real ? "GetReal" : "GetInt"}) << path;
    calls.erase(path);
  }
  for (const std::string& path : channel.send) {
    const std::vector<std::string>& found = calls[path];
    // Move/@Id is set in the two arms of an IF.
    EXPECT_EQ(found.size(), path == "RobotState/Move/@Id" ? 2u : 1u) << path;
    const bool real = std::regex_search(
        path, std::regex("(Axis|Ext|Pos|Latch|FrameOld|FrameNew)/@[A-FX-Z]\\d?$"));
    for (const std::string& one : found) EXPECT_EQ(one, real ? "SetReal" : "SetInt") << path;
    calls.erase(path);
  }
  for (const auto& [path, functions] : calls)
    ADD_FAILURE() << path << " is not in the channel file";
}

TEST(EkiFiles, DeclareEveryGlobalOnceAndDefineEverySubprogramThatIsCalled) {
  const ControllerFiles files = eki_files(with_frames());
  std::multiset<std::string> declared, defined;
  for (const auto& [name, text] : files) {
    for (const std::string& line : code_lines(text)) {
      std::smatch match;
      if (std::regex_search(line, match, std::regex("^DECL GLOBAL \\w+ (CC_\\w+)"))) {
        declared.insert(match[1]);
      }
      if (std::regex_search(line, match, std::regex("^(?:DEF|DEFFCT \\w+) (\\w+) \\("))) {
        defined.insert(match[1]);
      }
    }
  }
  std::set<std::string> used;
  for (const auto& [name, text] : files) {
    if (name.ends_with(".xml")) continue;
    for (const std::string& word : krl::identifiers(text)) {
      if (word.rfind("CC_", 0) == 0) used.insert(word);
    }
  }
  for (const std::string& name : used) {
    EXPECT_EQ(declared.count(name) + defined.count(name), 1u) << name;
  }
  for (const std::string& name : declared) EXPECT_EQ(used.count(name), 1u) << name;
}

TEST(EkiFiles, TestTheInputBeforeTheInterruptIsOnAndOnceMoreBehindIt) {
  const std::string source = eki_files({}).at("cellcal_eki.src");
  const std::vector<std::string> move = body(source, "DEF CC_MOVE");
  const std::size_t first = line_of(move, "IF $IN[1]==TRUE");
  const std::size_t on = line_of(move, "INTERRUPT ON 20");
  const std::size_t second = line_of(move, "IF $IN[1]==TRUE", first + 1);
  const std::size_t ptp = line_of(move, "PTP CC_TARGET"), lin = line_of(move, "LIN GOAL");
  EXPECT_LT(first, on);
  EXPECT_LT(on, second);
  EXPECT_LT(second, std::min(ptp, lin));
  EXPECT_LT(line_of(move, "INTERRUPT ON 21"), std::min(ptp, lin));
  EXPECT_LT(line_of(move, "INTERRUPT ON 22"), line_of(move, "IF $TIMER_FLAG[12]==TRUE"));
  EXPECT_LT(line_of(move, "IF $TIMER_FLAG[12]==TRUE"), std::min(ptp, lin));
}

TEST(EkiFiles, LeaveTheSubprogramWithItsInterruptsOff) {
  // At the main level RESUME would be an error, and stop the program.
  const std::string source = eki_files({}).at("cellcal_eki.src");
  const std::vector<std::string> move = body(source, "DEF CC_MOVE");
  int ways_out = 0;
  for (std::size_t i = line_of(move, "INTERRUPT ON"); i < move.size(); ++i) {
    if (move[i] != "RETURN" && move[i] != "CC_OUT=1") continue;
    ++ways_out;
    EXPECT_TRUE(move[i - 1] == "CC_GUARDS_OFF ( )" || move[i - 2] == "CC_GUARDS_OFF ( )") << i;
  }
  EXPECT_EQ(ways_out, 4);
  for (const char* isr : {"DEF CC_ON_INPUT", "DEF CC_ON_FLAG", "DEF CC_ON_TIMER"}) {
    const std::vector<std::string> lines = body(source, isr);
    EXPECT_LT(line_of(lines, "BRAKE"), line_of(lines, "CC_GUARDS_OFF ( )"));
    EXPECT_LT(line_of(lines, "CC_GUARDS_OFF ( )"), line_of(lines, "RESUME"));
  }
}

TEST(EkiFiles, LatchBeforeTheyResumeAndDeclareInterruptsAboveTheMotion) {
  const std::string source = eki_files({}).at("cellcal_eki.src");
  const std::vector<std::string> main = body(source, "DEF CELLCAL_EKI");
  // BAS (#INITMOV) sets an advance run of 3, and RESUME needs none.
  EXPECT_LT(line_of(main, "BAS (#INITMOV,0)"), line_of(main, "$ADVANCE=0"));
  EXPECT_LT(line_of(main, "INTERRUPT DECL 20 WHEN $IN[1]==TRUE DO CC_ON_INPUT"),
            line_of(main, "CC_MOVE ( )"));
  EXPECT_LT(line_of(main, "INTERRUPT DECL 21 WHEN $FLAG[902]==TRUE DO CC_ON_FLAG"),
            line_of(main, "CC_MOVE ( )"));
  EXPECT_LT(line_of(main, "INTERRUPT DECL 22 WHEN $TIMER_FLAG[12]==TRUE DO CC_ON_TIMER"),
            line_of(main, "CC_MOVE ( )"));
  EXPECT_LT(line_of(main, "CC_READY=FALSE"), line_of(main, "PTP $AXIS_ACT_MEAS"))
      << "what an earlier run left must not be believed while this one begins";
  EXPECT_LT(line_of(main, "PTP $AXIS_ACT_MEAS"), line_of(main, "REPEAT"));
  for (const std::string& line : main) EXPECT_NE(line.rfind("LIN", 0), 0u) << line;
  const std::vector<std::string> isr = body(source, "DEF CC_ON_INPUT");
  EXPECT_LT(line_of(isr, "BRAKE"), line_of(isr, "CC_LATCH=$AXIS_INT"));
  EXPECT_LT(line_of(isr, "CC_LATCH=$AXIS_INT"), line_of(isr, "RESUME"));
}

TEST(EkiFiles, BrakeAsShortAsTheyCanButForTheMeasuringTouch) {
  const std::string source = eki_files({}).at("cellcal_eki.src");
  for (const char* isr : {"DEF CC_ON_FLAG", "DEF CC_ON_TIMER"})
    EXPECT_EQ(body(source, isr).at(1), "BRAKE F") << isr;
  const std::vector<std::string> touch = body(source, "DEF CC_ON_INPUT");
  const std::vector<std::string> wanted{"IF CC_PATH==2 THEN", "BRAKE", "ELSE", "BRAKE F", "ENDIF"};
  ASSERT_GT(touch.size(), wanted.size());
  EXPECT_EQ(std::vector<std::string>(touch.begin() + 1, touch.begin() + 6), wanted);
}

TEST(EkiFiles, CancelAProgramStepByStepAndKeepTheMoveUnderWayUntilItIsGone) {
  const std::string sub = eki_files({}).at("cellcal_sub.sub");
  const std::vector<std::string> finish = body(sub, "DEF CC_FINISH");
  const std::size_t active = line_of(finish, "IF $PRO_STATE1==#P_ACTIVE THEN");
  const std::size_t otherwise = line_of(finish, "ELSE", active);
  EXPECT_EQ(line_of(finish, "CWRITE ($CMD,STAT,MODE,\"STOP 1\")"), active + 1);
  EXPECT_EQ(line_of(finish, "CWRITE ($CMD,STAT,MODE,\"CANCEL 1\")"), otherwise + 1);
  for (const std::string& line : finish) EXPECT_NE(line, "CC_BUSY=FALSE");
  const std::vector<std::string> watch = body(sub, "DEF CC_WATCH");
  EXPECT_LT(line_of(watch, "IF CC_GONE ( )==TRUE THEN"), line_of(watch, "CC_BUSY=FALSE"));
  EXPECT_LT(line_of(watch, "IF CC_GONE ( )==TRUE THEN"), line_of(watch, "CC_READY=FALSE"));
}

TEST(EkiFiles, AreReadyInCellcalsOwnProgramAloneWhateverHasCalledIt) {
  const ControllerFiles files = eki_files({});
  const std::string& sub = files.at("cellcal_sub.sub");
  const auto has = [&](const char* head, const char* part) {
    const std::vector<std::string> lines = body(sub, head);
    return std::any_of(lines.begin(), lines.end(), [&](const std::string& line) {
      return line.find(part) != std::string::npos;
    });
  };
  for (const char* head : {"DEFFCT BOOL CC_IS_THERE", "DEFFCT BOOL CC_GONE"})
    EXPECT_TRUE(has(head, "StrComp($PRO_NAME1[],CC_NAME[],#NOT_CASE_SENS)")) << head;
  EXPECT_TRUE(has("DEFFCT BOOL CC_IS_READY", "OK=CC_IS_THERE( ) AND (CC_LEAVE==FALSE)"));
  EXPECT_TRUE(has("DEFFCT BOOL CC_IS_THERE", "CC_READY AND (CC_BUSY OR (CC_MISSED<15))"));
  // The name is that of the selected program at the start, and the proof comes from the wait alone.
  const std::vector<std::string> main = body(files.at("cellcal_eki.src"), "DEF CELLCAL_EKI");
  EXPECT_LT(line_of(main, "OK=StrCopy(CC_NAME[],$PRO_NAME1[])"), line_of(main, "CC_READY=TRUE"));
  EXPECT_EQ(line_of(main, "WAIT FOR CC_NEW OR CC_LEAVE OR (CC_ECHO<>CC_ASK)") + 1,
            line_of(main, "CC_ECHO=CC_ASK"));
  const std::vector<std::string> pass = body(sub, "DEF CELLCAL_SUB");
  EXPECT_LT(line_of(pass, "CC_PROVE ( )"), line_of(pass, "CC_SEND ( )"));
}

TEST(EkiFiles, ReturnToCellWhereTheSessionEndsOrNoneComes) {
  EkiFilesConfig config;
  config.cell_wait_s = 60;
  const ControllerFiles files = eki_files(config);
  const std::string& sub = files.at("cellcal_sub.sub");
  const std::vector<std::string> part = body(sub, "DEF CC_PART");
  EXPECT_LT(line_of(part, "CC_LEAVE=CC_CALLED"), line_of(part, "CC_SESSION=0"));
  for (const char* head : {"DEF CC_LINK", "DEF CC_READ"}) line_of(body(sub, head), "CC_PART ( )");
  line_of(body(sub, "DEF CC_PROVE"), "IF $TIMER[10]-CC_IDLE>60000 THEN");
  const std::vector<std::string> main = body(files.at("cellcal_eki.src"), "DEF CELLCAL_EKI");
  const std::size_t left = line_of(main, "UNTIL CC_LEAVE AND (CC_NEW==FALSE)");
  EXPECT_EQ(line_of(main, "CC_READY=FALSE", left), left + 1);
  EXPECT_LT(line_of(main, "CC_LEAVE=FALSE"), line_of(main, "CC_READY=TRUE"));
}

TEST(EkiFiles, StartNothingUnlessPermittedInExtAndWithNothingSelected) {
  EkiFilesConfig config;
  EXPECT_NE(eki_files(config).at("cellcal_eki.dat").find("CC_MAY_RUN=FALSE"), std::string::npos);
  config.may_run = true;
  EXPECT_NE(eki_files(config).at("cellcal_eki.dat").find("CC_MAY_RUN=TRUE"), std::string::npos);
  const std::string sub = eki_files(config).at("cellcal_sub.sub");
  const std::vector<std::string> run = body(sub, "DEF CC_RUN");
  const std::size_t refused =
      line_of(run, "IF (CC_MAY_RUN==FALSE) OR ($EXT==FALSE) OR (CC_BUSY==TRUE) THEN");
  EXPECT_EQ(run.at(refused + 1), "RETURN");
  const std::size_t free = line_of(run, "IF $PRO_STATE1==#P_FREE THEN");
  EXPECT_EQ(run.at(free + 1), "CWRITE ($CMD,STAT,MODE,\"RUN/R1/CELLCAL_EKI()\")");
  EXPECT_LT(refused, free);
  std::size_t starts = 0;
  for (std::size_t at = sub.find("\"RUN/"); at != std::string::npos;
       at = sub.find("\"RUN/", at + 1))
    ++starts;
  EXPECT_EQ(starts, 1u);
}

TEST(EkiFiles, TellWhatTheControllerAsksForByTheConfiguredOutputsAlone) {
  EkiFilesConfig config;
  EXPECT_EQ(eki_files(config).at("cellcal_sub.sub").find("$OUT["), std::string::npos);
  config.brake_test_output = 12;
  config.collision_output = 14;
  const std::vector<std::string> asked =
      body(eki_files(config).at("cellcal_sub.sub"), "DEFFCT INT CC_REQUEST");
  const std::size_t brake = line_of(asked, "IF $OUT[12]==TRUE THEN");
  const std::size_t collision = line_of(asked, "IF $OUT[14]==TRUE THEN");
  EXPECT_EQ(asked.at(brake + 1), "ASKED=1");
  EXPECT_EQ(asked.at(collision + 1), "ASKED=3");
  EXPECT_LT(brake, collision) << "a collision hides the others";
}

TEST(EkiFiles, ClearTheChannelOnlyWhereItHasBeenOpen) {
  const std::string sub = eki_files({}).at("cellcal_sub.sub");
  for (const std::string& line : body(sub, "DEF CC_OPEN")) {
    EXPECT_EQ(line.find("EKI_Clear"), std::string::npos) << "shouts at every cold start";
  }
  const std::vector<std::string> link = body(sub, "DEF CC_LINK");
  EXPECT_LT(line_of(link, "CC_CLEAR ( )"), line_of(link, "CC_OPEN ( )"));
}

TEST(EkiFiles, LookEveryThreeSecondsWhetherTheChannelIsStillThere) {
  EkiFilesConfig config;
  const std::string sub = eki_files(config).at("cellcal_sub.sub");
  line_of(body(sub, "DEF CELLCAL_SUB"), "CC_LOOK ( )");
  const std::vector<std::string> look = body(sub, "DEF CC_LOOK");
  const std::size_t lost = line_of(look, "IF RET.Msg_No<>0 THEN");
  EXPECT_LT(line_of(look, "IF CC_LOOKS<150 THEN"), lost) << "states of 20 ms";
  EXPECT_EQ(line_of(look, "RET=EKI_CheckBuffer("), lost - 1);
  EXPECT_LT(lost, line_of(look, "RET=EKI_Init("));
  EXPECT_LT(line_of(look, "RET=EKI_Init("), line_of(look, "RET=EKI_Open("));
}

TEST(EkiFiles, LeaveTimeToOtherSubmitProgramsAndReturnToTheOneThatCalls) {
  const ControllerFiles files = eki_files({});
  for (const std::string& line : body(files.at("cellcal_sub.sub"), "DEF CELLCAL_SUB")) {
    EXPECT_NE(line, "LOOP") << "sps.sub calls it, and has other things to do";
  }
  const std::vector<std::string> pass = body(files.at("cellcal_sub.sub"), "DEF CELLCAL_SUB");
  EXPECT_EQ(line_of(pass, "IF CC_SESSION==0 THEN") + 1, line_of(pass, "WAIT SEC 0.012"))
      << "where nobody is obeyed, and never where a stop telegram may come";
  EXPECT_LT(line_of(pass, "CC_TIME ( )"), line_of(pass, "CC_LINK ( )"));
  const std::vector<std::string> loop = body(files.at("cellcal_loop.sub"), "DEF CELLCAL_LOOP");
  EXPECT_LT(line_of(loop, "CELLCAL_SUB ( )"), line_of(loop, "WAIT SEC"));
}

TEST(EkiFiles, NameNothingLikeAWordOfKrl) {
  const std::set<std::string> taken{"ON", "OFF", "PATH", "STATE", "STOP", "MODE", "DELAY"};
  const ControllerFiles files = eki_files({});
  for (const auto& [name, text] : files) {
    if (name.ends_with(".xml")) continue;
    for (const std::string& line : code_lines(text)) {
      std::smatch match;
      if (!std::regex_search(line, match, std::regex("^DECL (?:GLOBAL )?\\w+ (\\w+)"))) continue;
      // MODE of MODUS_T has this name in KUKA's own examples of CWRITE.
      if (line.find("MODUS_T") != std::string::npos) continue;
      EXPECT_EQ(taken.count(match[1]), 0u) << line;
    }
  }
}

TEST(EkiFiles, NeverMoveByIncrementsNorFromTheSubmitProgram) {
  const ControllerFiles files = eki_files({});
  for (const std::string& word : krl::identifiers(all({{"src", files.at("cellcal_eki.src")}}))) {
    EXPECT_TRUE(word.find("_REL") == std::string::npos) << word;
  }
  for (const std::string& word :
       krl::identifiers(files.at("cellcal_sub.sub") + files.at("cellcal_loop.sub"))) {
    EXPECT_TRUE(word != "PTP" && word != "LIN" && word != "CIRC" && word != "SPTP") << word;
  }
}

TEST(EkiFiles, TakeTheNumbersOfTheConfiguration) {
  const std::string source = eki_files(two_external()).at("cellcal_eki.src");
  for (const char* part : {"$TOOL=TOOL_DATA[3]", "$BASE=BASE_DATA[4]", "$LOAD=LOAD_DATA[5]",
                           "WHEN $IN[17]==TRUE", "CC_TARGET.E2<=$SOFTP_END[8]"}) {
    EXPECT_NE(source.find(part), std::string::npos) << part;
  }
  EXPECT_NE(eki_files({}).at("cellcal_eki.src").find("$TOOL=$NULLFRAME"), std::string::npos);
}

TEST(EkiFiles, SetWhatAnotherProgramMayHaveLeftOfEveryAxisTheyMove) {
  const std::string source = eki_files(two_external()).at("cellcal_eki.src");
  const std::vector<std::string> main = body(source, "DEF CELLCAL_EKI");
  for (const char* left : {"$TOOL=", "$BASE=", "$LOAD=", "$IPO_MODE=", "$ORI_TYPE=", "$VEL={CP ",
                           "$ACC={CP ", "$ADVANCE="})
    EXPECT_LT(line_of(main, left), line_of(main, "PTP $AXIS_ACT_MEAS")) << left;
  const std::vector<std::string> move = body(source, "DEF CC_MOVE");
  const std::size_t motion = std::min(line_of(move, "PTP CC_TARGET"), line_of(move, "LIN GOAL"));
  for (const char* speed : {"$VEL_AXIS[I]=CC_PERCENT", "$ACC_AXIS[I]=50",
                            "$VEL_EXTAX[I]=CC_PERCENT", "$ACC_EXTAX[I]=50"})
    EXPECT_LT(line_of(move, speed), motion) << speed;
  EXPECT_LT(line_of(move, "FOR I=1 TO 2"), line_of(move, "$VEL_EXTAX[I]"));
  EXPECT_EQ(all(eki_files({})).find("EXTAX"), std::string::npos) << "there is none to set";
}

TEST(EkiFiles, AreRefusedByTheKeyThatIsWrong) {
  const std::pair<const char*, std::function<void(EkiFilesConfig&)>> cases[] = {
      {"address", [](EkiFilesConfig& c) { c.address = "krc"; }},
      {"address", [](EkiFilesConfig& c) { c.address = ""; }},
      {"address", [](EkiFilesConfig& c) { c.address = "</IP>"; }},
      {"port", [](EkiFilesConfig& c) { c.port = 0; }},
      {"external_axes", [](EkiFilesConfig& c) { c.external_axes = 7; }},
      {"input", [](EkiFilesConfig& c) { c.input = 0; }},
      {"tool", [](EkiFilesConfig& c) { c.tool = -1; }},
      {"load", [](EkiFilesConfig& c) { c.load = 1000; }},
      {"acceleration_percent", [](EkiFilesConfig& c) { c.acceleration_percent = 0; }},
      {"stop_flag", [](EkiFilesConfig& c) { c.stop_flag = c.alive_flag; }},
      {"first_timer", [](EkiFilesConfig& c) { c.first_timer = 63; }},
      {"first_interrupt", [](EkiFilesConfig& c) { c.first_interrupt = 1; }},
      {"first_interrupt", [](EkiFilesConfig& c) { c.first_interrupt = 38; }},
      {"first_interrupt", [](EkiFilesConfig& c) { c.first_interrupt = 79; }},
      {"first_interrupt", [](EkiFilesConfig& c) { c.first_interrupt = 127; }},
      {"dead_man_ms", [](EkiFilesConfig& c) { c.dead_man_ms = 5000; }},
      {"cell_wait_s", [](EkiFilesConfig& c) { c.cell_wait_s = 0; }},
      {"collision_output", [](EkiFilesConfig& c) { c.collision_output = 9000; }},
  };
  for (const auto& [key, spoil] : cases) {
    EkiFilesConfig config;
    spoil(config);
    try {
      eki_files(config);
      ADD_FAILURE() << key << " was accepted";
    } catch (const ConfigError& error) {
      EXPECT_NE(std::string(error.what()).find(key), std::string::npos) << error.what();
    }
  }
}

TEST(KrlTemplate, FillsPlacesAndDropsLinesThatAreFilledWithNothing) {
  EXPECT_EQ(krl::fill("a @B@ /@A1 @Bb\n@EMPTY@\nc\n", {{"B", "x"}, {"EMPTY", ""}}),
            "a x /@A1 @Bb\r\nc\r\n");
  EXPECT_EQ(krl::fill("@B@\n", {{"B", "1\n2"}}), "1\r\n2\r\n");
  EXPECT_THROW(krl::fill("@NO@\n", {}), std::logic_error);
}

TEST(KrlTemplate, RepeatsSuccessiveLinesOfAListForEachItem) {
  const krl::Lists lists = {{"AXIS", {{{"NAME", "A1"}}, {{"NAME", "A2"}, {"B", "y"}}}},
                            {"ONCE", krl::once_if(true)},
                            {"NEVER", krl::once_if(false)}};
  const auto filled = [&](const char* text) { return krl::fill(text, {{"B", "x"}}, lists); };
  EXPECT_EQ(filled("a\n@*AXIS@<@@NAME@\n@*AXIS@@B@>\nb\n"),
            "a\r\n<@A1\r\nx>\r\n<@A2\r\ny>\r\nb\r\n");
  EXPECT_EQ(filled("@*AXIS@@NAME@\n@*@\n@*AXIS@@B@\n"), "A1\r\nA2\r\nx\r\ny\r\n") << "two blocks";
  EXPECT_EQ(filled("@*NEVER@a\n@*ONCE@\n@*ONCE@b@B@\n"), "\r\nbx\r\n");
  EXPECT_THROW(filled("@*NO@a\n"), std::logic_error);
}

}  // namespace
}  // namespace cellcal::drivers
