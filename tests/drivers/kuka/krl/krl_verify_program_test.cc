// Programs in a folder against the generated ones: what an edit must not change, and what it may.

#include <functional>

#include "drivers/kuka/krl/krl_files.h"
#include "tests/drivers/kuka/krl/krl_verdict.h"

namespace cellcal::drivers {
namespace {

struct Edit {
  const char *file, *from, *to, *words;
};

bool is_program(const std::string& name) {
  return name.ends_with(".src") || name.ends_with(".sub") || name.ends_with(".dat");
}

std::string every(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = text.find(from); at != std::string::npos;
       at = text.find(from, at + to.size()))
    text.replace(at, from.size(), to);
  return text;
}

/// A transformation of each character outside of strings and comments.
std::string outside_strings(std::string text, int (*change)(int)) {
  bool quoted = false, comment = false;
  for (char& c : text) {
    quoted = (c == '"') != quoted;
    comment = c == ';' || (comment && c != '\n');
    if (!quoted && !comment) c = static_cast<char>(change(static_cast<unsigned char>(c)));
  }
  return text;
}

using Change = std::function<std::string(const std::string&)>;

/// Edits that change nothing for the controller.
const std::pair<const char*, Change> kHarmless[] = {
    {"none", [](const auto& text) { return text; }},
    {"LF alone", [](const auto& text) { return every(text, "\r", ""); }},
    {"heads",
     [](const auto& text) {
       return "&ACCESS RVO1\r\n&REL 39\r\n&PARAM DISKPATH = KRC:\\R1\\Program\r\n" + text;
     }},
    {"no head", [](const auto& text) { return text.substr(text.find("DEF")); }},
    {"fold comments",
     [](const auto& text) { return every(text, ";FOLD", ";FOLD ;%{PE}%MKUKATPBASIS ; was"); }},
    {"no comments",
     [](const auto& text) { return every(every(text, ";FOLD", ";"), ";ENDFOLD", ";"); }},
    {"comments behind statements",
     [](const auto& text) { return every(text, "\r\n", " ;\"2026\r\n"); }},
    {"upper case", [](const auto& text) { return outside_strings(text, std::toupper); }},
    {"lower case", [](const auto& text) { return outside_strings(text, std::tolower); }},
    {"trailing blanks", [](const auto& text) { return every(text, "\r\n", " \t\r\n"); }},
    {"blank lines", [](const auto& text) { return every(text, "\r\n", "\r\n\r\n"); }},
    {"indentation", [](const auto& text) { return every(text, "\n", "\n\t  "); }},
    {"blanks within", [](const auto& text) { return every(every(text, ",", " , "), " (", "("); }},
};

ControllerFiles changed(ControllerFiles files, const Change& change) {
  for (auto& [name, text] : files)
    if (is_program(name)) text = change(text);
  return files;
}

TEST(EkiPrograms, FitWhereNothingDiffersForTheController) {
  EkiFilesConfig with_everything;
  with_everything.external_axes = 2;
  with_everything.write_frames = with_everything.write_advice = true;
  with_everything.may_run = true;
  with_everything.tool = 3;
  for (const EkiFilesConfig& config : {EkiFilesConfig{}, with_everything})
    for (const auto& [what, change] : kHarmless)
      EXPECT_EQ(all(verify_eki_files(changed(eki_files(config), change), config)), "") << what;
}

TEST(RsiProgram, FitsWhereNothingDiffersForTheController) {
  RsiFilesConfig ranges = rsi_config(), space = rsi_config(), track = rsi_config();
  ranges.ranges_deg.assign(6, {-170.0, 170.0});
  space.space.on = true;
  track.external_axes = 1;
  track.external = {{-500.0, 2500.0, true}};
  for (const RsiFilesConfig& config :
       {rsi_config(3), rsi_config(4), rsi_config(6), ranges, space, track})
    for (const auto& [what, change] : kHarmless)
      EXPECT_EQ(verdict(changed(rsi_files(config), change), config), "")
          << what << ", RSI " << config.rsi_version;
}

TEST(EkiPrograms, FitWithTheValuesThatTheControllerWritesIntoTheirDataList) {
  ControllerFiles files = eki_files({});
  replace(files, "cellcal_eki.dat", "CC_SESSION=0", "CC_SESSION=815");
  replace(files, "cellcal_eki.dat", "CC_READY=FALSE", "CC_READY=TRUE");
  replace(files, "cellcal_eki.dat", "{A1 0.0,A2 -90.0", "{A1 12.5,A2 -70.25");
  replace(files, "cellcal_eki.dat", "CC_NAME[]=\" \"", "CC_NAME[]=\"CELLCAL_EKI\"");
  EXPECT_EQ(all(verify_eki_files(files, {})), "");
  replace(files, "cellcal_eki.dat", "CC_MAY_RUN=FALSE", "CC_MAY_RUN=TRUE");
  EXPECT_NE(all(verify_eki_files(files, {})).find("\"DECL GLOBAL BOOL CC_MAY_RUN=TRUE\" instead"),
            std::string::npos);
}

TEST(EkiPrograms, AreRefusedWhereStopOrContactDiffer) {
  constexpr const char *kMain = "cellcal_eki.src", *kSub = "cellcal_sub.sub";
  const Edit edits[] = {
      {kMain, "INTERRUPT DECL 20", ";INTERRUPT DECL 20",
       "no statement instead of \"INTERRUPT DECL 20 WHEN $IN[1]==TRUE DO CC_ON_INPUT()\""},
      {kMain, "WHEN $IN[1]", "WHEN $IN[5]", "\"INTERRUPT DECL 20 WHEN $IN[5]==TRUE"},
      {kMain, "  IF CC_GUARD==1 THEN", "  IF CC_GUARD==2 THEN", "\"IF CC_GUARD==2 THEN\" instead"},
      {kMain, "    BRAKE\r\n", "", "no statement instead of \"BRAKE\""},
      {kMain, "  RESUME", "  ;RESUME", "no statement instead of \"RESUME\""},
      {kMain, "  INTERRUPT ON 21", "  RETURN\r\n  INTERRUPT ON 21",
       "\"RETURN\" instead of no statement"},
      {kMain, "  OK=TRUE\r\n", "  RETURN (TRUE)\r\n", "\"RETURN(TRUE)\" instead of \"OK=TRUE\""},
      {kMain, "  RETURN (OK)", "  OK=TRUE\r\n  RETURN (OK)", "\"OK=TRUE\" instead of no statement"},
      {kMain, "$SOFTP_END[2]", "$SOFTP_END[3]", "$SOFTP_END[3])\" instead of"},
      {kMain, "  CC_OUT=2", "  CC_OUT=1", "\"CC_OUT=1\" instead of \"CC_OUT=2\""},
      {kMain, "$ADVANCE=0", "$ADVANCE=3", "\"$ADVANCE=3\""},
      {kMain, "$TOOL=$NULLFRAME", "$TOOL=TOOL_DATA[2]", "\"$TOOL=TOOL_DATA[2]\""},
      {kMain, "$ACC={CP 0.5", "$ACC={CP 0.01", "\"$ACC={CP 0.01,"},
      {kMain, "      CC_MOVE ( )", "      CC_BUSY=FALSE\r\n      CC_MOVE ( )", "\"CC_BUSY=FALSE\""},
      {kSub, "    CC_START ( )", "", "no statement instead of \"CC_START()\""},
      {kSub, "Latch/@A2\",CC_LATCH.A2", "Latch/@A2\",CC_LATCH.A1", "CC_LATCH.A1)\" instead of"},
      {kSub, "$FLAG[902]=TRUE", "$FLAG[903]=TRUE", "\"$FLAG[903]=TRUE\" instead of"},
      {kSub, "  CC_WATCH ( )", "", "no statement instead of \"CC_WATCH()\""},
      {kSub, "  CC_READ ( )", "  IF $T1 THEN\r\n  CC_READ ( )\r\n  ENDIF",
       "\"IF $T1 THEN\" instead of no statement"},
      {kSub, "      CASE 4", "      CASE 9", "\"CASE 9\" instead of \"CASE 4\""},
      {kSub, "=-250", "=-9250", "\"$TIMER[12]=-9250\" instead of \"$TIMER[12]=-250\""},
      {"cellcal_loop.sub", "WAIT SEC 0.012", "WAIT SEC 12", "\"WAIT SEC 12\""},
  };
  for (const Edit& one : edits) {
    ControllerFiles files = eki_files({});
    replace(files, one.file, one.from, one.to);
    const std::string said = all(verify_eki_files(files, {}));
    EXPECT_NE(said.find(one.words), std::string::npos) << one.words << "\nsaid: " << said;
    EXPECT_EQ(said.rfind("refused ", 0), 0u) << one.words << "\nsaid: " << said;
  }
}

TEST(EkiPrograms, AreRefusedByEachStatementWithTheWrongInput) {
  ControllerFiles files = eki_files({});
  std::string& program = files.at("cellcal_eki.src");
  program = every(program, "$IN[1]", "$IN[5]");
  const std::vector<FileFinding> found = verify_eki_files(files, {});
  EXPECT_EQ(found.size(), 3u) << all(found);
  for (const FileFinding& one : found) EXPECT_TRUE(one.refused) << to_string(one);
  EXPECT_EQ(found.at(0).line, 35);
}

TEST(EkiPrograms, MaskNoOtherDifferenceByTheFirst) {
  ControllerFiles files = eki_files({});
  replace(files, "cellcal_sub.sub", "&REL 1", "&REL 1\r\n&PARAM EDITMASK = *");
  replace(files, "cellcal_sub.sub", "CC_PASS=SINCE", "CC_PASS=0");
  replace(files, "cellcal_sub.sub", "$FLAG[902]=TRUE", "$FLAG[903]=TRUE");
  const std::string said = all(verify_eki_files(files, {}));
  EXPECT_EQ(said.rfind("refused cellcal_sub.sub:", 0), 0u) << said;
  EXPECT_NE(said.find("warned cellcal_sub.sub:"), std::string::npos) << said;
  EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 2) << said;
}

