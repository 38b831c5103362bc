#include "calib/plan/lowest.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "calib/model/units.h"
#include "calib/plan/bodies.h"
#include "calib/plan/duration.h"
#include "calib/plan/pool.h"
#include "calib/plan/surroundings.h"

namespace cellcal::calib {

namespace {

/// Between two postures a body of 2 m dips by less than 1 mm.
constexpr double kLowestStepRad = 0.05;

class Lowest {
 public:
  explicit Lowest(const Cell& cell)
      : arm_(planning_arm(cell)), bodies_(arm_), up_(up_of(cell.robot)) {}

  double on_move(const JointVector& from, const JointVector& to) {
    double farthest_rad = 0.0, low_m = std::numeric_limits<double>::max();
    for (std::size_t i = 0; i < from.size(); ++i)
      farthest_rad = std::max(farthest_rad, std::abs(to[i] - from[i]));
    const int steps = std::max(1, static_cast<int>(std::ceil(farthest_rad / kLowestStepRad)));
    for (int k = 1; k <= steps; ++k)
      low_m = std::min(low_m, at(interpolated(from, to, static_cast<double>(k) / steps)));
    return low_m;
  }

 private:
  double at(const JointVector& q) {
    bodies_.place(q, axes_);
    double low_m = std::numeric_limits<double>::max();
    for (std::size_t k = 0; k < axes_.size(); ++k)
      if (const Body& body = bodies_.list()[k]; body.meets_cell)
        low_m = std::min(
            {low_m, axes_[k].a.dot(up_) - body.radius_m, axes_[k].b.dot(up_) - body.radius_m});
    return low_m;
  }

  ArmModel arm_;
  Bodies bodies_;
  Eigen::Vector3d up_;
  std::vector<Segment> axes_;
};

}  // namespace

double feet_m(const Cell& cell) {
  const Eigen::Vector3d up = up_of(cell.robot);
  double lowest_m = 0.0;
  for (const Post& post : posts_of(cell))
    if (cell.targets[post.target].carried_by == 0)
      lowest_m = std::min(lowest_m, post.frame.translation().dot(up) - post.length_m / 2.0);
  return lowest_m;
}

std::optional<LowestPoint> below_feet(const Cell& cell, const Plan& plan) {
  if (cell.floor_m) return std::nullopt;
  LowestPoint lowest{std::numeric_limits<double>::max(), feet_m(cell)};
  Lowest arm(cell);
  const std::vector<JointVector> stops = stops_of(plan, plan.start);
  for (std::size_t i = 1; i < stops.size(); ++i)
    lowest.at_m = std::min(lowest.at_m, arm.on_move(stops[i - 1], stops[i]));
  return lowest.at_m < lowest.feet_m ? std::optional(lowest) : std::nullopt;
}

Phrase found_phrase(const LowestPoint& lowest) {
  return {"say.plan.low", {{"low", lowest.at_m * kMmPerM}, {"feet", lowest.feet_m * kMmPerM}}};
}

Phrase floor_advice_phrase(const LowestPoint& lowest) {
  return {"say.plan.low.do", {{"feet", lowest.feet_m * kMmPerM}}};
}

Phrase phrase(const LowestPoint& lowest) {
  return joined("say.join.remedy", found_phrase(lowest), floor_advice_phrase(lowest));
}

}  // namespace cellcal::calib
