// Collision check of postures and moves: compared with brute-force distances, and in words.

#include "calib/plan/clearance.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "calib/files/files.h"
#include "calib/model/error.h"
#include "calib/model/linear.h"
#include "calib/plan/bodies.h"
#include "calib/plan/candidates.h"
#include "calib/plan/plan.h"
#include "calib/plan/pool.h"
#include "tests/calib/plan/box.h"
#include "tests/calib/plan/collisions.h"
#include "tests/calib/thrown.h"

namespace cellcal::calib {
namespace {

using testing::Approach;
using testing::box;
using testing::Collisions;
using testing::Nearest;

/// Points on an axis are up to 2 mm apart.
constexpr double kPointsM = 0.0015;

Cell demo() { return load_cell(CELLCAL_DEMO_CELL); }

Obstacle post(const char* id, const Eigen::Vector3d& at, double diameter, double height) {
  Obstacle o;
  o.id = id;
  o.shape = ObstacleShape::kCylinder;
  o.frame.translation() = at;
  o.diameter_m = diameter;
  o.height_m = height;
  return o;
}

/// The same box as twelve triangles.
Obstacle as_mesh(const Obstacle& box) {
  Obstacle o = box;
  o.shape = ObstacleShape::kMesh;
  auto mesh = std::make_shared<Mesh>();
  for (int k = 0; k < 8; ++k)
    mesh->vertices_m.push_back(
        Eigen::Vector3d((k & 1) ? 0.5 : -0.5, (k & 2) ? 0.5 : -0.5, (k & 4) ? 0.5 : -0.5)
            .cwiseProduct(box.size_m));
  mesh->triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                     {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  o.mesh = mesh;
  return o;
}

Cell furnished() {
  Cell cell = demo();
  cell.floor_m = -0.3;
  cell.obstacles = {box("table", {1.0, 0.0, 0.0}, {0.7, 1.0, 0.04}),
                    post("post", {0.6, 0.9, 0.6}, 0.1, 1.2),
                    box("beam", {0.4, -0.9, 0.9}, {0.9, 0.05, 0.05})};
  cell.obstacles[0].frame.linear() =
      Eigen::AngleAxisd(0.4, Eigen::Vector3d(0.2, 0.1, 1.0).normalized()).toRotationMatrix();
  cell.obstacles[1].frame.linear() =
      Eigen::AngleAxisd(0.5, Eigen::Vector3d(1.0, 0.3, 0.0).normalized()).toRotationMatrix();
  return cell;
}

JointVector drawn(const Robot& robot, Random& random) {
  JointVector q;
  for (const Joint& joint : robot.joints) q.push_back(random.uniform(joint.min_rad, joint.max_rad));
  return q;
}

bool of_itself(const Hit& hit) {
  const auto names = [&](const char* thing) { return hit.other.find(thing) != std::string::npos; };
  return hit.kind == Hit::Kind::kTooNear && !names("sphere") && !names("stand") &&
         !names("obstacle") && !names("floor");
}

TEST(Distance, OfSegmentsIsThatOfTheirNearestPointsPointsAndParallelsIncluded) {
  Random random(1);
  const auto point = [&] {
    return Eigen::Vector3d(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
  };
  for (int k = 0; k < 300; ++k) {
    Segment one{point(), point()}, other{point(), point()};
    if (k % 5 == 1) one.b = one.a;
    if (k % 5 == 2) other.b = other.a;
    if (k % 5 == 3) other.b = other.a + random.uniform(-1, 1) * (one.b - one.a);
    if (k % 15 == 4) one.b = one.a, other.b = other.a;
    double least = 1e9;
    constexpr int kSteps = 200;
    for (int i = 0; i <= kSteps; ++i)
      for (int j = 0; j <= kSteps; ++j)
        least = std::min(least, (one.a + i * (one.b - one.a) / kSteps - other.a -
                                 j * (other.b - other.a) / kSteps)
                                    .norm());
    EXPECT_LE(distance_m(one, other), least + 1e-12) << k;
    EXPECT_GE(distance_m(one, other), least - 0.02) << k;
    EXPECT_NEAR(distance_m(one, other), distance_m(other, one), 1e-9) << k;
  }
}

void expect_agreement(const Cell& cell, int postures) {
  const ArmModel arm(cell.robot, cell.tool);
  const Clearance clearance(cell, arm);
  const Collisions collisions(cell);
  Random random(7);
  int free = 0, hit = 0;
  for (int k = 0; k < postures; ++k) {
    const JointVector q = drawn(cell.robot, random);
    const Approach approach = collisions.at(q);
    const double room =
        std::min(approach.tip.gap_m - kTipMarginM, approach.body.gap_m - kBodyMarginM);
    const auto found = clearance.hit(q);
    EXPECT_EQ(clearance.clear(q), !found);
    if (!found) {
      ++free;
      EXPECT_GT(room, -kPointsM) << approach.tip.words << ", " << approach.body.words;
      EXPECT_GT(approach.self.gap_m, kBodyMarginM - kPointsM) << approach.self.words;
    } else if (!of_itself(*found)) {
      ++hit;
      EXPECT_LT(room, kPointsM) << words(*found);
    }
  }
  EXPECT_GT(free, postures / 20);
  EXPECT_GT(hit, postures / 20);
}

TEST(Clearance, OfPosturesAgreesWithPlainDistances) { expect_agreement(furnished(), 3000); }

TEST(Clearance, OfPosturesAgreesWithPlainDistancesFromTriangles) {
  Cell cell = furnished();
  cell.obstacles[0] = as_mesh(cell.obstacles[0]);
  cell.obstacles[2] = as_mesh(cell.obstacles[2]);
  expect_agreement(cell, 1000);
}

TEST(Clearance, OfPosturesAgreesForAToolWithABallAndAThickArm) {
  Cell cell = furnished();
  cell.tool.tip_radius_m = 0.008;
  cell.tool.radius_m = 0.05;
  cell.tool.slim_length_m = 0.12;
  for (Joint& joint : cell.robot.joints) joint.radius_m = 0.07;
  cell.targets[0].has_stand = false;
  cell.targets[1].stand_diameter_m = 0.06;
  cell.targets[2].stand_height_m = 0.1;
  expect_agreement(cell, 1000);
}

TEST(Clearance, OfMovesLeavesHalfTheMarginEverywhereOnTheWay) {
  Cell cell = furnished();
  cell.obstacles.push_back(box("sheet", {0.9, 0.2, 0.7}, {0.6, 0.0005, 0.6}));
  cell.obstacles.push_back(post("wire", {1.0, -0.1, 0.8}, 0.001, 1.0));
  const ArmModel arm(cell.robot, cell.tool);
  const Clearance clearance(cell, arm);
  const Collisions collisions(cell);
  Random random(3);
  int free = 0, blocked_between = 0;
  for (int k = 0; free < 150; ++k) {
    const JointVector from = drawn(cell.robot, random);
    JointVector to = from;
    for (std::size_t i = 0; i < to.size(); ++i)
      to[i] = std::clamp(to[i] + random.uniform(-1.0, 1.0) * (i == 0 ? 2.0 : 1.0),
                         cell.robot.joints[i].min_rad, cell.robot.joints[i].max_rad);
    if (!clearance.clear(from) || !clearance.clear(to)) continue;
    if (!clearance.clear(from, to)) {
      ++blocked_between;
      EXPECT_TRUE(clearance.hit(from, to));
      continue;
    }
    ++free;
    EXPECT_FALSE(clearance.hit(from, to));
    const Approach approach = collisions.along(from, to);
    EXPECT_GT(approach.tip.gap_m, kMarginKept * kTipMarginM - 1e-9) << approach.tip.words;
    EXPECT_GT(approach.body.gap_m, kMarginKept * kBodyMarginM - 1e-9) << approach.body.words;
    EXPECT_GT(approach.self.gap_m, kMarginKept * kBodyMarginM - 1e-9) << approach.self.words;
  }
  EXPECT_GT(blocked_between, 10);
}

TEST(Clearance, OfAMoveSeesASheetThatIsPassedInTheMiddle) {
  Cell cell = demo();
  cell.targets.resize(1);
  cell.targets[0].centre_m = {-1.0, 0.0, 0.2};
  cell.lengths.clear();
  const ArmModel arm(cell.robot, cell.tool);
  const JointVector left = {0.6, -1.2, 1.6, 0.0, 1.0, 0.0},
                    right = {-0.6, -1.2, 1.6, 0.0, 1.0, 0.0};
  EXPECT_TRUE(Clearance(cell, arm).clear(left, right));
  cell.obstacles = {box("sheet", {1.0, 0.0, 0.5}, {3.0, 1e-4, 3.0})};
  const Clearance clearance(cell, arm);
  EXPECT_FALSE(clearance.clear(left, right));
  EXPECT_EQ(clearance.hit(left, right)->other, "obstacle sheet");
}

/// The hit with only `obstacle` in the way of a posture in the middle of the cell.
std::string words_of(const Obstacle& obstacle) {
  Cell cell = demo();
  cell.targets.resize(1);
  cell.targets[0].centre_m = {-1.0, 0.0, 0.2};
  cell.lengths.clear();
  cell.obstacles = {obstacle};
  const ArmModel arm(cell.robot, cell.tool);
  return words_or(Clearance(cell, arm).hit({0.0, -1.2, 1.6, 0.0, 1.0, 0.0}), "");
}

TEST(Clearance, SaysWhichPartOfTheArmComesHowNearToWhat) {
  Cell cell = demo();
  const ArmModel arm(cell.robot, cell.tool);
  const ArmShape shape =
      arm.shape(arm.prepare(JointVector{0.0, -1.2, 1.6, 0.0, 1.0, 0.0}), nullptr);
  const Eigen::Vector3d elbow = shape.joint_origin_m[3], wrist = shape.joint_origin_m[4],
                        tip = shape.tcp.translation();
  // Above the forearm's middle: 100 mm of casting, then 12 mm of clearance.
  const Eigen::Vector3d middle = (elbow + wrist) / 2.0;
  const Eigen::Vector3d across =
      (wrist - elbow).cross(Eigen::Vector3d::UnitY()).normalized() * -0.162;
  Obstacle ball = post("lamp", middle - across, 0.1, 0.1);
  ball.frame.linear() =
      Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitX(), across).toRotationMatrix();
  EXPECT_EQ(
      words_of(ball),
      "the forearm (A4) comes within 12 mm of obstacle lamp (its radius of 100 mm is assumed: "
      "radius_mm of the robot file)");
  EXPECT_EQ(words_of(post("lamp", tip, 0.01, 0.01)), "the tool's slim end runs into obstacle lamp");
  EXPECT_EQ(words_of(box("far", {0.0, 3.0, 0.0}, {0.1, 0.1, 0.1})), "");
}

TEST(Hit, OfTheSameThingsIsOneHoweverNearTheyCome) {
  const Hit near{Hit::Kind::kTooNear, "the hand (A6)", "sphere S1", 0.012};
  Hit other = near;
  other.gap_m = 0.003;
  EXPECT_TRUE(near.is_like(other));
  EXPECT_NE(words(near), words(other));
  other.other = "sphere S2";
  EXPECT_FALSE(near.is_like(other));
  EXPECT_FALSE(near.is_like({Hit::Kind::kImpassable}));
}

TEST(Hit, OfNoBodySaysWhatTheWayLeadsTo) {
  EXPECT_EQ(words({Hit::Kind::kImpassable}),
            "the way leads near a singularity, or an axis beyond its correction limit");
  EXPECT_EQ(words_or(std::nullopt, "nothing is"), "nothing is");
}

TEST(Clearance, OfASearchLetsTheTipMeetItsOwnSphereAndStandAlone) {
  Cell cell = demo();
  cell.lengths.clear();
  const ArmModel arm(cell.robot, cell.tool);
  const JointVector q = {0.0, -0.9, 1.6, 0.0, 0.6, 0.0};
  const Eigen::Isometry3d tcp = arm.nominal_tcp(q);
  cell.targets.resize(2);
  // The tip 12 mm inside, as at the end of a search without contact.
  const Eigen::Vector3d flange = arm.shape(arm.prepare(q), nullptr).flange.translation();
  cell.targets[0].centre_m = tcp.translation() + 0.0187 * (tcp.translation() - flange).normalized();
  cell.targets[1].centre_m = Eigen::Vector3d(-1.5, 0.0, 0.2);
  {
    const Clearance clearance(cell, arm);
    EXPECT_FALSE(clearance.clear(q, q));
    EXPECT_TRUE(clearance.clear_search(q, q, 0)) << words(*clearance.hit_search(q, q, 0));
    EXPECT_FALSE(clearance.clear_search(q, q, 1));
  }
  cell.obstacles = {post("clamp", tcp.translation(), 0.01, 0.01)};
  const Clearance clearance(cell, arm);
  EXPECT_FALSE(clearance.clear_search(q, q, 0));
  EXPECT_EQ(clearance.hit_search(q, q, 0)->other, "obstacle clamp");
}

TEST(Clearance, AFloorThatIsStatedTakesThePlaceOfTheLowestTarget) {
  Cell cell = demo();
  const JointVector low = {-1.4, 0.0, 0.9, 0.0, -0.7, 0.0};  // above the floor, below the targets
  const ArmModel arm(cell.robot, cell.tool);
  ASSERT_LT(arm.shape(arm.prepare(low), nullptr).flange.translation().z(), 0.2);
  const auto too_low = Clearance(cell, arm).hit(low);
  ASSERT_TRUE(too_low);
  EXPECT_EQ(too_low->kind, Hit::Kind::kBelowTargets);
  EXPECT_NE(words(*too_low).find("100 mm below the lowest target (no floor_mm"), std::string::npos)
      << words(*too_low);
  cell.floor_m = -1.5;
  EXPECT_FALSE(Clearance(cell, arm).hit(low)) << words(*Clearance(cell, arm).hit(low));
  cell.floor_m = 0.15;
  const auto floor = Clearance(cell, arm).hit(low);
  ASSERT_TRUE(floor);
  EXPECT_EQ(floor->other, "the floor");
}

TEST(Clearance, KeepsTheHandOffTheArmItself) {
  Cell cell = demo();
  cell.floor_m = -10.0;
  const ArmModel arm(cell.robot, cell.tool);
  const Clearance clearance(cell, arm);
  const Collisions collisions(cell);
  Random random(5);
  int folded = 0;
  for (int k = 0; k < 2000; ++k) {
    const JointVector q = drawn(cell.robot, random);
    if (collisions.at(q).self.gap_m > kBodyMarginM - kPointsM) continue;
    ++folded;
    EXPECT_FALSE(clearance.clear(q));
  }
  EXPECT_GT(folded, 20);
}

/// From the forearm's axis that of the shaft, and its place nearest to the wrist.
std::pair<double, double> shaft_to_forearm_m(const Bodies& bodies, const JointVector& q) {
  std::vector<Segment> axes;
  bodies.place(q, axes);
  const Segment &forearm = axes[3], &shaft = axes[6];
  const Eigen::Vector3d along = (shaft.b - shaft.a).normalized();
  const double beyond =
      std::clamp((forearm.b - shaft.a).dot(along), 0.0, (shaft.b - shaft.a).norm());
  const Eigen::Vector3d root = shaft.a + beyond * along;
  return {distance_m(forearm, shaft), distance_m(forearm, {root, root})};
}

TEST(Clearance, KeepsAToolThatPointsBackOffTheForearm) {
  Cell cell = demo();
  cell.targets.clear();
  cell.lengths.clear();
  cell.tool.tcp.translation() = Eigen::Vector3d(0.5, 0.0, -0.25);
  const ArmModel arm(cell.robot, cell.tool);
  const Bodies bodies(arm);
  ASSERT_EQ(bodies.list()[6].words, "the tool's shaft");
  const Clearance clearance(cell, arm);
  Random random(1);
  const auto posture = [&] {
    JointVector q;
    for (const Joint& joint : cell.robot.joints)
      q.push_back(random.uniform(joint.min_rad, joint.max_rad));
    return q;
  };
  int across = 0, free = 0;
  JointVector last = middle_posture(cell.robot);
  for (int k = 0; k < 4000; ++k) {
    const JointVector q = posture();
    const auto [gap, root] = shaft_to_forearm_m(bodies, q);
    across += gap < root - kBodyMarginM;
    if (!clearance.clear(q)) continue;
    ++free;
    EXPECT_GE(gap, root - kBodyMarginM - 1e-9);
    if (k % 8 == 0 && clearance.clear(last, q))
      for (double share = 0.0; share < 1.0; share += 0.01) {
        const auto [near, from] = shaft_to_forearm_m(bodies, interpolated(last, q, share));
        EXPECT_GE(near, from - 1.1 * kBodyMarginM);
      }
    last = q;
  }
  EXPECT_GT(across, 100);
  EXPECT_GT(free, 500);
}

TEST(Clearance, KeepsOtherToolsOnTheFlangeClearToo) {
  Cell cell = demo();
  cell.targets.clear();
  cell.tool.id = "torch";
  Tool reflector = cell.tool;
  reflector.id = "P2";
  reflector.tcp.translation() = Eigen::Vector3d(0.35, 0.0, 0.05);
  reflector.tip_radius_m = 0.019;
  cell.other_tools = {reflector};
  const JointVector q = {0.0, -1.2, 1.6, 0.0, 1.0, 0.0};
  const ArmModel arm(cell);
  cell.obstacles = {box("cabinet", arm.nominal_tip_m(q, 1), {0.05, 0.05, 0.05})};
  const Clearance with(cell, arm);
  const auto hit = with.hit(q);
  ASSERT_TRUE(hit);
  EXPECT_EQ(words(*hit), "the end of P2 runs into obstacle cabinet");
  EXPECT_FALSE(with.clear(q));

  cell.other_tools.clear();
  const ArmModel bare(cell);
  EXPECT_TRUE(Clearance(cell, bare).clear(q)) << words(*Clearance(cell, bare).hit(q));
}

TEST(Clearance, AMeshThatWasNotReadIsRefused) {
  Cell cell = demo();
  cell.obstacles.push_back(box("fixture", {0, 0, 5}, {1, 1, 1}));
  cell.obstacles[0].shape = ObstacleShape::kMesh;
  cell.obstacles[0].mesh_file = "fixture.stl";
  const ArmModel arm(cell.robot, cell.tool);
  const auto error = testing::thrown<PlanError>([&] { const Clearance clearance(cell, arm); });
  EXPECT_EQ(error.kind, PlanError::Kind::kCell);
  EXPECT_NE(std::string(error.what()).find("fixture.stl"), std::string::npos);
}

TEST(Clearance, BlindSeesNothing) {
  const JointVector q(6, 0.0);
  EXPECT_TRUE(Clearance::blind().clear(q));
  EXPECT_TRUE(Clearance::blind().clear(q, q));
  EXPECT_FALSE(Clearance::blind().hit(q));
}

TEST(Bodies, AreAsThickAsTheArmIsLong) {
  const auto thick = [](const char* name) {
    return assumed_radius_m(load_robot(std::string(CELLCAL_ROBOTS_FOLDER) + "/" + name));
  };
  EXPECT_NEAR(thick("kr5_r1400.toml"), 0.100, 1e-12);
  EXPECT_NEAR(thick("kr3_r540.toml"), 0.060, 1e-12);
  EXPECT_NEAR(thick("kr210_r2700_2.toml"), 0.201, 1e-3);
}

TEST(Bodies, NeverMoveFurtherThanTheirLeversSay) {
  for (const auto& entry : std::filesystem::directory_iterator(CELLCAL_ROBOTS_FOLDER)) {
    if (entry.path().extension() != ".toml") continue;
    SCOPED_TRACE(entry.path().filename());
    const Robot robot = load_robot(entry.path());
    Tool tool;
    tool.tcp.translation() = Eigen::Vector3d(0.06, 0.05, 0.3);
    const ArmModel arm(robot, tool);
    const Bodies bodies(arm);
    Random random(11);
    std::vector<Segment> one, other;
    for (int k = 0; k < 100; ++k) {
      const JointVector q = drawn(robot, random);
      bodies.place(q, one);
      for (std::size_t j = 0; j < q.size(); ++j) {
        JointVector turned = q;
        constexpr double kTurnRad = 0.01;
        turned[j] += kTurnRad;
        bodies.place(turned, other);
        for (std::size_t b = 0; b < one.size(); ++b) {
          const double moved =
              std::max((one[b].a - other[b].a).norm(), (one[b].b - other[b].b).norm());
          EXPECT_LE(moved, bodies.list()[b].lever[j] * kTurnRad + 1e-12)
              << bodies.list()[b].words << ", joint " << j;
        }
      }
    }
  }
}

TEST(CornerOfPath, MayBeCutAsFarAsWhatStandsAroundItAllows) {
  Cell cell = demo();
  const ArmModel arm(cell.robot, cell.tool);
  PlanOptions options;
  options.fit_touches = 20;
  options.check_touches = 0;
  const Plan plan = make_plan(cell, options);
  const Clearance clearance(cell, arm);
  double most = 0.0;
  int cut = 0;
  for (std::size_t k = 1; k < plan.touches.size(); ++k) {
    const PlannedTouch& touch = plan.touches[k];
    ASSERT_EQ(touch.corners.size(), touch.transit.size());
    const JointVector& at = plan.touches[k - 1].clear;
    const JointVector &before = plan.touches[k - 1].end, &next = touch.transit.front();
    const Corner corner = clearance.corner(before, at, next);
    EXPECT_EQ(corner.in_share, touch.leaving.in_share);
    EXPECT_EQ(corner.out_share, touch.leaving.out_share);
    most = std::max({most, corner.in_share, corner.out_share});
    EXPECT_LE(most, kMostCornerShare);
    cut += corner.in_share > 0.0 && corner.out_share > 0.0;
    // A small object at the clear point's own tip, just beyond the margin there, leaves less.
    Cell tight = cell;
    const Eigen::Vector3d tip = arm.nominal_tip_m(at);
    const Eigen::Vector3d beside = touch.normal.unitOrthogonal();
    tight.obstacles = {box("beside", tip + 0.0125 * beside, {0.001, 0.001, 0.001})};
    const Corner less = Clearance(tight, arm).corner(before, at, next);
    EXPECT_LT(less.in_share, 0.5 * corner.in_share + 1e-12);
    EXPECT_LT(less.out_share, 0.5 * corner.out_share + 1e-12);
  }
  EXPECT_GE(cut, 15);
}

TEST(CornerOfPath, IsGoneToWhereTheCellSaysWhichMovesCanBeLed) {
  Cell cell = demo();
  PlanOptions options;
  options.fit_touches = 20;
  options.check_touches = 0;
  const Plan plan = make_plan(cell, options);
  cell.passable = [](const JointVector&, const JointVector&) { return true; };
  const ArmModel arm(cell.robot, cell.tool);
  const PlannedTouch& touch = plan.touches[1];
  const Corner corner = Clearance(cell, arm).corner(plan.touches[0].end, plan.touches[0].clear,
                                                    touch.transit.front());
  EXPECT_EQ(corner.in_share, 0.0);
  EXPECT_EQ(corner.out_share, 0.0);
}

TEST(CornerOfPath, ThatIsNotClearItselfIsNotCut) {
  const Cell cell = demo();
  const ArmModel arm(cell.robot, cell.tool);
  PlanOptions options;
  options.fit_touches = 20;
  options.check_touches = 0;
  const Plan plan = make_plan(cell, options);
  const Corner corner = Clearance(cell, arm).corner(plan.touches[0].clear, plan.touches[0].end,
                                                    plan.touches[0].clear);
  EXPECT_EQ(corner.in_share, 0.0);
}

}  // namespace
}  // namespace cellcal::calib