TEST(EkiPrograms, ThatDifferInWhatAUserMayChangeAreAWarning) {
  const Edit edits[] = {
      {"cellcal_eki.src", "  PTP $AXIS_ACT_MEAS", "  PTP XHOME", "\"PTP XHOME\" instead of"},
      {"cellcal_eki.src", "  CC_FAULT=0", "  MsgNotify(\"stop; cellcal\")",
       "\"MSGNOTIFY(\"stop; cellcal\")\" instead of \"CC_FAULT=0\""},
      {"cellcal_eki.src", "$ORI_TYPE=#VAR", "$OUT[9]=TRUE\r\n  $ORI_TYPE=#VAR",
       "\"$OUT[9]=TRUE\" instead of no statement"},
      {"cellcal_sub.sub", "KNOWN=(VARSTATE(\"$POS_ACT\")==#INITIALIZED)", "KNOWN=FALSE",
       "\"KNOWN=FALSE\" instead of \"KNOWN=(VARSTATE("},
  };
  for (const Edit& one : edits) {
    ControllerFiles files = eki_files({});
    replace(files, one.file, one.from, one.to);
    const std::string said = all(verify_eki_files(files, {}));
    EXPECT_NE(said.find(one.words), std::string::npos) << one.words << "\nsaid: " << said;
    EXPECT_EQ(said.find("refused"), std::string::npos) << said;
  }
}

