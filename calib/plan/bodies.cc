#include "calib/plan/bodies.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace cellcal::calib {

namespace {

using Eigen::Vector3d;

constexpr double kRadiusM = 0.10;  // forearm castings of 5 to 20 kg arms
constexpr double kOfReachM = 1.34;
constexpr double kLeastRadiusM = 0.06;
/// Height of a moving column's capsule above the foot: more than the margin of bodies, so that what
/// the foot stands on is not in its way.
constexpr double kAboveFootM = 0.03;
constexpr std::array kNames = {"the column",  "the upper arm", "the elbow",
                               "the forearm", "the wrist",     "the hand"};

double length_m(const Joint& joint) { return std::hypot(joint.d_m, joint.a_m); }

std::string words_of(const Robot& robot, std::size_t i) {
  const std::string& name = robot.joints[i].name;
  const std::size_t first = robot.first_turning();
  if (i < first) return "the carriage (" + name + ")";
  if (robot.joints.size() == first + kNames.size())
    return std::string(kNames[i - first]) + " (" + name + ")";
  return "the link that " + name + " moves";
}

double off_axis_m(const Vector3d& point, const ArmChain::Link& link) {
  return (point - link.z_origin).cross(link.z).norm();
}

}  // namespace

double assumed_radius_m(const Robot& robot) {
  double reach = robot.flange_fixed.translation().norm();
  for (std::size_t i = robot.first_turning() + 1; i < robot.joints.size(); ++i)
    reach += length_m(robot.joints[i]);
  return std::max(kLeastRadiusM, kRadiusM * reach / kOfReachM);
}

double distance_m(const Segment& one, const Segment& other) {
  // Ericson, Real-Time Collision Detection, 5.1.9.
  constexpr double kPoint = 1e-18;     // squared length below which a segment is a point
  constexpr double kParallel = 1e-12;  // squared sine
  const Vector3d d1 = one.b - one.a, d2 = other.b - other.a, r = one.a - other.a;
  const double a = d1.squaredNorm(), e = d2.squaredNorm(), c = d1.dot(r), f = d2.dot(r);
  double s = 0.0, t = 0.0;
  if (a > kPoint && e > kPoint) {
    const double b = d1.dot(d2), denominator = a * e - b * b;
    if (denominator > kParallel * a * e) s = std::clamp((b * f - c * e) / denominator, 0.0, 1.0);
    t = (b * s + f) / e;
    if (t < 0.0 || t > 1.0) {
      t = std::clamp(t, 0.0, 1.0);
      s = std::clamp((b * t - c) / a, 0.0, 1.0);
    }
  } else if (a > kPoint) {
    s = std::clamp(-c / a, 0.0, 1.0);
  } else if (e > kPoint) {
    t = std::clamp(f / e, 0.0, 1.0);
  }
  return (r + s * d1 - t * d2).norm();
}

