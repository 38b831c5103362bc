#include "daemon/api/page_data.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>

#include "calib/files/files.h"
#include "calib/model/kinematics.h"
#include "daemon/web/assets.h"

namespace cellcal::daemon::web {
namespace {

using nlohmann::json;

Eigen::Isometry3d frame_of(const json& rows) {
  Eigen::Isometry3d frame = Eigen::Isometry3d::Identity();
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column)
      frame.linear()(row, column) = rows.at(4 * row + column);
    frame.translation()[row] = rows.at(4 * row + 3).get<double>();
  }
  return frame;
}

struct APageOfTheDemoCell : ::testing::Test {
  calib::Cell cell = calib::load_cell(CELLCAL_DEMO_CELL);
  std::vector<double> joints_rad{0.3, -1.2, 1.1, 0.4, 0.9, -0.7};
};

TEST_F(APageOfTheDemoCell, HasASceneWhoseFramesPutTheTipWhereTheModelHasIt) {
  cell.robot.base_fixed.translate(Eigen::Vector3d(0.1, 0.2, 0.3));
  cell.robot.joints[2].beta_rad = 0.01;
  const json scene = json::parse(scene_to_json(7, cell));
  EXPECT_EQ(scene.at("session"), 7);
  Eigen::Isometry3d at = frame_of(scene.at("base"));
  for (std::size_t i = 0; i < joints_rad.size(); ++i) {
    const json& joint = scene.at("joints").at(i);
    const double theta = joint.at("sign").get<double>() * joints_rad[i] +
                         joint.at("offset_deg").get<double>() * calib::kRadPerDeg;
    at = at * Eigen::AngleAxisd(theta, Eigen::Vector3d::UnitZ()) * frame_of(joint.at("behind"));
  }
  at = at * frame_of(scene.at("flange")) * frame_of(scene.at("tool").at("frame"));
  const Eigen::Vector3d tip = calib::ArmModel(cell).nominal_tip_m(joints_rad) * calib::kMmPerM;
  EXPECT_LT((at.translation() - tip).norm(), 1e-4);
}

TEST_F(APageOfTheDemoCell, HasASceneWithEveryTargetStandAndObstacle) {
  calib::Obstacle table;
  table.id = "table";
  table.size_m = {1.0, 0.5, 0.02};
  calib::Obstacle unread;
  unread.id = "fence";
  unread.shape = calib::ObstacleShape::kMesh;
  calib::Obstacle fine = unread;
  calib::Mesh mesh;
  mesh.vertices_m = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.triangles.assign(kMostTrianglesDrawn, {0, 1, 2});
  fine.mesh = std::make_shared<const calib::Mesh>(mesh);
  mesh.triangles.push_back({0, 1, 2});
  calib::Obstacle huge = fine;
  huge.mesh = std::make_shared<const calib::Mesh>(mesh);
  cell.obstacles = {table, unread, fine, huge};
  cell.targets[1].has_centre = false;
  const json scene = json::parse(scene_to_json(1, cell));
  ASSERT_EQ(scene.at("targets").size(), 4u);
  EXPECT_EQ(scene.at("targets").at(0).at("id"), "S1");
  EXPECT_EQ(scene.at("targets").at(0).at("centre_mm"), (json{1080.0, -320.0, 330.0}));
  EXPECT_TRUE(scene.at("targets").at(1).at("centre_mm").is_null());
  EXPECT_EQ(scene.at("stands").size(), 3u) << "nobody knows where the fourth stands";
  const json& obstacles = scene.at("obstacles");
  EXPECT_EQ(obstacles.at(0).at("size_mm"), (json{1000.0, 500.0, 20.0}));
  EXPECT_EQ(obstacles.at(1).at("shape"), "unknown");
  EXPECT_EQ(obstacles.at(2).at("shape"), "mesh");
  EXPECT_EQ(obstacles.at(3).at("shape"), "box") << "more triangles than a page should draw";
}

struct APageOfACellWithAPositioner : APageOfTheDemoCell {
  APageOfACellWithAPositioner() {
    for (const char* name : {"E1", "E2"}) {
      calib::PositionerAxis axis;
      axis.name = name;
      axis.frame = Eigen::Translation3d(cell.robot.positioner.empty() ? 1.2 : 0.1, 0.0, 0.3) *
                   Eigen::AngleAxisd(-1.1, Eigen::Vector3d::UnitX());
      axis.sign = cell.robot.positioner.empty() ? 1 : -1;
      axis.max_rad = 2.0;
      cell.robot.positioner.push_back(axis);
    }
    cell.targets[0].carried_by = 2;
    calib::Obstacle fixture;
    fixture.id = "fixture";
    fixture.size_m = {0.1, 0.1, 0.1};
    fixture.carried_by = 1;
    cell.obstacles = {fixture};
  }
  std::vector<double> angles_rad{0.7, 1.3};
};

