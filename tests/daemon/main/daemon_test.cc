// The daemon as a process, with the emulated cell on virtual time, and its command line.

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <algorithm>

#include "daemon_fixture.h"

namespace cellcal::daemon::testing {
namespace {

const std::string kCell = CELLCAL_DEMO_CELL;

std::vector<std::string> run(const char* touches, const char* check) {
  return {"run", "--cell", kCell, "--touches", touches, "--check", check};
}

TEST(ADaemon, CalibratesTheEmulatedCellAndLeavesItsResults) {
  DaemonFixture fixture("[motion]\nconfirm_every = 2\n");  // the delay takes five touches
  fixture.start();
  const Outcome outcome = fixture.cellcal(run("12", "4"));
  ASSERT_TRUE(outcome.status == 0 || outcome.status == 3) << outcome.err << fixture.log();
  EXPECT_EQ(outcome.err, "") << "no progress in a pipe";
  EXPECT_NE(outcome.out.find("check after"), std::string::npos);
  const auto results = fixture.dir.path() / "state/sessions/1";
  for (const char* file : {"touches.csv", "calibration.json", "report.html", "report.de.html",
                           "plots.json", "plots.de.json"}) {
    EXPECT_TRUE(std::filesystem::exists(results / file)) << file;
  }
  const auto json = nlohmann::json::parse(content(results / "calibration.json"));
  EXPECT_EQ(json.at("verdict").at("publish").get<bool>(), outcome.status == 0);
  EXPECT_EQ(json.at("inputs").at("files").size(), 3u);

  const Outcome history = fixture.cellcal({"history"});
  EXPECT_NE(history.out.find(outcome.status == 0 ? "  published  " : "  withheld  "),
            std::string::npos)
      << history.out;
  const Outcome shown = fixture.cellcal({"show", "1"});
  EXPECT_EQ(shown.status, 0);
  // The emulated wires delay by a tenth of a millisecond.
  const std::string before = "latch delay (k = 2): ";
  const auto delay = shown.out.find(before);
  ASSERT_NE(delay, std::string::npos) << shown.out;
  EXPECT_NEAR(std::stod(shown.out.substr(delay + before.size())), -0.1, 0.5);
  EXPECT_EQ(shown.out.find(before, delay + 1), std::string::npos) << "once";
  EXPECT_EQ(shown.out.find("warning"), std::string::npos) << shown.out;
  EXPECT_EQ(fixture.cellcal({"show", "2"}).status, 1);
  EXPECT_EQ(fixture.cellcal({"show"}).out, shown.out) << "the newest";
  const std::string copy = fixture.dir / "copy.html";
  EXPECT_EQ(fixture.cellcal({"report", "-o", copy}).status, 0);
  EXPECT_EQ(content(copy), content(results / "report.html"));
  EXPECT_EQ(fixture.cellcal({"report", "1"}).out, (results / "report.html").string() + "\n");
  EXPECT_NE(shown.out.find("results: " + results.string() + "\n"), std::string::npos) << shown.out;

  std::filesystem::rename(results, fixture.dir / "lost");  // as where only the journal was restored
  EXPECT_EQ(fixture.cellcal({"show", "1"}).out.find("results: "), std::string::npos);
  EXPECT_EQ(fixture.cellcal({"report", "1"}).err,
            "cellcal report: " + (results / "report.html").string() +
                " is not there, as after a restored backup. The report is made from the journal "
                "with -o FILE\n");
  ASSERT_EQ(fixture.cellcal({"report", "1", "-o", copy}).status, 0);
  const std::string made = content(copy), own = content(fixture.dir / "lost/report.html");
  EXPECT_NE(made.find("made from the journal, without the plan"), std::string::npos);
  EXPECT_NE(made.find("emulated cell: a simulation"), std::string::npos);
  const std::string row = "<section id=\"parameters\"", end = "</section>";
  ASSERT_NE(own.find(row), std::string::npos);
  EXPECT_EQ(made.substr(made.find(row), made.find(end, made.find(row)) - made.find(row)),
            own.substr(own.find(row), own.find(end, own.find(row)) - own.find(row)));
}

TEST(ASession, ComparesTheControllersModelWithTheRobotFileOverBothWires) {
  const auto severity_with = [](const std::string& mock) {
    DaemonFixture fixture("[mock]\nseed = 3\n" + mock);
    fixture.start();
    const Outcome outcome = fixture.cellcal(run("12", "0"));
    EXPECT_TRUE(outcome.status == 0 || outcome.status == 3) << outcome.err << fixture.log();
    const auto json =
        nlohmann::json::parse(content(fixture.dir.path() / "state/sessions/1/calibration.json"));
    for (const auto& one : json.at("verdict").at("findings"))
      if (one.at("kind") == "controller_model") return one.at("severity").get<std::string>();
    return std::string("none");
  };
  for (const std::string wire : {"wire = \"rsi\"\n", "wire = \"eki\"\n"}) {
    EXPECT_EQ(severity_with(wire), "none") << wire;
    EXPECT_EQ(severity_with(wire + "absolute_accuracy = true\n"), "warns") << wire;
    EXPECT_EQ(severity_with(wire + "stated_robot = \"kr5_arc\"\n"), "warns") << wire;
    EXPECT_EQ(severity_with(wire + "stated_tool_mm = [0, 0, 150]\n"), "none")
        << "joint angles do not depend on it";
  }
}

TEST(AVirtualSession, GivesTheSameBitsForTheSameSeed) {
  std::string touches[2], calibrations[2];
  for (int i = 0; i < 2; ++i) {
    DaemonFixture fixture("[mock]\nseed = 3\n");
    fixture.start();
    fixture.cellcal(run("8", "2"));
    touches[i] = content(fixture.dir.path() / "state/sessions/1/touches.csv");
    calibrations[i] = content(fixture.dir.path() / "state/sessions/1/calibration.json");
  }
  EXPECT_FALSE(touches[0].empty());
  EXPECT_EQ(touches[0], touches[1]);
  EXPECT_EQ(calibrations[0], calibrations[1]);
}

TEST(AVirtualSession, BearsTodaysDateOnlyWhereItIsToldTo) {
  for (const bool wall_clock : {false, true}) {
    DaemonFixture fixture(wall_clock ? "[mock]\nwall_clock = true\n" : "");
    fixture.start();
    fixture.begin({{"cell", kCell}, {"touches", 6}, {"check", 0}});
    fixture.wait_for_touches(1);
    const auto shown = fixture.get("/v1/sessions/1");
    EXPECT_EQ(shown["started"].get<std::string>().starts_with("2000-01-01T"), !wall_clock);
  }
}

TEST(AVirtualSession, ByIncrementsMeasuresWhatOneByOffsetsDoes) {
  std::string touches[2];
  for (const bool relative : {false, true}) {
    DaemonFixture fixture(relative ? "[rsi]\nmode = \"relative\"\n[mock]\nseed = 3\n"
                                   : "[mock]\nseed = 3\n");
    fixture.start();
    const Outcome outcome = fixture.cellcal(run("12", "4"));
    EXPECT_TRUE(outcome.status == 0 || outcome.status == 3) << outcome.err << fixture.log();
    touches[relative ? 1 : 0] = content(fixture.dir.path() / "state/sessions/1/touches.csv");
  }
  // The same searches: angles of contact agree within the controller's decimals and the phase of
  // its cycle; 0.01 deg is far above both.
  std::istringstream by_offsets(touches[0]), by_increments(touches[1]);
  std::string a, b;
  int rows = 0;
  while (std::getline(by_offsets, a) && std::getline(by_increments, b)) {
    if (!std::isdigit(static_cast<unsigned char>(a[0])) && a[0] != '-') continue;
    ++rows;
    std::istringstream first(a), second(b);
    for (int joint = 0; joint < 6; ++joint) {
      std::string x, y;
      std::getline(first, x, ',');
      std::getline(second, y, ',');
      EXPECT_NEAR(std::stod(x), std::stod(y), 0.01) << a << "\n" << b;
    }
  }
  EXPECT_EQ(rows, 16);
}

TEST(AVirtualSession, ByCorrectionsInSpaceIsPublishedInEitherFrame) {
  for (const char* frame : {"base", "tool"}) {
    DaemonFixture fixture("[rsi]\ncorrection = \"space\"\ncorrection_frame = \"" +
                          std::string(frame) + "\"\n[controller]\ntool = 1\n[mock]\nseed = 3\n");
    fixture.start();
    const Outcome outcome = fixture.cellcal(run("32", "8"));
    EXPECT_EQ(outcome.status, 0) << frame << ": " << outcome.err << fixture.log();
    EXPECT_NE(outcome.out.find("verdict: publishable"), std::string::npos) << outcome.out;
  }
}

TEST(AVirtualSession, EndsByNameWhereCorrectionsInSpaceReachTheirLimit) {
  DaemonFixture fixture(
      "[rsi]\ncorrection = \"space\"\ncorrection_turn_limit_deg = 20\n[mock]\nseed = 3\n");
  fixture.start();
  const Outcome outcome = fixture.cellcal(run("12", "4"));
  EXPECT_EQ(outcome.status, 1);
  EXPECT_NE(outcome.err.find("limit 20.00 deg"), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find("correction_turn_limit_deg"), std::string::npos) << outcome.err;
}

TEST(ASession, ThatWouldGoBeyondTheCorrectionLimitIsRefusedBeforeTheFirstMotion) {
  const auto with_limit = [](const std::string& limit, const std::vector<std::string>& arguments,
                             nlohmann::json& status) {
    DaemonFixture fixture("[rsi]\ncorrection_limit_deg = " + limit + "\n[mock]\nseed = 3\n");
    fixture.start();
    const Outcome outcome = fixture.cellcal(arguments);
    status = fixture.status();
    return outcome;
  };
  nlohmann::json status;
  const Outcome refused = with_limit("40", run("8", "0"), status);
  EXPECT_EQ(refused.status, 1);
  for (const char* words : {"correction_limit_deg is 40", "Nothing has moved", "kuka-files",
                            "AXISCORRMON", "cold-start"})
    EXPECT_NE(refused.err.find(words), std::string::npos) << refused.err;
  EXPECT_EQ(refused.err.find("move-refused"), std::string::npos) << refused.err;
  EXPECT_EQ(status["touches"], 0);
  // With the reported limit it runs.
  const std::string set = "set correction_limit_deg = ";
  const std::size_t at = refused.err.find(set);
  ASSERT_NE(at, std::string::npos) << refused.err;
  const std::string limit = std::to_string(std::stoi(refused.err.substr(at + set.size())));
  const Outcome ran = with_limit(limit, run("8", "0"), status);
  EXPECT_EQ(ran.status, 3) << limit << ": " << ran.err;
  EXPECT_EQ(status["touches"], 8);
  EXPECT_NE(ran.out.find("the cell works, 8 of 8 touches"), std::string::npos) << ran.out;
  // Touches chosen one by one respect it.
  const Outcome inside =
      with_limit("120", {"run", "--cell", kCell, "--goal", "0.6", "--check", "2"}, status);
  EXPECT_TRUE(inside.status == 0 || inside.status == 3) << inside.err;
}

TEST(ASession, OfACellFileThatContradictsItselfDoesNotBegin) {
  DaemonFixture fixture;
  std::string cell = content(kCell);
  const std::string robot = "robot = \"";
  cell.insert(cell.find(robot) + robot.size(),
              std::filesystem::path(kCell).parent_path().string() + "/");
  cell.replace(cell.find("410.3"), 5, "0.4103");
  cell.replace(cell.find("59.9, 50.5"), 10, "0.05, 0.05");
  const std::string file = fixture.dir / "cell.toml";
  std::ofstream(file) << cell;
  fixture.start();
  const Outcome outcome = fixture.cellcal({"run", "--cell", file, "--touches", "8"});
  EXPECT_EQ(outcome.status, 1);
  EXPECT_NE(outcome.err.find("tool: the tip lies 0.416 mm from the flange"), std::string::npos)
      << outcome.err;
  EXPECT_EQ(fixture.cellcal({"history"}).out, "no sessions yet\n");
}

TEST(AKilledDaemon, LosesNoTouchAndItsSuccessorFinishesTheSession) {
  DaemonFixture fixture;
  fixture.start();
  fixture.begin({{"cell", kCell}, {"touches", 12}, {"check", 4}});
  fixture.wait_for_touches(5);
  const int before = fixture.status()["touches"];
  fixture.daemon->signal(SIGKILL);
  EXPECT_EQ(fixture.daemon->wait(), 128 + SIGKILL);

  fixture.start();
  const auto sessions = fixture.get("/v1/sessions");
  ASSERT_EQ(sessions.size(), 1u);
  EXPECT_EQ(sessions[0]["state"], "interrupted");
  const std::string words = fixture.cellcal({"status"}).out;
  EXPECT_EQ(words.find("idle. Session 1 of 2000-01-01"), 0u) << words;
  EXPECT_NE(words.find(" of 16. Resume, before any other session: 'cellcal run --resume'"),
            std::string::npos)
      << words;
  EXPECT_GE(sessions[0]["touches"], before);
  const Outcome outcome = fixture.cellcal({"run", "--resume"});
  EXPECT_TRUE(outcome.status == 0 || outcome.status == 3) << outcome.err;
  EXPECT_EQ(fixture.status()["session"], 1);
  const std::string csv = content(fixture.dir.path() / "state/sessions/1/touches.csv");
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 17) << csv;
  EXPECT_EQ(fixture.cellcal({"run", "--resume"}).status, 1) << "nothing is left to resume";
}

TEST(ASessionWithAGoal, EndsWhereItIsReachedAndShowsTheWayThere) {
  DaemonFixture fixture;
  fixture.start();
  const Outcome outcome =
      fixture.cellcal({"run", "--cell", kCell, "--goal", "0.4", "--check", "4"});
  ASSERT_EQ(outcome.status, 0) << outcome.err << fixture.log();
  EXPECT_EQ(outcome.out.find("stopped: goal reached: u95 0.3"), 0u) << outcome.out;
  const nlohmann::json status = fixture.status();
  EXPECT_EQ(status["goal_mm"], 0.4);
  EXPECT_LE(status["u95_mm"], 0.4);
  EXPECT_EQ(status["touches"], status["planned"]);
  const std::string csv = content(fixture.dir.path() / "state/sessions/1/touches.csv");
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), status["touches"].get<int>() + 1);
  // The prediction decreased touch by touch.
  double worst = 0.0;
  const std::string changes = http_request(fixture.socket(), "GET", "/v1/watch?since=0").body;
  std::istringstream lines(changes);
  for (std::string line; std::getline(lines, line);) {
    const auto change = nlohmann::json::parse(line);
    if (change["u95_mm"].is_number()) worst = std::max(worst, change["u95_mm"].get<double>());
  }
  EXPECT_GT(worst, 0.45);
  const nlohmann::json listed = fixture.get("/v1/sessions");
  EXPECT_EQ(listed[0]["planned"], status["touches"]);
}

