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
  Impl(const Cell& stated, const CourseOptions& how, const std::vector<Touch>& touches)
      : options(how),
        arm(planning_arm(stated)),
        finder(stated, how.plan, how.find, touches),
        made(touches) {
    progress.touches = static_cast<int>(made.size());
    progress.touches_left = std::max(0, how.goal.most_touches - progress.touches);
    progress.checks_left = how.plan.check_touches;
    if (finder.done()) begin();
  }

  /// All spheres are found.
  void begin() {
    online.emplace(finder.located(), options.plan, options.goal, JointVector{}, Pace{}, made);
  }

  std::optional<PlannedTouch> next(const JointVector& from) {
    if (!online) {
      if (auto touch = finder.next(from)) return touch;
      begin();
    }
    return online->next(from);
  }

  /// Straight away from the sphere that the tip is at.
  JointVector way_out(const JointVector& from) const {
    const Cell& cell = finder.located();
    const Clearance clearance(cell, arm);
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
    if (finder.seeking() == sphere)
      throw PlanError(
          fmt::format("the tip touches sphere {}, whose place is not known well enough yet to lead "
                      "away from it; "
                      "jog it free and resume",
                      cell.targets[sphere].id));
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

  CourseOptions options;
  ArmModel arm;
  Finder finder;
  std::vector<Touch> made;
  std::optional<Online> online;
  Progress progress;  ///< before there is one of online
};

Course::Course(const Cell& cell, const CourseOptions& options, const std::vector<Touch>& made)
    : impl_(new Impl(cell, options, made)) {}
Course::~Course() = default;
Course::Course(Course&&) noexcept = default;
Course& Course::operator=(Course&&) noexcept = default;

std::optional<PlannedTouch> Course::next(const JointVector& from, bool in_contact) {
  Impl& me = *impl_;
  const bool free = !in_contact && Clearance(me.finder.located(), me.arm).clear(from, kTipMarginM);
  if (free) return me.next(from);
  const JointVector out = me.way_out(from);
  auto touch = me.next(out);
  if (touch) touch->transit.insert(touch->transit.begin(), out);
  return touch;
}

void Course::touched(const Touch& touch) {
  Impl& me = *impl_;
  if (me.online) return me.online->touched(touch);
  me.made.push_back(touch);
  ++me.progress.touches;
  me.finder.touched(touch);
}

void Course::failed(NotMade how) {
  Impl& me = *impl_;
  if (me.online) return me.online->failed();
  if (how == NotMade::kMissed)
    me.finder.missed();
  else
    me.finder.failed();
}

std::vector<JointVector> Course::way_home() const {
  return impl_->online ? impl_->online->way_home() : std::vector<JointVector>{};
}

const Progress& Course::progress() const {
  return impl_->online ? impl_->online->progress() : impl_->progress;
}

std::string Course::stage() const {
  if (!impl_->finder.done()) return impl_->finder.words();
  return progress().fitted ? "checking" : "touching";
}

}  // namespace cellcal::calib
