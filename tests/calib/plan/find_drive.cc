#include "tests/calib/plan/find_drive.h"

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <span>
#include <string>

#include "calib/files/files.h"
#include "calib/model/kinematics.h"
#include "calib/model/linear.h"
#include "calib/plan/finder.h"
#include "calib/plan/pool.h"
#include "calib/plan/positioner_plan.h"
#include "tests/calib/simulate.h"

namespace cellcal::calib::testing {

namespace {

using Eigen::Vector3d;

JointVector between(const JointVector& from, const JointVector& to, double share) {
  JointVector q(from.size());
  for (std::size_t i = 0; i < q.size(); ++i) q[i] = from[i] + share * (to[i] - from[i]);
  return q;
}

std::span<const double> carriers(const sim::Truth& truth, std::size_t target,
                                 const std::vector<double>& positioner_rad) {
  const int axes = truth.carried_by.empty() ? 0 : truth.carried_by[target];
  return std::span(positioner_rad).first(static_cast<std::size_t>(axes));
}

/// In the frame carried by these axes.
Vector3d tip_of(const sim::Truth& truth, const JointVector& q,
                std::span<const double> carrier_rad = {}) {
  return truth.arm.position(truth.arm.prepare(q, 0, nullptr, carrier_rad), truth.errors.data());
}

}  // namespace

void record_gaps(const Cell& cell, const sim::Truth& truth, const JointVector& from,
                 const JointVector& to, std::optional<std::size_t> meant, SphereGaps& nearest,
                 const std::vector<double>& positioner_rad) {
  const ArmModel nominal(cell.robot, cell.tool);
  constexpr int kSteps = 60;
  for (int k = 0; k <= kSteps; ++k) {
    const JointVector q = between(from, to, static_cast<double>(k) / kSteps);
    const Vector3d shaft = -(nominal.nominal_tcp(q).linear() * cell.tool.tcp.linear().transpose() *
                             cell.tool.tcp.translation());
    const double slim = cell.tool.slim_length_m / shaft.norm();
    for (std::size_t t = 0; t < truth.centre_m.size(); ++t) {
      const auto carrier_rad = carriers(truth, t, positioner_rad);
      const Vector3d tip = tip_of(truth, q, carrier_rad);
      const Vector3d back = carried_at(cell.robot, carrier_rad).linear().transpose() * shaft;
      const double radius = truth.radius_m[t];  // of sphere and tip
      if (t != meant)
        nearest.tip_m = std::min(nearest.tip_m, (tip - truth.centre_m[t]).norm() - radius);
      for (double share = slim; share < 1.0; share += 0.02)
        nearest.shaft_m =
            std::min(nearest.shaft_m, (tip + share * back - truth.centre_m[t]).norm() - radius +
                                          cell.tool.tip_radius_m - cell.tool.radius_m);
    }
  }
}

const Cell& small_cell() {
  static const Cell small = [] {
    Cell cell = demo_cell();
    cell.robot = load_robot(std::filesystem::path(CELLCAL_ROBOTS_FOLDER) / "kr10_r1100_2.toml");
    cell.lengths.clear();
    cell.tool.tcp = Eigen::Isometry3d::Identity();
    cell.tool.tcp.translation() = Vector3d(0.0, 0.0, 0.16);
    cell.tool.length_m = 0.16;
    cell.tool.tip_radius_m = 0.002;
    cell.tool.radius_m = 0.02;
    cell.tool.slim_length_m = 0.08;
    cell.tool.slim_radius_m = 0.003;
    const Vector3d centres[] = {
        {0.62, -0.30, 0.20}, {0.60, 0.32, 0.22}, {0.40, -0.52, 0.38}, {0.45, 0.50, 0.44}};
    for (std::size_t t = 0; t < 4; ++t) {
      cell.targets[t].diameter_m = 0.0381;
      cell.targets[t].centre_m = centres[t];
      cell.targets[t].stand_diameter_m = 0.012;
    }
    Obstacle table;
    table.id = "table";
    table.frame.translation() = Vector3d(0.5, 0.0, -0.03);
    table.size_m = Vector3d(1.2, 1.6, 0.06);
    cell.obstacles = {table};
    cell.floor_m = -0.7;
    return cell;
  }();
  return small;
}

Cell table_cell(double diameter_m, double tip_radius_m, std::size_t first) {
  Cell cell;
  cell.robot = load_robot(std::filesystem::path(CELLCAL_ROBOTS_FOLDER) / "kr16_r1610_2.toml");
  cell.tool.tcp.translation() = Vector3d(0.0, 0.0, 0.3);
  cell.tool.length_m = 0.3;
  cell.tool.mass_kg = 1.5;
  cell.tool.tip_radius_m = tip_radius_m;
  cell.touch_sigma_m = 3e-5;
  cell.radius_offset_sigma_m = 3e-4;
  const Vector3d places[] = {
      {1.05, -0.40, 0.30}, {1.00, 0.42, 0.34}, {0.62, -0.72, 0.52}, {0.72, 0.68, 0.58}};
  for (std::size_t k = 0; k < std::size(places); ++k) {
    const std::size_t place = (first + k) % std::size(places);
    Target target;
    target.id = "S" + std::to_string(place + 1);
    target.diameter_m = diameter_m;
    target.diameter_sigma_m = 2e-6;
    target.has_centre = true;
    target.centre_m = places[place];
    cell.targets.push_back(target);
  }
  Obstacle table;
  table.id = "table";
  table.frame.translation() = Vector3d(0.9, 0.0, -0.05);
  table.size_m = Vector3d(1.2, 2.0, 0.06);
  cell.obstacles = {table};
  return cell;
}

Cell as_rough_as_stated(Cell cell, double sigma_m, unsigned seed) {
  constexpr double kMost = 2.7;
  Random random(seed);
  for (Target& target : cell.targets) {
    Vector3d draw;
    do {
      draw = Vector3d(random.normal(), random.normal(), random.normal());
    } while (draw.norm() > kMost);
    target.centre_m += sigma_m * draw;
    target.centre_sigma_m = sigma_m;
  }
  return cell;
}

std::optional<Touch> search(const Cell& cell, const sim::Truth& truth, const PlannedTouch& line) {
  const std::size_t target = cell.target_index(line.target);
  const auto gap = [&](double share) {
    return (tip_of(truth, between(line.standoff, line.end, share),
                   carriers(truth, target, line.positioner_rad)) -
            truth.centre_m[target])
               .norm() -
           truth.radius_m[target];
  };
  constexpr int kSteps = 400;
  for (int k = 1; k <= kSteps; ++k) {
    double out = (k - 1.0) / kSteps, in = static_cast<double>(k) / kSteps;
    if (gap(in) > 0.0) continue;
    for (int halving = 0; halving < 40; ++halving) {
      const double middle = (out + in) / 2.0;
      (gap(middle) > 0.0 ? out : in) = middle;
    }
    Touch touch;
    touch.target = line.target;
    touch.positioner_rad = line.positioner_rad;
    touch.joint_rad = between(line.standoff, line.end, out);
    return touch;
  }
  return std::nullopt;
}

Found drive(const Cell& cell, const sim::Truth& truth, bool all, std::size_t spheres,
            const std::vector<double>& positioner_rad) {
  Finder finder(cell, {}, all, {}, positioner_rad);
  Found found;
  const JointVector middle =
      positioner_rad.empty() ? middle_posture(cell.robot) : waiting_posture(cell);
  JointVector at;
  constexpr int kNoEnd = 700;
  const auto recorded = [&](const JointVector& from, const JointVector& to,
                            std::optional<std::size_t> meant) {
    record_gaps(cell, truth, from, to, meant, found.nearest, positioner_rad);
  };
  while (!finder.done() && *finder.seeking() < spheres) {
    if (found.touches + found.misses > kNoEnd) return found;
    const auto line = finder.next(at.empty() ? middle : at);
    for (const JointVector& waypoint : line->transit) {
      if (!at.empty()) recorded(at, waypoint, {});
      at = waypoint;
    }
    const std::size_t meant = cell.target_index(line->target);
    at = line->clear;
    const Vector3d begin = tip_of(truth, line->standoff, carriers(truth, meant, positioner_rad));
    found.began_inside |= (begin - truth.centre_m[meant]).norm() <= truth.radius_m[meant];
    const auto touch = search(cell, truth, *line);
    ++(touch ? found.touches : found.misses);
    const JointVector& deepest = touch ? touch->joint_rad : line->end;
    recorded(line->standoff, deepest, meant);
    recorded(deepest, line->clear, meant);
    if (touch) {
      finder.touched(*touch);
      found.made.push_back(*touch);
    } else {
      finder.missed();
    }
  }
  found.done = true;
  found.cell = finder.located();
  return found;
}

}  // namespace cellcal::calib::testing
