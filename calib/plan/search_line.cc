#include "calib/plan/search_line.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>

#include "calib/estimate/start.h"
#include "calib/model/error.h"
#include "calib/model/inverse.h"
#include "calib/model/units.h"
#include "calib/plan/finder.h"
#include "calib/words/phrase.h"

namespace cellcal::calib {

namespace {

using Eigen::Vector3d;

constexpr double kShaftBowM = 2.0 * kMostBowM;
constexpr double kLargestRad = 0.35;  ///< of a joint along a line; larger: another configuration

constexpr double kShaftMarginM = 0.005;
constexpr double kTipFromStandsM =
    0.004;  ///< distance from stands, where contact would be attributed to the sphere
/// A tip that only grazes the sphere may slip off.
constexpr double kGrazing = 0.9;
/// Depth by which the nominal tip must hit the sphere so that an inaccurate arm hits it too: only
/// then does the sphere protect the shaft from objects farther along the line.
constexpr double kCertainHitM = 0.005;

/// Position at which a point moving along the line from far outside first comes within `radius_m`
/// of the stand of a sphere, which ends `below_m` below its centre; measured along the normal from
/// the point closest to the centre, at offset `off`.
double at_stand(const Eigen::Vector3d& off, const Eigen::Vector3d& normal,
                const Eigen::Vector3d& up, double radius_m, double below_m) {
  // off + t normal, in top view: |h + t n| = radius.
  const Eigen::Vector3d h = off - off.dot(up) * up, n = normal - normal.dot(up) * up;
  const double a = n.squaredNorm(), b = h.dot(n), c = h.squaredNorm() - radius_m * radius_m;
  constexpr double kUpright = 1e-9;
  double first = std::numeric_limits<double>::max(), last = kNeverM;
  if (a > kUpright) {
    if (b * b <= a * c) return kNeverM;
    const double root = std::sqrt(b * b - a * c);
    first = (-b + root) / a;
    last = (-b - root) / a;
  } else if (c > 0.0) {
    return kNeverM;
  }
  const double height = off.dot(up) + below_m, climb = normal.dot(up);
  if (climb > kUpright) first = std::min(first, -height / climb);
  if (height + first * climb > kUpright) return kNeverM;
  return first > last ? first : kNeverM;
}

/// Spread of points about their mean.
struct Spread {
  double count = 0.0, squares = 0.0;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();