TEST(ASessionWithAGoal, ThatWasKilledIsGoneOnWithToTheSameGoal) {
  DaemonFixture fixture;
  fixture.start();
  fixture.begin({{"cell", kCell}, {"goal_mm", 0.4}, {"check", 4}});
  fixture.wait_for_touches(10);
  fixture.daemon->signal(SIGKILL);
  fixture.daemon->wait();
  fixture.start();
  const Outcome outcome = fixture.cellcal({"run", "--resume"});
  EXPECT_EQ(outcome.status, 0) << outcome.err << fixture.log();
  EXPECT_EQ(outcome.out.find("stopped: goal reached"), 0u) << outcome.out;
  EXPECT_EQ(fixture.status()["session"], 1);
}

TEST(ASessionThatFinds, MeetsSpheresThatStandCentimetresFromWhereTheyAreSaidTo) {
  DaemonFixture fixture("[mock]\nplacement_mm = 8\nseed = 2\n");
  fixture.start();
  const Outcome outcome =
      fixture.cellcal({"run", "--cell", kCell, "--find", "--touches", "40", "--check", "4"});
  ASSERT_EQ(outcome.status, 0) << outcome.err << fixture.log();
  const nlohmann::json status = fixture.status();
  EXPECT_EQ(status["touches"], 44);
  EXPECT_TRUE(status["goal_mm"].is_null());
  const std::string changes = http_request(fixture.socket(), "GET", "/v1/watch?since=0").body;
  EXPECT_NE(changes.find("touching"), std::string::npos);
}

