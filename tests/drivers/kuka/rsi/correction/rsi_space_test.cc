// Corrections in space: moves, refusals, and stops of an arm that a controller moves differently.

#include "drivers/kuka/rsi/rsi_space.h"

#include <random>

#include "calib/model/kinematics.h"
#include "tests/drivers/kuka/rsi/correction/space_rig.h"
#include "tests/drivers/said.h"

namespace cellcal::drivers {
namespace {

const AxisAngles kHome{0.0, -90 * kDeg, 90 * kDeg, 0.0, 90 * kDeg, 0.0};

double farthest_deg(const std::vector<double>& a, const AxisAngles& b) {
  double most = 0.0;
  for (std::size_t i = 0; i < b.size(); ++i) most = std::max(most, std::abs(a[i] - b[i]));
  return most / kDeg;
}

TEST(NominalArm, IsTheArmModelsNominalOne) {
  calib::Cell cell = torch_cell();
  cell.robot.base_fixed.translation() = Eigen::Vector3d(0.1, -0.2, 0.3);
  cell.robot.joints[2].beta_rad = 0.01;
  cell.robot.flange_fixed.translation() = Eigen::Vector3d(0.0, 0.0, 0.02);
  const calib::ArmModel model(cell.robot, cell.tool);
  const calib::NominalArm arm(cell.robot, cell.tool.tcp);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> angle(-3.0, 3.0);
  for (int i = 0; i < 100; ++i) {
    std::vector<double> q(6);
    for (double& one : q) one = angle(random);
    EXPECT_LT((arm.tcp(q).matrix() - model.nominal_tcp(q).matrix()).norm(), 1e-12);
  }
}

struct Frames {
  CorrectionFrame ours;
  sim::CorrectionFrame theirs;
};
class SpaceFrame : public ::testing::TestWithParam<Frames> {};

TEST_P(SpaceFrame, RkorrLeadsTheControllersArmToTheCommandedAxes) {
  const RsiConfig config = space_config(GetParam().ours);
  const auto arm = sim::make_cartesian_arm(torch_cell());
  SpaceCorrector space(config.space);
  space.begin(kHome);
  std::mt19937 random(2);
  std::uniform_real_distribution<double> by(-30.0, 30.0);
  for (int i = 0; i < 200; ++i) {
    KukaFrame correction_deg{};
    AxisAngles target = kHome;
    for (std::size_t k = 0; k < 6; ++k) {
      correction_deg[k] = by(random);
      target[k] += correction_deg[k] * kDeg;
    }
    const auto rkorr = space.rkorr(correction_deg);
    ASSERT_TRUE(rkorr);
    const std::vector<double> start(kHome.begin(), kHome.end()), near(target.begin(), target.end());
    const auto reached = arm->corrected(start, *rkorr, GetParam().theirs, near);
    ASSERT_TRUE(reached);
    EXPECT_LT(farthest_deg(*reached, target), 1e-5);
  }
}

TEST_P(SpaceFrame, TheArmKeepsToItsLineInJointSpaceAndArrives) {
  sim::ControllerConfig krc = space_krc(GetParam().theirs);
  krc.noise_sigma_deg = 0.0005;
  Rig rig(krc, space_config(GetParam().ours));
  rig.make_ready();
  // Rounding to 1e-6 mm and deg, and a start known from ASPos to 1e-4 deg, through the arm's
  // inverse.
  double off = 0.0, fastest = 0.0;
  AxisAngles before = rig.commanded();
  std::vector<double> at = rig.krc.setpoint_rad();
  rig.after_cycle = [&] {  // the reply of one cycle is the setpoint of the next
    off = std::max(off, farthest_deg(rig.krc.setpoint_rad(), before));
    before = rig.commanded();
    for (std::size_t i = 0; i < 6; ++i)
      fastest = std::max(fastest, std::abs(rig.krc.setpoint_rad()[i] - at[i]) / 0.004);
    at = rig.krc.setpoint_rad();
  };
  AxisAngles target = rig.commanded();
  const double by_deg[] = {25, -12, 18, 30, -22, -35};
  for (std::size_t i = 0; i < 6; ++i) target[i] += by_deg[i] * kDeg;
  for (const AxisAngles& to : {target, rig.commanded()}) {
    const CoreResult result = rig.move(MoveKind::kTransit, to);
    EXPECT_EQ(result.outcome, MoveOutcome::kArrived) << words(result);
    EXPECT_EQ(result.at_rad, to);
    EXPECT_NE(rig.reply.find("<RKorr X=\""), std::string::npos) << rig.reply;
    EXPECT_EQ(rig.reply.find("<AK"), std::string::npos);
  }
  EXPECT_LT(off, 1e-3) << "deg";
  EXPECT_LE(fastest, 100.5 * kDeg);
  EXPECT_EQ(rig.krc.late_ever(), 0U);
}

INSTANTIATE_TEST_SUITE_P(
    , SpaceFrame,
    ::testing::Values(Frames{CorrectionFrame::kBase, sim::CorrectionFrame::kBase},
                      Frames{CorrectionFrame::kRobRoot, sim::CorrectionFrame::kBase},
                      Frames{CorrectionFrame::kTool, sim::CorrectionFrame::kTool}),
    [](const auto& one) {
      return one.param.ours == CorrectionFrame::kBase      ? "Base"
             : one.param.ours == CorrectionFrame::kRobRoot ? "RobRoot"
                                                           : "Tool";
    });

// ---- refusals before any motion ---------------------------------------------------------------

CoreResult refused(RsiConfig config, const AxisAngles& by_deg) {
  Rig rig(space_krc(), std::move(config));
  rig.make_ready();
  AxisAngles target = rig.commanded();
  for (std::size_t i = 0; i < 6; ++i) target[i] += by_deg[i] * kDeg;
  const CoreResult result = rig.move(MoveKind::kTransit, target);
  rig.run(200ms);
  EXPECT_EQ(rig.krc.cartesian_correction(), sim::KukaFrame{}) << "something moved";
  return result;
}

TEST(RsiSpace, ShiftBeyondItsLimitIsRefusedWithBothFigures) {
  RsiConfig config = space_config();
  config.space.limit_mm = 100.0;
  const CoreResult result = refused(config, {10, 0, 0, 0, 0, 0});
  EXPECT_EQ(result.outcome, MoveOutcome::kRefused);
  const auto* limit = std::get_if<cause::ShiftLimit>(&result.cause);
  ASSERT_NE(limit, nullptr) << words(result);
  EXPECT_GT(limit->shift_mm, limit->limit_mm);
  EXPECT_EQ(limit->limit_mm, 100.0);
}

TEST(RsiSpace, TurnBeyondItsLimitIsRefusedWithBothFigures) {
  RsiConfig config = space_config();
  config.space.turn_limit_deg = 30.0;
  const CoreResult result = refused(config, {0, 0, 0, 0, 0, 40});
  EXPECT_EQ(result.outcome, MoveOutcome::kRefused);
  const auto* limit = std::get_if<cause::TurnLimit>(&result.cause);
  ASSERT_NE(limit, nullptr) << words(result);
  EXPECT_GT(limit->turn_deg, limit->limit_deg);
  EXPECT_EQ(limit->limit_deg, 30.0);
}

TEST(RsiSpace, ALimitThatOnlyTheMiddleOfTheLineExceedsIsSeen) {
  // On a circle of 800 mm from 150 to 210 deg next to the start: farthest in the middle. A6
  // compensates A1's rotation.
  RsiConfig config = space_config();
  const auto over = [&](double limit_mm, double to_deg) {
    config.space.limit_mm = limit_mm;
    SpaceCorrector space(config.space);
    space.begin(kHome);
    AxisAngles from(6, 0.0), to(6, 0.0);
    from[0] = from[5] = 150 * kDeg;
    to[0] = to[5] = to_deg * kDeg;
    return space.object_to(from, to);
  };
  EXPECT_FALSE(over(1601.0, 210.0));
  EXPECT_FALSE(over(1570.0, 155.0));
  const auto objection = over(1570.0, 210.0);
  ASSERT_TRUE(objection);
  const auto* limit = std::get_if<cause::ShiftLimit>(&*objection);
  ASSERT_NE(limit, nullptr);
  EXPECT_GT(limit->shift_mm, 1570.0);
}

TEST(RsiSpace, ALineThroughTheWristsSingularityIsRefusedAndItsAxisNamed) {
  RsiConfig config = space_config();
  config.space.turn_limit_deg = 179.0;
  config.correction_limit_deg.assign(6, 360.0);
  const CoreResult result = refused(config, {0, 0, 0, 0, -100, 0});
  EXPECT_EQ(result.outcome, MoveOutcome::kRefused);
  const auto* near = std::get_if<cause::NearSingular>(&result.cause);
  ASSERT_NE(near, nullptr) << words(result);
  EXPECT_TRUE(near->axis == 3 || near->axis == 5) << words(result);
  EXPECT_GT(near->gain, kMostGain);
}

TEST(RsiSpace, ALineToTheStretchedArmIsRefused) {
  RsiConfig config = space_config();
  config.space.turn_limit_deg = 179.0;
  // The forearm's offset of 120 mm lets it stretch at A3 = -11 deg.
  const CoreResult result = refused(config, {0, 0, -89, 0, 0, 0});
  EXPECT_EQ(result.outcome, MoveOutcome::kRefused);
  EXPECT_TRUE(is<cause::NearSingular>(result.cause)) << words(result);
}

TEST(RsiSpace, AnArmThatBeginsInASingularityIsRefusedAndLeftThere) {
  sim::ControllerConfig krc = space_krc();
  krc.start_rad[4] = 0.0;
  Rig rig(krc, space_config());
  rig.make_ready();
  const CoreResult result = rig.move(MoveKind::kTransit, rig.moved_by(4, 2.0));
  EXPECT_EQ(result.outcome, MoveOutcome::kRefused);
  EXPECT_TRUE(is<cause::NearSingular>(result.cause)) << words(result);
}

TEST(RsiSpace, AngleAMayPassHalfARevolution) {
  sim::ControllerConfig krc = space_krc();
  RsiConfig config = space_config();
  config.space.turn_limit_deg = 180.0;
  config.correction_limit_deg.assign(6, 360.0);
  config.space.limit_mm = 3000.0;
  krc.clamp_mm = krc.monitor_mm = 3000.0;
  Rig rig(krc, config);
  rig.make_ready();
  const CoreResult result = rig.move(MoveKind::kTransit, rig.moved_by(0, 170.0));
  ASSERT_EQ(result.outcome, MoveOutcome::kArrived) << words(result);
  EXPECT_LT(rig.krc.cartesian_correction()[3], -169.0);
  // A6 is upside down next to A1: the rotation passes 180 deg and returns.
  const CoreResult beyond = rig.move(MoveKind::kTransit, rig.moved_by(5, -20.0));
  ASSERT_EQ(beyond.outcome, MoveOutcome::kArrived) << words(beyond);
  EXPECT_GT(rig.krc.cartesian_correction()[3], 169.0);
}

TEST(RsiSpace, AngleBMayPassARightAngleInBothSenses) {
  RsiConfig config = space_config();
  config.space.turn_limit_deg = 180.0;
  Rig rig(space_krc(), config);
  rig.make_ready();
  // All three rotate about the root's y: B alone, exactly at 90 deg in the middle.
  AxisAngles target = rig.commanded();
  const AxisAngles home = target;
  for (const std::size_t i : {1, 2, 4}) target[i] += 33 * kDeg;
  double most_b = 0.0, off = 0.0;
  AxisAngles before = rig.commanded();
  rig.after_cycle = [&] {
    most_b = std::max(most_b, std::abs(rig.krc.cartesian_correction()[4]));
    off = std::max(off, farthest_deg(rig.krc.setpoint_rad(), before));
    before = rig.commanded();
  };
  for (const AxisAngles& to : {target, home}) {
    const CoreResult result = rig.move(MoveKind::kTransit, to);
    ASSERT_EQ(result.outcome, MoveOutcome::kArrived) << words(result);
  }
  EXPECT_GT(most_b, 89.0);
  EXPECT_LT(off, 1e-3) << "deg";
}

// ---- controllers with another interpretation --------------------------------------------------

TEST(RsiSpace, AnotherToolAtTheControllerShowsBeforeTheReference) {
  sim::ControllerConfig krc = space_krc();
  krc.arm = sim::make_cartesian_arm(sim::arm_cell());
  Rig rig(krc, space_config());
  rig.krc.rsi_on();
  rig.run(300ms);
  rig.core.rereference();
  rig.run(1s);
  EXPECT_EQ(rig.core.state().link, RobotLink::kNotReferenced);
  const std::string words = said(rig.core.state().words);
  EXPECT_NE(words.find("RIst"), std::string::npos) << words;
  EXPECT_NE(words.find("417."), std::string::npos) << "how far: " << words;
  EXPECT_NE(words.find("[controller] tool"), std::string::npos) << words;
}

/// Composes the angles in reverse order.
class OtherOrder final : public sim::CartesianArm {
 public:
  OtherOrder() : arm_(sim::make_cartesian_arm(torch_cell())) {}
  sim::KukaFrame frame(std::span<const double> q) const override { return arm_->frame(q); }
  std::optional<std::vector<double>> axes(const sim::KukaFrame& tcp,
                                          const std::vector<double>& near) const override {
    return arm_->axes(tcp, near);
  }
  std::optional<std::vector<double>> corrected(std::span<const double> start,
                                               const sim::KukaFrame& by,
                                               sim::CorrectionFrame system,
                                               const std::vector<double>& near) const override {
    // Rx(C) Ry(B) Rz(A) is the inverse of Rz(-A) Ry(-B) Rx(-C).
    const auto turn = [](double deg, const Eigen::Vector3d& axis) {
      return Eigen::AngleAxisd(deg * kDeg, axis);
    };
    const Eigen::Matrix3d r =
        (turn(by[5], Eigen::Vector3d::UnitX()) * turn(by[4], Eigen::Vector3d::UnitY()) *
         turn(by[3], Eigen::Vector3d::UnitZ()))
            .toRotationMatrix();
    sim::KukaFrame same = by;
    same[3] = std::atan2(r(1, 0), r(0, 0)) / kDeg;
    same[4] = std::asin(-r(2, 0)) / kDeg;
    same[5] = std::atan2(r(2, 1), r(2, 2)) / kDeg;
    return arm_->corrected(start, same, system, near);
  }

