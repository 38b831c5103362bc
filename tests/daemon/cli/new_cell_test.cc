// new-cell: its files have all keys known to the reader; invalid answers write nothing.

#include "daemon/cli/new_cell.h"

#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>

#include "calib/files/cell_file.h"
#include "calib/files/files.h"
#include "calib/files/robot_file.h"
#include "daemon/cell_form/cell_text.h"
#include "tests/daemon/cli/content.h"
#include "tests/daemon/cli/process.h"
#include "tests/daemon/journal/temporary_directory.h"

namespace cellcal::daemon::testing {
namespace {

void write(const std::filesystem::path& path, const std::string& text) {
  std::ofstream(path) << text;
}

/// The demonstration's four spheres on a shipped robot.
CellForm form(bool with_centres = true) {
  CellForm form;
  form.robot = find_robot("kr5_r1400", "cell.toml");
  form.tool = {{59.9, 50.5, 410.3}, {38.84, 3.59, 0.0}, {}, 1.535, 0.0};
  const std::map<std::string, Triple> centres{{"S1", {1080, -320, 330}},
                                              {"S2", {1060, 380, 330}},
                                              {"S3", {640, -620, 640}},
                                              {"S4", {760, 560, 780}}};
  for (const auto& [id, centre] : centres)
    form.spheres.push_back(
        {id, 61.4, 0.002, with_centres ? std::optional(centre) : std::nullopt, 10.0});
  form.lengths = {{"S1", "S2", 700.286, 0.005}, {"S1", "S3", 616.198, 0.005}};
  return form;
}

calib::Cell read(const std::string& text, const CellForm& form) {
  return calib::parse_cell({"new.toml", text, form.robot.name, form.robot.text});
}

std::string reason(const std::string& text, const CellForm& form) {
  try {
    read(text, form);
    return "accepted";
  } catch (const calib::FileError& error) {
    return error.what();
  }
}

/// Keys known to the reader at the position of `wrong_key`.
std::set<std::string> known(const std::string& text, const CellForm& form) {
  const std::string message = reason(text, form), mark = "known here are: ";
  const std::size_t at = message.find(mark);
  EXPECT_NE(at, std::string::npos) << message;
  std::set<std::string> names;
  const std::string list = at == std::string::npos ? "" : message.substr(at + mark.size());
  const std::regex word("[a-z0-9_]+");
  for (std::sregex_iterator one(list.begin(), list.end(), word), end; one != end; ++one)
    names.insert(one->str());
  return names;
}

using Keys = std::map<std::string, std::set<std::string>>;

/// All keys in the file, set, commented or mentioned in a comment, by table.
Keys keys_of(const std::string& text) {
  Keys keys;
  std::string table, line;
  std::smatch match;
  const std::regex key("([a-z][a-z0-9_]*) = ");
  for (std::istringstream lines(text); std::getline(lines, line);) {
    if (std::regex_search(line, match, std::regex("^#?\\[+([a-z]+)\\]"))) table = match[1];
    for (std::sregex_iterator one(line.begin(), line.end(), key), end; one != end; ++one)
      keys[table].insert((*one)[1]);
  }
  return keys;
}

/// Every key of cellcal.cell/1 by table, as listed by the reader for a wrong one.
Keys keys_of_the_reader(const CellForm& form) {
  const std::string top = "format = \"cellcal.cell/1\"\nrobot = \"kr5_r1400\"\n";
  const std::string tool = "[tool]\nxyz_mm = [1, 2, 3]\n", touch = "[touch]\nsigma_mm = 0.03\n";
  const std::string sphere = "[[target]]\nid = \"S\"\nkind = \"sphere\"\ndiameter_mm = 9\n";
  const std::string other = "[[target]]\nid = \"T\"\nkind = \"point\"\n";
  const std::string x = "no_such_key = 1\n", place = "xyz_mm = [0, 0, 0]\n";
  const std::string whole = top + tool + sphere + other + touch;
  Keys keys;
  const auto add = [&](const char* table, const std::string& text) {
    for (const std::string& key : known(text, form)) keys[table].insert(key);
  };
  add("", top + x + tool + sphere + touch);
  add("tool", top + tool + x + sphere + touch);
  add("tool", top + "[[tool]]\nid = \"a\"\nxyz_mm = [1, 2, 3]\n" + x + sphere + touch);
  add("touch", whole + x);
  add("identity", whole + "[identity]\n" + x);
  add("load", whole + "[[load]]\nid = \"l\"\nmass_kg = 1\ncom_mm = [0, 0, 1]\n" + x);
  add("length", whole + "[[length]]\nbetween = [\"S\", \"T\"]\nmm = 9\nsigma_mm = 1\n" + x);
  for (const char* kind :
       {"sphere\"\ndiameter_mm = 9", "wire\"", "plane\"", "point\"", "tracker\""})
    add("target", whole + "[[target]]\nid = \"U\"\nkind = \"" + kind + "\n" + x);
  for (const char* shape :
       {"box\"\nsize_mm = [1, 1, 1]", "cylinder\"\ndiameter_mm = 1\nheight_mm = 1",
        "mesh\"\nfile = \"a.stl\""})
    add("obstacle", whole + "[[obstacle]]\nid = \"o\"\nshape = \"" + shape + "\n" + place + x);
  return keys;
}

class ANewCellFile : public ::testing::TestWithParam<bool> {};

TEST_P(ANewCellFile, HasEveryKeyThatTheReaderKnows) {
  const CellForm made = form(GetParam());
  const Keys written = keys_of(cell_text(made));
  std::set<std::string> top = written.at("");
  for (const auto& [table, names] : keys_of_the_reader(made)) {
    for (const std::string& key : names) {
      if (!table.empty())
        EXPECT_TRUE(written.contains(table) && written.at(table).contains(key))
            << table << "." << key;
      else
        EXPECT_TRUE(top.contains(key) || written.contains(key)) << key;
    }
  }
}

/// With numbers rounded to a thousandth, as in comments.
std::string rounded(const std::string& toml) {
  std::string out;
  const std::regex number("-?[0-9]+\\.[0-9]{4,}");
  auto last = toml.begin();
  for (std::sregex_iterator one(toml.begin(), toml.end(), number), end; one != end; ++one) {
    out.append(last, (*one)[0].first);
    std::ostringstream text;
    text.precision(3);
    text << std::fixed << std::stod(one->str());
    out += text.str();
    last = (*one)[0].second;
  }
  return out.append(last, toml.end());
}

TEST_P(ANewCellFile, SaysTheSameWithEveryDefaultSpelledOut) {
  const CellForm made = form(GetParam());
  const std::string text = cell_text(made);
  // Up to the examples of whole tables, which have other values.
  const std::size_t examples = text.find("\n# Who and what was there");
  const std::string spelled =
      std::regex_replace(text.substr(0, examples), std::regex("(^|\n)#([a-z0-9_]+ = )"), "$1$2");
  EXPECT_NE(spelled, text.substr(0, examples));
  ASSERT_EQ(reason(spelled, made), "accepted");
  // Written back only if stated: defaults of a stand, and the required accuracy.
  const std::regex stands("(stand_[a-z]+|required)_mm = [^\n]*\n");
  const auto said = [&](const std::string& one) {
    return std::regex_replace(rounded(calib::cell_to_toml(read(one, made), "r")), stands, "");
  };
  EXPECT_EQ(said(spelled), said(text));
}

TEST_P(ANewCellFile, HasExamplesThatCanBeTakenAsTheyAre) {
  const CellForm made = form(GetParam());
  const std::string text = cell_text(made);
  const std::string spelled =
      std::regex_replace(text, std::regex("(^|\n)#(\\[|[a-z0-9_]+ = )"), "$1$2");
  ASSERT_EQ(reason(spelled, made), "accepted");
  const calib::Cell cell = read(spelled, made);
  EXPECT_EQ(cell.obstacles.size(), 3u);
  EXPECT_EQ(cell.targets.size(), 8u);
}

INSTANTIATE_TEST_SUITE_P(NewCell, ANewCellFile, ::testing::Bool());

TEST(ANewCellFile, HasLinesThatATerminalShowsWhole) {
  std::string line;
  for (std::istringstream lines(cell_text(form())); std::getline(lines, line);)
    EXPECT_LE(line.size(), 112u) << line;
}

TEST(ANewCellFile, IsOfAnyRobotThatIsShipped) {
  for (const calib::NamedRobot& one : calib::shipped_robots()) {
    CellForm made = form();
    made.robot = find_robot(one.file, "cell.toml");
    EXPECT_EQ(reason(cell_text(made), made), "accepted") << one.file;
  }
}

TEST(ARobotFileBesideTheCellFile, IsNamedRelativeToIt) {
  const TemporaryDirectory dir;
  write(dir / "mine.toml", form().robot.text);
  EXPECT_EQ(find_robot(dir / "mine.toml", dir / "cell.toml").reference, "mine.toml");
  std::filesystem::create_directory(dir / "sub");
  EXPECT_EQ(find_robot(dir / "mine.toml", dir / "sub/cell.toml").reference, dir / "mine.toml");
}

// ---- the dialogue ----------------------------------------------------------------------------

const std::vector<std::string> kAnswers{"kr5_r1400",  "59.9 50.5 410.3 38.84 3.59 0",
                                        "",           "1.535",
                                        "",           "0",
                                        "61.4 0.002", "1080, -320, 330",
                                        "=",          "1060 380 330",
                                        "",           "700.286 0.005"};

std::string joined(const std::vector<std::string>& lines, std::size_t count) {
  std::string text;
  for (std::size_t i = 0; i < count; ++i) text += lines[i] + "\n";
  return text;
}

struct Asked {
  CellForm form;
  std::string out;
};

Asked ask(const std::string& input) {
  std::istringstream in(input);
  std::ostringstream out;
  Asked asked;
  ask_for_rest(asked.form, {}, "cell.toml", in, out);
  asked.out = out.str();
  return asked;
}

TEST(TheDialogue, MakesTheCellOfItsAnswers) {
  const Asked asked = ask(joined(kAnswers, kAnswers.size()));
  const CellForm& made = asked.form;
  EXPECT_EQ(made.robot.reference, "kr5_r1400");
  EXPECT_EQ(made.tool.abc_deg, (Triple{38.84, 3.59, 0}));
  EXPECT_EQ(made.tool.xyz_sigma_mm, (Triple{0.5, 0.5, 0.5}));
  EXPECT_EQ(cell_of(made).tool.tcp_sigma_m.x(), 0.5e-3) << "without it no tool frame comes of it";
  EXPECT_EQ(made.tool.mass_kg, 1.535);
  EXPECT_EQ(cell_of(made).floor_m, 0.0);
  ASSERT_EQ(made.spheres.size(), 2u);
  EXPECT_EQ(made.spheres[1].id, "S2");
  EXPECT_EQ(made.spheres[1].diameter_mm, 61.4);
  EXPECT_EQ(made.spheres[1].centre_mm, (Triple{1060, 380, 330}));
  ASSERT_EQ(made.lengths.size(), 1u);
  EXPECT_EQ(made.lengths[0].mm, 700.286);
}

TEST(TheDialogue, TakesACertificateThatWasGivenForSpheresThatItAsksFor) {
  CellForm made;
  made.lengths = {{"S1", "S2", 700.286, 0.005}};
  std::istringstream in(joined(kAnswers, kAnswers.size() - 1));
  std::ostringstream out;
  ask_for_rest(made, {.certificate = true}, "cell.toml", in, out);
  EXPECT_EQ(objection(made), "");
  EXPECT_EQ(made.lengths.size(), 1u);
}

TEST(TheDialogue, AsksAgainForABadAnswerWithTheReason) {
  const std::vector<std::pair<std::size_t, std::pair<std::string, std::string>>> bad{
      {0, {"kr5_r140", "no robot file \"kr5_r140\""}},
      {0, {"kr5_", "there are kr5_arc, kr5_r1400"}},
      {0, {"", "a name is needed"}},
      {0, {"?", "kr6_r900_2"}},
      {1, {"59.9 50.5", "2 numbers given, 3 or 6 numbers expected"}},
      {1, {"59,9 50,5 410,3 0", "7 numbers given"}},
      {1, {"59.9 50.5 nan", "\"nan\" is not a number"}},
      {1, {"59.9 50.5 1e999", "\"1e999\" is not a number"}},
      {1, {"0.0599 0.0505 0.4103", "mm"}},
      {2, {"0.5 0.5", "2 numbers given, 1 or 3 numbers expected"}},
      {2, {"-1", "tool.xyz_sigma_mm"}},
      {3, {"heavy", "\"heavy\" is not a number"}},
      {3, {"-1", "tool.mass_kg"}},
      {5, {"low", "\"low\" is not a number"}},
      {6, {"-3", "diameter_mm"}},
      {6, {"/none/spheres.csv", "/none/spheres.csv"}},
      {7, {"1080 -320", "2 numbers given, 3 or 6 numbers expected"}},
      {7, {"9000 0 300", "S1"}},
      {9, {"1080 -320 331", "S2"}},
      {11, {"700.286", "1 number given, 2 numbers expected"}},
      {11, {"770.286 0.005", "S1"}},
      {11, {std::string(70000, '7'), "is not a number"}}};
  for (const auto& [at, words] : bad) {
    std::vector<std::string> answers = kAnswers;
    answers.insert(answers.begin() + static_cast<std::ptrdiff_t>(at), words.first);
    const Asked asked = ask(joined(answers, answers.size()));
    EXPECT_NE(asked.out.find(words.second), std::string::npos)
        << words.first.substr(0, 40) << ": " << asked.out.substr(0, 2000);
    EXPECT_EQ(cell_text(asked.form), cell_text(ask(joined(kAnswers, kAnswers.size())).form));
  }
}

TEST(TheDialogue, EndsWhereTheInputEndsAndLeavesNothing) {
  for (std::size_t count = 0; count < kAnswers.size(); ++count) {
    const TemporaryDirectory dir;
    std::istringstream in(joined(kAnswers, count));
    std::ostringstream out;
    EXPECT_THROW(new_cell({.output = dir / "cell.toml"}, in, out), EndOfInput) << count;
    EXPECT_TRUE(std::filesystem::is_empty(dir / "")) << count;
  }
}

TEST(TheDialogue, DoesNotBeginWhereTheFileCouldNotBeWritten) {
  const TemporaryDirectory dir;
  std::filesystem::create_directory(dir / "folder");
  for (const char* place : {"none/cell.toml", "folder"}) {
    std::istringstream in(joined(kAnswers, kAnswers.size()));
    std::ostringstream out;
    EXPECT_THROW(new_cell({.output = dir / place}, in, out), std::runtime_error) << place;
    EXPECT_EQ(out.str(), "") << place;
  }
}

TEST(ATaughtCentre, LiesBelowTheTipThatTouchesTheTop) {
  CellForm made = form();
  made.spheres.clear();
  made.tool.tip_radius_mm = 1.5;
  const std::vector<double> joints{20, -70, 80, 10, 60, 30};
  const Triple tip = tip_mm(made, joints);
  std::vector<std::string> answers(kAnswers.begin(), kAnswers.begin() + 6);
  answers[4] = "1.5";
  answers.insert(answers.end(), {"50", "20 -70 80 10 60 30", ""});
  const Asked asked = ask(joined(answers, answers.size()));
  const Triple centre = asked.form.spheres.at(0).centre_mm.value();
  EXPECT_NEAR(centre[0], tip[0], 1e-9);
  EXPECT_NEAR(centre[1], tip[1], 1e-9);
  EXPECT_NEAR(centre[2], tip[2] - 26.5, 1e-9);
}

// ---- a controller's backup --------------------------------------------------------------------

/// A KR 5's machine data, with these lines of $config.dat.
std::string backup(const TemporaryDirectory& dir, const std::string& config) {
  std::filesystem::create_directories(dir / "backup/KRC/R1/Mada");
  std::filesystem::create_directories(dir / "backup/KRC/R1/System");
  std::string machine =
      "$TRAFONAME[]=\"#KR5 R1400\"\n$TIRORO={X 0,Y 0,Z 400,A 0,B 0,C 0}\n$LENGTH_A=180\n"
      "$LENGTH_B=600\n$TX3P3={X 620,Y 0,Z 40,A 0,B 90,C 0}\n$TFLWP={X 0,Y 0,Z 80,A 0,B 0,C 0}\n"
      "$ROBROOT={X 100,Y 0,Z 500,A 90,B 0,C 0}\n";
  for (int i = 1; i <= 6; ++i) {
    const std::string n = "[" + std::to_string(i) + "]=";
    machine += "$SOFTN_END" + n + "-150\n$SOFTP_END" + n + "150\n$VEL_AXIS_MA" + n +
               "3000\n$RAT_MOT_AX" + n + "{N 125,D 1}\n";
  }
  write(dir / "backup/KRC/R1/Mada/$machine.dat", machine);
  write(dir / "backup/KRC/R1/System/$config.dat", config);
  return dir / "backup";
}

const std::string kTorch =
    "TOOL_DATA[1]={X 59.9,Y 50.5,Z 410.3,A 38.84,B 3.59,C 0.0}\nTOOL_NAME[1,]=\"torch\"\n"
    "LOAD_DATA[1]={M 1.535,CM {X 10.0,Y 5.0,Z 120.0,A 0.0,B 0.0,C 0.0},J {X 0.0,Y 0.0,Z 0.0}}\n";
const std::string kProbe = "TOOL_DATA[3]={X 0.0,Y 0.0,Z 250.0,A 0.0,B 0.0,C 0.0}\n";
const std::string kOthers =
    "TOOL_DATA[2]={X 0.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0}\nBASE_NAME[4,]=\"table\"\n"
    "BASE_DATA[4]={X 100.0,Y 1000.0,Z 500.0,A 90.0,B 0.0,C 0.0}\n"
    "TOOL_DATA[5]={X 1.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0}\nTOOL_TYPE[5]=#TCP\n";

NewCellCommand from_backup(const TemporaryDirectory& dir, const std::string& config) {
  write(dir / "spheres.csv",
        "id,diameter_mm,x_mm,y_mm,z_mm\nS1,61.4,1080,-320,330\nS2,61.4,1060,380,330\n");
  return {.output = dir / "cell.toml",
          .spheres = dir / "spheres.csv",
          .machine_data = {backup(dir, config)}};
}

std::string refusal(const NewCellCommand& command, const std::string& answers = "") {
  std::istringstream in(answers);
  std::ostringstream out;
  try {
    new_cell(command, in, out);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "written";
}

TEST(ABackup, GivesArmToolAndLoadAndNamesOtherToolsAndBases) {
  const TemporaryDirectory dir;
  EXPECT_EQ(refusal(from_backup(dir, kTorch + kOthers)), "written");
  const calib::Cell made = calib::load_cell(dir / "cell.toml");
  EXPECT_EQ(made.robot.name, "KR5 R1400");
  EXPECT_TRUE(std::filesystem::exists(dir / "kr5_r1400.toml"));
  EXPECT_NEAR(made.tool.tcp.translation().z(), 0.4103, 1e-12);
  EXPECT_EQ(made.tool.mass_kg, 1.535);
  EXPECT_NEAR(made.tool.com_m.z(), 0.120, 1e-12);
  const std::string text = content(dir / "cell.toml");
  EXPECT_NE(text.find("# BASE_DATA[4] \"table\", in the robot's base frame:\n#   xyz_mm = [1000.0, "
                      "0.0, 0.0]\n#   abc_deg = [0.0, 0.0, 0.0]\n"),
            std::string::npos)
      << text;
  EXPECT_NE(text.find("# TOOL_DATA[1] \"torch\", as [tool]:"), std::string::npos);
  EXPECT_EQ(text.find("TOOL_DATA[2]"), std::string::npos) << "not measured";
}

TEST(ABackup, WithSeveralToolsHasTheOneOfItsNumberOrAsks) {
  const TemporaryDirectory dir;
  NewCellCommand command = from_backup(dir, kTorch + kProbe + kOthers);
  EXPECT_NE(refusal(command).find("Tool: number of TOOL_DATA (1 \"torch\", 3), or X Y Z"),
            std::string::npos)
      << refusal(command);
  EXPECT_EQ(refusal(command, "2\n3\n\n0.8\n\n\n\n"), "written");
  EXPECT_EQ(calib::load_cell(dir / "cell.toml").tool.mass_kg, 0.8);
  EXPECT_EQ(calib::load_cell(dir / "cell.toml").tool.tcp.translation().z(), 0.25);
  command.force = true;
  command.tool = "1";
  EXPECT_EQ(refusal(command), "written");
  EXPECT_EQ(calib::load_cell(dir / "cell.toml").tool.mass_kg, 1.535);
}

TEST(ABackup, WhoseSlotHasNoToolIsNamedByNumberAndFile) {
  const TemporaryDirectory dir;
  NewCellCommand command = from_backup(dir, kTorch + kOthers);
  for (const auto& [number, words] : std::map<std::string, std::string>{
           {"2", "$config.dat:4: TOOL_DATA[2] is empty (X, Y, Z, A, B, C all 0)"},
           {"5", "$config.dat:7: TOOL_DATA[5] stands in the cell (TOOL_TYPE #TCP)"},
           {"9", "TOOL_DATA[9]: not in the given files. Measured are 1 \"torch\""}}) {
    command.tool = number;
    EXPECT_NE(refusal(command).find(words), std::string::npos) << refusal(command);
    EXPECT_FALSE(std::filesystem::exists(dir / "cell.toml"));
    EXPECT_FALSE(std::filesystem::exists(dir / "kr5_r1400.toml"));
  }
}

TEST(ABackup, DoesNotReplaceAnotherRobotFile) {
  const TemporaryDirectory dir;
  NewCellCommand command = from_backup(dir, kTorch);
  write(dir / "kr5_r1400.toml", "mine");
  EXPECT_NE(refusal(command).find("kr5_r1400.toml exists and is another robot"), std::string::npos);
  EXPECT_EQ(content(dir / "kr5_r1400.toml"), "mine");
  command.robot = "kr5_r1400";
  EXPECT_EQ(refusal(command), "written");
  EXPECT_EQ(content(dir / "kr5_r1400.toml"), "mine");
}

TEST(ABackup, OfAnArmOnACeilingGivesTheRobotFileItsGravityOrWarnsOfTheNamedOne) {
  const TemporaryDirectory dir;
  (void)from_backup(dir, kTorch);
  std::string machine = content(dir / "backup/KRC/R1/Mada/$machine.dat");
  machine.replace(machine.find("A 90,B 0,C 0"), 12, "A 0,B 0,C 180");
  write(dir / "backup/KRC/R1/Mada/$machine.dat", machine);
  const auto made = [&](const std::vector<std::string>& more) {
    std::vector<std::string> all = {CELLCAL,        "new-cell",        "--force",
                                    "-o",           dir / "cell.toml", "--machine-data",
                                    dir / "backup", "--spheres",       dir / "spheres.csv"};
    all.insert(all.end(), more.begin(), more.end());
    return run_program(all);
  };
  const Outcome own = made({});
  EXPECT_NE(own.err.find("mounting: gravity along [0, 0, 1]"), std::string::npos) << own.err;
  EXPECT_NEAR(calib::load_cell(dir / "cell.toml").robot.gravity_m_s2.z(), 9.81, 1e-9);
  const Outcome named = made({"--robot", "kr5_r1400"});
  EXPECT_NE(named.err.find(
                "along [0, 0, -1] in kr5_r1400. It stays: 'cellcal import-robot --robot kr5_r1400"),
            std::string::npos)
      << named.err;
  const Outcome tool = run_program({CELLCAL, "import-robot", "--machine-data", dir / "backup",
                                    "--cell", dir / "cell.toml", "--tool", "1"});
  EXPECT_EQ(tool.status, 0) << tool.err;
  EXPECT_NE(tool.err.find("warning: gravity along [0, 0, 1]"), std::string::npos) << tool.err;
}

TEST(ACellFile, GetsAnotherToolOfTheControllerAndKeepsAllElse) {
  const TemporaryDirectory dir;
  ASSERT_EQ(refusal(from_backup(dir, kTorch)), "written");
  const std::string before = content(dir / "cell.toml");
  backup(dir, kTorch + kProbe + kOthers);
  const auto put = [&](const std::string& number) {
    return run_program({CELLCAL, "import-robot", "--machine-data", dir / "backup", "--cell",
                        dir / "cell.toml", "--tool", number});
  };
  const Outcome done = put("3");
  ASSERT_EQ(done.status, 0) << done.err;
  EXPECT_NE(done.err.find("LOAD_DATA[3] has no mass: mass_kg = 1.535 stays"), std::string::npos)
      << done.err;
  EXPECT_EQ(calib::load_cell(dir / "cell.toml").tool.tcp.translation().z(), 0.25);
  EXPECT_EQ(content(dir / "cell.toml.before"), before);
  ASSERT_EQ(put("1").status, 0);
  EXPECT_EQ(content(dir / "cell.toml"), before);
  EXPECT_EQ(put("2").status, 1);
  EXPECT_EQ(content(dir / "cell.toml"), before);
}

TEST(ACellFilesTool, IsSetWhereItIsOneTableWithAKeyToALine) {
  const ToolForm tool{.xyz_mm = {1, 2, 300}, .mass_kg = 4.0};
  EXPECT_EQ(
      with_tool("[tool]\r\nxyz_mm=[0,0,9] # TCP\r\n#mass_kg = 2\r\n[touch]\r\nabc_deg = 1\r\n",
                "c.toml", tool),
      "[tool]\r\nabc_deg = [0.0, 0.0, 0.0]\r\nmass_kg = 4.0\r\nxyz_mm = [1.0, 2.0, 300.0]"
      "            # TCP\r\n#mass_kg = 2\r\n[touch]\r\nabc_deg = 1\r\n");
  for (const char* text : {"", "[[tool]]\nxyz_mm = [0,0,9]\n", "tool = {xyz_mm = [0,0,9]}\n",
                           "[tool]\nxyz_mm = [0,\n0,9]\n"})
    EXPECT_THROW(with_tool(text, "c.toml", tool), calib::FileError) << text;
}

// ---- the command -----------------------------------------------------------------------------

constexpr const char* kSpheres =
    "id,diameter_mm,x_mm,y_mm,z_mm\nS1,61.4,1080,-320,330\nS2,61.4,1060,380,330\n"
    "S3,61.4,640,-620,640\nS4,61.4,760,560,780\n";
constexpr const char* kCertificate =
    "from,to,mm,sigma_mm\nS1,S2,700.286,0.005\nS1,S3,616.198,0.005\n";

class TheCommand : public ::testing::Test {
 protected:
  TheCommand() {
    write(dir_ / "spheres.csv", kSpheres);
    write(dir_ / "certificate.csv", kCertificate);
  }
  std::vector<std::string> arguments() const {
    return {CELLCAL,
            "new-cell",
            "-o",
            cell_,
            "--robot",
            "kr5_r1400",
            "--tool",
            "59.9,50.5,410.3,38.84,3.59,0",
            "--mass",
            "1.535",
            "--spheres",
            dir_ / "spheres.csv",
            "--certificate",
            dir_ / "certificate.csv"};
  }
  const TemporaryDirectory dir_;
  const std::string cell_ = dir_ / "cell.toml";
};

TEST_F(TheCommand, MakesOfOptionsAloneAFileThatLoadsAndPlans) {
  const Outcome made = run_program(arguments());
  ASSERT_EQ(made.status, 0) << made.err;
  EXPECT_EQ(made.err, "");
  EXPECT_NE(made.out.find("plan of 110 touches"), std::string::npos) << made.out;
  EXPECT_NE(made.out.find("correction_limit_deg = "), std::string::npos) << made.out;
  const calib::Cell cell = calib::load_cell(cell_), demo = calib::load_cell(CELLCAL_DEMO_CELL);
  ASSERT_EQ(cell.targets.size(), demo.targets.size());
  for (std::size_t i = 0; i < demo.targets.size(); ++i)
    EXPECT_EQ(cell.targets[i].centre_m, demo.targets[i].centre_m);
  EXPECT_TRUE(cell.tool.tcp.isApprox(demo.tool.tcp));
  EXPECT_EQ(cell.tool.deflection_sigma, demo.tool.deflection_sigma);

  const std::string before = content(cell_);
  write(dir_ / "spheres.csv", std::string(kSpheres) + "S5,50,900,0,300\n");
  const Outcome again = run_program(arguments());
  EXPECT_EQ(again.status, 1);
  EXPECT_NE(again.err.find("exists"), std::string::npos) << again.err;
  EXPECT_EQ(content(cell_), before);

  write(dir_ / "spheres.csv", kSpheres);
  write(dir_ / "certificate.csv", "from,to,mm,sigma_mm\nS1,S2,700.286,0.005\n");
  std::vector<std::string> replacing = arguments();
  replacing.emplace_back("--force");
  const std::string one = run_program(replacing).out;
  EXPECT_NE(one.find(", 4 spheres, 1 certified length\n"), std::string::npos) << one;
}

TEST_F(TheCommand, ReplacesAFileWithForceAlone) {
  write(cell_, "mine");
  write(dir_ / "spheres.csv", "id,diameter_mm\nS1,50\n");
  write(dir_ / "certificate.csv", "from,to,mm,sigma_mm\n");
  NewCellCommand command{
      .output = cell_, .robot = "kr5_r1400", .tool = "0 0 300", .spheres = dir_ / "spheres.csv"};
  std::istringstream in;
  std::ostringstream out;
  EXPECT_THROW(new_cell(command, in, out), std::runtime_error);
  EXPECT_EQ(content(cell_), "mine");
  command.force = true;
  EXPECT_EQ(new_cell(command, in, out), 1) << "its sphere has no place yet: no plan";
  EXPECT_EQ(calib::load_cell(cell_).targets.size(), 1u);
  EXPECT_EQ(out.str(), "") << "nothing is asked";
  command.output = dir_ / "Zelle \"A\".toml";
  ::testing::internal::CaptureStdout();
  EXPECT_EQ(new_cell(command, in, out), 1);
  EXPECT_NE(::testing::internal::GetCapturedStdout().find("next: cellcal doctor --cell '" +
                                                          command.output.string() + "'\n"),
            std::string::npos);
}

TEST_F(TheCommand, NamesWhatAnOptionOrListSaysWronglyAndWritesNothing) {
  struct Case {
    std::string spheres, certificate, tool, words;
  };
  const std::string tool = "0,0,300";
  const std::vector<Case> cases{
      {kSpheres, kCertificate, "1,2", "--tool: 2 numbers given"},
      {"", kCertificate, tool, "spheres.csv: empty"},
      {"id,diameter_mm\n", kCertificate, tool, "spheres.csv: no row after the header"},
      {"id,size\nS1,50\n", kCertificate, tool, "spheres.csv:1: unknown column \"size\""},
      {"id,x_mm\nS1,50\n", kCertificate, tool, "spheres.csv:1: column \"diameter_mm\" is missing"},
      {"id,diameter_mm\nS1,nan\n", kCertificate, tool, "spheres.csv:2: diameter_mm"},
      {"id,diameter_mm,x_mm,y_mm,z_mm\nS1,50,1,,3\n", kCertificate, tool, "all three or none"},
      {"id,diameter_mm\nS1,50\nS1,50\n", kCertificate, tool,
       "spheres.csv:3: id: \"S1\" occurs twice"},
      {"id,diameter_mm\ntool,50\n", kCertificate, tool, "spheres.csv:2: id: must not be \"tool\""},
      {"diameter_mm,id\n50,#1\n", kCertificate, tool,
       "spheres.csv:2: id: must not be empty or hold"},
      {"id,diameter_mm\n#1,50\n", kCertificate, tool, "spheres.csv:2: 2 fields as in a row"},
      {"id;diameter_mm\nS1;50\n", kCertificate, tool, "no target \"S2\""},
      {kSpheres, "from,to,mm,sigma_mm\nS1,S9,700,0.005\n", tool,
       "certificate.csv:2: from, to: there is no target \"S9\" (nothing was written)"},
      {kSpheres, "from,to,mm,sigma_mm\nS1,S2,700", tool, "certificate.csv:2"},
      {kSpheres, "from,to,mm,sigma_mm\nS1,S2,770.286,0.005\n", tool, "S1"}};
  for (const Case& one : cases) {
    write(dir_ / "spheres.csv", one.spheres);
    write(dir_ / "certificate.csv", one.certificate);
    std::istringstream in;
    std::ostringstream out;
    try {
      new_cell({.output = cell_,
                .robot = "kr5_r1400",
                .tool = one.tool,
                .spheres = dir_ / "spheres.csv",
                .certificate = dir_ / "certificate.csv"},
               in, out);
      ADD_FAILURE() << one.words;
    } catch (const std::runtime_error& error) {
      EXPECT_NE(std::string(error.what()).find(one.words), std::string::npos) << error.what();
    }
    EXPECT_FALSE(std::filesystem::exists(cell_)) << one.words;
  }
}

}  // namespace
}  // namespace cellcal::daemon::testing