TEST(ASession, FindsASphereThatIsSomewhereInABox) {
  DaemonFixture fixture;
  std::string cell = content(kCell);
  const auto replace = [&](const std::string& from, const std::string& to,
                           const std::string& with) {
    const std::size_t begin = cell.find(from), end = cell.find(to, begin);
    ASSERT_NE(end, std::string::npos) << from;
    cell.replace(begin, end - begin, with);
  };
  replace("robot = \"", "kr5",
          "robot = \"" + std::filesystem::path(kCell).parent_path().string() + "/");
  replace("centre_mm = [1080", "centre_sigma",
          "search_low_mm = [1050, -340, 310]\nsearch_high_mm = [1110, -300, 350]\n");
  replace("[[length]]", "[touch]", "");  // not known either
  const std::string file = fixture.dir / "cell.toml";
  std::ofstream(file) << cell;
  fixture.start();
  const Outcome outcome =
      fixture.cellcal({"run", "--cell", file, "--touches", "40", "--check", "4"});
  EXPECT_TRUE(outcome.status == 0 || outcome.status == 3) << outcome.err << cell;
  EXPECT_EQ(fixture.status()["touches"], 44);
}

class ASessionWithAPlate : public ::testing::TestWithParam<std::vector<std::string>> {};

TEST_P(ASessionWithAPlate, TouchesItsFaceAsItDoesTheSpheres) {
  DaemonFixture fixture;
  std::string cell = content(kCell);
  const std::string robot = "robot = \"";
  cell.insert(cell.find(robot) + robot.size(),
              std::filesystem::path(kCell).parent_path().string() + "/");
  cell.insert(cell.find("[[length]]"),
              "[[target]]\nid = \"P\"\nkind = \"plane\"\ncentre_mm = [950, 50, 250]\n"
              "normal = [-0.3, 0.1, 0.95]\ncentre_sigma_mm = 5\nnormal_sigma_deg = 1\n"
              "extent_mm = 200\n\n");
  const std::string file = fixture.dir / "cell.toml";
  std::ofstream(file) << cell;
  fixture.start();
  std::vector<std::string> arguments{"run", "--cell", file, "--check", "5"};
  arguments.insert(arguments.end(), GetParam().begin(), GetParam().end());
  const Outcome outcome = fixture.cellcal(arguments);
  EXPECT_EQ(outcome.status, 0) << outcome.err << outcome.out;
  const std::string csv = content(fixture.dir.path() / "state/sessions/1/touches.csv");
  int of_plate = 0;
  for (std::size_t at = csv.find(",P,"); at != std::string::npos; at = csv.find(",P,", at + 1))
    ++of_plate;
  EXPECT_GE(of_plate, 5) << csv;
}