Bodies::Bodies(const ArmModel& arm) : arm_(arm), nominal_(arm.errors(nullptr)) {
  const Robot& robot = arm.robot();
  const Tool& tool = arm.tool();
  const std::size_t n = robot.joints.size();
  const int last = static_cast<int>(n) - 1;
  const double assumed = assumed_radius_m(robot);
  for (std::size_t i = 0; i < n; ++i) {
    Body body;
    body.words = words_of(robot, i);
    body.joint = static_cast<int>(i);
    body.assumed = !(robot.joints[i].radius_m > 0.0);
    body.radius_m = body.assumed ? assumed : robot.joints[i].radius_m;
    body.meets_cell = i > 0;
    list_.push_back(body);
  }
  const double tool_length = tool.tcp.translation().norm();
  has_shaft_ = tool_length > tool.slim_length_m;
  if (has_shaft_) list_.push_back({"the tool's shaft", last, tool.radius_m, false, true, {}});
  back_m_ = std::clamp(tool.slim_radius_m - tool.tip_radius_m, 0.0,
                       std::min(tool_length, tool.slim_length_m));
  list_.push_back({"the tool's slim end", last, tool.slim_radius_m, true, true, {}});
  has_ball_ = tool.tip_radius_m > tool.slim_radius_m;
  if (has_ball_) list_.push_back({"the ball of the tip", last, tool.tip_radius_m, true, true, {}});
  // Further tools make no contact and keep clear of everything.
  for (int k = 1; k < arm.tool_count(); ++k) {
    const Tool& other = arm.tool(k);
    list_.push_back({"the shaft of " + other.id, last, other.radius_m, false, true, {}});
    list_.push_back({"the end of " + other.id,
                     last,
                     std::max(other.slim_radius_m, other.tip_radius_m),
                     false,
                     true,
                     {}});
  }

  // Upper bound of the distance of the axis' points from each joint's axis: the links in between
  // stretched out. Bodies on the last link are fixed in its frame.
  ArmChain chain;
  arm.walk(arm.prepare(JointVector(n, 0.0)), nominal_, chain);
  std::vector<Segment> axes;
  place(JointVector(n, 0.0), axes);
  const ArmChain::Link& end = chain.link[n - 1];
  for (std::size_t k = 0; k < list_.size(); ++k) {
    Body& body = list_[k];
    body.lever.assign(n, 0.0);
    double beyond = 0.0;  // from the origin of the body's link
    if (body.joint == last) {
      beyond = std::max((axes[k].a - end.z_origin).norm(), (axes[k].b - end.z_origin).norm());
      body.lever[n - 1] = std::max(off_axis_m(axes[k].a, end), off_axis_m(axes[k].b, end));
    } else {
      const Joint& own = robot.joints[static_cast<std::size_t>(body.joint)];
      beyond = length_m(own);
      body.lever[static_cast<std::size_t>(body.joint)] =
          own.is_prismatic() ? 1.0 : std::abs(own.a_m);
    }
    for (int j = body.joint - 1; j >= 0; --j) {
      const Joint& joint = robot.joints[static_cast<std::size_t>(j)];
      body.lever[static_cast<std::size_t>(j)] =
          joint.is_prismatic() ? 1.0 : std::abs(joint.a_m) + beyond;
      beyond += length_m(joint);
    }
  }
}

void Bodies::place(std::span<const double> q, std::vector<Segment>& axes) const {
  ArmChain chain;
  arm_.walk(arm_.prepare(q), nominal_, chain);
  const std::size_t n = q.size();
  axes.clear();
  const std::size_t first = arm_.robot().first_turning();
  for (std::size_t i = 0; i < n; ++i)
    axes.push_back({i < first ? chain.link[i].end : chain.link[i].z_origin,
                    i + 1 < n ? chain.link[i + 1].z_origin : chain.flange_origin});
  if (first > 0) {
    Segment& column = axes[first];
    const Vector3d up = column.b - column.a;
    const double keeps = list_[first].radius_m + kAboveFootM;
    const double rise = std::abs(up.dot(chain.link[first].z));  // A2 is ahead of A1, too
    column.a += keeps / std::max(keeps, rise) * up;
  }
  const Tool& tool = arm_.tool();
  const Vector3d &tip = chain.rigid_tip, &flange = chain.flange_origin;
  const double length = (flange - tip).norm();
  const Vector3d back = length > 0.0 ? Vector3d((flange - tip) / length) : Vector3d::Zero();
  const Vector3d neck = tip + std::min(length, tool.slim_length_m) * back;
  if (has_shaft_) axes.push_back({flange, neck});
  axes.push_back({neck, tip + back_m_ * back});
  if (has_ball_) axes.push_back({tip, tip});
  for (int k = 1; k < arm_.tool_count(); ++k) {
    const Tool& other = arm_.tool(k);
    const Vector3d to_tip = chain.flange * other.tcp.translation();
    const double shaft = std::max(0.0, to_tip.norm() - other.slim_length_m);
    const Vector3d joint = flange + shaft * to_tip.stableNormalized();
    axes.push_back({flange, joint});
    axes.push_back({joint, flange + to_tip});
  }
}

}  // namespace cellcal::calib
