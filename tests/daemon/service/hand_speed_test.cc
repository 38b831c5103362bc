// The speed near a person, checked by the emulated controller's monitoring of T1.

#include <gtest/gtest.h>

#include "calib/files/files.h"
#include "calib/model/linear.h"
#include "daemon/service/job.h"
#include "daemon/tasks/options.h"
#include "sim/krc/cartesian_arm.h"
#include "tests/daemon/journal/temporary_directory.h"
#include "tests/daemon/runner/fakes.h"
#include "tests/drivers/kuka/rsi/rig.h"

namespace cellcal::daemon::testing {
namespace {

constexpr double kBoundMS = 0.225;
constexpr double kFraction = 0.5;

struct HandSpeedTest : ::testing::Test {
  drivers::RsiConfig config() const {
    drivers::RsiConfig config = drivers::rig_config();
    for (std::size_t i = 0; i < config.limits.size(); ++i) {
      const calib::Joint& joint = cell.robot.joints[i];
      config.limits[i].min_rad = joint.min_rad;
      config.limits[i].max_rad = joint.max_rad;
      config.limits[i].max_speed_rad_s = joint.max_speed_rad_s * kFraction;
    }
    config.correction_limit_deg.assign(6, 360.0);
    return config;
  }
  sim::ControllerConfig in_t1() const {
    sim::ControllerConfig krc;
    krc.arm = sim::make_cartesian_arm(cell);
    krc.clamp_deg = krc.monitor_deg = 360.0;
    return krc;
  }
  HandSpeed bound(bool mode_unknown = true, double speed_m_s = kBoundMS) const {
    return {arm, kFraction, {speed_m_s, mode_unknown}};
  }
  drivers::AxisAngles posture(calib::Random& random) const {
    drivers::AxisAngles at;
    for (const calib::Joint& joint : cell.robot.joints) {
      const double middle = (joint.min_rad + joint.max_rad) / 2.0;
      const double half = (joint.max_rad - joint.min_rad) / 2.0;
      at.push_back(random.uniform(middle - 0.8 * half, middle + 0.8 * half));
    }
    return at;
  }
  drivers::Move transit(const drivers::AxisAngles& to, const drivers::Vias& via = {}) const {
    drivers::Move move;
    move.kind = drivers::MoveKind::kTransit;
    move.target_rad = to;
    move.via = via;
    return move;
  }
  drivers::RobotState at(const drivers::AxisAngles& from, drivers::OperatingMode mode) const {
    drivers::RobotState state;
    state.commanded_rad = from;
    state.mode = mode;
    return state;
  }

  /// Moves of three legs, at the speed share derived from the adapter's state.
  void move_in_t1(const HandSpeed& speed, const sim::ControllerConfig& krc) const;