 private:
  std::shared_ptr<const sim::CartesianArm> arm_;
};

struct Misled {
  const char* name;
  std::function<void(sim::ControllerConfig&)> controller;
};
class RsiSpaceMismatch : public ::testing::TestWithParam<Misled> {};

/// Moves all axes and returns the outcome and the largest deviation of the arm [deg].
struct Astray {
  CoreResult result;
  double off_deg = 0.0;
  RobotLink link = RobotLink::kReady;
};
Astray misled(const Misled& how, MoveKind kind, double cruise_s, int search) {
  sim::ControllerConfig krc = space_krc();
  how.controller(krc);
  RsiConfig config = space_config();
  config.space.compare_tcp = false;  // as without RIst
  Rig rig(krc, config);
  rig.make_ready();
  rig.guard.arm(7);
  AxisAngles target = rig.commanded();
  const double by_deg[] = {8, -3, 4, 12, -10, 15};
  for (std::size_t i = 0; i < 6; ++i) target[i] += by_deg[i] * kDeg;
  Astray astray;
  AxisAngles before = rig.commanded();
  rig.after_cycle = [&] {
    astray.off_deg = std::max(astray.off_deg, farthest_deg(rig.krc.setpoint_rad(), before));
    before = rig.commanded();
  };
  astray.result = rig.move(kind, target, cruise_s, search);
  astray.link = rig.core.state().link;
  return astray;
}

/// Ends the move with the correct cause once the arm has left its line by slightly more than the
/// tolerance.
TEST_P(RsiSpaceMismatch, StopsByNameAfterASmallDeviationAndRecordsNoTouch) {
  const Astray astray = misled(GetParam(), MoveKind::kSearch, 20.0, 7);
  const CoreResult& result = astray.result;
  EXPECT_EQ(result.outcome, MoveOutcome::kNotFollowing) << words(result);
  EXPECT_FALSE(result.latch);
  EXPECT_TRUE((is<cause::AxisNotFollowing, cause::AxisStands>(result.cause))) << words(result);
  EXPECT_TRUE(result.in_space);
  EXPECT_LT(astray.off_deg, 0.12);
  EXPECT_EQ(astray.link, RobotLink::kNotReferenced);
}

/// A transit continues until the deviation is detected; then it is stopped immediately at any
/// speed.
TEST_P(RsiSpaceMismatch, StopsAFastTransitWithinAShortRamp) {
  const Astray astray = misled(GetParam(), MoveKind::kTransit, 0.0, 0);
  EXPECT_EQ(astray.result.outcome, MoveOutcome::kNotFollowing) << words(astray.result);
  EXPECT_EQ(astray.link, RobotLink::kNotReferenced);
  std::printf("%s: astray by %.2f deg at most\n", GetParam().name, astray.off_deg);
  EXPECT_LT(astray.off_deg, 1.5);
}

INSTANTIATE_TEST_SUITE_P(
    , RsiSpaceMismatch,
    ::testing::Values(
        Misled{"ByAnotherFrame", [](auto& c) { c.cartesian_system = sim::CorrectionFrame::kTool; }},
        Misled{"ByAnotherTool", [](auto& c) { c.arm = sim::make_cartesian_arm(sim::arm_cell()); }},
        Misled{"ByAnotherArm",
               [](auto& c) {
                 calib::Cell cell = torch_cell();
                 cell.robot.joints[2].a_m = 0.04;
                 cell.robot.joints[5].d_m = 0.08;
                 c.arm = sim::make_cartesian_arm(cell);
               }},
        Misled{"ByAnotherOrderOfTurns", [](auto& c) { c.arm = std::make_shared<OtherOrder>(); }},
        Misled{"ByASilentClamp", [](auto& c) { c.clamp_mm = 5.0; }}),
    [](const auto& one) { return one.param.name; });

}  // namespace
}  // namespace cellcal::drivers
