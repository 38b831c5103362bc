// All modules of a controller corrected together.

#include <gtest/gtest.h>

#include <algorithm>

#include "calib/model/error.h"
#include "tests/daemon/krl/fixture.h"

namespace cellcal::daemon::testing {
namespace {

using krl::CorrectedBackup;
using krl::CorrectedModule;
using krl::Why;

constexpr const char* kConfig =
    "DEFDAT $CONFIG PUBLIC\nDECL E6AXIS XHOME={A1 0.0,A2 -90.0,A3 90.0,A4 0.0,A5 10.0,A6 0.0}\n"
    "TOOL_DATA[1]={X 59.9,Y 50.5,Z 410.3,A 38.84,B 3.59,C 0.0}\n"
    "BASE_DATA[2]={X 10.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0}\n";
/// With another BASE_DATA[2].
std::string config_at_5() {
  std::string config = kConfig;
  return config.replace(config.find("X 10.0"), 6, "X 5.0");
}
constexpr const char* kSetUp = "BAS(#TOOL,1)\nBAS(#BASE,0)\nPTP XHOME\n";

std::string taught_at(std::size_t i) {
  static const auto all = postures(6);
  return pose_text(all.at(i));
}

krl::ProgramFiles module_named(const std::string& name, const std::string& body,
                               const std::string& dat = {}) {
  krl::ProgramFiles one;
  one.src = {name + ".src", "DEF " + name + "()\n" + kSetUp + body + "\nEND\n"};
  if (!dat.empty()) one.dat = krl::KrlFile{name + ".dat", "DEFDAT " + name + " PUBLIC\n" + dat};
  return one;
}

CorrectedBackup corrected_together(std::vector<krl::ProgramFiles> modules,
                                   const std::string& more = {},
                                   const std::string& config = kConfig) {
  krl::BackupFiles files;
  files.modules = std::move(modules);
  files.controller = {{"$config.dat", config + more}};
  return correct_backup(calibration(), files);
}

const CorrectedModule& of(const CorrectedBackup& backup, const std::string& name) {
  return *std::ranges::find_if(
      backup.modules, [&](const CorrectedModule& one) { return one.src == name + ".src"; });
}

std::string why_not(const CorrectedModule& module) {
  std::string all;
  for (const krl::Refusal& one : module.refusals) all += words(one, cell().robot) + "\n";
  return all;
}

std::string text_of_file(const CorrectedBackup& backup, const std::string& name) {
  for (const krl::KrlFile& file : backup.files)
    if (file.name == name) return file.text;
  return {};
}

TEST(KukasMasteringReferences, Stay) {
  const std::string axes = "={A1 20.0,A2 -80.0,A3 80.0,A4 10.0,A5 40.0,A6 0.0}\n";
  const auto result =
      corrected_together({module_named("MasRef_User", "PTP XM", "DECL E6AXIS XM" + axes),
                          module_named("A", "PTP XMMD_ORIGIN")},
                         "DECL E6AXIS XMMD_ORIGIN" + axes);
  EXPECT_TRUE(result.points.empty());
  EXPECT_TRUE(of(result, "MasRef_User").kukas);
  EXPECT_EQ(why_not(of(result, "A")), "");
  auto alone = module_named("MasRef_User", "PTP XM", "DECL E6AXIS XM" + axes);
  alone.controller = {{"$config.dat", kConfig}};
  EXPECT_TRUE(correct_program(calibration(), alone).points.empty());
}

TEST(ABackup, CorrectsPointsOfOtherModulesOfTheConfigurationAndOfArrays) {
  const auto result = corrected_together(
      {module_named("PICK", "PTP XABOVE\nPTP XSLOT[2]\nPTP XPALLET\nPTP XPART.GRAB\nPTP XOWN",
                    "DECL E6POS XOWN=" + taught_at(0) + "\n"),
       module_named("POINTS", "",
                    "DECL GLOBAL E6POS XABOVE=" + taught_at(1) +
                        "\nDECL GLOBAL E6POS XSLOT[3]\nXSLOT[2]=" + taught_at(2) +
                        "\nDECL GLOBAL PART_T XPART={ID 4,GRAB {E6POS: " + taught_at(3).substr(1) +
                        "}\n"),
       module_named("OTHER", "PTP XOWN", "DECL E6POS XOWN=" + taught_at(4) + "\n")},
      "DECL GLOBAL E6POS XPALLET=" + taught_at(5) + "\n");
  EXPECT_EQ(why_not(of(result, "PICK")), "");
  EXPECT_EQ(of(result, "PICK").points, 5);
  EXPECT_EQ(of(result, "OTHER").points, 1);  // its own XOWN
  EXPECT_EQ(result.points.size(), 6U);
  for (const auto& point : result.points) {
    EXPECT_GT(point.shift_mm.norm(), 1e-3) << point.name;
    EXPECT_LT(point.left_mm, 0.02) << point.name;
  }
  for (const char* file : {"PICK.dat", "POINTS.dat", "OTHER.dat", "$config.dat"})
    EXPECT_NE(text_of_file(result, file), "") << file;
  EXPECT_NE(text_of_file(result, "$config.dat").find("XHOME={A1 0.0,A2 -90.0"), std::string::npos);
}

TEST(APointOfAnotherProgram, IsRefusedAloneWithTheRemediesThatWork) {
  const krl::ProgramFiles user = module_named("USER", "PTP XQ"),
                          points = module_named("POINTS", "",
                                                "DECL GLOBAL E6POS XQ=" + taught_at(0) + "\n");
  krl::ProgramFiles alone = user;
  alone.controller = {{"$config.dat", kConfig}};
  const auto refused = correct_program(calibration(), alone);
  ASSERT_EQ(refused.refusals.size(), 1U);
  const std::string why = words(refused.refusals[0], cell().robot);
  for (const char* remedy : {"by --backup", "with --leave", "with --dat"})
    EXPECT_NE(why.find(remedy), std::string::npos) << why;
  EXPECT_EQ(of(corrected_together({user, points}), "USER").points, 1);
  EXPECT_TRUE(correct_program(calibration(), alone, {.leave = {"XQ"}}).refusals.empty());
}

/// A module in tool 1 and base 2, and another with that statement.
CorrectedBackup beside(const std::string& statement, const std::string& name = "OTHER",
                       const std::string& ending = ".src") {
  krl::ProgramFiles other;
  other.src = {name + ending, "DEF " + name + "()\n" + statement + "\nEND\n"};
  return corrected_together(
      {module_named("A", "BAS(#BASE,2)\nPTP XA", "DECL E6POS XA=" + taught_at(0) + "\n"), other});
}

TEST(AFrameThatAnotherModuleChanges, IsRefusedWithThePlace) {
  for (const char* change :
       {"BASE_DATA[2].X=BASE_DATA[2].X+400", "TOOL_DATA[1].Z=7", "FIND(BASE_DATA[2])",
        "TRIGGER WHEN DISTANCE=0 DELAY=0 DO TOOL_DATA[1].X=Y", "IF A THEN TOOL_DATA[1].X=5",
        "R=EKI_GetFrame(\"C\",\"F\",TOOL_DATA[1])", "SREAD(S[],T,O,\"%r\",TOOL_DATA[1].X)",
        "IF FIND(3,(TOOL_DATA[1])) THEN", "B=StrToFrame(S[],BASE_DATA[2])",
        "SET(1,TOOL_DATA[1])\nEND\nDEF SET(N:IN,F:OUT)", "LOAD_DATA[1].M=3", "$ROBROOT.Z=5",
        "MACHINE_FRAME_DAT[2]=X", "MACHINE_DEF[3].ROOT=X"}) {
    for (const char* ending : {".src", ".sub"}) {
      const auto result = beside(change, "OTHER", ending);
      ASSERT_EQ(of(result, "A").refusals.size(), 1U) << change;
      EXPECT_EQ(of(result, "A").refusals[0].why, Why::kFrameChanged) << change;
      EXPECT_NE(why_not(of(result, "A")).find(std::string("changed in OTHER") + ending + ":2."),
                std::string::npos)
          << why_not(of(result, "A"));
    }
    EXPECT_EQ(of(beside(change, "BrakeTestReq", ""), "A").points, 1) << "the controller's own";
  }
}

TEST(AFrameThatAnotherModuleReadsOrThatIsOfAnotherNumber, IsNone) {
  for (const char* use :
       {"BASE_DATA[3].X=5", "TOOL_DATA[2]=X", "$BASE=$WORLD:BASE_DATA[2]", "Y=5+BASE_DATA[2].X",
        "XP=INV_POS(BASE_DATA[2]):XN", "SET($NULLFRAME)", "DECL FRAME BASE_DATA[9]",
        "RET=EKI_SetFrame(\"T\",\"R\",TOOL_DATA[1])", "IF TOOL_DATA[1].Z>3 THEN\nENDIF",
        "IF 5==TOOL_DATA[1].Z THEN\nENDIF", "SWITCH TOOL_DATA[1].Z\nENDSWITCH",
        "IF TOOL_DATA[1].Z==5 THEN\nENDIF", "IF (A AND (LOAD_DATA[1].M<>0)) THEN\nENDIF",
        "R=ABS(TOOL_DATA[1].Z)", "RETURN TOOL_DATA[1]", "CWRITE(H,S,M,\"%r\",BASE_DATA[2].X)",
        "SET(1,TOOL_DATA[1])\nEND\nDEF SET(N:IN,F:IN)", "Q={X TOOL_DATA[1].X}"}) {
    const auto result = beside(use);
    EXPECT_EQ(why_not(of(result, "A")), "") << use;
    EXPECT_TRUE(result.warnings.empty()) << use;
  }
}

TEST(AFrameOfAComputedNumberThatAnotherModuleChanges, IsAWarningWithThePlace) {
  const struct {
    const char *change, *data;
  } cases[] = {{"BASE_DATA[N]=X", "BASE_DATA"},
               {"TOOL_DATA[N].X=5", "TOOL_DATA"},
               {"LOAD_DATA[N].M=5", "LOAD_DATA"}};
  for (const auto& one : cases) {
    const auto result = beside(one.change);
    EXPECT_EQ(of(result, "A").points, 1) << why_not(of(result, "A"));
    ASSERT_EQ(result.warnings.size(), 1U) << one.change;
    EXPECT_NE(words(result.warnings[0]).find(std::string("OTHER.src:2: changes ") + one.data),
              std::string::npos)
        << words(result.warnings[0]);
  }
  EXPECT_TRUE(beside("MACHINE_DEF[N].ROOT=X").warnings.empty()) << "nothing is on a positioner";
  const auto own = corrected_together({module_named("A", "BASE_DATA[N]=X\nBAS(#BASE,2)\nPTP XA",
                                                    "DECL E6POS XA=" + taught_at(0) + "\n")});
  EXPECT_EQ(of(own, "A").refusals.at(0).why, Why::kFrameChanged) << why_not(of(own, "A"));
}

/// As RoboDK's posts begin, with other frames than $config.dat has.
constexpr const char* kStated =
    "BASE_DATA[2] = {FRAME: X 5.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0}\n"
    "TOOL_DATA[7] = {FRAME: X 59.9,Y 50.5,Z 410.3,A 38.84,B 3.59,C 0.0}\n";

krl::ProgramFiles stating(const std::string& head, const std::string& more = {}) {
  krl::ProgramFiles one;
  one.src = {"A.src", "DEF A()\nBAS(#TOOL,0)\nPTP $AXIS_ACT\n" + head +
                          "BAS(#TOOL,7)\nBAS(#BASE,2)\nPTP XA\n" + more + "END\n"};
  one.dat = krl::KrlFile{"A.dat", "DEFDAT A\nDECL E6POS XA=" + taught_at(0) + "\n"};
  return one;
}

TEST(AFrameThatAProgramStatesAtItsBeginning, IsThatOfItsMotions) {
  const auto reference = corrected_together(
      {stating("")}, "TOOL_DATA[7]={X 59.9,Y 50.5,Z 410.3,A 38.84,B 3.59,C 0.0}\n", config_at_5());
  ASSERT_EQ(reference.points.size(), 1U) << why_not(of(reference, "A"));
  const auto result = corrected_together({stating(kStated)});
  ASSERT_EQ(result.points.size(), 1U) << why_not(of(result, "A"));
  EXPECT_EQ(result.points[0].shift_mm, reference.points[0].shift_mm);
  krl::ProgramFiles alone =
      stating(kStated, "SUB()\nEND\nDEF SUB()\nBAS(#TOOL,7)\nBAS(#BASE,2)\nLIN XA\n");
  alone.controller = {{"$config.dat", kConfig}};
  alone.modules = {{"other.src", "DEF OTHER()\nBASE_DATA[3].X=5\nY=BASE_DATA[2].X\nEND\n"}};
  const auto one = correct_program(calibration(), alone);
  ASSERT_EQ(one.points.size(), 1U) << all_words(one);
  EXPECT_EQ(one.points[0].shift_mm, reference.points[0].shift_mm);
}

TEST(AFrameThatAProgramStates, IsRefusedWhereItMayBeAnotherAtAMotion) {
  const std::string base = "BASE_DATA[2] = {FRAME: X 5.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0}\n",
                    other_base = "BASE_DATA[2] = {X 5.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.001}\n",
                    tool = "TOOL_DATA[7] = {X 59.9,Y 50.5,Z 410.3,A 38.84,B 3.59,C 0.0}\n";
  const auto refused = [](const krl::ProgramFiles& program, const std::string& other = "") {
    const auto result = corrected_together({program, module_named("B", other)});
    return !of(result, "A").refusals.empty();
  };
  EXPECT_FALSE(refused(stating(tool + base)));
  EXPECT_FALSE(refused(stating(tool + base + base), base)) << "the same value everywhere";
  for (const std::string& head :
       {tool + base + other_base, tool + "IF $IN[1] THEN\n" + base + "ENDIF\n",
        tool + "PTP XHOME\n" + base, tool + "LIN_REL {Z 5}\n" + base, tool + "MOVE()\n" + base,
        tool + "GOTO NEXT\n" + base + "NEXT:\n",
        tool + "PTP $POS_ACT:{X 5,Y 0,Z 0,A 0,B 0,C 0}\n" + base, tool + "BASE_DATA[2] = {X 5.0}\n",
        tool + "BASE_DATA[2] = FIND(1)\n", base + "TOOL_DATA[7] = TOOL_DATA[1]\n",
        tool + base + "BASE_DATA[N].X = 5\n"})
    EXPECT_TRUE(refused(stating(head))) << head;
  for (const std::string& more :
       {other_base, std::string("BASE_DATA[2].X=7\n"),
        "END\nGLOBAL DEF SUB()\nBAS(#TOOL,7)\nBAS(#BASE,2)\nPTP XA\n" + std::string()})
    EXPECT_TRUE(refused(stating(tool + base, more))) << more;
  // $BASE has the value from before.
  EXPECT_TRUE(refused({{"A.src", "DEF A()\nBAS(#TOOL,1)\nBAS(#BASE,2)\n" + base + "PTP XA\nEND\n"},
                       stating("").dat,
                       {},
                       {}}));
  EXPECT_TRUE(refused({{"A.src", "DEF A()\nSUB()\nEND\nDEF SUB()\n" + base +
                                     "BAS(#TOOL,1)\nBAS(#BASE,2)\nPTP XA\nEND\n"},
                       stating("").dat,
                       {},
                       {}}));
  EXPECT_TRUE(refused(stating(tool + base), "BASE_DATA[2].X=7"));
  EXPECT_FALSE(refused(stating(tool + base), "X=BASE_DATA[2]"));
}

TEST(AFrameThatAProgramStates, RefusesOtherModulesUnlessItIsThatOfTheController) {
  const auto other =
      module_named("B", "BAS(#BASE,2)\nPTP XB", "DECL E6POS XB=" + taught_at(1) + "\n");
  const auto differs = corrected_together({stating(kStated), other});
  EXPECT_EQ(of(differs, "A").points, 1);
  ASSERT_EQ(of(differs, "B").refusals.size(), 1U);
  EXPECT_EQ(of(differs, "B").refusals[0].why, Why::kFrameChanged);
  const auto same = corrected_together({stating(kStated), other}, {}, config_at_5());
  EXPECT_EQ(of(same, "A").points, 1);
  EXPECT_EQ(of(same, "B").points, 1) << why_not(of(same, "B"));
}

TEST(APointWrittenOut, IsLeftByItsLineInAllModulesOfABackup) {
  krl::BackupFiles files;
  files.modules = {module_named("A", "PTP " + taught_at(0)),
                   module_named("B", "PTP XB", "DECL E6POS XB=" + taught_at(1))};
  files.controller = {{"$config.dat", kConfig}};
  const auto result = correct_backup(calibration(), files, {{"LINE 5"}});
  EXPECT_EQ(of(result, "A").points, 0);
  EXPECT_EQ(of(result, "B").points, 1);
  const auto left = std::ranges::find(result.left, "line 5", &krl::LeftPoint::name);
  ASSERT_NE(left, result.left.end());
  EXPECT_EQ(left->why, "--leave, A.src");
}

TEST(APointThatModulesMoveToInTwoFrames, IsRefusedWithBoth) {
  const auto result = corrected_together(
      {module_named("A", "PTP XG", "DECL GLOBAL E6POS XG=" + taught_at(0) + "\n"),
       module_named("B", "BAS(#BASE,2)\nPTP XG"),
       module_named("C", "PTP XC", "DECL E6POS XC=" + taught_at(1) + "\n")});
  for (const char* name : {"A", "B"}) {
    ASSERT_FALSE(of(result, name).refusals.empty());
    EXPECT_EQ(of(result, name).refusals[0].why, Why::kTwoFrames);
    EXPECT_EQ(of(result, name).refusals[0].file, "B.src");
  }
  EXPECT_EQ(of(result, "C").points, 1);
  EXPECT_EQ(result.files.size(), 1U);
}

TEST(ARefusedModule, KeepsItsPointsAndThoseItShares) {
  const auto result = corrected_together(
      {module_named("A", "PTP XG\nPTP XA\nLIN_REL {Z 5}", "DECL E6POS XA=" + taught_at(0) + "\n"),
       module_named("B", "PTP XG\nPTP XB", "DECL E6POS XB=" + taught_at(1) + "\n"),
       module_named("C", "PTP XB2\nPTP XB2", "DECL E6POS XB2=" + taught_at(2) + "\n")},
      "DECL GLOBAL E6POS XG=" + taught_at(3) + "\n");
  EXPECT_EQ(of(result, "A").refusals.at(0).why, Why::kRelativeMotion);
  ASSERT_EQ(of(result, "B").refusals.size(), 1U);
  EXPECT_EQ(of(result, "B").refusals[0].why, Why::kShared);
  EXPECT_NE(why_not(of(result, "B")).find("A.src"), std::string::npos);
  EXPECT_EQ(of(result, "C").points, 1);
  ASSERT_EQ(result.files.size(), 1U);
  EXPECT_EQ(result.files[0].name, "C.dat");
}

TEST(APointThatAnotherModuleChangesOrReads, IsRefused) {
  for (const char* use : {"XG.Z=XG.Z+5", "XN=XSLOT[N]", "FIND(XG)"}) {
    const auto result = corrected_together(
        {module_named("A", "PTP XG\nPTP XSLOT[1]",
                      "DECL GLOBAL E6POS XG=" + taught_at(0) +
                          "\nDECL GLOBAL E6POS XSLOT[2]\nXSLOT[1]=" + taught_at(1) + "\n"),
         module_named("B", use)});
    ASSERT_FALSE(of(result, "A").refusals.empty()) << use;
    EXPECT_EQ(of(result, "A").refusals[0].why, Why::kComputed) << use;
    EXPECT_EQ(of(result, "A").refusals[0].file, "B.src");
    EXPECT_TRUE(result.files.empty()) << use;
  }
}

TEST(AGlobalPointThatTwoModulesGive, IsRefused) {
  const auto result = corrected_together(
      {module_named("A", "PTP XG", "DECL GLOBAL E6POS XG=" + taught_at(0) + "\n"),
       module_named("B", "", "DECL GLOBAL E6POS XG=" + taught_at(1) + "\n"),
       module_named("C", "PTP XG")});
  EXPECT_TRUE(result.files.empty());
  EXPECT_FALSE(of(result, "C").refusals.empty());
}

TEST(FramesByName, AreThoseOfTheDeclaration) {
  const std::string frames =
      "DECL GLOBAL FRAME torch={X 59.9,Y 50.5,Z 410.3,A 38.84,B 3.59,C 0}\n"
      "DECL GLOBAL FRAME table={X 0,Y 0,Z 0,A 0,B 0,C 0}\nDECL E6POS XP=" +
      taught_at(0) + "\n";
  const auto result =
      corrected_together({module_named("A", "$TOOL = torch\n$BASE=table\nPTP XP", frames)});
  EXPECT_EQ(why_not(of(result, "A")), "");
  ASSERT_EQ(result.points.size(), 1U);
  EXPECT_EQ(result.points[0].tool, -1);
  for (const char* change : {"table.X=5", "table=FIND()", "MEASURE(torch)"}) {
    const auto changed = corrected_together(
        {module_named("A", "$TOOL=torch\n$BASE=table\nPTP XP", frames), module_named("B", change)});
    EXPECT_FALSE(of(changed, "A").refusals.empty()) << change;
  }
}

TEST(FramesByName, AreNotThoseThatAParameterOrVariableHides) {
  const std::string data =
      "DECL GLOBAL FRAME table={X 0,Y 0,Z 0,A 0,B 0,C 0}\n"
      "DECL GLOBAL LOAD part={M 5.0,CM {X 60.0,Y 0.0,Z 150.0,A 0.0,B 0.0,C 0.0}}\nDECL E6POS XP=" +
      taught_at(0) + "\n";
  const auto place = [&](const std::string& routine) {
    return module_named(
        "A", "PLACE(BASE_DATA[2])\nEND\n" + routine + "\n$LOAD=part\n$BASE=table\nPTP XP", data);
  };
  const std::string tool = "BAS(#TOOL,1)";
  for (const std::string& hides :
       {"DEF PLACE(table :IN)\nDECL FRAME table\n" + tool,
        "DEF PLACE(table :IN, part :IN)\n" + tool, "DEFFCT INT PLACE(ANY :OUT,table :OUT)\n" + tool,
        "DEF PLACE(ANY :IN)\nFRAME ANY, table\n" + tool,
        "DEF PLACE(ANY :IN)\nDECL FRAME ANY\nDECL LOAD part\n" + tool}) {
    EXPECT_NE(why_not(of(corrected_together({place(hides)}), "A")), "") << hides;
    krl::ProgramFiles alone = place(hides);
    alone.controller = {{"$config.dat", kConfig}};
    EXPECT_FALSE(correct_program(calibration(), alone).refusals.empty()) << hides;
  }
  // In another module it hides nothing.
  const auto apart = corrected_together({place("DEF PLACE(ANY :IN)\nDECL FRAME ANY\n" + tool),
                                         module_named("B", "END\nDEF OTHER(table :IN)")});
  EXPECT_EQ(why_not(of(apart, "A")), "");
}

/// POINTS moves to its XP1, and USER imports it with that line, in its .src or .dat.
CorrectedBackup imported(const std::string& line, const std::string& body, bool in_data = false) {
  return corrected_together(
      {module_named("POINTS", "PTP XP1", "DECL E6POS XP1=" + taught_at(0) + "\n"),
       module_named("USER", (in_data ? "" : line + "\n") + body,
                    "DECL E6POS XP2=" + taught_at(1) + "\n" + (in_data ? line + "\n" : "")),
       module_named("OTHER", "PTP XP1", "DECL E6POS XP1=" + taught_at(2) + "\n")});
}
constexpr const char* kImport = "IMPORT E6POS XP1 IS /R1/POINTS..XP1";

TEST(AnImportedPoint, IsThatOfTheOtherModule) {
  for (const bool in_data : {false, true}) {
    const auto result = imported(kImport, "PTP XP1\nPTP XP2", in_data);
    EXPECT_EQ(why_not(of(result, "USER")), "");
    EXPECT_EQ(result.points.size(), 3U);
    EXPECT_EQ(
        of(imported(std::string("DECL ") + kImport, "PTP XP1\nPTP XP2", in_data), "USER").points,
        2);
  }
}

TEST(AnImportedPoint, KeepsItsValueInAllModulesWhereItIsRefusedInOne) {
  for (const char* body :
       {"BAS(#BASE,2)\nPTP XP1", "XP1.Z=XP1.Z+5\nPTP XP2", "PTP XP1\nLIN_REL {Z 5}"})
    for (const bool in_data : {false, true}) {
      const auto result = imported(kImport, body, in_data);
      EXPECT_FALSE(of(result, "POINTS").refusals.empty()) << body;
      EXPECT_EQ(text_of_file(result, "POINTS.dat"), "") << body;
      EXPECT_EQ(of(result, "OTHER").points, 1) << "its own";
    }
}

TEST(AnImportedPoint, UnderAnotherNameIsRefusedByBoth) {
  for (const char* line :
       {"IMPORT E6POS XA IS /R1/POINTS..XP1", "DECL IMPORT E6POS XA[] IS /R1/POINTS..XP1[]"}) {
    const auto result = imported(line, "PTP XA");
    for (const char* name : {"POINTS", "USER"}) {
      ASSERT_EQ(of(result, name).refusals.size(), 1U) << name << why_not(of(result, name));
      EXPECT_EQ(of(result, name).refusals[0].why, Why::kImported) << name;
    }
    EXPECT_EQ(of(result, "OTHER").points, 1);
  }
  // A point of that name elsewhere is another.
  EXPECT_EQ(
      of(imported("IMPORT E6POS XP1 IS /R1/POINTS..XP9", "PTP XP1"), "USER").refusals.at(0).why,
      Why::kImported);
  EXPECT_EQ(
      of(imported("IMPORT E6POS XP1 IS /R1/NOWHERE..XP1", "PTP XP1"), "USER").refusals.at(0).why,
      Why::kUnknownPoint);
}

TEST(PointsWithoutAMotion, OfABackupAreListedWithTheirFile) {
  const std::string point = "=" + taught_at(0) + "\n";
  krl::BackupFiles files;
  files.modules = {
      module_named("A", "PTP XA\nPTP XARR[I]",
                   "DECL E6POS XA" + point + "DECL E6POS XOLD" + point +
                       "DECL E6POS XARR[2]\nXARR[1]" + point + "DECL GLOBAL E6POS XALL" + point),
      module_named("B", "PTP XB", "DECL E6POS XB" + point + "DECL E6POS XOLD" + point),
      module_named("bas", "", "DECL E6POS XKUKA" + point)};
  files.data = {{"points.dat", "DECL GLOBAL E6POS XFAR" + point}};
  files.controller = {
      {"$config.dat", kConfig + ("DECL E6POS XSPARE" + point)},
      {"$machine.dat", "E6AXIS $H_POS={A1 0.0,A2 0.0,A3 0.0,A4 0.0,A5 0.0,A6 0.0}\n"}};
  std::string left;
  for (const krl::LeftPoint& one : correct_backup(calibration(), files).left)
    left += one.name + ": " + one.why + "\n";
  EXPECT_EQ(left,
            "XALL: no motion goes to it, A.dat\n"
            "XFAR: no motion goes to it, points.dat\n"
            "XHOME: home or mastering reference\n"
            "XKUKA: the controller's own program, bas.dat\n"
            "XOLD: no motion goes to it, A.dat\n"
            "XOLD: no motion goes to it, B.dat\n"
            "XSPARE: no motion goes to it, $config.dat\n");
}

TEST(HomesAndTheMasteringReference, Stay) {
  const auto result = corrected_together({module_named("A", "PTP XHOME\nPTP XMASREF")},
                                         "DECL GLOBAL E6POS XMASREF=" + taught_at(0) + "\n");
  EXPECT_EQ(of(result, "A").points, 0);
  EXPECT_EQ(of(result, "A").motions, 3);
  EXPECT_TRUE(of(result, "A").refusals.empty());
  EXPECT_EQ(result.left.size(), 2U);
}

TEST(TheControllersOwnPrograms, StayAndRefuseNothing) {
  const auto result = corrected_together(
      {module_named("bas", "LIN_REL {Z 5}\nPTP XNOWHERE"),
       module_named("$tt_ident", "PTP XNOWHERE"), module_named("BrakeTestReq", "PTP XNOWHERE"),
       module_named("A", "PTP XA", "DECL E6POS XA=" + taught_at(0) + "\n")});
  for (const char* name : {"bas", "$tt_ident", "BrakeTestReq"}) {
    EXPECT_TRUE(of(result, name).refusals.empty()) << name;
    EXPECT_TRUE(of(result, name).kukas) << name;
    EXPECT_GT(of(result, name).motions, 0) << name;
  }
  EXPECT_EQ(of(result, "A").points, 1);
}

TEST(ABackupWithHostileModules, RefusesThemByName) {
  for (const std::string& body :
       {std::string("PTP XP[1][2].A.B"), std::string("PTP XP[99999]"), std::string("PTP XP."),
        std::string("PTP XS.P"), std::string("LIN XP["), std::string("PTP .P")}) {
    const auto result = corrected_together({module_named(
        "A", body, "DECL E6POS XP[3]\nXP[1]={X 1\nDECL S_T XS={P {X 1,Y 2}}\nXP[2]={}\n")});
    EXPECT_TRUE(result.files.empty()) << body;
    EXPECT_FALSE(of(result, "A").refusals.empty()) << body;
  }
  krl::BackupFiles nul;
  nul.modules = {module_named("A", "PTP XP")};
  nul.data = {{"x.dat", std::string("A\0B", 3)}};
  EXPECT_THROW(correct_backup(calibration(), nul), calib::FileError);
}

}  // namespace
}  // namespace cellcal::daemon::testing
