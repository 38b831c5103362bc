// Several tools in a cell file, and optional columns of touches.

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "calib/files/toml.h"
#include "calib/model/kinematics.h"
#include "calib/model/units.h"
#include "tests/calib/files/documents.h"

namespace cellcal::calib {
namespace {

using testing::cell_of;
using testing::cell_refusal;
using testing::expect_words;
using testing::kCell;
using testing::refusal;
using testing::with;

constexpr const char* kSecond = R"([[tool]]
id = "P2"
xyz_mm = [120.0, -30.5, 95.25]
xyz_sigma_mm = [1, 2, 3]
tip_radius_mm = 6.35

)";

/// kCell with a list of tools: its own, named P1, and `more`.
std::string listed(const std::string& more) {
  const std::string text = with(kCell, "[tool]", "[[tool]]\nid = \"P1\"");
  return with(text, "[[target]]\nid = \"S1\"", more + "[[target]]\nid = \"S1\"");
}

TEST(Tools, ATableAloneIsReadAndWrittenAsEver) {
  const Cell cell = testing::cell();
  EXPECT_TRUE(cell.tool.id.empty());
  EXPECT_TRUE(cell.other_tools.empty());
  const std::string written = cell_to_toml(cell, "two.toml");
  EXPECT_NE(written.find("\n[tool]\nxyz_mm = [59.9, 50.5, 410.3]\n"), std::string::npos) << written;
  EXPECT_EQ(written.find("turn_sigma_deg"), std::string::npos) << written;
}

TEST(Tools, OfAListTheFirstIsTheCellsAndTheOthersAreBesideIt) {
  const Cell cell = cell_of(listed(kSecond));
  EXPECT_EQ(cell.tool.id, "P1");
  EXPECT_NEAR(cell.tool.tip_radius_m, 0.6e-3, 1e-15);
  ASSERT_EQ(cell.other_tools.size(), 1u);
  const Tool& second = cell.other_tools[0];
  EXPECT_EQ(second.id, "P2");
  EXPECT_LT((second.tcp.translation() - Eigen::Vector3d(0.12, -0.0305, 0.09525)).norm(), 1e-15);
  EXPECT_LT((second.tcp_sigma_m - Eigen::Vector3d(1e-3, 2e-3, 3e-3)).norm(), 1e-15);
  EXPECT_EQ(second.mass_kg, 0.0);
}

TEST(Tools, SurviveBeingWrittenAlsoThroughJson) {
  const std::string once = cell_to_toml(cell_of(listed(kSecond)), "two.toml");
  for (const Cell& again :
       {cell_of(once), read_cell(table_from_json(toml_to_json(once), "json"), testing::robot())}) {
    EXPECT_EQ(cell_to_toml(again, "two.toml"), once);
    ASSERT_EQ(again.other_tools.size(), 1u);
    EXPECT_EQ(again.other_tools[0].id, "P2");
  }
}

/// kCell with loads of its tool.
std::string with_loads(const std::string& more) {
  return with(kCell, "[[target]]\nid = \"S1\"", more + "[[target]]\nid = \"S1\"");
}

constexpr const char* kFull = "[[load]]\nid = \"full\"\nmass_kg = 8.5\ncom_mm = [10, -20, 150]\n\n";

TEST(Loads, AreReadAndSurviveBeingWrittenAlsoThroughJson) {
  const Cell cell = cell_of(with_loads(kFull));
  ASSERT_EQ(cell.loads.size(), 1u);
  EXPECT_EQ(cell.loads[0].id, "full");
  EXPECT_EQ(cell.loads[0].mass_kg, 8.5);
  EXPECT_LT((cell.loads[0].com_m - Eigen::Vector3d(0.01, -0.02, 0.15)).norm(), 1e-15);
  const std::string once = cell_to_toml(cell, "two.toml");
  const Cell again = read_cell(table_from_json(toml_to_json(once), "json"), testing::robot());
  EXPECT_EQ(cell_to_toml(again, "two.toml"), once);
  EXPECT_EQ(cell_of(once).loads.size(), 1u);
}

TEST(Loads, ThatCannotBeAreRefusedByKey) {
  for (const auto& [now, key] : std::initializer_list<std::pair<const char*, const char*>>{
           {"id = \"\"", "load[1].id"},
           {"id = \"a,b\"", "load[1].id"},
           {"id = \"full\"\ncolour = 1", "load[1].colour"}})
    expect_words(cell_refusal(with(with_loads(kFull), "id = \"full\"", now)), {"cell.toml:", key});
  for (const auto& [was, now, key] :
       std::initializer_list<std::tuple<const char*, const char*, const char*>>{
           {"mass_kg = 8.5", "mass_kg = -1", "load[1].mass_kg"},
           {"mass_kg = 8.5", "mass_kg = nan", "load[1].mass_kg"},
           {"mass_kg = 8.5\n", "", "load[1].mass_kg"},
           {"com_mm = [10, -20, 150]", "com_mm = [10]", "load[1].com_mm"}})
    expect_words(cell_refusal(with(with_loads(kFull), was, now)), {"cell.toml:", key});
  expect_words(cell_refusal(with_loads(std::string(kFull) + kFull)), {"load[2].id", "twice"});
  std::string many;
  for (int k = 0; k < 17; ++k) many += with(kFull, "full", "l" + std::to_string(k));
  expect_words(cell_refusal(with_loads(many)), {"at most 16 [[load]] tables"});
}

TEST(Loads, ATouchNamesItsLoadAndAnUnknownOneIsRefusedByColumn) {
  const Cell cell = cell_of(with_loads(kFull));
  const std::string text = "A1,A2,target,load\n1,2,S1,full\n1,3,S1,\n";
  const std::vector<Touch> touches = parse_touches(text, "touches.csv", cell);
  ASSERT_EQ(touches.size(), 2u);
  EXPECT_EQ(touches[0].load, "full");
  EXPECT_EQ(touches[1].load, "");
  std::vector<Touch> again =
      parse_touches(format_touches(touches, cell.robot), "touches.csv", cell);
  EXPECT_EQ(again[0].load, "full");
  EXPECT_EQ(again[1].load, "");
  const std::string refused =
      refusal([&] { (void)parse_touches(with(text, "full", "empty"), "touches.csv", cell); });
  expect_words(refused, {"touches.csv:2", "load", "no [[load]] \"empty\""});
}

TEST(Tools, ThatCannotBeToldApartOrAreTooManyAreRefusedWithTheirLine) {
  struct Broken {
    const char* now;  ///< replaces id = "P2"
    const char* key;
  };
  for (const Broken& broken :
       std::initializer_list<Broken>{{"id = \"P1\"", "tool[2].id"},
                                     {"id = \"\"", "tool[2].id"},
                                     {"id = \"a,b\"", "tool[2].id"},
                                     {"id = \"tool\"", "tool[2].id"},
                                     {"id = \"touch\"", "tool[2].id"},
                                     {"id = \"A1\"", "tool[2].id"},
                                     {"id = \"P\\n2\"", "tool[2].id"},
                                     {"id = 5", "tool[2].id"},
                                     {"id = \"P2\"\ncolour = \"red\"", "tool[2].colour"},
                                     {"id = \"P2\"\nmass_kg = -1", "tool[2].mass_kg"},
                                     {"id = \"P2\"\nmass_kg = nan", "tool[2].mass_kg"}}) {
    SCOPED_TRACE(broken.now);
    expect_words(cell_refusal(listed(with(kSecond, "id = \"P2\"", broken.now))),
                 {"cell.toml:", broken.key});
  }
  expect_words(cell_refusal(listed(with(kSecond, "id = \"P2\"\n", ""))), {"tool[2].id", "missing"});
  expect_words(cell_refusal(listed(with(kSecond, "\"P2\"", "\"S2\""))),
               {"cell.toml:", "target[2].id", "is the id of a tool"});
  std::string many;
  for (int k = 2; k <= kMaxTools + 1; ++k) many += with(kSecond, "P2", "P" + std::to_string(k));
  expect_words(cell_refusal(listed(many)), {"cell.toml:", "tool", "1 to 8"});
  expect_words(cell_refusal(with(kCell, "[tool]", "tool = []\n[other]")), {"cell.toml:", "tool"});
  expect_words(cell_refusal(with(kCell, "tip_radius_mm = 0.6", "tip_radius_mm = 0.6\nid = \"P1\"")),
               {"cell.toml:", "tool.id", "unknown key"});
}

TEST(Tools, TurnsOfATrackerHaveOneSigmaForAll) {
  const std::string line = "sigma_mm = 0.03\n";
  EXPECT_NEAR(cell_of(with(kCell, line, line + "turn_sigma_deg = 0.01\n")).turn_sigma_rad,
              0.01 * kRadPerDeg, 1e-15);
  for (const char* bad : {"-1", "91", "nan", "inf", "\"0.01\"", "[0.01]"})
    expect_words(cell_refusal(with(kCell, line, line + "turn_sigma_deg = " + bad + "\n")),
                 {"cell.toml:", "touch.turn_sigma_deg"});
}

/// A cell with two tools and a tracker.
const Cell& many_sided() {
  static const Cell cell = cell_of(with(
      listed(kSecond), "[[length]]", "[[target]]\nid = \"L\"\nkind = \"tracker\"\n\n[[length]]"));
  return cell;
}

std::vector<Touch> parse_of_many_sided(const std::string& text) {
  return parse_touches(text, "touches.csv", many_sided());
}

std::string csv_refusal(const std::string& text) {
  return refusal([&] { (void)parse_of_many_sided(text); });
}

TEST(TouchColumns, AToolIsNamedOrItIsTheFirst) {
  const auto touches = parse_of_many_sided("A1,A2,target,tool\n1,2,S1,P2\n1,2,S1,P1\n1,2,S1,\n");
  EXPECT_EQ(touches[0].tool, "P2");
  EXPECT_EQ(touches[1].tool, "") << "one tool has one name";
  EXPECT_EQ(touches[2].tool, "");
  expect_words(csv_refusal("A1,A2,target,tool\n1,2,S1,P3\n"), {"touches.csv:2: tool", "P3"});
  EXPECT_EQ(parse_touches("A1,A2,target,tool\n1,2,S1,tool\n", "t.csv", testing::cell())[0].tool,
            "");
  expect_words(testing::touches_refusal("A1,A2,target,tool\n1,2,S1,P2\n"), {"tool", "P2"});
}

TEST(TouchColumns, ATemperatureIsCarriedInDegreesCelsius) {
  const auto touches =
      parse_of_many_sided("A1,A2,target,temperature_c\n1,2,S1,21.25\n1,2,S1,\n1,2,S1,-3\n");
  EXPECT_EQ(touches[0].temperature_c, 21.25);
  EXPECT_FALSE(touches[1].temperature_c);
  EXPECT_EQ(touches[2].temperature_c, -3.0);
  for (const char* bad : {"293.15e3", "-101", "201", "nan", "inf", "warm", "21 C"})
    expect_words(csv_refusal(std::string("A1,A2,target,temperature_c\n1,2,S1,") + bad + "\n"),
                 {"touches.csv:2: temperature_c"});
}

TEST(TouchColumns, ATimeIsOfIso8601) {
  EXPECT_EQ(parse_of_many_sided("A1,A2,target,time\n1,2,S1,2024-09-24T10:00:00+02:00\n")[0].time,
            "2024-09-24T10:00:00+02:00");
  for (const char* bad : {"now", "24.09.2024", "10:00", "1727172000"})
    expect_words(csv_refusal(std::string("A1,A2,target,time\n1,2,S1,") + bad + "\n"),
                 {"touches.csv:2: time", bad, "ISO 8601"});
}

TEST(TouchColumns, TurnsOfATrackerAreThreeWithASigma) {
  const std::string head = "A1,A2,target,x_mm,y_mm,z_mm,a_deg,b_deg,c_deg,turn_sigma_deg\n";
  const Touch touch = parse_of_many_sided(head + "1,2,L,10,20,30,-90,0.5,180,0.02\n")[0];
  ASSERT_TRUE(touch.tracker_abc_rad);
  EXPECT_NEAR((*touch.tracker_abc_rad)[0], -90 * kRadPerDeg, 1e-15);
  EXPECT_NEAR((*touch.tracker_abc_rad)[2], 180 * kRadPerDeg, 1e-15);
  EXPECT_NEAR(touch.turn_sigma_rad, 0.02 * kRadPerDeg, 1e-15);
  EXPECT_FALSE(parse_of_many_sided(head + "1,2,L,10,20,30,,,,\n")[0].tracker_abc_rad);
  expect_words(csv_refusal(head + "1,2,L,10,20,30,1,,3,0.02\n"),
               {"touches.csv:2: b_deg", "missing"});
  expect_words(csv_refusal(head + "1,2,L,10,20,30,1,2,3,\n"),
               {"touches.csv:2: turn_sigma_deg", "missing", "[touch]"});
  expect_words(csv_refusal(head + "1,2,S1,10,20,30,1,2,3,0.02\n"),
               {"touches.csv:2: a_deg", "tracker"});
  for (const char* bad : {"1,2,3,0", "1,2,3,-1", "1,2,3,nan", "1,2,3,91"})
    expect_words(csv_refusal(head + "1,2,L,10,20,30," + bad + "\n"),
                 {"touches.csv:2: turn_sigma_deg"});
  for (const char* bad : {"inf,2,3,1", "1e9,2,3,1", "x,2,3,1"})
    expect_words(csv_refusal(head + "1,2,L,10,20,30," + bad + "\n"), {"touches.csv:2: a_deg"});
}

TEST(TouchColumns, TheTargetMayBeAbsentOfATrackerAlone) {
  Cell cell = many_sided();
  std::erase_if(cell.targets, [](const Target& one) { return one.kind != TargetKind::kTracker; });
  ASSERT_EQ(cell.targets.size(), 1u);
  const std::string table = "A1,A2,x_mm,y_mm,z_mm\n1,2,10,20,30\n";
  EXPECT_EQ(parse_touches(table, "touches.csv", cell)[0].target, cell.targets[0].id);
  expect_words(csv_refusal(table), {"touches.csv:1:", "no column \"target\""});
}

TEST(TouchColumns, TurnsOfATrackerMayBeAQuaternionInAnyOrder) {
  const std::string rest = ",turn_sigma_deg\n1,2,L,10,20,30,",
                    head = "A1,A2,target,x_mm,y_mm,z_mm,";
  for (const auto& [columns, row] :
       {std::pair("qw,qx,qy,qz", "0.5,0.5,-0.5,0.5"), std::pair("qx,qy,qz,qw", "0.5,-0.5,0.5,0.5"),
        std::pair("Quat W,Quat X,Quat Y,Quat Z", "-0.5001,-0.5,0.5,-0.5")}) {
    const Touch touch = parse_of_many_sided(head + columns + rest + row + ",0.02\n")[0];
    ASSERT_TRUE(touch.tracker_abc_rad) << columns;
    const auto& abc = *touch.tracker_abc_rad;
    const FrameMmDeg frame{{}, {abc[0] * kDegPerRad, abc[1] * kDegPerRad, abc[2] * kDegPerRad}};
    EXPECT_TRUE(to_isometry(frame).linear().isApprox(
        Eigen::Quaterniond(0.5, 0.5, -0.5, 0.5).toRotationMatrix(), 1e-3))
        << columns;
  }
  EXPECT_FALSE(parse_of_many_sided(head + "qw,qx,qy,qz" + rest + ",,,,\n")[0].tracker_abc_rad);
  expect_words(csv_refusal(head + "qw,qx,qy,qz" + rest + "1,1,0,0,0.02\n"),
               {"touches.csv:2: qw", "length 1.41", "length 1"});
  expect_words(csv_refusal(head + "qw,qx,qy" + rest + "1,0,0,0.02\n"),
               {"touches.csv:1: qz: missing"});
  expect_words(csv_refusal(head + "q0,q1,q2,q3" + rest + "1,0,0,0,0.02\n"),
               {"unknown column \"q0\""});
  expect_words(csv_refusal(head + "a_deg,qw,qx,qy,qz" + rest + "5,1,0,0,0,0.02\n"),
               {"touches.csv:2:", "both"});
}

TEST(TouchColumns, AllSurviveBeingWritten) {
  const auto touches = parse_of_many_sided(
      "A1,A2,target,tool,x_mm,y_mm,z_mm,a_deg,b_deg,c_deg,turn_sigma_deg,temperature_c,time,set\n"
      "1,2,L,P2,10,20,30,-90,0.5,180,0.02,21.5,2024-09-24T10:00:00Z,check\n"
      "3,4,S2,,,,,,,,,,,fit\n");
  const std::string once = format_touches(touches, many_sided().robot);
  const auto again = parse_of_many_sided(once);
  EXPECT_EQ(format_touches(again, many_sided().robot), once);
  ASSERT_EQ(again.size(), 2u);
  EXPECT_EQ(again[0].tool, "P2");
  EXPECT_EQ(again[0].temperature_c, 21.5);
  ASSERT_TRUE(again[0].tracker_abc_rad);
  EXPECT_NEAR((*again[0].tracker_abc_rad)[1], 0.5 * kRadPerDeg, 1e-12);
  EXPECT_EQ(again[1].tool, "");
  EXPECT_FALSE(again[1].temperature_c);
  EXPECT_FALSE(again[1].tracker_abc_rad);
}

}  // namespace
}  // namespace cellcal::calib