INSTANTIATE_TEST_SUITE_P(Plans, ASessionWithAPlate,
                         ::testing::Values(std::vector<std::string>{"--touches", "40"},
                                           std::vector<std::string>{"--goal", "0.4"}),
                         [](const auto& which) {
                           return std::string(which.index == 0 ? "made_before" : "one_by_one");
                         });

TEST(AGoal, OutOfRangeIsRefusedBeforeAnythingBegins) {
  DaemonFixture fixture;
  fixture.start();
  fixture.refuse({{"cell", kCell}, {"goal_mm", 0.0001}}, 422, "the goal must be 0.01 to 10 mm");
  EXPECT_EQ(fixture.begin({{"cell", kCell}, {"goal_mm", "small"}}).status, 400);
  EXPECT_EQ(fixture.begin({{"cell", kCell}, {"goal_mm", 0.3}, {"region", "moon"}}).status, 422);
}

TEST(AClientWithoutATerminal, WritesLinesOfProgressWhereItIsAskedTo) {
  DaemonFixture fixture;
  fixture.start();
  auto given = run("12", "4");
  given.push_back("--progress");
  const Outcome outcome = fixture.cellcal(given);
  const auto lines = std::count(outcome.err.begin(), outcome.err.end(), '\n');
  EXPECT_GE(lines, 1) << outcome.err;
  EXPECT_LE(lines, 3) << "not one for every look: " << outcome.err;
  EXPECT_EQ(outcome.err.find('\r'), std::string::npos) << outcome.err;
  EXPECT_EQ(outcome.err.substr(0, 1), "[") << outcome.err;
}

