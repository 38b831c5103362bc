// Durations of the paths between the touches of a plan: as executed (jerk-limited, blended corners), as
// straight moves between the same postures, whether clear or not, and as predicted by the planner. Prints
// seconds; no threshold.

#include <fmt/format.h>

#include <chrono>
#include <map>

#include "calib/files/files.h"
#include "calib/plan/duration.h"
#include "calib/plan/plan.h"
#include "drivers/kuka/rsi/path_move.h"
#include "tests/command_line/command_line.h"

namespace {

using namespace cellcal;  // NOLINT: a benchmark's own file

drivers::AxisAngles axes(const calib::JointVector& q) {
  drivers::AxisAngles axes;
  for (const double one : q) axes.push_back(one);
  return axes;
}

/// The demo's: 80 % of the robot file's speeds, and its controller's accelerations.
std::vector<drivers::AxisLimit> limits(const calib::Robot& robot, double speed, double deg_s2,
                                       double deg_s3) {
  constexpr double kDeg = 3.14159265358979323846 / 180.0;
  std::vector<drivers::AxisLimit> limits;
  for (const calib::Joint& joint : robot.joints)
    limits.push_back({-10.0, 10.0, speed * joint.max_speed_rad_s, deg_s2 * kDeg, deg_s3 * kDeg});
  return limits;
}

struct Sum {
  int count = 0;
  double run_s = 0.0, straight_s = 0.0, stopping_s = 0.0;

  void print(const std::string& what) const {
    if (count == 0) return;
    fmt::print("{:24} {:5}  {:6.3f}  {:6.3f}  {:6.3f}  {:7.1f}\n", what, count, run_s / count,
               straight_s / count, stopping_s / count, run_s);
  }
};

}  // namespace

int main(int argc, char** argv) {
  std::string path = CELLCAL_DEMO_CELL;
  int touches = 100, plans = 3;
  double speed = 0.8, acceleration = 600.0, jerk = 8000.0;
  CommandLine line(
      "Seconds between the touches of plans, run, straight and stopping at each way-point");
  line.option("--cell", path);
  line.option("--touches", touches).between(2, 2000);
  line.option("--plans", plans, "Seeds 1 to so many").between(1, 100);
  line.option("--speed", speed, "Share of the robot file's axis speeds").between(0.01, 1.0);
  line.option("--acceleration", acceleration, "deg/s2").between(1, 1e5);
  line.option("--jerk", jerk, "deg/s3").between(1, 1e7);
  if (const auto code = line.parse(argc, argv)) return *code;
  const calib::Cell cell = calib::load_cell(path);
  const auto allowed = limits(cell.robot, speed, acceleration, jerk);
  std::map<std::size_t, Sum> by_points;
  Sum same, other, all;
  double foreseen_s = 0.0, planning_s = 0.0;
  for (int seed = 1; seed <= plans; ++seed) {
    calib::PlanOptions options;
    options.fit_touches = touches;
    options.check_touches = 0;
    options.seed = static_cast<unsigned>(seed);
    const auto begun = std::chrono::steady_clock::now();
    const calib::Plan plan = calib::make_plan(cell, options);
    planning_s += std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
    calib::Pace pace;
    pace.speed_fraction = speed;
    foreseen_s += calib::duration_s(plan, cell.robot, pace);
    for (std::size_t k = 1; k < plan.touches.size(); ++k) {
      const calib::PlannedTouch &last = plan.touches[k - 1], &next = plan.touches[k];
      // From the contact, half-way along the search line, via the clear point.
      drivers::AxisAngles from = axes(last.standoff);
      for (std::size_t i = 0; i < from.size(); ++i) from[i] = 0.5 * (from[i] + last.end[i]);
      drivers::Vias vias, stops;
      vias.push_back({axes(last.clear), next.leaving.in_share, next.leaving.out_share});
      for (std::size_t w = 0; w + 1 < next.transit.size() && vias.size() < drivers::kMaxVias; ++w)
        vias.push_back(
            {axes(next.transit[w]), next.corners[w].in_share, next.corners[w].out_share});
      for (const drivers::Via& via : vias) stops.push_back({via.at_rad, 0.0, 0.0});
      const drivers::AxisAngles to = axes(next.standoff);
      const double run_s = drivers::PathMove(from, to, allowed, 0.0, vias).duration_s();
      const double straight_s = drivers::PathMove(from, to, allowed, 0.0).duration_s();
      const double stopping_s = drivers::PathMove(from, to, allowed, 0.0, stops).duration_s();
      for (Sum* sum : {&by_points[next.transit.size() - 1],
                       last.target == next.target ? &same : &other, &all}) {
        ++sum->count;
        sum->run_s += run_s;
        sum->straight_s += straight_s;
        sum->stopping_s += stopping_s;
      }
    }
  }
  fmt::print("{:24} {:>5}  {:>6}  {:>6}  {:>6}  {:>7}\n", "s", "moves", "run", "direct", "stops",
             "in all");
  for (const auto& [points, sum] : by_points) sum.print(fmt::format("{} way-points", points));
  same.print("same target");
  other.print("other target");
  all.print("all");
  fmt::print("foreseen, searches and all: {:.1f} s a plan; planned in {:.2f} s\n",
             foreseen_s / plans, planning_s / plans);
  return 0;
}