TEST_F(APageOfACellWithAPositioner, HasASceneWhoseAxesTurnWhatTheyCarry) {
  const json scene = json::parse(scene_to_json(1, cell));
  const auto moved = [&](std::size_t axes) {
    Eigen::Isometry3d all = Eigen::Isometry3d::Identity();
    for (std::size_t j = 0; j < axes; ++j) {
      const json& axis = scene.at("positioner").at(j);
      const Eigen::Isometry3d at = frame_of(axis.at("frame"));
      all =
          all * at *
          Eigen::AngleAxisd(axis.at("sign").get<int>() * angles_rad[j], Eigen::Vector3d::UnitZ()) *
          at.inverse();
    }
    return all;
  };
  const json& sphere = scene.at("targets").at(0);
  EXPECT_EQ(sphere.at("on"), "E2");
  const auto at = sphere.at("centre_mm").get<std::vector<double>>();
  const Eigen::Vector3d there = moved(2) * Eigen::Vector3d(at[0], at[1], at[2]);
  const Eigen::Vector3d really = carried_at(cell.robot, angles_rad) * cell.targets[0].centre_m;
  EXPECT_LT((there - 1e3 * really).norm(), 1e-3);
  EXPECT_EQ(scene.at("stands").at(0).at("on"), "E2");
  EXPECT_FALSE(scene.at("targets").at(2).contains("on"));
  EXPECT_EQ(scene.at("obstacles").at(0).at("on"), "E1");
}

TEST_F(APageOfACellWithAPositioner, HasTheAnglesOfPlannedAndMadeTouches) {
  calib::Plan plan;
  plan.touches.resize(1);
  plan.touches[0].target = "S1";
  plan.touches[0].standoff = joints_rad;
  plan.touches[0].positioner_rad = angles_rad;
  const auto first_of = [](const std::string& text) {
    return json::parse(text).at("touches").at(0).at("positioner_deg").at(1).get<double>();
  };
  EXPECT_NEAR(first_of(plan_to_json(1, 0, plan, cell)), 1.3 * 180.0 / M_PI, 1e-5);
  calib::Touch made;
  made.target = "S1";
  made.joint_rad = joints_rad;
  made.positioner_rad = angles_rad;
  EXPECT_NEAR(first_of(figures_to_json({}, cell, {made}, nullptr)), 1.3 * 180.0 / M_PI, 1e-5);
}

TEST_F(APageOfTheDemoCell, HasAPlanWhoseTipsAreWhereTheContactsAreExpected) {
  calib::PlannedTouch touch;
  touch.target = "S2";
  touch.set = calib::TouchSet::kCheck;
  touch.standoff = joints_rad;
  calib::JointVector corner = joints_rad;
  corner[0] += 0.5;
  touch.transit = {corner, joints_rad};
  touch.normal = Eigen::Vector3d::UnitX();
  touch.expected_m = 0.012;
  calib::Plan plan;
  plan.touches = {touch};
  const json made = json::parse(plan_to_json(3, 5, plan, cell));
  EXPECT_EQ(made.at("session"), 3);
  const json& first = made.at("touches").at(0);
  EXPECT_EQ(first.at("index"), 5) << "counted in its session";
  EXPECT_EQ(first.at("set"), "check");
  ASSERT_EQ(first.at("way_deg").size(), 2u);
  EXPECT_EQ(first.at("way_deg").at(1), first.at("joints_deg")) << "it ends at the stand-off";
  EXPECT_NE(first.at("way_deg").at(0), first.at("joints_deg"));
  const Eigen::Vector3d standoff = calib::ArmModel(cell).nominal_tip_m(joints_rad) * calib::kMmPerM;
  EXPECT_NEAR(first.at("tip_mm").at(0).get<double>(), standoff.x() - 12.0, 1e-5);
  EXPECT_NEAR(first.at("tip_mm").at(1).get<double>(), standoff.y(), 1e-5);
}

struct AFoundArm : APageOfTheDemoCell {
  AFoundArm() {
    found.cell = cell;
    calib::TargetResult sphere;
    sphere.id = "S1";
    const Eigen::Vector3d tip = calib::ArmModel(cell).nominal_tip_m(joints_rad);
    sphere.centre_m = tip - 0.031 * Eigen::Vector3d::UnitZ();
    sphere.effective_radius_m = 0.0307;
    found.targets = {sphere};
    touch.joint_rad = joints_rad;
    touch.target = "S1";
  }
  calib::Calibration found;
  calib::Touch touch;
};

TEST_F(AFoundArm, HasResidualsOutwardsFromItsSpheres) {
  EXPECT_NEAR(residual_m(found, touch).value(), 0.0003, 1e-9);
}

TEST_F(AFoundArm, IsBentByWhatWasFoundOfIt) {
  calib::ParameterResult turn;
  turn.key = calib::joint_parameter(calib::ParameterKind::kTheta, 1);
  turn.correction = 1e-3;
  found.parameters = {turn};
  const double with = residual_m(found, touch).value();
  EXPECT_GT(std::abs(with - 0.0003), 1e-5);
}

TEST_F(AFoundArm, WasReadTooDeepByALateLatch) {
  found.cell.latch_delay_s = 0.01;
  touch.speed_m_s = 0.01;
  EXPECT_NEAR(residual_m(found, touch).value(), 0.0004, 1e-9);
}