TEST(ASession, LeavesTheQualityOfItsLinksInTheStatus) {
  DaemonFixture fixture;
  fixture.start();
  EXPECT_TRUE(fixture.status()["links"].is_null());
  const Outcome outcome = fixture.cellcal(run("6", "0"));
  EXPECT_TRUE(outcome.status == 0 || outcome.status == 3) << outcome.err;
  nlohmann::json links = fixture.status()["links"];
  // The session closes its devices shortly after reporting that it is done.
  for (int i = 0; links["open"] == true && i < 1000; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    links = fixture.status()["links"];
  }
  EXPECT_EQ(links["open"], false);
  EXPECT_EQ(links["robot"]["cycle_ms"], 4.0);
  EXPECT_GT(links["robot"]["packets"], 1000);
  EXPECT_EQ(links["robot"]["late"], 0);
  EXPECT_GT(links["contact"]["frames"], 1000);
  EXPECT_EQ(links["contact"]["crc_errors"], 0);
  EXPECT_EQ(links["contact"]["firmware"], "1.1.0");
  const std::string words = fixture.cellcal({"status"}).out;
  EXPECT_NE(words.find("robot link: cycle 4.00 ms"), std::string::npos) << words;
  EXPECT_NE(words.find("contact link: firmware 1.1.0"), std::string::npos) << words;
}

