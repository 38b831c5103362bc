#include "daemon/api/page_scene.h"

#include <cmath>

#include "calib/model/kinematics.h"
#include "calib/model/robot.h"
#include "calib/model/units.h"
#include "calib/plan/bodies.h"
#include "calib/plan/surroundings.h"

namespace cellcal::daemon::web {

using nlohmann::json;

namespace {

using calib::kMmPerM;

Eigen::Isometry3d behind(const calib::Joint& joint) {
  using Eigen::AngleAxisd, Eigen::Vector3d;
  Eigen::Isometry3d fixed = Eigen::Isometry3d::Identity();
  fixed.translate(Vector3d(joint.a_m, 0.0, joint.d_m));
  fixed.rotate(AngleAxisd(joint.alpha_rad, Vector3d::UnitX()));
  fixed.rotate(AngleAxisd(joint.beta_rad, Vector3d::UnitY()));
  return fixed;
}

json joint_to_json(const calib::Joint& joint, double assumed_m) {
  return {{"name", joint.name},
          {"sign", joint.sign},
          {"offset_deg", number(joint.offset_rad, calib::kDegPerRad)},
          {"min_deg", number(joint.min_rad, calib::kDegPerRad)},
          {"max_deg", number(joint.max_rad, calib::kDegPerRad)},
          {"behind", frame(behind(joint))},
          {"radius_mm", number(joint.radius_m > 0.0 ? joint.radius_m : assumed_m, kMmPerM)}};
}

json joints_to_json(const calib::Robot& robot) {
  json list = json::array();
  const double assumed_m = calib::assumed_radius_m(robot);
  for (const calib::Joint& joint : robot.joints) list.push_back(joint_to_json(joint, assumed_m));
  return list;
}

json target_to_json(const calib::Target& target) {
  json value{{"id", target.id},
             {"kind", calib::to_string(target.kind)},
             {"diameter_mm", number(target.diameter_m, kMmPerM)},
             {"centre_mm", nullptr},
             {"box_mm", nullptr}};
  if (target.has_centre) value["centre_mm"] = mm(target.centre_m);
  if (target.has_box) value["box_mm"] = {mm(target.low_m), mm(target.high_m)};
  return value;
}

json targets_to_json(const calib::Cell& cell) {
  json list = json::array();
  for (const calib::Target& target : cell.targets) list.push_back(target_to_json(target));
  return list;
}

json cylinder(const std::string& id, const Eigen::Isometry3d& at, double diameter_m,
              double height_m) {
  return {{"id", id},
          {"shape", "cylinder"},
          {"frame", frame(at)},
          {"diameter_mm", number(diameter_m, kMmPerM)},
          {"height_mm", number(height_m, kMmPerM)}};
}

json box(const std::string& id, const Eigen::Isometry3d& at, const Eigen::Vector3d& size_m) {
  return {{"id", id}, {"shape", "box"}, {"frame", frame(at)}, {"size_mm", mm(size_m)}};
}

json box_around(const calib::Obstacle& obstacle) {
  Eigen::AlignedBox3d around;
  for (const Eigen::Vector3d& vertex : obstacle.mesh->vertices_m) around.extend(vertex);
  return box(obstacle.id, obstacle.frame * Eigen::Translation3d(around.center()), around.sizes());
}

json mesh(const calib::Obstacle& obstacle) {
  json vertices = json::array(), triangles = json::array();
  for (const Eigen::Vector3d& vertex : obstacle.mesh->vertices_m)
    for (const double value : vertex) vertices.push_back(number(value, kMmPerM));
  for (const auto& triangle : obstacle.mesh->triangles)
    for (const int corner : triangle) triangles.push_back(corner);
  return {{"id", obstacle.id},
          {"shape", "mesh"},
          {"frame", frame(obstacle.frame)},
          {"vertices_mm", std::move(vertices)},
          {"triangles", std::move(triangles)}};
}

json obstacle_to_json(const calib::Obstacle& obstacle) {
  switch (obstacle.shape) {
    case calib::ObstacleShape::kBox:
      return box(obstacle.id, obstacle.frame, obstacle.size_m);
    case calib::ObstacleShape::kCylinder:
      return cylinder(obstacle.id, obstacle.frame, obstacle.diameter_m, obstacle.height_m);
    case calib::ObstacleShape::kMesh:
      break;
  }
  const bool empty = obstacle.mesh == nullptr || obstacle.mesh->vertices_m.empty();
  if (empty) return {{"id", obstacle.id}, {"shape", "unknown"}};
  return obstacle.mesh->triangles.size() > kMostTrianglesDrawn ? box_around(obstacle)
                                                               : mesh(obstacle);
}

json obstacles_to_json(const calib::Cell& cell) {
  json list = json::array();
  for (const calib::Obstacle& obstacle : cell.obstacles) list.push_back(obstacle_to_json(obstacle));
  return list;
}

json stands_to_json(const calib::Cell& cell) {
  json list = json::array();
  for (const calib::Post& post : calib::posts_of(cell))
    list.push_back(
        cylinder(cell.targets[post.target].id, post.frame, 2.0 * post.radius_m, post.length_m));
  return list;
}

json tool_to_json(const calib::Tool& tool) {
  return {{"frame", frame(tool.tcp)},
          {"radius_mm", number(tool.radius_m, kMmPerM)},
          {"tip_length_mm", number(tool.slim_length_m, kMmPerM)},
          {"tip_radius_mm", number(std::max(tool.slim_radius_m, tool.tip_radius_m), kMmPerM)}};
}

}  // namespace

std::string scene_to_json(std::int64_t session, const calib::Cell& cell) {
  const Eigen::Vector3d up = calib::up_of(cell.robot);
  return dump({{"session", session},
               {"robot", cell.robot.name},
               {"base", frame(cell.robot.base_fixed)},
               {"joints", joints_to_json(cell.robot)},
               {"flange", frame(cell.robot.flange_fixed)},
               {"tool", tool_to_json(cell.tool)},
               {"targets", targets_to_json(cell)},
               {"stands", stands_to_json(cell)},
               {"obstacles", obstacles_to_json(cell)},
               {"up", {up.x(), up.y(), up.z()}},
               {"floor_mm", cell.floor_m ? number(*cell.floor_m, kMmPerM) : json(nullptr)}});
}

using nlohmann::json;

std::string plan_to_json(std::int64_t session, std::size_t first, const calib::Plan& plan,
                         const calib::Cell& cell) {
  const calib::ArmModel arm(cell);
  json touches = json::array();
  for (std::size_t i = 0; i < plan.touches.size(); ++i) {
    const calib::PlannedTouch& touch = plan.touches[i];
    const Eigen::Vector3d tip = arm.nominal_tip_m(touch.standoff) - touch.expected_m * touch.normal;
    touches.push_back({{"index", first + i},
                       {"target", touch.target},
                       {"set", to_string(touch.set)},
                       {"joints_deg", degrees(touch.standoff)},
                       {"tip_mm", mm(tip)}});
  }
  return dump({{"session", session}, {"touches", std::move(touches)}});
}

using nlohmann::json;

namespace {

/// 1 nm and 1e-7 deg: invisible rounding that halves the size.
constexpr double kDigits = 1e6;

double rounded(double value) { return std::round(value * kDigits) / kDigits; }

}  // namespace

json number(double value, double factor) {
  if (!std::isfinite(value * factor)) return nullptr;
  return rounded(value * factor);
}

json mm(const Eigen::Vector3d& point_m) {
  json list = json::array();
  for (const double value : point_m) list.push_back(number(value, calib::kMmPerM));
  return list;
}

json frame(const Eigen::Isometry3d& frame) {
  json list = json::array();
  for (int row = 0; row < 3; ++row) {
    // Direction components are dimensionless and not converted.
    for (int column = 0; column < 3; ++column) list.push_back(frame.linear()(row, column));
    list.push_back(number(frame.translation()[row], calib::kMmPerM));
  }
  return list;
}

json degrees(const calib::JointVector& joint_rad) {
  json list = json::array();
  for (const double value : joint_rad) list.push_back(number(value, calib::kDegPerRad));
  return list;
}

std::string dump(const json& value) {
  return value.dump(-1, ' ', false, json::error_handler_t::replace);
}

}  // namespace cellcal::daemon::web
