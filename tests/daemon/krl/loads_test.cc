// Loads activated by a program: $LOAD=LOAD_DATA[n].

#include <gtest/gtest.h>

#include "calib/estimate/predict.h"
#include "daemon/krl/controller_view.h"
#include "daemon/krl/correct_program.h"
#include "daemon/krl/run_time_program.h"
#include "tests/daemon/krl/fixture.h"

namespace cellcal::daemon::testing {
namespace {

using krl::correct_program;
using krl::CorrectedProgram;

constexpr const char* kHere = "PTP {A1 20.0,A2 -80.0,A3 80.0,A4 10.0,A5 40.0,A6 0.0}\n";

krl::ProgramFiles loaded(const std::string& body) {
  krl::ProgramFiles f;
  f.src = {"p.src", "DEF p()\n" + body + "END\n"};
  f.dat = krl::KrlFile{"p.dat", "DEFDAT P\nENDDAT\n"};
  f.controller = {
      {"$config.dat",
       "TOOL_DATA[1]={X 59.9,Y 50.5,Z 410.3,A 38.84,B 3.59,C 0.0}\n"
       "LOAD_DATA[1]={M 1.5,CM {X 0.0,Y 0.0,Z 90.0,A 0.0,B 0.0,C 0.0},J {X 0.0,Y 0.0,Z 0.0}}\n"
       "LOAD_DATA[2]={M 5.0,CM {X 60.0,Y 0.0,Z 150.0,A 0.0,B 0.0,C 0.0},J {X 0.0,Y 0.0,Z 0.0}}\n"
       "LOAD_DATA[3]={M -1.0,CM {X 0.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0},J {X 0.0,Y 0.0,Z 0.0}}\n"}};
  return f;
}

CorrectedProgram corrected_with(const std::string& body) {
  return correct_program(calibration(), loaded(body));
}

/// "kind:line" of each refusal.
std::string refused_as(const std::string& body) {
  std::string text;
  for (const krl::Refusal& one : corrected_with(body).refusals)
    text += krl::name_of(one.why) + (":" + std::to_string(one.line)) + " ";
  return text;
}

TEST(ALoadInForce, IsBorneByTheCellsToolFromItsStatementOn) {
  const CorrectedProgram own =
      corrected_with("$TOOL=TOOL_DATA[1]\n$LOAD=LOAD_DATA[1]\n" + std::string(kHere));
  const CorrectedProgram full =
      corrected_with("$TOOL=TOOL_DATA[1]\n$LOAD=LOAD_DATA[2]\n" + std::string(kHere));
  ASSERT_TRUE(own.refusals.empty()) << all_words(own);
  ASSERT_TRUE(full.refusals.empty()) << all_words(full);
  const CorrectedProgram before = corrected_with("BAS(#TOOL,1)\n" + std::string(kHere));
  EXPECT_EQ(own.points[0].shift_mm, before.points[0].shift_mm) << "its own load changes nothing";
  EXPECT_EQ(full.tools.at(0).load, 2);
  // The additional deflection of the arm.
  const calib::Calibration c = calibration();
  const calib::JointVector q = [] {
    calib::JointVector at;
    for (const double deg : {20.0, -80.0, 80.0, 10.0, 40.0, 0.0})
      at.push_back(deg * calib::kRadPerDeg);
    return at;
  }();
  const calib::Calibration heavy =
      calib::with_load(c, calib::FlangeLoad{5.0, Eigen::Vector3d(0.06, 0.0, 0.15)});
  const Eigen::Vector3d more_mm = (calib::Predictor(heavy).calibrated(q).tcp.translation() -
                                   calib::Predictor(c).calibrated(q).tcp.translation()) *
                                  1e3;
  EXPECT_GT(more_mm.norm(), 0.005) << "there is something to correct";
  EXPECT_LT((own.points[0].shift_mm - full.points[0].shift_mm - more_mm).norm(),
            0.1 * more_mm.norm());
}

/// Points and warnings with LOAD_DATA[4] of tool 4, which has the frame of the cell file's tool: 1.535 kg at 30 25 205.
CorrectedProgram of_the_cells_tool(const std::string& load) {
  krl::ProgramFiles f = loaded("BAS(#TOOL,4)\n" + std::string(kHere));
  f.controller[0].text += "TOOL_DATA[4]={X 59.9,Y 50.5,Z 410.3,A 38.84,B 3.59,C 0.0}\n" + load;
  return correct_program(calibration(), f);
}

TEST(TheCellsTool, BearsLoadDataOfItsNumberWhereThatIsAnother) {
  const auto load = [](const char* mass, const char* centre) {
    return std::string("LOAD_DATA[4]={M ") + mass + ",CM {" + centre +
           ",A 0,B 0,C 0},J {X 0,Y 0,Z 0}}\n";
  };
  const CorrectedProgram own = of_the_cells_tool("");
  EXPECT_TRUE(own.warnings.empty());
  for (const std::string& same :
       {load("1.6", "X 28.0,Y 25.0,Z 200.0"), load("1.5", "X 0.0,Y 0.0,Z 0.0"),
        load("0.0", "X 0.0,Y 0.0,Z 0.0"), load("-1.0", "X 0.0,Y 0.0,Z 0.0")}) {
    const CorrectedProgram result = of_the_cells_tool(same);
    EXPECT_EQ(result.points.at(0).shift_mm, own.points.at(0).shift_mm) << same;
    EXPECT_TRUE(result.warnings.empty()) << same;
    EXPECT_EQ(result.tools.at(0).load, -1) << same;
  }
  const CorrectedProgram full = of_the_cells_tool(load("5.0", "X 60.0,Y 0.0,Z 150.0"));
  const CorrectedProgram set =
      corrected_with("$TOOL=TOOL_DATA[1]\n$LOAD=LOAD_DATA[2]\n" + std::string(kHere));
  EXPECT_EQ(full.points.at(0).shift_mm, set.points.at(0).shift_mm) << "as where $LOAD states it";
  EXPECT_EQ(full.tools.at(0).load, 4);
  ASSERT_EQ(full.warnings.size(), 2u);
  const std::string heavier = calib::words(full.warnings[1]);
  EXPECT_EQ(heavier.find("5 kg on the flange: in the touches 1.53"), 0u) << heavier;
  ASSERT_EQ(set.warnings.size(), 1u);
  EXPECT_EQ(calib::words(set.warnings[0]), heavier);
  const std::string words = calib::words(full.warnings[0]);
  for (const char* part : {"tool 4", "LOAD_DATA[4] 5.00 kg at X 60", "cell file 1.53 kg"})
    EXPECT_NE(words.find(part), std::string::npos) << words;
}

/// With a counterbalance and a gear of rising stiffness on one joint, the bound holds up to the touched load.
TEST(ALoad, BeyondThoseOfTheTouchesIsNamedWithTheSpringOfItsArm) {
  calib::Calibration c = calibration();
  const auto words = [&](double mass_kg) {
    const auto heavier = krl::heavier_than_touched(c, mass_kg);
    return heavier ? calib::words(*heavier) : "";
  };
  EXPECT_EQ(words(2.0), "");
  c.cell.robot.joints[1].counterbalance_sigma_rad = 1e-3;
  EXPECT_EQ(words(2.0), "");
  c.cell.robot.joints[1].stiffening_sigma_rad = 3e-4;
  EXPECT_EQ(words(1.6), "");
  EXPECT_NE(words(2.0).find("2 kg on the flange: in the touches 1.53"), std::string::npos);
  EXPECT_NE(words(2.0).find("does not hold for more, since the gear of A2"), std::string::npos);
  c.cell.loads.push_back({"part", 0.5, Eigen::Vector3d::Zero()});
  c.touched_loads = {"", "part"};
  EXPECT_EQ(words(2.0), "") << "touched with it";
}

TEST(ALoad, OfAnotherToolFarAboveThoseOfTheTouchesIsNamed) {
  krl::ProgramFiles f = loaded("BAS(#TOOL,5)\n" + std::string(kHere));
  f.controller[0].text +=
      "TOOL_DATA[5]={X 0.0,Y 0.0,Z 300.0,A 0.0,B 0.0,C 0.0}\n"
      "LOAD_DATA[5]={M 5.0,CM {X 60.0,Y 0.0,Z 150.0,A 0,B 0,C 0},J {X 0,Y 0,Z 0}}\n";
  const CorrectedProgram result = correct_program(calibration(), f, {.anywhere = true});
  ASSERT_EQ(result.warnings.size(), 1u) << all_words(result);
  EXPECT_EQ(calib::words(result.warnings[0]).find("5 kg on the flange"), 0u);
}

TEST(TheCellsTool, IsNamedWithItsLoadInABackup) {
  krl::BackupFiles files;
  files.controller = loaded("").controller;
  files.controller[0].text +=
      "TOOL_DATA[2]={X 59.9,Y 50.5,Z 410.3,A 38.84,B 3.59,C 0.0}\n";  // LOAD_DATA[2]: 5 kg
  files.modules = {loaded("BAS(#TOOL,2)\n" + std::string(kHere)),
                   loaded("BAS(#TOOL,1)\n" + std::string(kHere))};
  files.modules[1].src.name = "q.src";
  const krl::CorrectedBackup result = correct_backup(calibration(), files);
  ASSERT_EQ(result.modules.at(0).tools.size(), 1u);
  EXPECT_EQ(result.modules[0].tools[0].load, 2);
  ASSERT_EQ(result.modules.at(1).tools.size(), 1u);
  EXPECT_EQ(result.modules[1].tools[0].load, -1);
  EXPECT_EQ(result.warnings.size(), 2u) << "another load than the cell file's, and far heavier";
}

TEST(ALoadInForce, IsNamedWithEachModuleOfABackup) {
  const auto module = [](const std::string& name, const std::string& body) {
    krl::ProgramFiles one = loaded("$TOOL=TOOL_DATA[1]\n" + body);
    one.src.name = name + ".src";
    one.dat->name = name + ".dat";
    one.controller.clear();
    return one;
  };
  krl::BackupFiles files;
  files.controller = loaded("").controller;
  files.modules = {module("empty", kHere),
                   module("full", "$LOAD=LOAD_DATA[2]\n" + std::string(kHere)),
                   module("refused", "$LOAD=LOAD_DATA[9]\n" + std::string(kHere))};
  const krl::CorrectedBackup result = correct_backup(calibration(), files);
  ASSERT_EQ(result.modules.size(), 3u);
  ASSERT_EQ(result.modules[0].tools.size(), 1u);
  EXPECT_EQ(result.modules[0].tools[0].number, 1);
  EXPECT_EQ(result.modules[0].tools[0].load, -1) << "the tool's own";
  ASSERT_EQ(result.modules[1].tools.size(), 1u);
  EXPECT_EQ(result.modules[1].tools[0].load, 2);
  EXPECT_TRUE(result.modules[2].tools.empty());
}

TEST(ALoadInForce, StaysUntilAnotherIsSet) {
  const CorrectedProgram result =
      corrected_with("BAS(#TOOL,1)\n" + std::string(kHere) +
                     "$LOAD=LOAD_DATA[2]\nPTP {A1 25.0,A2 -80.0,A3 80.0,A4 10.0,A5 40.0,A6 0.0}\n"
                     "BAS(#TOOL,1)\nPTP {A1 30.0,A2 -80.0,A3 80.0,A4 10.0,A5 40.0,A6 0.0}\n");
  ASSERT_TRUE(result.refusals.empty()) << all_words(result);
  ASSERT_EQ(result.tools.size(), 2u);
  EXPECT_EQ(result.tools[0].load, -1);
  EXPECT_EQ(result.tools[1].load, 2);
}

TEST(ALoadInForce, ThatCannotBeResolvedIsRefusedByNameAndLine) {
  const std::string tool = "$TOOL=TOOL_DATA[1]\n";
  EXPECT_EQ(refused_as(tool + "$LOAD=LOAD_DATA[9]\n" + kHere), "no_such_load:4 ");
  EXPECT_EQ(refused_as(tool + "$LOAD=LOAD_DATA[3]\n" + kHere), "no_such_load:4 ") << "no mass";
  for (const char* unknown :
       {"$LOAD=PART_LOAD\n", "$LOAD=LOAD_DATA[I]\n", "$LOAD=LOAD_DATA[1+1]\n", "$LOAD.M=3.0\n",
        "$LOAD={M 3.0}\n", "$LOAD.CM={X 0,Y 0,Z 0}\n", "$LOAD.M=M1\n$LOAD.CM={X 0,Y 0,Z 0}\n",
        "$LOAD={M 3.0,CM {X X1,Y 0,Z 0}}\n", "$LOAD={M 3,CM {X 0,Y 0,Z 0}}\n$LOAD.CM.X=X1\n",
        "$LOAD.CM={X 0,Y 0,Z 0}\n$LOAD=LOAD_DATA[2]\n$LOAD.M=3.0\n"})
    EXPECT_EQ(refused_as(tool + unknown + kHere).substr(0, 15), "load_not_known:") << unknown;
  const auto result = corrected_with(tool + "$LOAD=PART_LOAD\n" + kHere);
  EXPECT_NE(all_words(result).find("load in force unknown"), std::string::npos);
  EXPECT_NE(all_words(result).find("$LOAD"), std::string::npos);
}

/// With a LOAD in p.dat.
CorrectedProgram named(const std::string& declaration, const std::string& body) {
  krl::ProgramFiles f = loaded("$TOOL=TOOL_DATA[1]\n" + body + kHere);
  f.dat->text = "DEFDAT P\n" + declaration + "\nENDDAT\n";
  return correct_program(calibration(), f);
}

TEST(ALoadInForce, ByTheNameOfAVariableIsThatOfItsDeclaration) {
  const std::string value = "={M 5.0,CM {X 60.0,Y 0.0,Z 150.0,A 0.0,B 0.0,C 0.0},J {X 0,Y 0,Z 0}}";
  const CorrectedProgram numbered =
      corrected_with("$TOOL=TOOL_DATA[1]\n$LOAD=LOAD_DATA[2]\n" + std::string(kHere));
  for (const char* type : {"DECL GLOBAL LOAD ", "DECL LOAD "}) {
    const auto result = named(type + ("part_L" + value), "$LOAD = part_L\n");
    ASSERT_EQ(result.points.size(), 1u) << all_words(result);
    EXPECT_EQ(result.points[0].shift_mm, numbered.points.at(0).shift_mm);
    EXPECT_EQ(result.tools.at(0).load_name, "PART_L");
    EXPECT_TRUE(result.tools[0].other_load());
  }
  for (const std::string& refused :
       {"DECL FRAME part_L" + value, std::string("DECL LOAD part_L={M 5.0}"),
        std::string("DECL LOAD part_L"),
        std::string("DECL LOAD part_L={M -1.0,CM {X 0,Y 0,Z 0,A 0,B 0,C 0}}"),
        "DECL LOAD part_L" + value + "\nDECL LOAD part_L" + value})
    EXPECT_FALSE(named(refused, "$LOAD=part_L\n").refusals.empty()) << refused;
  for (const char* changed : {"part_L.M=3\n$LOAD=part_L\n", "$LOAD=part_L\npart_L=other\n"})
    EXPECT_FALSE(named("DECL LOAD part_L" + value, changed).refusals.empty()) << changed;
}

TEST(ALoadInForce, WrittenOutInNumbersIsBorneAsItsLoadDataWouldBe) {
  const std::string tool = "$TOOL=TOOL_DATA[1]\n";
  const CorrectedProgram numbered = corrected_with(tool + "$LOAD=LOAD_DATA[2]\n" + kHere);
  const std::string com = "{X 60.0,Y 0.0,Z 150.0,A 0.0,B 0.0,C 0.0}";
  for (const std::string& written :
       {"$LOAD={M 5.0,CM " + com + ",J {X 0,Y 0,Z 0}}\n", "$LOAD.M=5.0\n$LOAD.CM=" + com + "\n",
        "$LOAD.CM=" + com + "\n$LOAD.M=5\n$LOAD.J={X 1,Y 0,Z 0}\n",
        "$LOAD={M 9,CM " + com + "}\n$LOAD.M=5\n"}) {
    const auto result = corrected_with(tool + written + kHere);
    ASSERT_EQ(result.points.size(), 1u) << written << all_words(result);
    EXPECT_EQ(result.points[0].shift_mm, numbered.points.at(0).shift_mm) << written;
    EXPECT_EQ(result.tools.at(0).load_name, "$LOAD 5 kg at 60 0 150 mm");
  }
  const auto own = corrected_with("$LOAD.M=9\n$LOAD.CM=" + com +
                                  "\nBAS(#TOOL,1)\n$LOAD.J={X 1,Y 0,Z 0}\n" + kHere);
  EXPECT_EQ(all_words(own), "") << "BAS sets the tool's own load";
}

TEST(ALoadInForce, ByANameThatAnotherModuleChangesIsRefused) {
  const std::string value =
      "={M 5.0,CM {X 60.0,Y 0.0,Z 150.0,A 0.0,B 0.0,C 0.0},J {X 0,Y 0,Z 0}}\n";
  for (const bool changed : {false, true}) {
    krl::BackupFiles files;
    files.controller = loaded("").controller;
    files.modules = {loaded("$TOOL=TOOL_DATA[1]\n$LOAD=part_L\n" + std::string(kHere)), {}};
    files.modules[0].dat->text = "DEFDAT P\nDECL GLOBAL LOAD part_L" + value;
    files.modules[1].src = {"q.src",
                            std::string("DEF Q()\n") + (changed ? "part_L.M=3\n" : "") + "END\n"};
    EXPECT_EQ(correct_backup(calibration(), files).modules.at(0).refusals.empty(), !changed);
    krl::ProgramFiles alone = files.modules[0];
    alone.controller = files.controller;
    alone.modules = {files.modules[1].src};
    EXPECT_EQ(correct_program(calibration(), alone).refusals.empty(), !changed);
  }
}

TEST(ALoadInForce, InABranchIsUnknownBehindIt) {
  EXPECT_NE(refused_as("$TOOL=TOOL_DATA[1]\nIF $IN[1] THEN\n$LOAD=LOAD_DATA[2]\nENDIF\n" +
                       std::string(kHere)),
            "");
}

TEST(ALoadInForce, AtRunTimeIsTheToolsOwnAndAnotherNamedByLine) {
  const auto other = [](const std::string& body) {
    krl::BackupFiles files;
    krl::ProgramFiles module;
    module.src = {"p.src", "DEF p()\n" + body + "LIN {X 1.0,Y 2.0,Z 3.0,A 0.0,B 0.0,C 0.0}\nEND\n"};
    files.modules.push_back(module);
    const krl::RewrittenPrograms result = krl::rewrite_motions(files, {});
    const krl::RewrittenModule& made = result.modules.at(0);
    EXPECT_TRUE(made.refusals.empty());
    return made.other_load.empty() ? std::string()
                                   : std::to_string(made.other_load_line) + ":" + made.other_load;
  };
  EXPECT_EQ(other("$TOOL=TOOL_DATA[2]\n$BASE=BASE_DATA[1]\n$LOAD=LOAD_DATA[2]\n"), "");
  EXPECT_EQ(other("$LOAD=LOAD_DATA[2]\n$TOOL=TOOL_DATA[2]\n"), "");
  EXPECT_EQ(other("$TOOL=TOOL_DATA[1]\n$LOAD=LOAD_DATA[2]\n"), "3:LOAD_DATA[2]");
  EXPECT_EQ(other("$LOAD.M=3.0\n"), "2:$LOAD");
}

}  // namespace
}  // namespace cellcal::daemon::testing