TEST(AnAbortedSession, KeepsItsTouchesAndCanBeGoneOnWith) {
  DaemonFixture fixture;
  fixture.start();
  fixture.begin({{"cell", kCell}, {"touches", 12}, {"check", 4}});
  fixture.wait_for_touches(2);
  const Outcome second = fixture.cellcal(run("8", "2"));
  EXPECT_EQ(second.status, 1);
  EXPECT_NE(second.err.find("is running"), std::string::npos) << second.err;
  const Outcome aborted = fixture.cellcal({"abort"});
  EXPECT_EQ(aborted.status, 0) << aborted.err;
  EXPECT_EQ(fixture.status()["phase"], "aborted");
  EXPECT_EQ(fixture.cellcal({"abort"}).status, 1);
  const Outcome outcome = fixture.cellcal({"run", "--resume"});
  EXPECT_TRUE(outcome.status == 0 || outcome.status == 3) << outcome.err;
}

TEST(AnIdleDaemon, IsNotDeafenedByAPipeAsCellFile) {
  DaemonFixture fixture;
  fixture.start();
  const std::string pipe = fixture.dir / "cell.toml";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  fixture.refuse({{"cell", pipe}}, 422, "is a pipe; name a file");
  EXPECT_EQ(fixture.status()["phase"], "idle");
}

