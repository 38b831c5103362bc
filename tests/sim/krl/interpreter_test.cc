#include "sim/krl/interpreter.h"

#include "tests/sim/krl/krl_rig.h"

namespace cellcal::sim::krl {
namespace {

using State = Interpreter::State;

TEST(KrlInterpreter, AssignsAndComputesInWholeNumbersAndReals) {
  EXPECT_EQ(KrlRig("N=7/2").n(), 3);
  EXPECT_EQ(KrlRig("N=-7/2").n(), -3);
  EXPECT_EQ(KrlRig("N=2+3*4").n(), 14);
  EXPECT_EQ(KrlRig("N=(2+3)*4").n(), 20);
  EXPECT_EQ(KrlRig("N=2.5").n(), 3) << "a REAL is rounded";
  EXPECT_EQ(KrlRig("N='H1F' B_AND 'B110'").n(), 6);
  EXPECT_EQ(KrlRig("N=B_NOT 0").n(), -1);
  EXPECT_FLOAT_EQ(KrlRig("R=7/2.0").r(), 3.5F);
  EXPECT_FLOAT_EQ(KrlRig("R=SQRT(16.0)+SIN(30.0)").r(), 4.5F);
  EXPECT_FLOAT_EQ(KrlRig("R=ATAN2(1.0,1.0)").r(), 45.0F);
}

TEST(KrlInterpreter, RealsHave32Bits) {
  EXPECT_EQ(KrlRig("R=16777216.0\nR=R+1.0").r(), 16777216.0F);
  EXPECT_EQ(KrlRig("R=0.1+0.2").r(), 0.1F + 0.2F);
}

TEST(KrlInterpreter, ComparisonsBindLessThanAndAndOr) {
  EXPECT_TRUE(KrlRig("B=(1<2) AND (2.0>=2) AND NOT FALSE").b());
  EXPECT_FALSE(KrlRig("B=TRUE EXOR TRUE").b());
  EXPECT_TRUE(KrlRig("B=TRUE OR FALSE==TRUE").b()) << "as (TRUE OR FALSE)==TRUE";
}

TEST(KrlInterpreter, BranchesAndLoops) {
  EXPECT_EQ(KrlRig("IF N==0 THEN\nN=1\nELSE\nN=2\nENDIF").n(), 1);
  EXPECT_EQ(KrlRig("IF N==1 THEN\nN=1\nELSE\nN=2\nENDIF").n(), 2);
  EXPECT_EQ(KrlRig("DECL INT I\nFOR I=1 TO 10\nN=N+I\nENDFOR").n(), 55);
  EXPECT_EQ(KrlRig("DECL INT I\nFOR I=10 TO 1 STEP -3\nN=N+I\nENDFOR").n(), 22);
  EXPECT_EQ(KrlRig("DECL INT I\nFOR I=1 TO 0\nN=N+1\nENDFOR").n(), 0);
  EXPECT_EQ(KrlRig("WHILE N<5\nN=N+1\nENDWHILE").n(), 5);
  EXPECT_EQ(KrlRig("REPEAT\nN=N+1\nUNTIL N>=3").n(), 3);
  EXPECT_EQ(KrlRig("LOOP\nN=N+1\nIF N==4 THEN\nEXIT\nENDIF\nENDLOOP\nN=N+10").n(), 14);
  EXPECT_EQ(KrlRig("AGAIN:\nN=N+1\nIF N<6 THEN\nGOTO AGAIN\nENDIF").n(), 6);
}

TEST(KrlInterpreter, SwitchTakesTheFirstMatchingCaseOrTheDefault) {
  const auto chosen = [](const char* selector) {
    return KrlRig(std::string("SWITCH ") + selector +
                  "\nCASE 1\nN=10\nCASE 2,3\nN=20\nDEFAULT\nN=30\nENDSWITCH")
        .n();
  };
  EXPECT_EQ(chosen("1"), 10);
  EXPECT_EQ(chosen("3"), 20);
  EXPECT_EQ(chosen("9"), 30);
  EXPECT_EQ(KrlRig("SWITCH 7\nCASE 1\nN=1\nENDSWITCH").n(), 0);
}

TEST(KrlInterpreter, StructuresEnumerationsAndArrays) {
  EXPECT_FLOAT_EQ(KrlRig("DECL FRAME F\nF={X 1.5,Y -2.0}\nR=F.X+F.Y").r(), -0.5F);
  EXPECT_EQ(KrlRig("DECL COLOUR_T C\nC=#RED\nIF C==#RED THEN\nN=1\nENDIF",
                   "GLOBAL ENUM COLOUR_T BLUE,RED")
                .n(),
            1);
  EXPECT_EQ(KrlRig("N=A[2]+M[2,3]",
                   "DECL GLOBAL INT A[3]\nA[1]=4\nA[2]=5\nDECL GLOBAL INT M[2,3]\nM[2,3]=7")
                .n(),
            12);
  EXPECT_FLOAT_EQ(
      KrlRig("R=P[2].F.X",
             "GLOBAL STRUC PLACE_T FRAME F,INT K\nDECL GLOBAL PLACE_T P[2]\nP[2]={F {X 4.0},K 1}")
          .r(),
      4.0F);
}

TEST(KrlInterpreter, TextsAreComparedCopiedAndMeasured) {
  const char* const data = "DECL GLOBAL CHAR T[8]\nT[]=\"Cell\"";
  EXPECT_TRUE(KrlRig("B=StrComp(T[],\"CELL\",#NOT_CASE_SENS)", data).b());
  EXPECT_FALSE(KrlRig("B=StrComp(T[],\"CELL\",#CASE_SENS)", data).b());
  EXPECT_EQ(KrlRig("B=StrCopy(T[],\"abc\")\nN=StrLen(T[])", data).n(), 3);
  EXPECT_EQ(KrlRig("N=StrAdd(T[],\"cal\")+StrDeclLen(T[])", data).n(), 15);
  EXPECT_EQ(KrlRig("B=StrCopy(T[],\"too long for it\")", data).interpreter->state(),
            State::kFailed);
}

TEST(KrlInterpreter, FramesAreComposedAndInverted) {
  KrlRig rig(
      "DECL FRAME F\nF={X 10.0,Y 0.0,Z 0.0,A 90.0,B 0.0,C 0.0}:{FRAME: X 5.0,Y 0.0,Z 1.0,A 0.0,B 0.0,C 0.0}\n"
      "R=F.Y\nF=INV_POS(F):F\nN=F.X+F.Y+F.Z+F.A");
  EXPECT_NEAR(rig.r(), 5.0F, 1e-5);
  EXPECT_EQ(rig.n(), 0);
}

TEST(KrlInterpreter, SubProgramsTakeCopiesAndReferences) {
  KrlRig rig("DECL INT I\nI=1\nADD (I,5)\nN=I*10+TWICE(I)", "",
             "DEF ADD (X :OUT,BY :IN)\nDECL INT X,BY\nX=X+BY\nBY=0\nEND\n"
             "DEFFCT INT TWICE (X :IN)\nDECL INT X\nX=X*2\nRETURN (X)\nENDFCT\n");
  EXPECT_EQ(rig.n(), 72);
}

TEST(KrlInterpreter, CallsMainAndGlobalRoutinesOfOtherModulesAndNoOthers) {
  const KrlRig::Files other = {
      {"o.src", "DEF O ( )\nN=N+1\nEND\nGLOBAL DEF G ( )\nN=N+10\nEND\nDEF L ( )\nEND\n"}};
  EXPECT_EQ(KrlRig("O ( )\nG ( )", "", "", other).n(), 11);
  EXPECT_THROW(KrlRig("L ( )", "", "", other), calib::FileError);
}

TEST(KrlInterpreter, WaitsForConditionsAndSeconds) {
  KrlRig rig("WAIT FOR $IN[1]\nN=1\nWAIT SEC 0.012\nN=2");
  rig.run();
  EXPECT_EQ(rig.n(), 0);
  rig.input(1, true);
  rig.run();
  EXPECT_EQ(rig.n(), 1);
  rig.run(0.008);
  EXPECT_EQ(rig.n(), 1);
  rig.run(0.004);
  EXPECT_EQ(rig.n(), 2);
  EXPECT_TRUE(rig.ended());
}

TEST(KrlInterpreter, HaltsUntilItIsStartedAgain) {
  KrlRig rig("HALT\nN=1");
  rig.run();
  EXPECT_EQ(rig.interpreter->state(), State::kHalted);
  EXPECT_EQ(rig.n(), 0);
  rig.interpreter->go_on();
  rig.run();
  EXPECT_EQ(rig.n(), 1);
}

TEST(KrlInterpreter, WaitsForTheEndOfEachMotion) {
  KrlRig rig("PTP {A1 10.0,A2 -90.0}\nN=1\nLIN {X 5.0} C_DIS\nN=2\nLIN_REL {Z -1.0} #TOOL");
  EXPECT_EQ(rig.arm.moves, 1);
  EXPECT_FLOAT_EQ(rig.arm.target.part("A2").r, -90.0F);
  EXPECT_FALSE(rig.arm.target.part("A3").given);
  rig.run();
  EXPECT_EQ(rig.n(), 0);
  rig.arm.busy = false;
  rig.run();
  EXPECT_EQ(rig.n(), 1);
  EXPECT_EQ(rig.arm.kind, Motion::Kind::kLin);
  EXPECT_TRUE(rig.arm.approximate);
  rig.arm.busy = false;
  rig.run();
  EXPECT_EQ(rig.arm.kind, Motion::Kind::kLinRel);
}

constexpr const char* kGuarded = "INTERRUPT DECL 20 WHEN $IN[1]==TRUE DO HIT ( )\nSUB ( )\nN=N+100";
constexpr const char* kSubs =
    "DEF SUB ( )\nINTERRUPT ON 20\nPTP {A1 10.0}\nN=50\nEND\n"
    "DEF HIT ( )\nBRAKE F\nINTERRUPT OFF 20\nN=7\nRESUME\nEND\n";

TEST(KrlInterpreter, AnInterruptBrakesAndResumesAtTheLevelOfItsDeclaration) {
  KrlRig rig(kGuarded, "", kSubs);
  rig.interpreter->poll_interrupts();
  rig.run();
  EXPECT_EQ(rig.arm.brakes, 0);
  rig.input(1, true);
  rig.interpreter->poll_interrupts();
  rig.run();
  EXPECT_EQ(rig.arm.brakes, 1);
  EXPECT_TRUE(rig.arm.fast_brake);
  EXPECT_EQ(rig.n(), 0) << "BRAKE lasts until the arm rests";
  rig.arm.busy = false;
  rig.run();
  EXPECT_EQ(rig.arm.dropped, 1);
  EXPECT_EQ(rig.n(), 107);
  EXPECT_TRUE(rig.ended());
}

TEST(KrlInterpreter, InterruptsAreOfEdges) {
  KrlRig rig(kGuarded, "",
             std::string("DEF SUB ( )\nWAIT FOR $IN[2]\nINTERRUPT ON 20\nPTP {A1 10.0}\nEND\n") +
                 "DEF HIT ( )\nN=7\nEND\n");
  rig.input(1, true);
  rig.input(2, true);
  rig.run();
  rig.interpreter->poll_interrupts();
  rig.run();
  EXPECT_EQ(rig.n(), 0) << "it was on before";
  rig.input(1, false);
  rig.interpreter->poll_interrupts();
  rig.input(1, true);
  rig.interpreter->poll_interrupts();
  rig.run();
  EXPECT_EQ(rig.n(), 7);
}

TEST(KrlInterpreter, FaultsOfARunNameTheirLine) {
  const auto fault = [](const std::string& body, const std::string& data = "",
                        const std::string& more = "") {
    return KrlRig(body, data, more).interpreter->message();
  };
  EXPECT_EQ(fault("DECL INT I\nN=1\nN=I+1"), "m.src:4: INT is read and has no value");
  EXPECT_EQ(fault("N=1/N"), "m.src:2: division by zero");
  EXPECT_EQ(fault("N=2147483647\nN=N+1"), "m.src:3: an INT beyond its range");
  EXPECT_EQ(fault("B=$IN[9]"), "m.src:2: subscript 9 is outside 1 to 8");
  EXPECT_EQ(fault("R=SQRT(-1.0)"), "m.src:2: argument outside the function's range");
  EXPECT_EQ(fault("N=F()", "", "DEFFCT INT F ( )\nN=1\nENDFCT\n"),
            "m.src:6: F ends without RETURN");
  EXPECT_EQ(fault("M ( )"), "m.src:2: sub-programs are nested too deeply");
  EXPECT_EQ(fault("RESUME"), "m.src:2: RESUME outside an interrupt's sub-program");
  EXPECT_EQ(fault("INTERRUPT ON 3"), "m.src:2: interrupt 3 is not declared");
}

TEST(KrlInterpreter, HooksSeeReadsAndAssignments) {
  Program program(KrlRig::Files{{"m.src", "DEF M ( )\n$OUT[3]=$IN[2]\nEND\n"}},
                  "BOOL $IN[8]\nBOOL $OUT[8]\n");
  std::size_t read = 0, set = 0;
  program.variable("$IN").read = [&](Value& value, std::size_t at) {
    read = at;
    value.parts[at].set_whole(1);
  };
  program.variable("$OUT").set = [&](const Value& value, std::size_t at) {
    set = value.parts[at].truth() ? at : 0;
  };
  Interpreter submit(program);
  submit.select("M");
  submit.run(0.0);
  EXPECT_EQ(read, 1U);
  EXPECT_EQ(set, 2U);
}

TEST(KrlInterpreter, ASubmitProgramDoesNotMove) {
  Program program(KrlRig::Files{{"m.src", "DEF M ( )\nPTP {A1 1.0}\nEND\n"}});
  Interpreter submit(program);
  submit.select("M");
  submit.run(0.0);
  EXPECT_EQ(submit.message(), "m.src:2: a submit program has no motions");
}

TEST(KrlInterpreter, AnEndlessLoopIsLeftAndContinuedInTheNextCycle) {
  KrlRig rig("LOOP\nN=N+1\nENDLOOP");
  const std::int32_t before = rig.n();
  rig.run();
  EXPECT_GT(rig.n(), before);
  EXPECT_TRUE(rig.interpreter->running());
}

}  // namespace
}  // namespace cellcal::sim::krl
