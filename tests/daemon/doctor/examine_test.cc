// The whole examination over loopback, with a controller that records its commands.

#include <fstream>
#include <thread>

#include "calib/files/files.h"
#include "daemon/config/config.h"
#include "daemon/doctor/doctor.h"
#include "drivers/kuka/krl/krl_files.h"
#include "sim/krc/cartesian_arm.h"
#include "sim/krc/krc_udp.h"
#include "tests/daemon/cli/mistaken_cells.h"
#include "tests/daemon/doctor/outcome_of.h"
#include "tests/daemon/journal/temporary_directory.h"

namespace cellcal::daemon::testing {
namespace {

std::string text_of(const std::filesystem::path& file) {
  std::ifstream in(file);
  return {std::istreambuf_iterator<char>(in), {}};
}

const std::filesystem::path kDemoRobot =
    std::filesystem::path(CELLCAL_DEMO_CELL).replace_filename("kr5_worn.toml");

/// The demo cell with another robot file.
std::string demo_with(const std::string& robot) {
  std::string cell = text_of(CELLCAL_DEMO_CELL);
  const std::string own = kDemoRobot.filename().string();
  return cell.replace(cell.find(own), own.size(), robot);
}

struct AnExamination : public ::testing::Test {
  void configure(const std::string& text) {
    std::ofstream(dir / "d.toml") << "format = \"cellcal.daemon/1\"\nsocket = \""
                                  << (dir / "s").string() << "\"\n"
                                  << text;
  }
  DoctorRequest request() const {
    DoctorRequest one;
    one.config = dir / "d.toml";
    one.cell = CELLCAL_DEMO_CELL;
    one.wait_s = 20.0;
    one.observe_s = 1.0;
    return one;
  }
  TemporaryDirectory dir;
};

TEST_F(AnExamination, OfAWrongConfigurationNamesItAndEndsThere) {
  configure("backend = \"rsi\"\ncolour = 1\n");
  Findings findings;
  examine(request(), findings);
  ASSERT_EQ(findings.all().size(), 1u);
  EXPECT_NE(words(findings.all().front().found).find("d.toml"), std::string::npos);
  EXPECT_FALSE(findings.green());
}

TEST_F(AnExamination, WritesWhereTheJournalIsAndWarnsOfLittleSpace) {
  const auto state_dir = [&] {
    Findings findings;
    examine(request(), findings);
    expect_advice(findings);
    return finding_of(findings, "state directory");
  };
  configure("backend = \"mock\"\nstate_dir = \"" + (dir / "state").string() + "\"\n");
  EXPECT_EQ(state_dir().outcome, Outcome::kSkipped) << "cellcald makes it";
  std::filesystem::create_directory(dir / "state");
  const Outcome written = state_dir().outcome;  // this disk may have little space
  EXPECT_TRUE(written == Outcome::kOk || written == Outcome::kWarning);
  EXPECT_TRUE(std::filesystem::is_empty(dir / "state"));
  std::filesystem::remove(dir / "state");
  std::ofstream(dir / "state") << "a file\n";
  EXPECT_EQ(state_dir().outcome, Outcome::kFailed);

  const auto judged = [&](double bytes, bool is_written) {
    Findings findings;
    judge_state_dir("/s", bytes, is_written, findings);
    return finding_of(findings, "state directory");
  };
  EXPECT_EQ(judged(5e9, true).found, "5000 MB free in /s");
  EXPECT_EQ(judged(5e9, true).outcome, Outcome::kOk);
  EXPECT_EQ(judged(5e9, false).outcome, Outcome::kSkipped);
  EXPECT_EQ(judged(5e7, false).outcome, Outcome::kWarning);
}

TEST_F(AnExamination, OfAWrongCellGoesOnWithoutIt) {
  configure("backend = \"mock\"\n");
  DoctorRequest one = request();
  one.cell = dir / "none.toml";
  Findings findings;
  examine(one, findings);
  EXPECT_EQ(outcome_of(findings, "cell file"), Outcome::kFailed);
  EXPECT_EQ(outcome_of(findings, "daemon"), Outcome::kWarning);
  EXPECT_EQ(outcome_of(findings, "wires"), Outcome::kWarning);
}

TEST_F(AnExamination, TellsAKr5ApartByWhereItsFlangeIs) {
  configure("backend = \"mock\"\n");
  Findings findings;
  examine(request(), findings);
  const auto geometry = finding_of(findings, "robot geometry");
  EXPECT_EQ(geometry.outcome, Outcome::kWarning);
  EXPECT_NE(geometry.found.find("X 800.0 mm, Z 960.0 mm"), std::string::npos) << geometry.found;
}

TEST_F(AnExamination, KnowsAKr5ByItsGeometryAndNotByItsName) {
  configure("backend = \"mock\"\n");
  std::string robot = text_of(kDemoRobot);
  const std::string name = "KUKA KR 5 R1400, re-mastered by hand";
  std::ofstream(dir / "robot.toml") << robot.replace(robot.find(name), name.size(), "welder 3");
  DoctorRequest one = request();
  one.cell = dir / "cell.toml";
  std::ofstream(one.cell) << demo_with("robot.toml");
  Findings renamed;
  examine(one, renamed);
  EXPECT_EQ(outcome_of(renamed, "robot geometry"), Outcome::kWarning);
  std::ofstream(one.cell) << demo_with("kr10_r1420");
  Findings other;
  examine(one, other);
  const auto geometry = finding_of(other, "robot geometry");
  EXPECT_EQ(geometry.outcome, Outcome::kOk) << geometry.advice;
  EXPECT_NE(geometry.found.find("X 810.0 mm, Z 1000.0 mm"), std::string::npos) << geometry.found;
}

TEST_F(AnExamination, ForeseesHowFarTheAxesGoInASession) {
  configure("backend = \"mock\"\n");
  Findings wide;
  examine(request(), wide);
  EXPECT_EQ(outcome_of(wide, "cell itself"), Outcome::kOk);
  EXPECT_EQ(outcome_of(wide, "plan"), Outcome::kOk) << finding_of(wide, "plan").found;
  configure("backend = \"mock\"\n[rsi]\ncorrection_limit_deg = 40\n");
  Findings narrow;
  examine(request(), narrow);
  const auto plan = finding_of(narrow, "plan");
  EXPECT_EQ(plan.outcome, Outcome::kFailed);
  EXPECT_NE(plan.found.find("correction_limit_deg is 40"), std::string::npos) << plan.found;
  for (const char* words : {"set correction_limit_deg = ", "kuka-files", "cold-start"})
    EXPECT_NE(plan.advice.find(words), std::string::npos) << plan.advice;
}

TEST_F(AnExamination, NamesAScheduleThatNothingStartsTheControllersProgramFor) {
  const std::string schedule =
      "[schedule]\nunattended = true\nresponsible = \"A. Miller\"\nSTART\n[[schedule.session]]\n"
      "name = \"nightly\"\ncell = \"/c.toml\"\nfrom = \"22:00\"\nto = \"05:30\"\n";
  const auto with = [&](const std::string& start, const std::string& more = "") {
    std::string text = schedule;
    configure("backend = \"rsi\"\n[contact]\ndevice = \"/dev/null\"\n" + more +
              text.replace(text.find("START"), 5, start));
    Findings findings;
    examine_schedule(load_config(request().config), findings);
    return findings;
  };
  const Findings none = with("");
  EXPECT_EQ(outcome_of(none, "unattended start"), Outcome::kFailed);
  EXPECT_NE(finding_of(none, "unattended start").found.find("Unattended at night"),
            std::string::npos);
  EXPECT_EQ(outcome_of(with("program_start = \"cell\""), "unattended start"), Outcome::kOk);
  EXPECT_EQ(outcome_of(with("program_start = \"cell\"", "[session]\nconnect_wait_s = 60\n"),
                       "unattended start"),
            Outcome::kWarning);
}

TEST_F(AnExamination, SaysWhereACellFileContradictsItself) {
  configure("backend = \"mock\"\n");
  std::string cell = demo_with(kDemoRobot.string());
  cell.replace(cell.find("1128.051"), 8, "112.8051");
  cell +=
      "\n[[obstacle]]\nid = \"table\"\nshape = \"box\"\nsize_mm = [200, 200, 200]\n"
      "xyz_mm = [1060, 380, 330]\n";
  DoctorRequest one = request();
  one.cell = dir / "cell.toml";
  std::ofstream(one.cell) << cell;
  Findings findings;
  examine(one, findings);
  std::string found;
  for (const Finding& finding : findings.all())
    if (finding.check == "cell itself") {
      EXPECT_EQ(finding.outcome, Outcome::kFailed);
      found += words(finding.found) + "\n";
    }
  EXPECT_NE(found.find("S2-S3: 112.805 mm stated"), std::string::npos) << found;
  EXPECT_NE(found.find("sphere S2: "), std::string::npos) << found;
  EXPECT_NE(found.find("deep in obstacle table"), std::string::npos) << found;
  expect_advice(findings);
}

TEST_F(AnExamination, NamesTheUsualMistakesWithTheirValues) {
  configure("backend = \"mock\"\n");
  for (const MistakenCell& one : mistaken_cells()) {
    DoctorRequest with = request();
    with.cell = write(one, dir.path());
    Findings findings;
    examine(with, findings);
    const bool of_the_plan = one.kind == calib::CellFaultKind::kRequired;
    if (!of_the_plan) {
      const auto faults = calib::faults_of(calib::load_cell(with.cell));
      ASSERT_EQ(faults.size(), 1u) << one.name;
      EXPECT_EQ(faults[0].kind, one.kind) << one.name;
    }
    const auto found = finding_of(findings, of_the_plan ? "required accuracy" : "cell itself");
    EXPECT_EQ(found.outcome, one.refused ? Outcome::kFailed : Outcome::kWarning) << one.name;
    for (const std::string& value : one.values)
      EXPECT_NE((found.found + found.advice).find(value), std::string::npos)
          << one.name << ": " << found.found << " -> " << found.advice;
    expect_advice(findings);
  }
}

TEST_F(AnExamination, NamesALimitOnTheControllerThatIsBelowTheConfigurations) {
  drivers::RsiFilesConfig narrow;
  narrow.pc_address = "10.0.0.5";
  narrow.correction_limit_deg = 40.0;
  std::filesystem::create_directory(dir / "krc");
  for (const auto& [name, text] : drivers::rsi_files(narrow))
    std::ofstream(std::filesystem::path(dir / "krc") / name, std::ios::binary) << text;
  configure("backend = \"mock\"\n[rsi]\nbind = \"10.0.0.5\"\ncorrection_limit_deg = 90\n");
  DoctorRequest with = request();
  with.files = dir / "krc";
  Findings findings;
  examine(with, findings);
  std::string found;
  for (const Finding& one : findings.all())
    if (one.check == "controller files" && one.outcome == Outcome::kFailed)
      found += words(one.found) + "\n";
  for (const char* value : {"is 40 deg, [rsi] correction_limit_deg is 90", "silently clamped"})
    EXPECT_NE(found.find(value), std::string::npos) << found;
}

TEST_F(AnExamination, FromWithinTheDaemonAsksNoDaemonAndNamesItsOwnRights) {
  configure("backend = \"mock\"\n");
  DoctorRequest one = request();
  one.cell = dir / "none.toml";
  Findings findings;
  examine_from_within(one, load_config(dir / "d.toml"), findings);
  EXPECT_EQ(outcome_of(findings, "configuration"), Outcome::kOk);
  EXPECT_EQ(outcome_of(findings, "cell file"), Outcome::kFailed);
  EXPECT_EQ(outcome_of(findings, "wires"), Outcome::kWarning);
  for (const Finding& found : findings.all()) EXPECT_NE(found.check, "daemon");
}

TEST_F(AnExamination, ThatIsStoppedDoesNotWaitForTheController) {
  const std::uint16_t port = 49700 + static_cast<std::uint16_t>(::getpid() % 100);
  configure("backend = \"rsi\"\n[rsi]\nbind = \"127.0.0.1\"\nport = " + std::to_string(port) +
            "\nrealtime = false\n[contact]\ndevice = \"" + (dir / "none").string() + "\"\n");
  DoctorRequest one = request();
  one.wait_s = 600.0;
  std::stop_source stop;
  one.stop = stop.get_token();
  // The stop is requested when the links are examined; before that there is nothing to wait for.
  one.hint = [&](const calib::Phrase&) { stop.request_stop(); };
  one.cell.clear();
  Findings findings;
  examine_from_within(one, load_config(dir / "d.toml"), findings);
  EXPECT_EQ(outcome_of(findings, "rsi packets"), Outcome::kFailed) << "none came";
}

TEST_F(AnExamination, AdvisesToPlugInASensorThatIsMissingAndNoOther) {
  const auto port_at = [&](const std::string& device) {
    configure("backend = \"rsi\"\n[rsi]\nbind = \"127.0.0.1\"\nport = " +
              std::to_string(49500 + ::getpid() % 100) +
              "\nrealtime = false\n[contact]\ndevice = \"" + device + "\"\n");
    DoctorRequest one = request();
    one.wait_s = 0.1;
    one.cell.clear();
    Findings findings;
    examine_from_within(one, load_config(dir / "d.toml"), findings);
    expect_advice(findings);
    return finding_of(findings, "contact port");
  };
  EXPECT_NE(port_at(dir / "none").advice.find("plug the sensor in"), std::string::npos);
  const Said refused = port_at("/dev/null");
  EXPECT_EQ(refused.outcome, Outcome::kFailed);
  EXPECT_EQ(refused.advice.find("plug"), std::string::npos) << refused.advice;
}

/// Over RSI on loopback, with a controller with this model of the demo cell's arm; null: none.
testing::Said model_by(const TemporaryDirectory& dir, std::shared_ptr<const sim::CartesianArm> arm,
                       const DoctorRequest& request) {
  sim::ControllerConfig controller;
  controller.timeout_cycles = 1000;
  controller.arm = std::move(arm);
  sim::KrcUdpOptions udp;
  udp.pc_port = load_config(dir / "d.toml").rsi.port;
  udp.restart_after_s = 0.1;
  sim::KrcUdp krc(controller, udp, [](sim::Controller&, drivers::TimePoint) {});
  krc.start();
  Findings findings;
  examine(request, findings);
  krc.stop();
  expect_advice(findings);
  return finding_of(findings, "controller's model");
}

TEST_F(AnExamination, OverRsiComparesTheControllersModelWithTheRobotFile) {
  const std::uint16_t port = 49800 + static_cast<std::uint16_t>(::getpid() % 100);
  configure("backend = \"rsi\"\n[rsi]\nbind = \"127.0.0.1\"\nport = " + std::to_string(port) +
            "\nrealtime = false\nsilence_cycles = 50\n[contact]\ndevice = \"" +
            (dir / "none").string() + "\"\n");
  calib::Cell cell = calib::load_cell(CELLCAL_DEMO_CELL);
  cell.tool.tcp = Eigen::Isometry3d::Identity();  // $NULLFRAME
  const auto same = model_by(dir, sim::make_cartesian_arm(cell), request());
  EXPECT_EQ(same.outcome, Outcome::kOk) << same.found;
  EXPECT_NE(same.found.find("0.00 mm from the robot file"), std::string::npos) << same.found;
  cell.robot = calib::load_named_robot("kr5_arc");
  const auto other = model_by(dir, sim::make_cartesian_arm(cell), request());
  EXPECT_EQ(other.outcome, Outcome::kWarning) << other.found;
  EXPECT_NE(other.found.find("another robot type"), std::string::npos) << other.found;
  const auto none = model_by(dir, nullptr, request());
  EXPECT_EQ(none.outcome, Outcome::kWarning);
  EXPECT_NE(none.advice.find("DEF_RIst"), std::string::npos) << none.advice;
}

TEST_F(AnExamination, OverRsiNeverAsksForACorrection) {
  const std::uint16_t port = 49900 + static_cast<std::uint16_t>(::getpid() % 100);
  configure("backend = \"rsi\"\n[rsi]\nbind = \"127.0.0.1\"\nport = " + std::to_string(port) +
            "\nrealtime = false\nsilence_cycles = 50\n[contact]\ndevice = \"" +
            (dir / "none").string() + "\"\n");
  sim::ControllerConfig controller;
  controller.timeout_cycles = 1000;
  sim::KrcUdpOptions udp;
  udp.pc_port = port;
  udp.restart_after_s = 0.1;
  double largest_deg = 0.0;
  sim::KrcUdp krc(controller, udp, [&](sim::Controller& c, drivers::TimePoint) {
    for (const double deg : c.correction_deg()) largest_deg = std::max(largest_deg, std::abs(deg));
  });
  krc.start();
  Findings findings;
  examine(request(), findings);
  krc.stop();
  EXPECT_EQ(outcome_of(findings, "contact port"), Outcome::kFailed);
  EXPECT_EQ(outcome_of(findings, "rsi decimals"), Outcome::kOk);
  EXPECT_NE(outcome_of(findings, "rsi replies"), Outcome::kSkipped);
  EXPECT_EQ(largest_deg, 0.0);
}

}  // namespace
}  // namespace cellcal::daemon::testing