TEST(ADaemon, ThatWasGivenItsJournalAsCellFileKeepsASecondOneOut) {
  DaemonFixture fixture;
  fixture.start();
  const std::string journal = fixture.dir.path() / "state/journal.db";
  EXPECT_EQ(fixture.begin({{"cell", journal}}).status, 422);
  std::ofstream(fixture.dir / "second.toml")
      << "format = \"cellcal.daemon/1\"\nbackend = \"mock\"\nstate_dir = \""
      << (fixture.dir / "state").string() << "\"\nsocket = \"" << (fixture.dir / "s2").string()
      << "\"\n";
  const Outcome second = run_program({CELLCALD, "--config", fixture.dir / "second.toml"});
  EXPECT_NE(second.status, 0);
  EXPECT_NE(second.err.find("second cellcald"), std::string::npos) << second.err;
}

TEST(ASession, WhoseJournalIsRemovedEndsByNameBeforeTheNextTouch) {
  DaemonFixture fixture;
  fixture.start();
  fixture.begin({{"cell", kCell}, {"touches", 60}, {"check", 4}});
  fixture.wait_for_touches(2);
  std::filesystem::remove(fixture.dir.path() / "state/journal.db");
  const Outcome watched = fixture.cellcal({"watch"});
  EXPECT_EQ(watched.status, 1);
  EXPECT_NE(watched.err.find("journal: "), std::string::npos) << watched.err;
  EXPECT_NE(watched.err.find("journal.db is gone"), std::string::npos) << watched.err;
  EXPECT_NE(watched.err.find("restart cellcald"), std::string::npos) << watched.err;
}

TEST(ASession, WhoseEndTheFullDiskDidNotTakeIsGoneOnWith) {
  DaemonFixture fixture;
  fixture.start();
  fixture.begin({{"cell", kCell}, {"touches", 40}, {"check", 4}});
  fixture.wait_for_touches(2);
  rlimit before{};
  ASSERT_EQ(::prlimit(fixture.daemon->pid(), RLIMIT_FSIZE, nullptr, &before), 0);
  rlimit full = before;
  full.rlim_cur = 4096;
  ASSERT_EQ(::prlimit(fixture.daemon->pid(), RLIMIT_FSIZE, &full, nullptr), 0);
  const Outcome watched = fixture.cellcal({"watch"});
  EXPECT_EQ(watched.status, 1);
  EXPECT_NE(watched.err.find("journal: "), std::string::npos) << watched.err;
  ASSERT_EQ(::prlimit(fixture.daemon->pid(), RLIMIT_FSIZE, &before, nullptr), 0);
  const Outcome outcome = fixture.cellcal({"run", "--resume"});
  EXPECT_TRUE(outcome.status == 0 || outcome.status == 3) << outcome.err << fixture.log();
  EXPECT_EQ(fixture.status()["session"], 1);
}

TEST(ASignal, AbortsTheSessionWithoutAConnection) {
  DaemonFixture fixture;
  fixture.start();
  fixture.begin({{"cell", kCell}, {"touches", 60}, {"check", 4}});
  fixture.wait_for_touches(1);
  fixture.daemon->signal(SIGUSR1);
  const Outcome watched = fixture.cellcal({"watch"});
  EXPECT_NE(watched.err.find("was aborted"), std::string::npos) << watched.err;
  EXPECT_EQ(fixture.status()["phase"], "aborted");
}

TEST(ATerminatedDaemon, EndsItsSessionAndItselfWithStatus0) {
  DaemonFixture fixture;
  fixture.start();
  fixture.begin({{"cell", kCell}, {"touches", 12}, {"check", 4}});
  fixture.wait_for_touches(1);
  fixture.daemon->signal(SIGTERM);
  EXPECT_EQ(fixture.daemon->wait(), 0) << fixture.log();
  EXPECT_FALSE(std::filesystem::exists(fixture.socket()));
  fixture.start();
  const auto sessions = fixture.get("/v1/sessions");
  EXPECT_EQ(sessions[0]["state"], "aborted");
}

