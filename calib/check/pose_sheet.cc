#include "calib/check/pose_sheet.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "calib/check/foresight.h"
#include "calib/model/units.h"

namespace cellcal::calib {

namespace {

/// As for repeats of a session (calib/estimate/repeats).
constexpr double kSamePlaceRad = 0.05 * kRadPerDeg;
/// Mean and standard deviation of the absolute value of a standard normal variable.
const double kNormalMean = std::sqrt(2.0 / std::numbers::pi);
const double kNormalSigma = std::sqrt(1.0 - 2.0 / std::numbers::pi);
constexpr double kSigmasOfRp = 3.0;  // ISO 9283, RP_l

struct Measured {
  std::size_t touch = 0;
  const Touch* at = nullptr;
  double off_m = 0.0;  ///< along the normal
  double variance_m2 = 0.0, noise_m2 = 0.0;
};

/// Touches of spheres whose place the calibration has.
std::vector<Measured> measured(const Calibration& c, std::span<const Touch> touches,
                               const std::vector<bool>& left_out) {
  std::vector<Measured> all;
  std::vector<Touch> made;
  for (std::size_t i = 0; i < touches.size(); ++i) {
    const auto target = std::ranges::find(c.targets, touches[i].target, &TargetResult::id);
    if (target == c.targets.end() || target->kind != TargetKind::kSphere) continue;
    if (i < left_out.size() && left_out[i]) continue;
    all.push_back({.touch = i, .at = &touches[i]});
    made.push_back(touches[i]);
  }
  if (made.empty()) return all;
  const Foresight foresight = foresee(c, made);
  const Eigen::VectorXd off = residuals_m(foresight.contacts);
  for (std::size_t k = 0; k < all.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    all[k].off_m = off[i];
    all[k].noise_m2 = foresight.passing_m2(i, i);
    all[k].variance_m2 = foresight.lasting_m2(i, i) + all[k].noise_m2;
  }
  return all;
}

bool same_place(const Touch& a, const Touch& b) {
  if (a.target != b.target || a.tool != b.tool || a.load != b.load ||
      a.joint_rad.size() != b.joint_rad.size())
    return false;
  for (std::size_t k = 0; k < a.joint_rad.size(); ++k)
    if (std::abs(a.joint_rad[k] - b.joint_rad[k]) > kSamePlaceRad) return false;
  return true;
}

void add(const Measured& one, PoseAccuracy& to) {
  const double ap = std::abs(one.off_m);
  ++to.poses;
  to.mean_m += ap;
  to.max_m = std::max(to.max_m, ap);
  to.predicted_m += kNormalMean * std::sqrt(std::max(0.0, one.variance_m2));
}

std::vector<PoseAccuracy> accuracy_of(const Calibration& c, const std::vector<Measured>& all) {
  std::vector<PoseAccuracy> found;
  for (const TargetResult& target : c.targets) {
    PoseAccuracy row{.target = target.id};
    for (const Measured& one : all)
      if (one.at->target == target.id && one.at->set == TouchSet::kCheck) add(one, row);
    if (row.poses == 0) continue;
    row.mean_m /= row.poses;
    row.predicted_m /= row.poses;
    found.push_back(row);
  }
  return found;
}

PoseRepeatability repeatability_of(const std::vector<const Measured*>& repeats) {
  const auto n = static_cast<double>(repeats.size());
  PoseRepeatability row{.target = repeats[0]->at->target,
                        .first = repeats[0]->touch,
                        .repeats = static_cast<int>(repeats.size())};
  double mean = 0.0, noise = 0.0, squares = 0.0;
  for (const Measured* one : repeats) {
    mean += one->off_m / n;
    noise += std::sqrt(std::max(0.0, one->noise_m2)) / n;
  }
  for (const Measured* one : repeats) row.mean_m += std::abs(one->off_m - mean) / n;
  for (const Measured* one : repeats)
    squares += std::pow(std::abs(one->off_m - mean) - row.mean_m, 2);
  row.sigma_m = std::sqrt(squares / (n - 1.0));
  row.rp_m = row.mean_m + kSigmasOfRp * row.sigma_m;
  row.predicted_m = noise * (kNormalMean + kSigmasOfRp * kNormalSigma);
  return row;
}

}  // namespace

PoseSheet pose_sheet(const Calibration& calibration, std::span<const Touch> touches,
                     const std::vector<bool>& left_out) {
  if (calibration.covariance.size() == 0) return {};
  const std::vector<Measured> all = measured(calibration, touches, left_out);
  PoseSheet sheet{accuracy_of(calibration, all), {}};
  std::vector<bool> taken(all.size());
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (taken[i]) continue;
    std::vector<const Measured*> repeats;
    for (std::size_t k = i; k < all.size(); ++k) {
      if (taken[k] || !same_place(*all[i].at, *all[k].at)) continue;
      taken[k] = true;
      repeats.push_back(&all[k]);
    }
    if (static_cast<int>(repeats.size()) >= kLeastRepeats)
      sheet.repeatability.push_back(repeatability_of(repeats));
  }
  return sheet;
}

}  // namespace cellcal::calib