TEST(EkiPrograms, AreQuotedWhereTheyDiffer) {
  ControllerFiles files = eki_files({});
  replace(files, "cellcal_sub.sub", "\"RobotState/Status/@Override\",$OV_PRO",
          "\"RobotState/Status/@Override\",$OV_JOG");
  EXPECT_NE(
      all(verify_eki_files(files, {}))
          .find("\"...atus/@Override\",$OV_JOG)\" instead of \"...atus/@Override\",$OV_PRO)\""),
      std::string::npos)
      << all(verify_eki_files(files, {}));
}

TEST(EkiPrograms, ThatAreAltogetherOthersAreRefusedInAFewWords) {
  for (const std::size_t lines : {std::size_t{0}, std::size_t{700}, std::size_t{500'000}}) {
    ControllerFiles files = eki_files({});
    std::string& program = files.at("cellcal_sub.sub");
    program.clear();
    for (std::size_t i = 0; i < lines; ++i) program += "A=1\n";
    const std::vector<FileFinding> found = verify_eki_files(files, {});
    ASSERT_FALSE(found.empty());
    EXPECT_TRUE(found.front().refused);
    EXPECT_LE(found.size(), 11u) << all(found);
  }
}

TEST(RsiProgram, IsRefusedWhereTheFenceDiffers) {
  const auto cut = [](std::string text, const char* from, const char* to) {
    const std::size_t at = text.find(from);
    return text.erase(at, text.find(to, at) - at);
  };
  const std::pair<Change, const char*> edits[] = {
      {[&](const auto& text) { return cut(text, "  IF CC_FENCE(", "  RET=RSI_ON"); },
       "CC_FENCE is not called before RSI_ON"},
      {[](const auto& text) { return every(text, "SOFT-HERE<LIMIT", "SOFT-HERE>LIMIT"); },
       "\"IF SOFT-HERE>LIMIT THEN\" instead of \"IF SOFT-HERE<LIMIT THEN\""},
      {[](const auto& text) { return every(text, "\"UpperLimA2\"", "\"UpperLimA1\""); },
       "no call sets UpperLimA2 of AxisCorr_1"},
      {[](const auto& text) {
         const std::size_t kept = text.find("RET=RSI_SetPublicPar") + 1;
         return text.substr(0, kept) +
                every(text.substr(kept), "RET=RSI_SetPublicPar", ";RET=RSI_SetPublicPar");
       },
       "no call sets UpperLimA1 of AxisCorr_1"},
      {[](const auto& text) { return every(text, "OK=OK AND (RET==RSIOK) AND (LIMIT<=0.0)", ""); },
       "no statement instead of \"OK=OK AND(RET==RSIOK)AND(LIMIT<=0.0)\""},
      {[](const auto& text) { return every(text, "  RETURN (OK)", "  RETURN (TRUE)"); },
       "\"RETURN(TRUE)\" instead of \"RETURN(OK)\""},
      {[](const auto& text) { return every(text, "LIMIT=-90.0", "LIMIT=90.0"); },
       "\"LIMIT=\" instead of \"LIMIT=-\""},
      {[](const auto& text) { return every(text, "\"cellcal_rsi\",CONTID", "\"own\",CONTID"); },
       "\"RET=RSI_CREATE(\"own\",CONTID,TRUE)\" instead of"},
      {[](const auto& text) { return every(text, "  RET=RSI_OFF()", "  RET=RSIOK"); },
       "\"RET=RSIOK\" instead of \"RET=RSI_OFF()\""},
  };
  for (const auto& [change, words] : edits) {
    const std::string said = verdict(changed(rsi_files(rsi_config()), change), rsi_config());
    EXPECT_NE(said.find(words), std::string::npos) << words << "\nsaid: " << said;
    EXPECT_EQ(said.rfind("refused cellcal_rsi.src:", 0), 0u) << words << "\nsaid: " << said;
  }
}

TEST(RsiProgram, ThatLacksARangeOfOneAxisIsRefused) {
  RsiFilesConfig config = rsi_config();
  config.ranges_deg.assign(6, {-170.0, 170.0});
  ControllerFiles files = rsi_files(config);
  replace(files, "cellcal_rsi.src", "$SOFTN_END[3],-170.1", "$SOFTN_END[3],$SOFTN_END[3]");
  EXPECT_EQ(verdict(files, config).rfind("refused cellcal_rsi.src:", 0), 0u)
      << verdict(files, config);
}

TEST(RsiProgram, ThatDiffersInWhatAUserMayChangeIsAWarning) {
  const Edit edits[] = {
      {"", "  PTP $AXIS_ACT_MEAS", "  PTP XHOME", "\"PTP XHOME\" instead of"},
      {"", "  RET=RSI_RESET()\r\n", "", "no statement instead of \"RET=RSI_RESET()\""},
      {"", "(#ABSOLUTE,#IPO_FAST)", "(#ABSOLUTE)", "\"RET=RSI_ON(#ABSOLUTE)\" instead of"},
      {"", "$LOAD={M -1.0", "$LOAD={M 20.5", "\"$LOAD={M 20.5"},
  };
  for (const Edit& one : edits) {
    ControllerFiles files = rsi_files(rsi_config());
    replace(files, "cellcal_rsi.src", one.from, one.to);
    const std::string said = verdict(files, rsi_config());
    EXPECT_EQ(said.rfind("warned cellcal_rsi.src:", 0), 0u) << said;
    EXPECT_NE(said.find(one.words), std::string::npos) << one.words << "\nsaid: " << said;
  }
}

TEST(RsiProgram, OfAnotherNameNeedsTheFenceToo) {
  ControllerFiles files = rsi_files(rsi_config());
  files["own.src"] = every(files.at("cellcal_rsi.src"), "IF CC_FENCE(CONTID)==FALSE", "IF FALSE");
  files.erase("cellcal_rsi.src");
  const std::string said = verdict(files, rsi_config());
  EXPECT_NE(said.find("refused own.src:"), std::string::npos) << said;
  EXPECT_NE(said.find("CC_FENCE is not called before RSI_ON"), std::string::npos) << said;
}

TEST(RsiProgram, IsReadWithAnyStatement) {
  for (const char* text : {"LIMIT=CC_\n", "LIMIT=CC_LOW(1,2\n", "DEF \nDEFFCT (\n", "\"\n;\n&\n"}) {
    ControllerFiles files = rsi_files(rsi_config());
    files.at("cellcal_rsi.src") = "DEFFCT BOOL CC_FENCE (\n" + std::string(text);
    EXPECT_NE(verdict(files, rsi_config()).find("refused"), std::string::npos) << text;
  }
}

}  // namespace
}  // namespace cellcal::drivers
