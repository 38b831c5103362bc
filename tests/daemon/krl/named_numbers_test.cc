// Numbers of tools and bases by the name of an INT.

#include <gtest/gtest.h>

#include "tests/daemon/krl/fixture.h"

namespace cellcal::daemon::testing {
namespace {

krl::ProgramFiles named_files(const std::string& dat, const std::string& body,
                              const std::string& config = {}) {
  return {{"p.src", "DEF P()\n" + body + "PTP XN\nEND\n"},
          krl::KrlFile{"p.dat",
                       "DEFDAT P\nDECL E6POS XN=" + pose_text({0.2, -1.4, 1.5, 0.3, 0.8, 0.1}) +
                           "\n" + dat + "ENDDAT\n"},
          {{"$config.dat",
            "TOOL_DATA[1]={X 59.9,Y 50.5,Z 410.3,A 38.84,B 3.59,C 0.0}\n"
            "BASE_DATA[3]={X 0.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0}\n" +
                config}}};
}

/// "1.3" of the point, or the refusals.
std::string by_name(const std::string& dat, const std::string& body,
                    const std::string& config = {}) {
  const auto result =
      krl::correct_program(calibration(), named_files(dat, body, config), {.anywhere = true});
  if (!result.refusals.empty()) return all_words(result);
  return std::to_string(result.points.at(0).tool) + "." + std::to_string(result.points[0].base);
}

constexpr const char* kNamed = "BAS(#TOOL,GRIPPER)\nBAS(#BASE,TABLE)\n";

TEST(ANumberByName, IsThatOfAConstantOrOfAnIntThatNothingAssigns) {
  const std::string numbers = "DECL CONST INT GRIPPER=1\nDECL INT TABLE=3\n";
  for (
      const char* body :
      {kNamed, "$TOOL=TOOL_DATA[GRIPPER]\n$BASE=BASE_DATA[TABLE]\n",
       "FDAT_ACT.TOOL_NO=GRIPPER\nFDAT_ACT.BASE_NO=TABLE\nBAS(#FRAMES)\n",
       "BAS(#BASE,TABLE)\nIF N==GRIPPER THEN\nBAS(#TOOL,GRIPPER)\nELSE\nBAS(#TOOL,1)\nENDIF\n",
       "BAS(#TOOL,1)\nSPTP XN WITH $BASE=BASE_DATA[TABLE]\nBAS(#BASE,TABLE)\n",
       "USE(GRIPPER)\nBAS(#BASE,TABLE)\nPTP XN\nEND\nDEF USE(N :IN)\nBAS(#TOOL,N)\nEND\nDEF LAST()\nBAS(#TOOL,1)\nBAS(#BASE,3)\n"})
    EXPECT_EQ(by_name(numbers, body), "1.3") << body;
  EXPECT_EQ(by_name("", kNamed, "GLOBAL CONST INT GRIPPER=1\nGLOBAL CONST INT TABLE=3\n"), "1.3");
  EXPECT_EQ(by_name("CONST INT TABLE=3,GRIPPER=1\n", kNamed, "GLOBAL CONST INT GRIPPER=7\n"),
            "1.3");
}

TEST(ANumberByName, IsUnknownWhereItHasAnotherReading) {
  const std::string tool = "DECL CONST INT GRIPPER=1\n", numbers = tool + "DECL INT TABLE=3\n";
  for (const auto& [dat, body] : std::vector<std::pair<std::string, std::string>>{
           {tool, kNamed},
           {tool + "DECL INT TABLE\n", kNamed},
           {tool + "DECL REAL TABLE=3\n", kNamed},
           {tool + "DECL INT TABLE[3]\n", kNamed},
           {tool + "DECL INT TABLE=1+2\n", kNamed},
           {numbers + "TABLE=4\n", kNamed},
           {numbers + "DECL INT TABLE=3\n", kNamed},
           {numbers, kNamed + std::string("TABLE=4\n")},
           {numbers, kNamed + std::string("SREAD(S[],ST,\"%d\",TABLE)\n")},
           {numbers, kNamed + std::string("FOR TABLE=1 TO 3\nENDFOR\n")},
           {numbers, "BAS(#TOOL,GRIPPER)\nBAS(#BASE,TABLE+1)\n"},
           {numbers, "BAS(#TOOL,GRIPPER)\n$BASE=BASE_DATA[TABLE]:SHIFT\n"},
           {tool, "INT TABLE\n" + std::string(kNamed)},
           {tool + "CONST INT TABLE=3\n",
            "GO()\nEND\nDEF OTHER(TABLE :IN)\nEND\nDEF GO()\n" + std::string(kNamed)},
           {tool + "CONST INT TABLE=3\n", "DECL INT TABLE\n" + std::string(kNamed)}})
    EXPECT_NE(by_name(dat, body, "GLOBAL CONST INT SHIFT=1\n").find("base unknown since"),
              std::string::npos)
        << dat << body << by_name(dat, body);
  EXPECT_NE(
      by_name("DECL INT TABLE\nDECL CONST INT GRIPPER=1\n", kNamed, "GLOBAL CONST INT TABLE=3\n")
          .find("base unknown"),
      std::string::npos)
      << "its own .dat hides the controller's";
}

TEST(ANumberByName, IsUnknownWhereTheControllersFileHasAnIntOrAnInterruptIsGivenIt) {
  const std::string tool = "GLOBAL CONST INT GRIPPER=1\n";
  EXPECT_NE(by_name("", kNamed, tool + "DECL GLOBAL INT TABLE=3\n").find("base unknown"),
            std::string::npos);
  EXPECT_NE(
      by_name("DECL INT TABLE=3\n",
              "INTERRUPT DECL 3 WHEN $IN[1]==TRUE DO IRQ(20,TABLE)\n" + std::string(kNamed), tool)
          .find("base unknown"),
      std::string::npos);
}

TEST(ANumberByName, IsUnknownWhereAnotherModuleChangesIt) {
  for (const bool constant : {false, true}) {
    krl::BackupFiles files;
    krl::ProgramFiles one = named_files("", kNamed);
    files.controller = one.controller;
    files.controller[0].text += std::string("CONST INT GRIPPER=1\n") +
                                (constant ? "GLOBAL CONST" : "DECL GLOBAL") + " INT TABLE=3\n";
    const krl::KrlFile other{"q.src", "DEF Q()\nIF TABLE==3 THEN\nENDIF\nTABLE=4\nEND\n"};
    one.controller.clear();
    files.modules = {one, {other, {}, {}, {}}};
    EXPECT_EQ(
        correct_backup(calibration(), files, {.anywhere = true}).modules.at(0).refusals.empty(),
        constant);
    one.controller = files.controller;
    one.modules = {other};
    EXPECT_EQ(correct_program(calibration(), one, {.anywhere = true}).refusals.empty(), constant);
  }
}

}  // namespace
}  // namespace cellcal::daemon::testing
