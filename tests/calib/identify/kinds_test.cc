// Planes and trackers, and all kinds of targets mixed.

#include <gtest/gtest.h>

#include "calib/estimate/predict.h"
#include "calib/files/calibration_json.h"
#include "calib/files/files.h"
#include "calib/identify/identify.h"
#include "calib/identify/identify_once.h"
#include "calib/model/error.h"
#include "sim/cell/compare.h"
#include "tests/calib/findings.h"
#include "tests/calib/millimetre.h"
#include "tests/calib/simulate.h"
#include "tests/calib/thrown.h"
#include "tests/experiments/constraints/stage.h"

namespace cellcal::calib {
namespace {

using testing::found;
using testing::kMm;
using testing::the;
using testing::words_of;

using Eigen::Vector3d;
using sim::constraints::Stage;

Target target_of(const std::string& id, TargetKind kind, const Vector3d& at) {
  Target target;
  target.id = id;
  target.kind = kind;
  target.has_centre = kind != TargetKind::kTracker;
  target.centre_m = at;
  if (kind == TargetKind::kSphere) target.diameter_m = 0.0614;
  return target;
}

Target plane(const std::string& id, const Vector3d& at, const Vector3d& normal) {
  Target target = target_of(id, TargetKind::kPlane, at);
  target.has_normal = true;
  target.normal = normal.normalized();
  return target;
}

/// The demo's arm and tool, with a ball as the tip.
Cell bare_cell() {
  Cell cell = testing::demo_cell();
  cell.targets.clear();
  cell.lengths.clear();
  cell.tool.tip_radius_m = 1.5 * kMm;
  return cell;
}

Cell three_planes() {
  Cell cell = bare_cell();
  cell.targets = {plane("P1", {1.0, 0.0, 0.35}, {0, 0, 1}),
                  plane("P2", {0.8, 0.5, 0.5}, {-1, -1, 1}),
                  plane("P3", {0.9, -0.5, 0.6}, {-1, 1, 0.6})};
  return cell;
}

/// Enough planes for noise-free touches to determine every direction except the frame.
Cell six_planes() {
  Cell cell = three_planes();
  cell.targets.push_back(plane("P4", {0.8, 0.1, 0.7}, {-1, 0, 0.5}));
  cell.targets.push_back(plane("P5", {1.0, 0.35, 0.7}, {-0.5, -1, 0.5}));
  cell.targets.push_back(plane("P6", {0.6, -0.7, 0.3}, {0.3, 0.5, 1}));
  return cell;
}

Cell tracker_alone() {
  Cell cell = bare_cell();
  cell.targets = {target_of("T", TargetKind::kTracker, Vector3d::Zero())};
  return cell;
}

Cell all_kinds() {
  Cell cell = three_planes();
  cell.targets.resize(1);
  cell.targets.push_back(target_of("S", TargetKind::kSphere, {1.08, -0.32, 0.33}));
  cell.targets.push_back(target_of("W", TargetKind::kWire, {0.9, 0.3, 0.4}));
  cell.targets.push_back(target_of("C", TargetKind::kPoint, {0.76, 0.56, 0.78}));
  cell.targets.push_back(target_of("T", TargetKind::kTracker, Vector3d::Zero()));
  for (const char* to : {"W", "C"}) cell.lengths.push_back({"S", to, 1.0, 5e-6});
  return cell;
}

/// A cell with the tolerances of noise-free touches.
Cell noise_free(Cell cell) {
  cell.touch_sigma_m = 1e-9;
  cell.radius_offset_sigma_m = 1e-9;
  for (CertifiedLength& length : cell.lengths) length.sigma_m = 1e-9;
  return cell;
}

std::vector<JointVector> joints_of(const std::vector<Touch>& touches) {
  std::vector<JointVector> joints;
  for (const Touch& touch : touches) joints.push_back(touch.joint_rad);
  return joints;
}

/// Expects that identification is refused, for a reason of this kind concerning this target.
void expect_refused(const Cell& cell, const std::vector<Touch>& touches, IdentifyError::Kind kind,
                    const std::string& target) {
  const auto error =
      testing::thrown<IdentifyError>([&] { (void)identify_single_pass(cell, touches); });
  EXPECT_EQ(error.kind, kind) << error.what();
  EXPECT_EQ(error.target, target) << error.what();
  EXPECT_EQ(std::string(error.what()).find("target " + target + ": "), 0U) << error.what();
  EXPECT_EQ(the(identify(cell, touches), FindingKind::kNotIdentified).text, error.what());
}

/// Files may omit values that the touches determine.
Cell silent(Cell cell) {
  for (Target& target : cell.targets) target.has_centre = target.has_normal = false;
  return cell;
}

TEST(Kinds, RecoverTheArmExactlyFromNoiseFreeTouches) {
  for (const Cell& kind : {six_planes(), tracker_alone(), all_kinds()}) {
    const Stage stage = sim::constraints::set_up(noise_free(kind), {.seed = 3});
    Cell cell = stage.cell;
    for (CertifiedLength& length : cell.lengths)
      length.length_m = (stage.truth.centre_m[cell.target_index(length.from)] -
                         stage.truth.centre_m[cell.target_index(length.to)])
                            .norm();
    const auto touches =
        sim::constraints::touch(stage, {.fit = 240, .check = 40, .noise_m = 0.0, .seed = 3});
    SCOPED_TRACE(kind.targets.size());
    const Calibration result = identify(cell, touches);
    EXPECT_GT(result.check_before.rms_m, 0.3 * kMm);
    EXPECT_LT(result.after.max_m, 1e-9);
    EXPECT_LT(result.check.max_m, 1e-9);
    EXPECT_TRUE(result.outliers.empty());
    const auto figures = sim::truth_figures(stage.truth, result, joints_of(touches)).workspace;
    EXPECT_GT(figures.nominal_mean_m, 0.5 * kMm);
    // Touches of planes tolerate errors elsewhere on the arm: there the tolerances decide.
    EXPECT_LT(figures.max_m, kind.targets.size() == 6 ? 0.1 * kMm : 1e-8);
  }
}

TEST(Kinds, FindWhereTheyStand) {
  const Stage stage = sim::constraints::set_up(all_kinds(), {.seed = 4});
  const double rho = 0.1 * kMm;
  const auto touches = sim::constraints::touch(stage, {.fit = 200, .rho_m = rho, .seed = 4});
  const Calibration result = identify(silent(stage.cell), touches);
  EXPECT_TRUE(result.verdict.publish()) << words_of(result);
  // The position of the base is a convention, the relative positions of the targets are not.
  const TargetResult &p = result.targets[0], &s = result.targets[1], &t = result.targets[4];
  const double found = p.normal.dot(s.centre_m) - p.distance_m;
  const double real = stage.normal[0].dot(stage.truth.centre_m[1] - stage.truth.centre_m[0]);
  EXPECT_NEAR(found, real, 0.15 * kMm);
  const Vector3d normal_seen = stage.frame[4].linear().transpose() * stage.normal[0];
  EXPECT_LT((t.frame.linear().transpose() * p.normal - normal_seen).norm(), 5e-4);
  const Vector3d sphere_seen = stage.frame[4].inverse() * stage.truth.centre_m[1];
  EXPECT_LT((t.frame.inverse() * s.centre_m - sphere_seen).norm(), 0.3 * kMm);
  EXPECT_NEAR(p.effective_radius_m, 1.5 * kMm + rho, 0.1 * kMm);
  EXPECT_EQ(t.effective_radius_m, 0.0);
  EXPECT_NEAR(result.chi2_per_dof, 1.0, 0.4);
}

TEST(Kinds, MistakesOfATrackersReadingsAreNamed) {
  const Stage stage = sim::constraints::set_up(tracker_alone(), {.seed = 5});
  const auto right = sim::constraints::touch(stage, {.fit = 60, .seed = 5});
  auto metres = right;
  auto left_handed = right;
  for (std::size_t i = 0; i < right.size(); ++i) {
    for (double& m : metres[i].tracker_m) m *= 1e-3;
    std::swap(left_handed[i].tracker_m[1], left_handed[i].tracker_m[2]);
  }
  Calibration c = identify(stage.cell, metres);
  const Finding unit = testing::cause(c, LikelyCause::kReadingsUnit);
  ASSERT_EQ(unit.parts.size(), 1u) << words_of(c);
  EXPECT_EQ(unit.parts[0].about.name, "T") << words_of(c);
  EXPECT_EQ(value(unit.evidence, "unit"), 1e3) << words_of(c);
  c = identify(stage.cell, left_handed);
  const Finding handed = testing::cause(c, LikelyCause::kReadingsHandedness);
  ASSERT_EQ(handed.parts.size(), 1u) << words_of(c);
  EXPECT_EQ(handed.parts[0].about.name, "T") << words_of(c);
  auto mastered = right;
  for (Touch& touch : mastered) touch.joint_rad[3] += 0.01;
  c = identify(stage.cell, mastered);
  EXPECT_EQ(testing::cause(c, LikelyCause::kMastering).about.name, "A4") << words_of(c);
}

TEST(Kinds, TheScaleOfATrackerIsCheckedByTheArmsTolerancesAndThatIsSaid) {
  const Stage stage = sim::constraints::set_up(tracker_alone(), {.seed = 5});
  auto touches = sim::constraints::touch(stage, {.fit = 60, .seed = 5});
  Calibration result = identify(stage.cell, touches);
  EXPECT_TRUE(result.verdict.publish());
  EXPECT_TRUE(found(result, FindingKind::kUncheckedReadings)) << words_of(result);
  for (Touch& touch : touches)
    for (double& m : touch.tracker_m) m *= 1.008;
  result = identify(stage.cell, touches);
  EXPECT_FALSE(result.verdict.publish());
  EXPECT_NEAR(the(result, FindingKind::kArmScale, "off"), 0.5, 0.5) << words_of(result);
}

TEST(Kinds, HoldTheScaleWithATrackerAndNotWithPlanes) {
  Stage stage = sim::constraints::set_up(tracker_alone(), {.seed = 5});
  auto touches = sim::constraints::touch(stage, {.fit = 60, .seed = 5});
  Calibration result = identify(stage.cell, touches);
  EXPECT_TRUE(result.verdict.publish()) << words_of(result);
  EXPECT_TRUE(result.verdict.workspace);
  EXPECT_EQ(result.frame_basis.cols(), 3);
  EXPECT_EQ(the(result, FindingKind::kScaleByReadings).about.name, "T");
  EXPECT_LT(sim::truth_figures(stage.truth, result, joints_of(touches)).workspace.mean_m,
            0.1 * kMm);
  EXPECT_GT(result.predicted_near_targets_m, 0.0);

  // Many readings at three places count as three places.
  std::vector<Touch> three;
  for (int k = 0; k < 20; ++k) three.insert(three.end(), touches.begin(), touches.begin() + 3);
  EXPECT_FALSE(identify(stage.cell, three).verdict.workspace);

  stage = sim::constraints::set_up(three_planes(), {.seed = 5});
  touches = sim::constraints::touch(stage, {.fit = 60, .seed = 5});
  result = identify(stage.cell, touches);
  EXPECT_TRUE(result.verdict.publish()) << words_of(result);
  EXPECT_FALSE(result.verdict.workspace);
  EXPECT_EQ(result.frame_basis.cols(), 3);
}

/// A tracker's reading near one posture; the tool rotates with the first axis only.
Touch without_turning_the_tool(const Stage& stage, Random& random) {
  Touch touch;
  touch.target = "T";
  const double arm = random.uniform(-0.25, 0.25), forearm = random.uniform(-0.25, 0.25);
  touch.joint_rad = {random.uniform(-0.4, 0.4), -1.4 + arm, 1.6 + forearm, 0.0,
                     0.9 - arm - forearm,       0.0};
  const Vector3d tip =
      stage.truth.arm.position(stage.truth.arm.prepare(touch.joint_rad), stage.truth.errors.data());
  const Vector3d seen = stage.frame[0].inverse() * tip;
  for (int k = 0; k < 3; ++k) touch.tracker_m[k] = seen[k] + 0.03 * kMm * random.normal();
  return touch;
}

TEST(Kinds, HoldWhereATrackerMeasuredThoughTheToolWasNeverTurned) {
  Cell cell = tracker_alone();
  cell.tool.tcp_sigma_m.setConstant(30.0 * kMm);
  const Stage stage = sim::constraints::set_up(cell, {.seed = 5});
  Random random(3);
  std::vector<Touch> touches;
  for (int i = 0; i < 100; ++i) touches.push_back(without_turning_the_tool(stage, random));
  const Calibration made = identify(stage.cell, touches);
  EXPECT_TRUE(made.verdict.publish()) << words_of(made);
  EXPECT_FALSE(made.verdict.workspace);
  EXPECT_LT(made.predicted_near_targets_m, 0.3 * kMm);
  EXPECT_GT(made.predicted_workspace_m, 2.0 * kMm);

  const Calibration c = calibration_from_json(calibration_to_json(made), "c.json");
  const Predictor predictor(c);
  int inside = 0;
  double error_m2 = 0.0, bound_m2 = 0.0;
  constexpr int kPoses = 200;
  for (int i = 0; i < kPoses; ++i) {
    const Touch unseen = without_turning_the_tool(stage, random);
    const Prediction at = predictor.calibrated(unseen.joint_rad);
    const Vector3d seen(unseen.tracker_m[0], unseen.tracker_m[1], unseen.tracker_m[2]);
    const double off_m = (c.targets[0].frame * seen - at.tcp.translation()).norm();
    inside += off_m <= at.u95_m;
    error_m2 += off_m * off_m;
    bound_m2 += at.u95_m * at.u95_m;
  }
  EXPECT_GE(inside, kPoses * 9 / 10);
  EXPECT_LT(bound_m2, 16.0 * error_m2) << "four times the error";
  JointVector turned = touches[0].joint_rad;
  turned[4] += 1.2;
  EXPECT_GT(predictor.calibrated(turned).u95_m, 5.0 * kMm) << "of a tip that is hardly known";
}

TEST(Kinds, TellFromTheToolOnWhichSideAPlaneWasTouched) {
  const Stage stage = sim::constraints::set_up(three_planes(), {.seed = 6});
  const auto touches = sim::constraints::touch(stage, {.fit = 60, .cone_rad = 0.8, .seed = 6});
  const Calibration result = identify(silent(stage.cell), touches);
  for (std::size_t t = 0; t < 3; ++t)
    EXPECT_GT(result.targets[t].normal.dot(stage.normal[t]), 0.999);
}

TEST(Kinds, HoldTheScaleWithALongWireAndNotWithAShortOne) {
  Cell cell = bare_cell();
  cell.targets = {target_of("W", TargetKind::kWire, {0.9, 0.3, 0.4})};
  const Stage stage = sim::constraints::set_up(cell, {.seed = 9});
  const Calibration result =
      identify(stage.cell, sim::constraints::touch(stage, {.fit = 100, .seed = 9}));
  EXPECT_TRUE(result.verdict.workspace) << words_of(result);
  EXPECT_EQ(the(result, FindingKind::kScaleByReadings).about.name, "W");
  const auto near = sim::constraints::touch(
      stage, {.fit = 100, .wire_least_m = 0.03, .wire_most_m = 0.031, .seed = 9});
  EXPECT_FALSE(identify(stage.cell, near).verdict.workspace);
}

TEST(Kinds, AskForThePlanesNormalWhereTheToolLayAlongIt) {
  Cell cell = bare_cell();
  cell.targets = {plane("P1", {1.0, 0.0, 0.4}, {0, 0, 1})};
  const Stage stage = sim::constraints::set_up(cell, {.seed = 7});
  // As many from either side, by the line from tip to flange.
  const ArmModel arm(stage.cell.robot, stage.cell.tool);
  std::vector<Touch> touches;
  double sum = 0.0;
  for (const Touch& touch :
       sim::constraints::touch(stage, {.fit = 200, .cone_rad = 2.2, .seed = 7})) {
    const Eigen::Isometry3d tcp = arm.nominal_tcp(touch.joint_rad);
    const double to_side =
        ((tcp * stage.cell.tool.tcp.inverse()).translation() - tcp.translation()).normalized().z();
    if (std::abs(sum + to_side) > std::max(std::abs(sum), 0.3)) continue;
    sum += to_side;
    touches.push_back(touch);
  }
  ASSERT_GT(touches.size(), 40u);
  expect_refused(silent(stage.cell), touches, IdentifyError::Kind::kUndetermined, "P1");
  EXPECT_GT(identify(stage.cell, touches).targets[0].normal.z(), 0.99);
}

TEST(Kinds, SeeThePlanesSideThoughTheToolLayNearlyAlongItAtSomeTouches) {
  Cell cell = bare_cell();
  cell.targets = {plane("P1", {1.0, 0.0, 0.4}, {0, 0, 1})};
  const Stage stage = sim::constraints::set_up(cell, {.seed = 7});
  const auto touches = sim::constraints::touch(stage, {.fit = 60, .cone_rad = 1.5, .seed = 7});
  EXPECT_GT(identify(silent(stage.cell), touches).targets[0].normal.z(), 0.99);
}

TEST(Kinds, OfAnyThatTellTooLittleLeaveAResultThatReadsBack) {
  for (const TargetKind kind : {TargetKind::kSphere, TargetKind::kWire, TargetKind::kPlane,
                                TargetKind::kPoint, TargetKind::kTracker})
    for (const bool tool : {true, false}) {
      Cell cell = bare_cell();
      if (!tool) cell.tool.tcp.translation().setZero();
      cell.targets = {target_of("T", kind, {0.9, 0.1, 0.5})};
      cell.targets[0].has_centre = false;
      Touch touch;
      touch.target = "T";
      touch.joint_rad = {0.1, -1.2, 1.3, 0.4, 0.5, 0.6};
      touch.radius_m = 0.3;
      std::vector<Touch> two(2, touch);
      two[1].joint_rad[1] += 0.1;
      const Calibration c = not_identified(cell, two, {}, "too little");
      EXPECT_NO_THROW((void)calibration_from_json(calibration_to_json(c), "c.json"))
          << static_cast<int>(kind);
      EXPECT_GT(c.predicted_near_targets_m, 0.0);
      EXPECT_FALSE(identify(cell, two).verdict.publish());
    }
}

TEST(Kinds, RefuseAPlaneTouchedInALineOrStatedElsewhere) {
  Cell cell = bare_cell();
  cell.targets = {plane("P1", {1.0, 0.0, 0.4}, {0, 0, 1})};
  Stage stage = sim::constraints::set_up(cell, {.seed = 8});
  auto touches = sim::constraints::touch(stage, {.fit = 30, .seed = 8});
  Cell wrong = stage.cell;
  wrong.targets[0].normal = Vector3d::UnitX();
  expect_refused(wrong, touches, IdentifyError::Kind::kCell, "P1");

  touches = sim::constraints::touch(stage, {.fit = 30, .plane_half_m = 1e-6, .seed = 8});
  expect_refused(silent(stage.cell), {touches[0], touches[1]}, IdentifyError::Kind::kUndetermined,
                 "P1");
  // With a stated normal it is computed, but not published.
  const Calibration result = identify(stage.cell, touches);
  EXPECT_FALSE(result.verdict.publish());
  EXPECT_TRUE(found(result, FindingKind::kTooFewDirections)) << words_of(result);
}

TEST(Kinds, RefuseATrackerWhoseReadingsAreInALineOrNoNumbers) {
  const Stage stage = sim::constraints::set_up(tracker_alone(), {.seed = 9});
  auto touches = sim::constraints::touch(stage, {.fit = 30, .seed = 9});
  using Kind = IdentifyError::Kind;
  expect_refused(stage.cell, {touches[0], touches[1]}, Kind::kUndetermined, "T");
  const std::vector<Touch> one_place(10, touches[0]);
  expect_refused(stage.cell, one_place, Kind::kUndetermined, "T");
  auto line = touches;
  for (std::size_t i = 0; i < line.size(); ++i)
    for (int k = 0; k < 3; ++k) line[i].tracker_m[k] = static_cast<double>(i * (k + 1));
  expect_refused(stage.cell, line, Kind::kUndetermined, "T");
  touches[3].tracker_m[1] = std::nan("");
  expect_refused(stage.cell, touches, Kind::kTouches, "T");
}

TEST(Kinds, NameOutliersOnPlanesAndTrackers) {
  for (const Cell& kind : {three_planes(), tracker_alone()}) {
    const Stage stage = sim::constraints::set_up(kind, {.seed = 10});
    auto touches = sim::constraints::touch(stage, {.fit = 90, .seed = 10});
    if (kind.targets.size() == 1)
      touches[7].tracker_m[2] += 3.0 * kMm;
    else
      touches[7].joint_rad[1] += 0.01;
    const Calibration result = identify(stage.cell, touches);
    ASSERT_EQ(result.outliers.size(), 1u);
    EXPECT_EQ(result.outliers[0].touch, 7u);
    EXPECT_TRUE(result.verdict.publish()) << words_of(result);
    EXPECT_EQ(result.outliers[0].target_kind,
              kind.targets.size() == 1 ? TargetKind::kTracker : TargetKind::kPlane);
  }
}

TEST(Kinds, WithoutSpheresAreNotToldOfTheSizeOfTheSpheres) {
  const Stage stage = sim::constraints::set_up(three_planes(), {.seed = 10});
  const Calibration result =
      identify(stage.cell, sim::constraints::touch(stage, {.fit = 90, .seed = 10}));
  EXPECT_FALSE(result.verdict.workspace);
  EXPECT_NE(the(result, FindingKind::kScaleByNothing, "spheres"), 1.0) << words_of(result);
}

TEST(Kinds, RefuseALengthThatEndsAtAPlaneOrTracker) {
  const Stage stage = sim::constraints::set_up(all_kinds(), {.seed = 11});
  const auto touches = sim::constraints::touch(stage, {.fit = 60, .seed = 11});
  for (const char* id : {"P1", "T"}) {
    Cell cell = stage.cell;
    cell.lengths.push_back({"S", id, 0.5, 1e-5});
    const auto error = testing::thrown<IdentifyError>([&] { (void)identify(cell, touches); });
    EXPECT_EQ(error.kind, IdentifyError::Kind::kCell) << error.what();
    EXPECT_EQ(error.target, id);
  }
}

TEST(Kinds, PredictTheSameOnceWrittenAndRead) {
  const Stage stage = sim::constraints::set_up(all_kinds(), {.seed = 12});
  const Cell cell = stage.cell;
  const auto touches = parse_touches(
      format_touches(sim::constraints::touch(stage, {.fit = 100, .check = 20, .seed = 12}),
                     cell.robot),
      "touches.csv", cell);
  const Calibration result = identify(cell, touches);
  const Calibration back = calibration_from_json(calibration_to_json(result), "cal.json");
  ASSERT_EQ(back.targets.size(), 5u);
  for (std::size_t t = 0; t < 5; ++t) {
    EXPECT_EQ(back.targets[t].kind, result.targets[t].kind);
    EXPECT_LT((back.targets[t].centre_m - result.targets[t].centre_m).norm(), 1e-12);
    EXPECT_LT((back.targets[t].normal - result.targets[t].normal).norm(), 1e-12);
    EXPECT_NEAR(back.targets[t].distance_m, result.targets[t].distance_m, 1e-12);
    EXPECT_LT((back.targets[t].frame.matrix() - result.targets[t].frame.matrix()).norm(), 1e-12);
  }
  const Predictor before(result), after(back);
  for (const Touch& touch : touches) {
    const Prediction a = before.calibrated(touch.joint_rad), b = after.calibrated(touch.joint_rad);
    EXPECT_LT((a.tcp.translation() - b.tcp.translation()).norm(), 1e-12);
    EXPECT_NEAR(a.u95_m, b.u95_m, 1e-6 * a.u95_m);
  }
}

}  // namespace
}  // namespace cellcal::calib
