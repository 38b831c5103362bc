// Effect of a program's calls on its frames and postures.

#include <gtest/gtest.h>

#include "tests/daemon/krl/fixture.h"

namespace cellcal::daemon::testing {
namespace {

using krl::Why;

constexpr const char* kFramesSet = "BAS(#TOOL,1)\nBAS(#BASE,0)\nPTP XP1\n";

krl::CorrectedProgram correct_calling(const std::string& between,
                                      std::vector<krl::KrlFile> modules = {},
                                      std::vector<std::string> still = {}) {
  static const auto points = postures(1);
  krl::ProgramFiles f;
  f.src = {"p.src", "DEF P()\n" + std::string(kFramesSet) + between + "\nLIN XP1\nEND\n"};
  f.dat = krl::KrlFile{"p.dat", "DECL E6POS XP1=" + pose_text(points[0]) + "\n"};
  f.controller = {{"$config.dat", "TOOL_DATA[1]={X 59.9,Y 50.5,Z 410.3,A 38.84,B 3.59,C 0.0}\n"}};
  f.modules = std::move(modules);
  krl::CorrectionOptions options;
  options.still = std::move(still);
  return correct_program(calibration(), f, options);
}

TEST(ACallOfKukasInlineForms, LeavesFramesAndPostureKnown) {
  for (const char* call :
       {"SET_CD_PARAMS (0)", "$COLLMON_TOL_PRO[1] = USE_CM_PRO_VALUES(0)", "set_cd_params(0)",
        "TRIGGER WHEN DISTANCE=1 DELAY=ArcGetDelay(#PreDefinition,WDAT1) DO "
        "ArcMainNG(#PreDefinition,WDAT1,WP2) PRIO=-1",
        "USER_GRP(1,DMY[])", "GRPg_Check(1,2,FALSE,1)", "MsgNotify(\"a\",\"b\")",
        "B=VARSTATE(\"X\")==#DEFINED", "RET=EKI_SetReal(\"C\",\"E/X\",1.0)",
        "RET=RSI_ON(#ABSOLUTE)", "PULSE($OUT[1],TRUE,0.5)", "CWRITE($CMD,STAT,MODE,\"RUN\")"})
    EXPECT_EQ(all_words(correct_calling(call)), "") << call;
}

TEST(AnUnknownCall, IsNamedWithItsLine) {
  const auto result = correct_calling("CLAMP(1)");
  ASSERT_EQ(result.refusals.size(), 1U);
  EXPECT_EQ(result.refusals[0].why, Why::kToolNotKnown);
  EXPECT_EQ(result.refusals[0].lost.what, "CLAMP");
  EXPECT_EQ(result.refusals[0].lost.line, 5);
  EXPECT_NE(all_words(result).find("unknown since CLAMP in line 5"), std::string::npos)
      << all_words(result);
  EXPECT_EQ(all_words(correct_calling("CLAMP(1)", {}, {"CLAMP"})), "");
}

TEST(AMotionOfRsi, LeavesTheFramesAndNotThePosture) {
  const auto result = correct_calling("RET=RSI_MOVECORR()");
  ASSERT_EQ(result.refusals.size(), 1U);
  EXPECT_EQ(result.refusals[0].why, Why::kPostureNotKnown);
  EXPECT_EQ(result.refusals[0].lost.what, "RSI_MOVECORR");
}

TEST(ABodyThatIsGiven, SaysWhatItsCallDoes) {
  const krl::KrlFile still{"clamp.src",
                           "DEF Clamp(N:IN)\nINT N\n$OUT[N]=TRUE\nHELP()\nEND\n"
                           "DEF HELP()\nWAIT SEC 0.1\nEND\n"};
  EXPECT_EQ(all_words(correct_calling("CLAMP(1)", {still})), "");
  EXPECT_EQ(correct_calling("HELP()", {still}).refusals.size(), 1U);  // local to its module
  const krl::KrlFile global{"lib.src",
                            "DEF LIB()\nEND\nGLOBAL DEF CLAMP(N:IN)\n$OUT[N]=TRUE\nEND\n"};
  EXPECT_EQ(all_words(correct_calling("CLAMP(1)", {global})), "");
  for (const char* body : {"PTP XHOME", "$BASE=BASE_DATA[2]", "FDAT_ACT=FP1", "OTHER()",
                           "BAS(#INITMOV,0)", "LIN_REL {Z 1}"}) {
    const krl::KrlFile moving{"clamp.src", std::string("DEF CLAMP()\n") + body + "\nEND\n"};
    EXPECT_FALSE(correct_calling("CLAMP()", {moving}).refusals.empty()) << body;
  }
}

TEST(ABodyThroughOthers, DoesWhatTheyDo) {
  std::vector<krl::KrlFile> chain;
  for (int i = 0; i < 50; ++i)
    chain.push_back(
        {"c" + std::to_string(i) + ".src",
         "DEF C" + std::to_string(i) + "()\nC" + std::to_string((i + 1) % 50) + "()\nEND\n"});
  EXPECT_EQ(all_words(correct_calling("C0()", chain)), "");  // recursive
  chain[30].text = "DEF C30()\n$TOOL=$NULLFRAME\nEND\n";
  EXPECT_FALSE(correct_calling("C0()", chain).refusals.empty());
}

TEST(ABodyThatChangesAToolOrBaseOfTheController, IsSeen) {
  const krl::KrlFile module{"setup.src", "DEF SETUP()\nTOOL_DATA[1].X=5\nEND\n"};
  const auto result = correct_calling("SETUP()", {module});
  ASSERT_FALSE(result.refusals.empty());
  EXPECT_EQ(result.refusals[0].why, Why::kFrameChanged);
}

TEST(AModuleBesideThatIsNotCalled, ChangesAToolOfTheController) {
  const krl::KrlFile other{"main.src", "DEF MAIN()\nTOOL_DATA[1].X=5\nP()\nEND\n"};
  const auto result = correct_calling("", {other});
  ASSERT_EQ(result.refusals.size(), 1U);
  EXPECT_EQ(result.refusals[0].why, Why::kFrameChanged);
  EXPECT_EQ(result.refusals[0].lost.what, "main.src");
  EXPECT_EQ(result.refusals[0].lost.line, 2);
  EXPECT_EQ(all_words(correct_calling("", {other}, {"MAIN"})), "") << "stated by the user";
  const auto warned = correct_calling("", {{"main.src", "DEF MAIN()\nTOOL_DATA[N].X=5\nEND\n"}});
  EXPECT_EQ(all_words(warned), "");
  EXPECT_EQ(warned.warnings.size(), 1U);
}

TEST(ARoutineElsewhereThatMoves, IsNamedAsNotCorrected) {
  const auto warned = [](const std::string& body, const std::vector<krl::KrlFile>& modules,
                         const std::vector<std::string>& still = {}) {
    const krl::KrlFile config{
        "$config.dat", "DECL E6AXIS XHOME={A1 0.0,A2 -90.0,A3 90.0,A4 0.0,A5 10.0,A6 0.0}\n"};
    const krl::BackupFiles f{
        {{{"p.src", "DEF p()\n" + body + "END\n"}, {}, {}, modules}}, {}, {config}};
    std::string all;
    for (const calib::Phrase& one : uncorrected_callees(f, still)) all += calib::words(one) + "\n";
    return all;
  };
  const krl::KrlFile place{"place.src", "DEF place()\nLIN XP9\nEND\n"},
      home{"home.src", "DEF home()\nPTP $AXIS_ACT\nPTP XHOME C_PTP\nEND\n"},
      through{"through.src", "DEF through()\nplace()\nhome()\nEND\n"};
  const std::string named = warned("PLACE()\n", {place});
  EXPECT_NE(named.find("PLACE in place.src, which this program calls, moves and is not corrected"),
            std::string::npos)
      << named;
  EXPECT_EQ(warned("through()\n", {place, home, through}), named) << "through another";
  EXPECT_EQ(warned("IF ABS(place())>1 THEN\nENDIF\nplace()\n", {place}), named) << "once";
  EXPECT_EQ(warned("home()\n", {place, home}), "") << "a home stays";
  EXPECT_NE(warned("away()\n", {{"away.src", "DEF away()\nPTP XHOME7\nEND\n"}}), "") << "its own";
  EXPECT_EQ(warned("", {place}), "") << "not called";
  EXPECT_EQ(warned("PLACE()\n", {place}, {"PLACE"}), "") << "stated not to move";
  EXPECT_EQ(warned("own()\nEND\nDEF own()\nPTP XP1\n", {place}), "") << "corrected with it";
  EXPECT_EQ(warned("IR_STOPM()\n", {{"ir_stopm.src", "DEF ir_stopm()\nPTP XP1\nEND\n"}}), "");
}

TEST(ARoutineThatNoFileHas, IsNamedAtRunTime) {
  const auto warned = [](const std::string& body, const std::vector<std::string>& still = {}) {
    const krl::BackupFiles f{{{{"p.src", "DEF p()\n" + body + "END\n"}, {}, {}, {}}}, {}, {}};
    std::string all;
    for (const calib::Phrase& one : uncorrected_callees(f, still)) all += calib::words(one) + "\n";
    return all;
  };
  EXPECT_NE(warned("go(XP2)\nown()\ngo(XP3)\nEND\nDEF own()\nfetch()\n")
                .find("no given file has: FETCH, GO."),
            std::string::npos);
  EXPECT_EQ(warned("go(XP2)\n", {"GO"}), "") << "stated not to move";
  EXPECT_EQ(warned("MsgNotify(\"a\")\nown()\nEND\nDEF own()\nPTP XP1\n"), "");
}

/// XP2 of a program that calls `body` with it, or an unknown routine.
krl::CorrectedProgram correct_handing_over(const std::string& line, const std::string& body = {},
                                           const krl::CorrectionOptions& options = {}) {
  const auto points = postures(2);
  krl::ProgramFiles f;
  f.src = {"p.src", "DEF P()\n" + line + "\n" + kFramesSet + "END\n" + body};
  f.dat = krl::KrlFile{"p.dat", "DECL E6POS XP1=" + pose_text(points[0]) + "\nDECL E6POS XP2=" +
                                    pose_text(points[1]) + "\nDECL E6POS XP[2]\n"};
  f.controller = {{"$config.dat",
                   "TOOL_DATA[1]={X 59.9,Y 50.5,Z 410.3,A 38.84,B 3.59,C 0.0}\n"
                   "DECL E6AXIS XHOME={A1 0.0,A2 -90.0,A3 90.0,A4 0.0,A5 10.0,A6 0.0}\n"}};
  return correct_program(calibration(), f, options);
}

TEST(APointHandedToARoutine, IsRefusedWhereItMayMoveThere) {
  for (const char* line : {"GO(XP2)", "GO(XP2,5)", "IF GO(XP2) THEN\nENDIF", "GO(XP[1])"}) {
    const auto result = correct_handing_over(line);
    ASSERT_EQ(result.refusals.size(), 1U) << line << all_words(result);
    EXPECT_EQ(result.refusals[0].why, Why::kHandedOver) << line;
    EXPECT_EQ(result.refusals[0].line, 2);
    EXPECT_NE(all_words(result).find("handed to GO, which may move to it"), std::string::npos);
  }
}

TEST(APointHandedToARoutine, StaysWhereNothingMovesThere) {
  EXPECT_EQ(all_words(correct_handing_over("GO(XP2)", "DEF GO(P:IN)\nE6POS P\nWAIT SEC 1\nEND\n")),
            "");
  EXPECT_EQ(all_words(correct_handing_over("GO(XP2)", {}, {.leave = {"XP2"}})), "");
  EXPECT_EQ(all_words(correct_handing_over("GO(XP2)", {}, {.still = {"GO"}})), "");
  EXPECT_EQ(all_words(correct_handing_over("GO(XHOME)")), "") << "a home stays";
  EXPECT_EQ(all_words(correct_handing_over("GO($POS_ACT)")), "");
  EXPECT_EQ(all_words(correct_handing_over("GO(N)")), "") << "no point";
  const auto moved = correct_handing_over("GO(XP1)");
  ASSERT_EQ(moved.refusals.size(), 1U);
  EXPECT_EQ(moved.refusals[0].why, Why::kComputed) << "a motion goes to it, too";
}

TEST(ModulesThatAreNoText, HaveNoRoutines) {
  const krl::KrlFile broken{"clamp.src", std::string("DEF CLAMP()\0END\n", 16)},
      cut{"clamp.src", "DEF"};
  EXPECT_EQ(correct_calling("CLAMP()", {broken}).refusals.size(), 1U);
  EXPECT_EQ(correct_calling("CLAMP()", {cut}).refusals.size(), 1U);
}

}  // namespace
}  // namespace cellcal::daemon::testing
