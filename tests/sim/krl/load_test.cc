// Modules that a controller refuses to select.

#include "tests/sim/krl/krl_rig.h"

namespace cellcal::sim::krl {
namespace {

std::string body(const std::string& text) {
  return refusal({{"m.src", "DEF M ( )\n" + text + "\nEND\n"}});
}

TEST(KrlLoad, NamesFileAndLineOfWhatIsNoStatement) {
  EXPECT_EQ(body("X=1"), "m.src:2: X is not declared");
  EXPECT_EQ(body("DECL INT I\nI=1\nDECL INT K"), "m.src:4: a declaration follows a statement");
  EXPECT_EQ(body("DECL INT I\nI=TRUE"), "m.src:3: BOOL cannot become INT");
  EXPECT_EQ(body("DECL INT I=4"), "m.src:2: I: only a .dat gives values with the declaration");
  EXPECT_EQ(body("DECL INT ABCDEFGHIJKLMNOPQRSTUVWXY"),
            "m.src:2: ABCDEFGHIJKLMNOPQRSTUVWXY: names have 24 characters at most");
  EXPECT_EQ(body("DECL INT LOOP"), "m.src:2: LOOP is a keyword");
  EXPECT_EQ(body("DECL INT I,I"), "m.src:2: I is declared twice");
  EXPECT_EQ(body("DECL NOTHING_T I"), "m.src:2: NOTHING_T: no such type");
  EXPECT_EQ(body("FOO ( )"), "m.src:2: FOO(): no such sub-program");
  EXPECT_EQ(body("EXIT"), "m.src:2: EXIT outside a loop");
  EXPECT_EQ(body("GOTO AWAY"), "m.src:2: GOTO AWAY: no such label");
  EXPECT_EQ(body("IF TRUE THEN\nHALT"), "m.src:2: the block has no ENDIF");
  EXPECT_EQ(body("LOOP\nENDWHILE"), "m.src:3: ENDWHILE is a keyword");
  EXPECT_EQ(body("WAIT FOR 1==2 AND 3==3"), "m.src:2: both sides have to be BOOL");
  EXPECT_EQ(body("HALT HALT"), "m.src:2: \"HALT\" follows the end of the statement");
  EXPECT_EQ(body("RETURN (1)"), "m.src:2: a DEF has no result");
  EXPECT_EQ(body("TRIGGER WHEN DISTANCE=0 DELAY=0 DO HALT"),
            "m.src:2: TRIGGER is not executed here");
  EXPECT_EQ(body("$IN[1]=#P_END"), "m.src:2: PRO_STATE cannot become BOOL");
  EXPECT_EQ(body("$NULLFRAME={X 1.0}"), "m.src:2: $NULLFRAME is CONST");
}

TEST(KrlLoad, NamesFileAndLineOfWhatIsNoModule) {
  EXPECT_EQ(refusal({{"m.src", "DEF M ( )\n"}}), "m.src:1: M has no END");
  EXPECT_EQ(refusal({{"m.src", "DEFFCT INT M ( )\nRETURN (1)\nEND\n"}}),
            "m.src:3: END where ENDFCT is missing");
  EXPECT_EQ(refusal({{"m.src", "DEF M (X :IN )\nEND\n"}}), "m.src:1: parameter X is not declared");
  EXPECT_EQ(refusal({{"m.dat", "DEFDAT M\nDECL GLOBAL INT I=1\nENDDAT\n"}}),
            "m.dat:2: GLOBAL needs a DEFDAT that is PUBLIC");
  EXPECT_EQ(refusal({{"m.dat", "DEFDAT M PUBLIC\nDECL INT I=1\n"}}), "m.dat:2: no ENDDAT");
  EXPECT_EQ(refusal({{"m.dat", "DEFDAT M PUBLIC\nDECL INT I=1/0\nENDDAT\n"}}),
            "m.dat:2: division by zero");
}

TEST(KrlLoad, LocalVariablesAreNotSeenByOtherModules) {
  const std::string data = "DEFDAT A PUBLIC\nDECL INT OWN=1\nDECL GLOBAL INT ALL_S=1\nENDDAT\n";
  EXPECT_EQ(refusal({{"a.dat", data}, {"b.src", "DEF B ( )\nALL_S=2\nEND\n"}}), "");
  EXPECT_EQ(refusal({{"a.dat", data}, {"b.src", "DEF B ( )\nOWN=2\nEND\n"}}),
            "b.src:2: OWN is not declared");
}

TEST(KrlLoad, HostileNestingIsRefused) {
  EXPECT_EQ(body("DECL INT I\nI=" + std::string(5000, '(')), "m.src:3: nested too deeply");
  EXPECT_EQ(body("DECL INT I\nI=" + std::string(5000, '-')), "m.src:3: nested too deeply");
  EXPECT_EQ(body("DECL INT I[100000],K[3]\nI[1]=1"), "m.src:2: I: no memory is left for it");
  std::string loops;
  for (int i = 0; i < 1000; ++i) loops += "LOOP\n";
  EXPECT_NE(body(loops), "");
}

}  // namespace
}  // namespace cellcal::sim::krl