  void add(const Eigen::Vector3d& point) {
    count += 1.0;
    sum += point;
    squares += point.squaredNorm();
  }
  /// Sum over three components; `of_one` for a single point.
  double variance(double of_one) const {
    return count < 2.0 ? of_one : (squares - sum.squaredNorm() / count) / (count - 1.0);
  }
};

/// Most that a touch lies off the fitted sphere, in errors of the arm.
constexpr double kOffSigmas = 4.0;
/// Touches within this angle, seen from the centre, are on one side and constrain the lateral
/// position poorly.
constexpr double kOneSideRad = 70.0 * kRadPerDeg;
constexpr std::size_t kLeastHits = 6, kMostHits = 12;
/// Margin to the ball that encloses all particles, within the previous one: the arm at the previous
/// clear point stays clear of it.
constexpr double kOutsideM = 0.008;

double angle_rad(const Vector3d& a, const Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

/// After the maximum number of touches. Suggests more room if its touches are on one side.
PlanError too_uncertain(const Sought& one, const std::string& id) {
  double widest_rad = 0.0;
  for (const Vector3d& a : one.tips)
    for (const Vector3d& b : one.tips)
      widest_rad = std::max(widest_rad, angle_rad(a - one.centre_m, b - one.centre_m));
  const char* todo = widest_rad < kOneSideRad
                         ? "Give the arm more room around it, or measure its centre and state it "
                           "as centre_mm"
                         : "Measure its centre and state it as centre_mm";
  const double u_mm = 2e3 * one.sigma_m, limit_mm = 2e3 * one.enough_m();
  const int decimals = decimals_apart(u_mm, limit_mm, 1);
  return {
      PlanError::Kind::kNotFound, id,
      fmt::format("sphere {}: centre ± {:.{}f} mm (k=2) after {} touches, limit {:.{}f} mm. All "
                  "lie within {:.0f} deg as seen from its centre. {}",
                  id, u_mm, decimals, one.tips.size(), limit_mm, decimals, widest_rad * kDegPerRad,
                  todo)};
}

}  // namespace

Vector3d shaft_in_tool(const Tool& tool) { return tool.tcp.linear().transpose() * shaft_of(tool); }

std::optional<JointVector> LineLeader::posture(const LineToLead& line, double outside_m,
                                               const Vector3d& beside,
                                               const JointVector& near) const {
  Eigen::Isometry3d pose(line.orientation);
  pose.translation() = line.aim_m + outside_m * line.normal + beside;
  return inverse(arm_, pose, near, margin_rad_);
}

Vector3d LineLeader::on_move(const JointVector& from, const JointVector& to, double share,
                             double behind_tip_m) const {
  return arm_.nominal_tcp(interpolated(from, to, share)) *
         Vector3d(-behind_tip_m * shaft_in_tool(tool_));
}

Vector3d LineLeader::bow_m(const JointVector& from, const JointVector& to) const {
  const Vector3d a = on_move(from, to, 0.0, 0.0), b = on_move(from, to, 1.0, 0.0);
  const Vector3d off = on_move(from, to, 0.5, 0.0) - a, along = (b - a).normalized();
  return off - off.dot(along) * along;
}

bool LineLeader::keeps_to(const LineToLead& line, const LedSearch& led) const {
  for (std::size_t i = 0; i < led.end.size(); ++i)
    if (std::abs(led.end[i] - led.clear[i]) > kLargestRad) return false;
  const double behind_m = tool_.slim_length_m;
  const Vector3d shaft = led.from - behind_m * (line.orientation * shaft_in_tool(tool_));
  const auto off_m = [&](double share, double behind_tip_m, const Vector3d& begin) {
    const Vector3d off = on_move(led.standoff, led.end, share, behind_tip_m) - begin;
    return (off - off.dot(line.normal) * line.normal).norm();
  };
  for (const double share : {0.0, 0.25, 0.5, 0.75, 1.0})
    if (off_m(share, 0.0, led.from) > kMostBowM || off_m(share, behind_m, shaft) > kShaftBowM)
      return false;
  return true;
}

std::optional<LedSearch> LineLeader::lead(const LineToLead& line, const LineEnds& ends) const {
  LedSearch led;
  led.from = line.aim_m + ends.standoff_m * line.normal;
  led.to = line.aim_m + ends.end_m * line.normal;
  Vector3d beside = Vector3d::Zero();
  for (const bool corrected : {false, true}) {
    const auto clear = posture(line, ends.clear_m, beside, line.near);
    if (!clear) return std::nullopt;
    const auto standoff = posture(line, ends.standoff_m, beside, *clear);
    if (!standoff) return std::nullopt;
    const auto end = posture(line, ends.end_m, beside, *standoff);
    if (!end) return std::nullopt;
    led.clear = *clear;
    led.standoff = *standoff;
    led.end = *end;
    if (!corrected) beside = -bow_m(*standoff, *end) / 2.0;
    if (beside.norm() > kMostBowM) return std::nullopt;
  }
  return keeps_to(line, led) ? std::optional(led) : std::nullopt;
}

SearchDepth search_depth(const SearchLine& line, const std::vector<Eigen::Vector3d>& places,
                         double radius_m, const SearchStand& stand, const Tool& tool) {
  const double tip_radius = radius_m + tool.tip_radius_m;
  const double shaft_radius = radius_m + tool.radius_m + kShaftMarginM;
  // The shaft's end moves in the same direction, after the tip and, for an inclined tool,
  // laterally offset.
  const Eigen::Vector3d behind = -tool.slim_length_m * line.shaft;
  const double above = behind.dot(line.normal);
  const Eigen::Vector3d beside = behind - above * line.normal;
  // The stand ends at the sphere's surface. Anything above that meets the sphere first; a stand up to
  // the centre would exclude all lateral touches of spheres smaller than its margins.
  const double within = radius_m * radius_m - stand.radius_m * stand.radius_m;
  const auto below_centre = [&](double body_radius_m) {
    return std::max(0.0, std::sqrt(std::max(0.0, within)) - body_radius_m);
  };
  const double slim_radius = std::max(tool.slim_radius_m, tool.tip_radius_m);
  SearchDepth depth;
  depth.end_m = kNeverM;
  double lowest = std::numeric_limits<double>::max();
  depth.met_m.reserve(places.size());
  for (const Eigen::Vector3d& place : places) {
    const Eigen::Vector3d off = place - line.aim_m;
    const double height = off.dot(line.normal);
    const Eigen::Vector3d across = off - height * line.normal;
    lowest = std::min(lowest, height);
    const double tip = across.norm(), shaft = (across - beside).norm();
    const double tip_at = tip < kGrazing * tip_radius
                              ? height + std::sqrt(tip_radius * tip_radius - tip * tip)
                              : kNeverM;
    const double sure = tip + kCertainHitM;
    const double certain_contact_at =
        sure < tip_radius ? height + std::sqrt(tip_radius * tip_radius - sure * sure) : kNeverM;
    const double shaft_at =
        shaft < shaft_radius
            ? height + std::sqrt(shaft_radius * shaft_radius - shaft * shaft) - above
            : kNeverM;
    if (shaft_at > certain_contact_at) depth.end_m = std::max(depth.end_m, shaft_at);
    if (stand.radius_m > 0.0) {
      const double has_tip_stand =
          at_stand(-off, line.normal, stand.up, stand.radius_m + slim_radius + kTipFromStandsM,
                   below_centre(slim_radius));
      const double shaft_radius_m = tool.radius_m + kShaftMarginM;
      const double has_shaft_stand =
          at_stand(behind - off, line.normal, stand.up, stand.radius_m + shaft_radius_m,
                   below_centre(shaft_radius_m));
      const double stands = std::max(has_tip_stand, has_shaft_stand);
      if (stands > certain_contact_at) depth.end_m = std::max(depth.end_m, stands);
    }
    depth.met_m.push_back(tip_at);
  }
  depth.end_m = std::max(depth.end_m, lowest);
  for (double& at : depth.met_m) {
    if (at > depth.end_m)
      depth.share += 1.0;
    else
      at = kNeverM;
  }
  if (!places.empty()) depth.share /= static_cast<double>(places.size());
  return depth;
}

double expected_reduction_m2(const SearchDepth& depth, const std::vector<Eigen::Vector3d>& places,
                             double sigma_m) {
  // Places sorted by outcome, in groups of one sigma; those not met are one group. Depths as
  // measured, with fixed errors distributed like a normal variable.
  constexpr double kErrors[] = {-1.28, 0.52, -0.25, 0.84, -0.84, 0.25, 1.28, -0.52, 0.0};
  std::map<long, Spread> groups;
  Spread all;
  for (std::size_t k = 0; k < places.size(); ++k) {
    const double met = depth.met_m[k];
    const double read = met / sigma_m + kErrors[k % std::size(kErrors)];
    const long group =
        met == kNeverM ? std::numeric_limits<long>::max() : static_cast<long>(std::floor(read));
    groups[group].add(places[k]);
    all.add(places[k]);
  }
  if (places.size() < 2) return 0.0;
  double left = 0.0;
  for (const auto& [group, spread] : groups)
    left += spread.count * spread.variance(all.variance(0.0));
  return std::max(0.0, all.variance(0.0) - left / all.count);  // (71)
}

std::string advice_after_touches(double arm_sigma_m) {
  return fmt::format(
      "Check its diameter_mm, the tool's xyz_mm, and that nothing else is there. If they are right, the arm is "
      "off by more than {:.0f} mm: check its mastering and offset_deg, or state larger tolerances in the robot file",
      kOffSigmas * arm_sigma_m * kMmPerM);
}

Ball ball_of_prior(const CentreParticles& particles) {
  return {particles.prior_mean(), particles.bound_m() + kWrongM};
}

void Sought::touched(const Vector3d& from, const Vector3d& tip, const Target& stated) {
  tips.push_back(tip);
  particles.hit(from, tip);
  shrink_ball();
  const std::vector<double> radii(tips.size(), radius_m);
  const Vector3d mean = particles.mean();
  const double arm_sigma_m = particles.arm_sigma_m(), most_off_m = kOffSigmas * arm_sigma_m;
  centre_m = fit_centre(tips, radii, {&mean, particles.prior_sigma_m()}, arm_sigma_m).centre_m;
  Eigen::Matrix3d information =
      Eigen::Matrix3d::Identity() / std::pow(particles.prior_sigma_m(), 2);
  double off = 0.0;
  for (const Vector3d& p : tips) {
    const Vector3d row = (centre_m - p).normalized() / arm_sigma_m;
    information += row * row.transpose();
    off = std::max(off, std::abs((centre_m - p).norm() - radius_m));
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(information, Eigen::EigenvaluesOnly);
  sigma_m = 1.0 / std::sqrt(solver.eigenvalues()[0]);
  found =
      tips.size() >= kLeastHits && !particles.empty() && sigma_m <= enough_m() && off <= most_off_m;
  if (found || tips.size() < kMostHits) return;
  if (off <= most_off_m) throw too_uncertain(*this, stated.id);
  throw PlanError(
      PlanError::Kind::kNotFound, stated.id,
      fmt::format("the touches of {} do not lie on a sphere of {:.1f} mm: one is {:.1f} mm off. {}",
                  stated.id, stated.diameter_m * kMmPerM, off * kMmPerM,
                  advice_after_touches(arm_sigma_m)));
}

double Sought::enough_m() const {
  constexpr double kDeepM = 0.004;  ///< a search reaches three of these beyond the surface
  const double found_m = found_sigma_m(particles.arm_sigma_m());
  if (tips.size() < kMostHits) return found_m;
  return std::max(found_m, std::min(kDeepM, most_centre_sigma_m(radius_m)));
}

void Sought::shrink_ball() {
  if (tips.empty() || particles.empty()) return;
  const Vector3d mean = particles.mean();
  const double around_mean = particles.reach_m(mean) + kWrongM;
  // After exclusions, wide particles lie to one side, and so does their mean.
  const double as_before = particles.reach_m(ball.centre_m) + kWrongM;
  const double outside = (mean - ball.centre_m).norm() + around_mean - ball.beyond_m;
  ball.beyond_m = as_before;
  if (around_mean < ball.beyond_m && outside <= kOutsideM) ball = {mean, around_mean};
}

}  // namespace cellcal::calib
