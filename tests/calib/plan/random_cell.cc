#include "tests/calib/plan/random_cell.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>

#include "calib/files/files.h"
#include "calib/model/linear.h"

namespace cellcal::calib::testing {

namespace {

using Eigen::Vector3d;

constexpr double kPi = std::numbers::pi;

std::vector<std::filesystem::path> robot_files(const std::string& folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    if (entry.path().extension() == ".toml") files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

double reach_m(const Robot& robot) {
  double reach = 0.0;
  for (std::size_t i = 1; i < robot.joints.size(); ++i)
    reach += std::hypot(robot.joints[i].d_m, robot.joints[i].a_m);
  return reach;
}

Vector3d about(Random& random, double low, double high, double bottom, double top) {
  const double angle = random.uniform(-kPi, kPi), off = random.uniform(low, high);
  return {off * std::cos(angle), off * std::sin(angle), random.uniform(bottom, top)};
}

Eigen::Matrix3d turned(Random& random) {
  return (Eigen::AngleAxisd(random.uniform(-kPi, kPi), Vector3d::UnitZ()) *
          Eigen::AngleAxisd(random.uniform(-0.5, 0.5), Vector3d::UnitX()))
      .toRotationMatrix();
}

std::shared_ptr<const Mesh> octahedron(const Vector3d& size) {
  auto mesh = std::make_shared<Mesh>();
  for (int axis = 0; axis < 3; ++axis)
    for (const double side : {-0.5, 0.5})
      mesh->vertices_m.push_back(side * size[axis] * Vector3d::Unit(axis));
  for (const int x : {0, 1})
    for (const int y : {2, 3})
      for (const int z : {4, 5}) mesh->triangles.push_back({x, y, z});
  return mesh;
}

}  // namespace

RandomCell random_cell(const std::string& robots, unsigned seed) {
  Random random(seed);
  const auto files = robot_files(robots);
  RandomCell made;
  const auto& file = files[random.below(files.size())];
  made.robot = file.filename().string();
  Cell& cell = made.cell;
  cell.robot = load_robot(file);
  const double reach = reach_m(cell.robot);
  const double shoulder = std::abs(cell.robot.joints[0].d_m);

  // A tool that extends beyond the hand's casting.
  const double length = random.uniform(0.2, 0.35) * std::max(1.0, reach);
  cell.tool.tcp.translation() =
      Vector3d(random.uniform(-0.2, 0.2) * length, random.uniform(-0.2, 0.2) * length, length);
  cell.tool.length_m = cell.tool.tcp.translation().norm();
  cell.tool.tip_radius_m = random.uniform() < 0.5 ? 0.0 : random.uniform(0.0005, 0.006);
  cell.tool.radius_m = random.uniform(0.015, 0.04);
  cell.touch_sigma_m = 3e-5;
  cell.radius_offset_sigma_m = 3e-4;

  // Places of spheres: in front of the arm, in a sector of their own.
  const double heading = random.uniform(-1.2, 1.2);
  const std::size_t spheres = 2 + random.below(3);
  for (std::size_t k = 0; k < spheres; ++k) {
    Target target;
    target.id = "S" + std::to_string(k + 1);
    target.diameter_m = random.uniform() < 0.5 ? 0.0381 : 0.0614;
    target.diameter_sigma_m = 2e-6;
    target.has_centre = true;
    target.centre_sigma_m = 0.01;
    const double angle = heading + random.uniform(-0.8, 0.8),
                 off = random.uniform(0.5, 0.8) * reach;
    target.centre_m = {off * std::cos(angle), off * std::sin(angle),
                       shoulder + random.uniform(-0.4, 0.2) * reach};
    const double stand = random.uniform();
    target.has_stand = stand < 0.9;
    if (stand < 0.3) target.stand_diameter_m = random.uniform(0.01, 0.03);
    cell.targets.push_back(target);
  }
  if (random.uniform() < 0.7) {
    cell.floor_m = shoulder - random.uniform(0.6, 1.0) * reach;
    for (const Target& target : cell.targets)
      cell.floor_m = std::min(*cell.floor_m, target.centre_m.z() - 0.15);
  }
  const std::size_t obstacles = random.below(11);
  for (std::size_t k = 0; k < obstacles; ++k) {
    Obstacle o;
    o.id = "O" + std::to_string(k + 1);
    o.frame.linear() = turned(random);
    o.frame.translation() =
        about(random, 0.35 * reach, 1.2 * reach, shoulder - 0.6 * reach, shoulder + 0.8 * reach);
    const Vector3d size =
        Vector3d(random.uniform(0.01, 0.4), random.uniform(0.01, 0.4), random.uniform(0.01, 0.4)) *
        reach;
    const double kind = random.uniform();
    if (kind < 0.4) {
      o.size_m = size;
    } else if (kind < 0.8) {
      o.shape = ObstacleShape::kCylinder;
      o.diameter_m = random.uniform(0.005, 0.15) * reach;
      o.height_m = random.uniform(0.05, 0.8) * reach;
    } else {
      o.shape = ObstacleShape::kMesh;
      o.mesh = octahedron(size);
    }
    cell.obstacles.push_back(o);
  }
  return made;
}

}  // namespace cellcal::calib::testing