  calib::Cell cell = calib::load_cell(CELLCAL_DEMO_CELL);
  std::shared_ptr<const calib::ArmModel> arm = std::make_shared<const calib::ArmModel>(cell);
};

void HandSpeedTest::move_in_t1(const HandSpeed& speed, const sim::ControllerConfig& krc) const {
  drivers::Rig rig(krc, config());
  rig.krc.mode(sim::OperatingMode::kT1);
  rig.make_ready();
  calib::Random random(3);
  for (int k = 0; k < 20; ++k) {
    drivers::Vias via;
    via.push_back({posture(random), 0.5, 0.5});
    via.push_back({posture(random), 0.3, 0.4});
    drivers::Move move = transit(posture(random), via);
    move.id = ++rig.last_id;
    move.speed_share = speed.share(move, rig.core.state());
    ASSERT_GT(move.speed_share, 0.0);
    rig.core.begin(move);
    const drivers::CoreResult result = rig.finish(std::chrono::seconds(300));
    ASSERT_EQ(result.outcome, drivers::MoveOutcome::kArrived) << words(result) << rig.krc.message();
  }
  EXPECT_EQ(rig.krc.phase(), sim::RsiPhase::kRunning) << rig.krc.message();
}

TEST_F(HandSpeedTest, KeepsAnArmOverRsiMovingInT1AfterTheFirstCalibrationToo) {
  move_in_t1(bound(false), in_t1());
}

TEST_F(HandSpeedTest, KeepsAnArmMovingInT1BeforeItWhereRsiDoesNotTellTheMode) {
  sim::ControllerConfig older = in_t1();
  older.mode_tag.clear();
  move_in_t1(bound(true), older);
}

TEST_F(HandSpeedTest, UnboundedEndsTheSessionInT1) {
  drivers::Rig rig(in_t1(), config());
  rig.krc.mode(sim::OperatingMode::kT1);
  rig.make_ready();
  calib::Random random(3);
  rig.begin(drivers::MoveKind::kTransit, posture(random));
  EXPECT_NE(rig.finish().outcome, drivers::MoveOutcome::kArrived);
  EXPECT_EQ(rig.krc.message(), "T1: more than 250 mm/s at the TCP");
}

TEST_F(HandSpeedTest, IsUsedUpOnAWayThatTheAxesCouldRunFaster) {
  drivers::AxisAngles from{0.0, -1.0, 1.5, 0.0, 0.5, 0.0}, to = from;
  to[0] = 1.0;
  const double share = bound().share(transit(to), at(from, drivers::OperatingMode::kUnknown));
  const Eigen::Vector3d tip = arm->nominal_tip_m(std::vector<double>(from.begin(), from.end()));
  const double full_m_s = tip.head<2>().norm() * cell.robot.joints[0].max_speed_rad_s * kFraction;
  EXPECT_NEAR(share * full_m_s, kBoundMS, 0.01 * kBoundMS);
}

TEST_F(HandSpeedTest, BoundsWhatAPositionerTurns) {
  calib::PositionerAxis axis;
  axis.frame.translation() = Eigen::Vector3d(1.0, 0.0, 0.5);
  axis.min_rad = -3.0;
  axis.max_rad = 3.0;
  calib::Cell with = cell;
  with.robot.positioner = {axis};
  with.targets[0].carried_by = 1;
  with.targets[0].centre_m = Eigen::Vector3d(0.6, 0.0, 0.2);
  const HandSpeed speed(std::make_shared<const calib::ArmModel>(with), kFraction,
                        {kBoundMS, true, 1.0}, with.targets);
  drivers::AxisAngles from{0.0, -1.0, 1.5, 0.0, 0.5, 0.0, -1.0}, to = from;
  to[6] = 2.0;
  const double share = speed.share(transit(to), at(from, drivers::OperatingMode::kT1));
  EXPECT_NEAR(share * 0.6, kBoundMS, 0.01 * kBoundMS);
  calib::Target& sought = with.targets[0];
  sought.has_centre = false;
  sought.has_box = true;
  sought.low_m = Eigen::Vector3d(0.5, -0.1, 0.2);
  sought.high_m = Eigen::Vector3d(0.6, 0.8, 0.2);
  const HandSpeed before(std::make_shared<const calib::ArmModel>(with), kFraction,
                         {kBoundMS, true, 1.0}, with.targets);
  EXPECT_NEAR(before.share(transit(to), at(from, drivers::OperatingMode::kT1)), kBoundMS,
              0.01 * kBoundMS)
      << "1 m from the axis it may be";
  to[6] = from[6];
  to[0] = 0.1;
  EXPECT_EQ(speed.share(transit(to), at(from, drivers::OperatingMode::kT1)),
            bound().share(transit({to.begin(), to.end() - 1}),
                          at({from.begin(), from.end() - 1}, drivers::OperatingMode::kT1)))
      << "a table at rest";
}

TEST_F(HandSpeedTest, AppliesInT1AndWhereTheModeIsUnknownBeforeTheFirstCalibration) {
  using Mode = drivers::OperatingMode;
  drivers::AxisAngles from{0.0, -1.0, 1.5, 0.0, 0.5, 0.0}, to = from;
  to[0] = 1.0;
  const auto share = [&](const HandSpeed& speed, Mode mode) {
    return speed.share(transit(to), at(from, mode));
  };
  for (const bool before_the_first : {false, true}) {
    const HandSpeed speed = bound(before_the_first);
    EXPECT_LT(share(speed, Mode::kT1), 1.0);
    EXPECT_EQ(share(speed, Mode::kUnknown) < 1.0, before_the_first);
    for (const Mode fast : {Mode::kT2, Mode::kAut, Mode::kExt}) EXPECT_EQ(share(speed, fast), 1.0);
  }
  EXPECT_EQ(share(bound(true, 0.0), Mode::kT1), 1.0) << "switched off";
}

TEST_F(HandSpeedTest, LeavesSearchesAndMovesWithADurationAlone) {
  drivers::AxisAngles from{0.0, -1.0, 1.5, 0.0, 0.5, 0.0}, to = from;
  to[0] = 1.0;
  drivers::Move move = transit(to);
  move.cruise_s = 3.0;
  EXPECT_EQ(bound().share(move, at(from, drivers::OperatingMode::kT1)), 1.0);
}

struct HandSpeedOfASession : HandSpeedTest {
  struct Emulated final : FakeBackend {
    bool emulated() const override { return true; }
  };
  /// True if a new session is bounded when the link does not report the mode.
  bool bounded() {
    SessionSettings settings;
    settings.hand_speed_m_s = kBoundMS;
    settings.speed_fraction = kFraction;
    RunRequest request;
    request.cell = CELLCAL_DEMO_CELL;
    const auto job =
        prepare(journal, request, settings,
                [&](const calib::Cell&, double, const std::string&) -> std::unique_ptr<Backend> {
                  if (emulated) return std::make_unique<Emulated>();
                  return std::make_unique<FakeBackend>();
                });
    if (!job->hand_speed) return false;
    drivers::AxisAngles from{0.0, -1.0, 1.5, 0.0, 0.5, 0.0}, to = from;
    to[0] = 1.0;
    return job->hand_speed->share(transit(to), at(from, drivers::OperatingMode::kUnknown)) < 1.0;
  }
  void end_one(SessionKind kind, Ending ending, bool by_an_emulated_cell = false) {
    SessionInputs inputs = read_inputs(CELLCAL_DEMO_CELL);
    SessionOptions options;
    options.kind = kind;
    options.emulated = by_an_emulated_cell;
    inputs.options = options_to_json(options);
    journal.record(journal.begin(inputs, "t0"), RecordEnd{ending, ""}, "t1");
  }
  TemporaryDirectory dir;
  Journal journal{dir / "j.db"};
  bool emulated = false;
};

TEST_F(HandSpeedOfASession, IsBoundedUntilACalibrationOfTheRealCellHasEnded) {
  EXPECT_TRUE(bounded());
  end_one(SessionKind::kCalibrate, Ending::kFailed);
  end_one(SessionKind::kDryRun, Ending::kDone);
  end_one(SessionKind::kCalibrate, Ending::kDone, true);
  EXPECT_TRUE(bounded());
  end_one(SessionKind::kCalibrate, Ending::kDone);
  EXPECT_FALSE(bounded());
}

TEST_F(HandSpeedOfASession, IsNotBoundedInAnEmulatedCell) {
  emulated = true;
  EXPECT_FALSE(bounded());
}

}  // namespace
}  // namespace cellcal::daemon::testing