TEST_F(AFoundArm, HasNoResidualAtAPlaceThatWasNotFound) {
  touch.target = "S2";
  EXPECT_FALSE(residual_m(found, touch));
  found.targets[0].kind = calib::TargetKind::kWire;
  touch.target = "S1";
  EXPECT_FALSE(residual_m(found, touch));
}

TEST_F(AFoundArm, IsToldWithTouchesVerdictAndFindings) {
  found.verdict.judged = true;
  SessionRecord record;
  record.id = 9;
  record.state = RecordState::kDone;
  const json figures = json::parse(figures_to_json(record, cell, {touch}, &found));
  EXPECT_EQ(figures.at("session"), 9);
  EXPECT_EQ(figures.at("result").at("publish"), true);
  EXPECT_NEAR(figures.at("touches").at(0).at("residual_mm").get<double>(), 0.3, 1e-5);
  const json running = json::parse(figures_to_json(record, cell, {touch}, nullptr));
  EXPECT_TRUE(running.at("result").is_null());
  EXPECT_TRUE(running.at("touches").at(0).at("residual_mm").is_null());
  EXPECT_EQ(running.at("touches").at(0).at("tip_mm").size(), 3u);
  const json known =
      json::parse(figures_to_json(record, cell, {touch, touch}, nullptr, {{1, {1.2e-3, 0.4e-3}}}));
  EXPECT_TRUE(known.at("touches").at(0).at("residual_mm").is_null());
  EXPECT_NEAR(known.at("touches").at(1).at("residual_mm").get<double>(), 1.2, 1e-5);
  EXPECT_NEAR(known.at("touches").at(1).at("u95_mm").get<double>(), 0.4, 1e-5);
}

TEST_F(AFoundArm, ThatAnUpdateFoundUnchangedIsNotWithheld) {
  found.verdict.findings = {{calib::FindingKind::kUpdateNotNeeded, calib::Severity::kWithholds},
                            {calib::FindingKind::kNoGain, calib::Severity::kWithholds}};
  const json findings =
      json::parse(figures_to_json({}, cell, {touch}, &found)).at("result").at("findings");
  EXPECT_EQ(findings.at(0).at("severity"), "informs");
  EXPECT_EQ(findings.at(1).at("severity"), "withholds");
}

SessionRecord done(std::int64_t id, const std::string& cell,
                   RecordState state = RecordState::kDone) {
  SessionRecord record;
  record.id = id;
  record.state = state;
  record.inputs.cell_name = cell;
  return record;
}

TEST_F(AFoundArm, IsComparedWithThoseOfItsOwnCellOldestFirst) {
  calib::ParameterResult zero;
  zero.key = calib::joint_parameter(calib::ParameterKind::kTheta, 2);
  zero.correction = 0.01 * calib::kRadPerDeg;
  found.parameters = {zero};
  const auto all = [&](std::int64_t id) {
    return id == 5 ? std::nullopt : std::optional(found);  // 5: from another version
  };
  const std::vector<SessionRecord> sessions{done(6, "/a", RecordState::kFailed), done(5, "/a"),
                                            done(4, "/a"), done(3, "/b"), done(2, "/a")};
  const json drift = json::parse(drift_to_json(sessions, "", all));
  EXPECT_EQ(drift.at("cell"), "/a");
  ASSERT_EQ(drift.at("sessions").size(), 2u);
  EXPECT_EQ(drift.at("sessions").at(0).at("session"), 2);
  EXPECT_EQ(drift.at("sessions").at(1).at("session"), 4);
  EXPECT_EQ(drift.at("sessions").at(1).at("zeros").at(0).at("joint"), "A3");
  EXPECT_NEAR(drift.at("sessions").at(1).at("zeros").at(0).at("deg").get<double>(), 0.01, 1e-6);
  EXPECT_EQ(json::parse(drift_to_json(sessions, "/b", all)).at("sessions").size(), 1u);
}

TEST(NumbersForThePage, AreFiniteOrNull) {
  EXPECT_TRUE(number(std::numeric_limits<double>::quiet_NaN()).is_null());
  EXPECT_TRUE(number(std::numeric_limits<double>::infinity(), 1000.0).is_null());
  EXPECT_TRUE(number(1e308, 1000.0).is_null());
  EXPECT_EQ(number(0.0012, 1000.0), 1.2);
}

TEST(ThePage, BeginsAtTheRootWhetherItWasBuiltOrNot) {
  bool has_root = false;
  for (const Asset& asset : assets()) {
    EXPECT_FALSE(asset.body.empty()) << asset.path;
    EXPECT_TRUE(asset.path == "/" || asset.path == "/fleet" || asset.path.starts_with("/page/"))
        << asset.path;
    EXPECT_TRUE(asset.etag.starts_with('"') && asset.etag.ends_with('"')) << asset.path;
    EXPECT_EQ(asset.body.starts_with("\x1f\x8b"), asset.gzipped) << asset.path;
    has_root |= asset.path == "/";
  }
  EXPECT_TRUE(has_root);
}

}  // namespace
}  // namespace cellcal::daemon::web
