// Time of the correction of poses: the demo cell's calibrated arm with all effects of the model,
// with seeds as for a program, and without seeds as for a list of poses. Prints figures; no
// threshold.

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "calib/export/corrector.h"
#include "calib/files/files.h"
#include "calib/model/kinematics.h"
#include "calib/model/linear.h"
#include "calib/model/units.h"
#include "calib/result/level.h"
#include "tests/command_line/command_line.h"

namespace {

using namespace cellcal::calib;  // NOLINT: a benchmark's own file

Calibration of_random_errors(const Cell& cell, const ModelLevel& level) {
  Calibration c;
  c.cell = cell;
  c.level = level;
  Random random(1);
  const ArmModel arm(at_level(cell, level));
  for (const ArmParameter& parameter : arm.parameters()) {
    ParameterResult one;
    one.key = parameter;
    one.correction = parameter.sigma * random.normal();
    c.parameters.push_back(one);
  }
  return c;
}

struct Poses {
  std::vector<JointVector> joints;
  std::vector<Eigen::Isometry3d> tcp;
};

Poses poses_of(const Cell& cell, int count) {
  constexpr double kMarginRad = 0.1, kWristDeg = 5.0;
  Random random(2);
  const ArmModel arm(cell);
  Poses poses;
  while (static_cast<int>(poses.joints.size()) < count) {
    JointVector q;
    for (const Joint& joint : cell.robot.joints)
      q.push_back(random.uniform(joint.min_rad + kMarginRad, joint.max_rad - kMarginRad));
    if (std::abs(q[4]) < kWristDeg * kRadPerDeg) continue;
    poses.tcp.push_back(arm.nominal_tcp(q));
    poses.joints.push_back(std::move(q));
  }
  return poses;
}

template <typename Work>
void measure(const char* name, const Poses& poses, const Work& correct) {
  std::size_t reached = 0;
  double worst_m = 0.0;
  const auto start = std::chrono::steady_clock::now();
  for (std::size_t i = 0; i < poses.tcp.size(); ++i) {
    const Reach reach = correct(i);
    if (const auto* at = std::get_if<Reached>(&reach)) {
      ++reached;
      worst_m = std::max(worst_m, at->off_m);
    }
  }
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const auto count = static_cast<double>(poses.tcp.size());
  fmt::print("{:<34s} {:8.3f} s {:10.0f} poses/s {:7.2f} % reached, worst {:.1e} mm off\n", name,
             seconds, count / seconds, 100.0 * static_cast<double>(reached) / count,
             worst_m * kMmPerM);
}

}  // namespace

int main(int argc, char** argv) {
  cellcal::CommandLine app{"Times the correction of poses on one core."};
  int count = 100000;
  app.option("--poses", count, "Poses").between(1, 10000000);
  if (const auto code = app.parse(argc, argv)) return *code;
  const Cell cell = load_cell(CELLCAL_DEMO_CELL);
  const Poses poses = poses_of(cell, count);
  const Corrector full(of_random_errors(cell, kFullestLevel));
  const Corrector geometry(of_random_errors(cell, {0.0, 0.0, 0.0, 0.0}));
  fmt::print("KR 5, {} poses all over the joints' ranges, one core\n", count);
  measure("geometry and bending, seeded", poses,
          [&](std::size_t i) { return geometry.joints(poses.tcp[i], poses.joints[i]); });
  measure("compliance, gears, play, seeded", poses,
          [&](std::size_t i) { return full.joints(poses.tcp[i], poses.joints[i]); });
  measure("the same, nearest of all postures", poses,
          [&](std::size_t i) { return full.nearest(poses.tcp[i], poses.joints[i]); });
  return 0;
}