TEST(ADaemon, RefusesToStartBesideAnotherOne) {
  DaemonFixture fixture;
  fixture.start();
  const Outcome second = run_program({CELLCALD, "--config", fixture.dir / "d.toml"});
  EXPECT_EQ(second.status, 1);
  EXPECT_EQ(std::count(second.err.begin(), second.err.end(), '\n'), 1) << second.err;
  EXPECT_NE(second.err.find("second cellcald"), std::string::npos) << second.err;
}

TEST(ADaemon, WithADamagedJournalDoesNotStartAndSaysWhy) {
  DaemonFixture fixture;
  std::filesystem::create_directories(fixture.dir / "state");
  std::ofstream(fixture.dir.path() / "state/journal.db") << std::string(9000, '?');
  const Outcome outcome = run_program({CELLCALD, "--config", fixture.dir / "d.toml"});
  EXPECT_EQ(outcome.status, 1);
  EXPECT_NE(outcome.err.find("journal.db"), std::string::npos) << outcome.err;
}

TEST(Cellcald, ValidatesAConfigurationAndEnds) {
  const DaemonFixture fixture;
  EXPECT_EQ(run_program({CELLCALD, "--config", fixture.dir / "d.toml", "--check"}).status, 0);
  std::ofstream(fixture.dir / "bad.toml") << "format = \"cellcal.daemon/1\"\ncolour = 1\n";
  const Outcome bad = run_program({CELLCALD, "--config", fixture.dir / "bad.toml", "--check"});
  EXPECT_EQ(bad.status, 2);
  EXPECT_NE(bad.err.find("bad.toml"), std::string::npos);
  EXPECT_EQ(run_program({CELLCALD, "--configure"}).status, 2);
  EXPECT_NE(run_program({CELLCALD, "--help"}).out.find("Example: cellcald"), std::string::npos);
}

TEST(ASession, SaysBeforeItMovesThatItsPlanDoesNotReachWhatIsRequired) {
  DaemonFixture fixture(kFast);
  fixture.start();
  const std::filesystem::path demo(CELLCAL_DEMO_CELL), cell = fixture.dir / "cell.toml";
  std::filesystem::copy_file(demo.parent_path() / "kr5_worn.toml", fixture.dir / "kr5_worn.toml");
  std::string text = content(demo);
  const std::string robot = "robot = \"kr5_worn.toml\"\n";
  text.insert(text.find(robot) + robot.size(), "required_mm = 0.011\n");
  std::ofstream(cell) << text;
  const Outcome run = fixture.cellcal({"run", "--cell", cell, "--touches", "12", "--check", "0"});
  EXPECT_NE(run.err.find("warning: required_mm = 0.011, the plan reaches "), std::string::npos)
      << run.err << run.out;
  EXPECT_NE(run.err.find("state a larger required_mm"), std::string::npos) << run.err;
  ASSERT_EQ(fixture.status()["warnings"].size(), 1u);
  const Outcome shown = fixture.cellcal({"show", "1"});
  EXPECT_NE(shown.out.find("warning: required_mm = 0.011"), std::string::npos) << shown.out;
  EXPECT_NE(fixture.cellcal({"status"}).out.find("warning: required_mm = 0.011"),
            std::string::npos);
  const Outcome german = fixture.cellcal({"status", "--language", "de"});
  EXPECT_NE(german.out.find("Warnung: required_mm = 0,011"), std::string::npos) << german.out;

  const Outcome goal = fixture.cellcal({"run", "--cell", cell, "--goal", "0.4", "--touches", "20"});
  for (const char* part :
       {"warning: required_mm = 0.011, a goal of 0.400 mm leads to a mean error of about 0.190 mm",
        "Ask for a goal of 0.023 mm, or state a larger required_mm"})
    EXPECT_NE(goal.err.find(part), std::string::npos) << goal.err;
  EXPECT_NE(fixture.cellcal({"show", "2"}).out.find("a goal of 0.400 mm"), std::string::npos);
}

}  // namespace
}  // namespace cellcal::daemon::testing
