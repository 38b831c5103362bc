// Time of the arm model: terms that depend on the angles only, the position, and the position with
// its derivatives. Prints figures; no threshold.

#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "calib/files/files.h"
#include "calib/model/inverse.h"
#include "calib/model/linear.h"
#include "calib/result/level.h"
#include "tests/command_line/command_line.h"

namespace {

using namespace cellcal::calib;  // NOLINT: a benchmark's own file

constexpr int kBatches = 21;  // their median is reported

/// Nanoseconds per call; `work` gets the number of the call and returns a value of its result.
template <typename Work>
double nanoseconds(int calls, const Work& work) {
  std::vector<double> ns;
  volatile double sink = 0.0;  // unused results would be optimised away
  for (int batch = 0; batch < kBatches; ++batch) {
    const auto start = std::chrono::steady_clock::now();
    double sum = 0.0;
    for (int i = 0; i < calls; ++i) sum += work(static_cast<std::size_t>(i));
    sink = sink + sum;
    ns.push_back(
        std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - start).count() /
        calls);
  }
  std::nth_element(ns.begin(), ns.begin() + kBatches / 2, ns.end());
  return ns[kBatches / 2];
}

void measure(const char* name, const Cell& cell, int calls) {
  const ArmModel arm(cell.robot, cell.tool);
  Random random(1);
  constexpr std::size_t kPoses = 64;
  std::vector<JointVector> joints;
  std::vector<PreparedPose> poses;
  for (std::size_t k = 0; k < kPoses; ++k) {
    JointVector q;
    for (const Joint& joint : cell.robot.joints)
      q.push_back(random.uniform(joint.min_rad, joint.max_rad));
    poses.push_back(arm.prepare(q));
    joints.push_back(std::move(q));
  }
  Eigen::VectorXd x(arm.size());
  for (int p = 0; p < arm.size(); ++p)
    x[p] = arm.parameters()[static_cast<std::size_t>(p)].sigma * random.normal();
  Eigen::Matrix3Xd jacobian(3, arm.size());
  const double prepare = nanoseconds(
      calls, [&](std::size_t i) { return arm.prepare(joints[i % kPoses]).direction(0, 0); });
  const double position = nanoseconds(
      calls, [&](std::size_t i) { return arm.position(poses[i % kPoses], x.data()).x(); });
  const double derivatives = nanoseconds(calls, [&](std::size_t i) {
    return arm.position(poses[i % kPoses], x.data(), jacobian).x() + jacobian(0, 0);
  });
  const double inverse_ns = nanoseconds(calls / 50 + 1, [&](std::size_t i) {
    JointVector seed = joints[i % kPoses];
    for (double& angle : seed) angle += 0.05;
    const auto q = inverse(arm, arm.nominal_tcp(joints[i % kPoses]), seed, 0.0);
    return q ? (*q)[0] : 0.0;
  });
  fmt::print("{:28s} {:10d} {:10.0f} {:10.0f} {:12.0f} {:10.0f}\n", name, arm.size(), prepare,
             position, derivatives, inverse_ns);
}

}  // namespace

int main(int argc, char** argv) {
  cellcal::CommandLine app{"Times the arm model, nanoseconds per call."};
  int calls = 20000;
  app.option("--calls", calls, "Calls per batch").between(100, 100000000);
  if (const auto code = app.parse(argc, argv)) return *code;
  fmt::print("{:28s} {:>10s} {:>10s} {:>10s} {:>12s} {:>10s}\n", "arm", "parameters", "prepare",
             "position", "+derivatives", "inverse");
  const Cell cell = load_cell(CELLCAL_DEMO_CELL);
  measure("KR 5, geometry and bending", cell, calls);
  measure("KR 5, gears too", at_level(cell, ModelLevel{}), calls);
  Cell seven = cell;
  seven.robot = load_robot(CELLCAL_ROBOTS_FOLDER "/iiwa14.toml");
  measure("iiwa 14, compliance and gears", at_level(seven, ModelLevel{}), calls);
  return 0;
}
