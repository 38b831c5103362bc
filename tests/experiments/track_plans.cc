// Share of plans for an arm on a linear unit that meet the spheres of the emulated cell: with
// searches and margins as for an arm on its foot, and widened by the unit's prior.

#include <fmt/format.h>

#include <cstdio>

#include "calib/files/files.h"
#include "calib/plan/plan.h"
#include "sim/cell/physical_cell.h"
#include "sim/cell/truth.h"
#include "tests/command_line/command_line.h"

namespace {

using namespace cellcal;

calib::Cell cell_of(const calib::Robot& robot) {
  constexpr double kPlaces[][3] = {{1.0, 0.3, 0.3},   {0.9, 0.6, 0.5},  {0.95, 1.0, 0.35},
                                   {1.05, 1.7, 0.25}, {0.9, 2.3, 0.55}, {1.0, 2.8, 0.35}};
  calib::Cell cell;
  cell.robot = robot;
  cell.tool.tcp.translation() = Eigen::Vector3d(0.06, 0.05, 0.41);
  cell.tool.length_m = cell.tool.tcp.translation().norm();
  cell.tool.mass_kg = 2.0;
  for (const auto& place : kPlaces) {
    calib::Target sphere;
    sphere.id = fmt::format("S{}", cell.targets.size() + 1);
    sphere.diameter_m = 0.06;
    sphere.has_centre = true;
    sphere.centre_m = Eigen::Vector3d(place[0], place[1], place[2]);
    cell.targets.push_back(std::move(sphere));
  }
  return cell;
}

/// The smallest gap of the true tip on a straight move [m].
double least_gap_m(const sim::PhysicalCell& real, const calib::JointVector& from,
                   const calib::JointVector& to) {
  constexpr int kSamples = 40;
  double least = 1e3;
  for (int k = 0; k <= kSamples; ++k) {
    calib::JointVector q = from;
    for (std::size_t i = 0; i < q.size(); ++i) q[i] += k * (to[i] - from[i]) / kSamples;
    least = std::min(least, real.gap_m(q));
  }
  return least;
}

struct Column {
  int arms = 0, served = 0, touches = 0, missed = 0, early = 0, hits = 0;

  void add(const calib::Plan& plan, const sim::PhysicalCell& real) {
    int wrong = 0;
    const calib::JointVector* at = &plan.start;
    for (const calib::PlannedTouch& touch : plan.touches) {
      double least = 1e3;
      for (const calib::JointVector& next : touch.transit) {
        least = std::min(least, least_gap_m(real, *at, next));
        at = &next;
      }
      const bool hit = least <= 0.0, before = real.gap_m(touch.standoff) <= 0.0;
      const bool none = !before && least_gap_m(real, touch.standoff, touch.end) > 0.0;
      ++touches;
      missed += none;
      early += before;
      hits += hit && !before;
      wrong += none || before || hit;
      at = &touch.clear;
    }
    ++arms;
    served += wrong == 0;
  }
  void print(const char* name, const calib::Plan& plan) const {
    double longest = 0.0, sum = 0.0;
    for (const calib::PlannedTouch& touch : plan.touches) {
      longest = std::max(longest, touch.expected_m);
      sum += touch.expected_m;
    }
    fmt::print("| {} | {:.1f}, {:.1f} mm | {} of {} | {}, {}, {} of {} |\n", name,
               1e3 * sum / static_cast<double>(plan.touches.size()), 1e3 * longest, served, arms,
               missed, early, hits, touches);
  }
};

}  // namespace

int main(int argc, char** argv) {
  try {
    int robots = 10;
    bool rigid = false;
    calib::PlanOptions options;
    options.fit_touches = 60;
    options.seed = 12;
    cellcal::CommandLine app(
        "A KR 16 on a linear unit of 3 m in the emulated cell: arms whose every planned touch finds "
        "its sphere.\nExample: track_plans --robots 10");
    app.option("--robots", robots, "Random arms and tracks").between(1, 1000);
    app.option("--rigid", rigid,
               "An arm that does not bend: what is left of its errors is geometry");
    if (const auto code = app.parse(argc, argv)) return *code;
    calib::Cell cell = cell_of(calib::load_robot(CELLCAL_TRACK_ROBOT));
    if (rigid)
      for (calib::Joint& joint : cell.robot.joints) joint.compliance_sigma_rad_per_nm = 0.0;
    calib::Cell exact = cell;
    exact.robot.joints[0].guide = calib::LinearGuide{cell.robot.joints[0].guide->along};
    const calib::Plan usual = calib::make_plan(exact, options),
                      widened = calib::make_plan(cell, options);
    Column as_usual, as_widened;
    for (int seed = 1; seed <= robots; ++seed) {
      sim::TruthOptions truth;
      truth.seed = static_cast<std::uint64_t>(seed);
      const sim::PhysicalCell real(sim::draw_truth(cell, truth));
      as_usual.add(usual, real);
      as_widened.add(widened, real);
    }
    fmt::print(
        "| searches and margins | stand-off: mean, longest | arms served | no contact, contact at "
        "the stand-off, on the way |\n|---|---|---|---|\n");
    as_usual.print("as on its foot", usual);
    as_widened.print("widened by the unit's prior", widened);
    return 0;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "track_plans: %s\n", e.what());
    return 1;
  }
}
