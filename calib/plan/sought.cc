#include "calib/plan/sought.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "calib/estimate/start.h"
#include "calib/model/error.h"
#include "calib/model/units.h"
#include "calib/plan/finder.h"

namespace cellcal::calib {

namespace {

using Eigen::Vector3d;

constexpr double kOffM = 0.008;
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
  return {PlanError::Kind::kNotFound, id,
          fmt::format("sphere {}: centre +- {:.1f} mm (k=2) after {} touches, limit {:g} mm. All "
                      "lie within {:.0f} deg as seen from its centre. {}",
                      id, 2e3 * one.sigma_m, one.tips.size(), 2e3 * kFoundSigmaM,
                      widest_rad * kDegPerRad, todo)};
}

}  // namespace

Ball ball_of_prior(const CentreParticles& particles) {
  return {particles.prior_mean(), particles.bound_m() + kWrongM};
}

void Sought::touched(const Vector3d& from, const Vector3d& tip, const Target& stated) {
  tips.push_back(tip);
  particles.hit(from, tip);
  shrink_ball();
  const std::vector<double> radii(tips.size(), radius_m);
  const Vector3d mean = particles.mean();
  centre_m = fit_centre(tips, radii, {&mean, particles.prior_sigma_m()}, kArmSigmaM).centre_m;
  Eigen::Matrix3d information =
      Eigen::Matrix3d::Identity() / std::pow(particles.prior_sigma_m(), 2);
  double off = 0.0;
  for (const Vector3d& p : tips) {
    const Vector3d row = (centre_m - p).normalized() / kArmSigmaM;
    information += row * row.transpose();
    off = std::max(off, std::abs((centre_m - p).norm() - radius_m));
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(information, Eigen::EigenvaluesOnly);
  sigma_m = 1.0 / std::sqrt(solver.eigenvalues()[0]);
  found =
      tips.size() >= kLeastHits && !particles.empty() && sigma_m <= kFoundSigmaM && off <= kOffM;
  if (found || tips.size() < kMostHits) return;
  if (off <= kOffM) throw too_uncertain(*this, stated.id);
  throw PlanError(
      PlanError::Kind::kNotFound, stated.id,
      fmt::format(
          "the touches of {} do not lie on a sphere of {:.1f} mm: one is {:.1f} mm off. Check its "
          "diameter, and that nothing else is where it is searched for",
          stated.id, stated.diameter_m * 1e3, off * 1e3));
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
