#include "calib/plan/course.h"

#include <fmt/format.h>

#include <limits>

#include "calib/model/inverse.h"
#include "calib/plan/pool.h"

namespace cellcal::calib {

namespace {

/// A tip further from every nominal sphere touches something else.
constexpr double kNearSphereM = 0.03;

}  // namespace

struct Course::Impl {
  Impl(const Cell& stated, const CourseOptions& how, const std::vector<Touch>& made)
      : cell(stated),
        options(how),
        arm(planning_arm(cell)),
        clearance(cell, arm),
        online(cell, how.plan, how.goal, {}, {}, made) {}

  /// Straight away from the sphere that the tip is at.
  JointVector way_out(const JointVector& from) const {
    const Eigen::Isometry3d pose = arm.nominal_tcp(from);
    double nearest_m = std::numeric_limits<double>::max(), radius_m = 0.0;
    std::size_t sphere = 0;
    for (std::size_t t = 0; t < cell.targets.size(); ++t) {
      const Target& target = cell.targets[t];
      if (target.kind != TargetKind::kSphere || !target.has_centre) continue;
      const double radius = target.diameter_m / 2.0 + cell.tool.tip_radius_m;
      const double gap = std::abs((pose.translation() - target.centre_m).norm() - radius);
      if (gap >= nearest_m) continue;
      nearest_m = gap;
      radius_m = radius;
      sphere = t;
    }
    if (nearest_m > kNearSphereM)
      throw PlanError(
          fmt::format("the arm does not stand at a sphere, and where it stands {}; jog it free and "
                      "resume",
                      clearance.hit(from, kTipMarginM).value_or("the tip is in contact")));
    const Eigen::Vector3d& centre = cell.targets[sphere].centre_m;
    Eigen::Isometry3d outside = pose;
    outside.translation() =
        centre + (radius_m + options.plan.clear_m) * (pose.translation() - centre).normalized();
    const auto out = inverse(arm, outside, from, 0.0);
    if (!out || !clearance.clear_search(from, *out, sphere, kTipMarginM))
      throw PlanError(
          fmt::format("no clear way leads from sphere {}, where the tip is, straight outwards; jog "
                      "the arm free "
                      "and resume",
                      cell.targets[sphere].id));
    return *out;
  }

  Cell cell;
  CourseOptions options;
  ArmModel arm;
  Clearance clearance;
  Online online;
};

Course::Course(const Cell& cell, const CourseOptions& options, const std::vector<Touch>& made)
    : impl_(new Impl(cell, options, made)) {}
Course::~Course() = default;
Course::Course(Course&&) noexcept = default;
Course& Course::operator=(Course&&) noexcept = default;

std::optional<PlannedTouch> Course::next(const JointVector& from, bool in_contact) {
  Impl& me = *impl_;
  if (!in_contact && me.clearance.clear(from, kTipMarginM)) return me.online.next(from);
  const JointVector out = me.way_out(from);
  auto touch = me.online.next(out);
  if (touch) touch->transit.insert(touch->transit.begin(), out);
  return touch;
}

void Course::touched(const Touch& touch) { impl_->online.touched(touch); }
void Course::failed() { impl_->online.failed(); }
std::vector<JointVector> Course::way_home() const { return impl_->online.way_home(); }
const Progress& Course::progress() const { return impl_->online.progress(); }

}  // namespace cellcal::calib
