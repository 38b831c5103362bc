#include "tests/experiments/true_track.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace cellcal::experiments {

namespace {

using Eigen::AngleAxisd;
using Eigen::Vector3d;

/// Half the distances of the wagons, along and across.
constexpr double kAheadM = 0.35, kBesideM = 0.3;
constexpr double kPinionM = 0.25;  ///< circumference
constexpr int kSamples = 61;

double sign_of(calib::Random& random) { return random.uniform() < 0.5 ? -1.0 : 1.0; }

}  // namespace

double TrueTrack::Rail::raw(double s) const {
  double sum = bend * std::abs(s - joint);
  for (const Wave& wave : waves)
    sum += wave.amplitude * std::sin(2.0 * std::numbers::pi * s / wave.length + wave.phase);
  return sum;
}

TrueTrack::Rail TrueTrack::make_rail(double least, double most, double straightness_m,
                                     calib::Random& random) {
  Rail rail;
  for (int k = 0; k < 3; ++k)
    rail.waves.push_back(
        {random.normal(), random.uniform(2.5, 6.0), random.uniform(0.0, 2.0 * std::numbers::pi)});
  rail.joint = random.uniform(least, most);
  rail.bend = random.normal();
  // Less the straight line that fits best.
  double s0 = 0.0, s1 = 0.0, s2 = 0.0, f0 = 0.0, f1 = 0.0, farthest = 0.0;
  const auto place = [&](int k) { return least + (most - least) * k / (kSamples - 1); };
  for (int k = 0; k < kSamples; ++k) {
    const double s = place(k), f = rail.raw(s);
    s0 += 1.0, s1 += s, s2 += s * s, f0 += f, f1 += s * f;
  }
  rail.slope = (s0 * f1 - s1 * f0) / (s0 * s2 - s1 * s1);
  rail.level = (f0 - rail.slope * s1) / s0;
  for (int k = 0; k < kSamples; ++k) farthest = std::max(farthest, std::abs(rail.at(place(k))));
  rail.scale = straightness_m / farthest;
  return rail;
}

TrueTrack::TrueTrack(const calib::Joint& joint, const TrackErrors& errors, calib::Random& random) {
  axes_.col(0) = joint.guide->along;
  axes_.col(2) = Vector3d::UnitZ();
  axes_.col(1) = axes_.col(2).cross(axes_.col(0));
  middle_ = (joint.min_rad + joint.max_rad) / 2.0;
  scale_ = sign_of(random) * errors.scale;
  pitch_rad_m_ = sign_of(random) * errors.pitch_rad_m;
  across_rad_ = errors.direction_rad * random.normal();
  above_rad_ = errors.direction_rad * random.normal();
  pinion_m_ = errors.pinion_m;
  pinion_phase_ = random.uniform(0.0, 2.0 * std::numbers::pi);
  side_ = make_rail(joint.min_rad, joint.max_rad, errors.straightness_m, random);
  left_ = make_rail(joint.min_rad, joint.max_rad, errors.straightness_m, random);
  right_ = left_;  // milled together, levelled separately
  const Rail apart = make_rail(joint.min_rad, joint.max_rad, 0.3 * errors.straightness_m, random);
  right_.waves.insert(right_.waves.end(), {apart.waves[0].amplitude * apart.scale / right_.scale,
                                           apart.waves[0].length, apart.waves[0].phase});
}

Eigen::Isometry3d TrueTrack::carriage(double s) const {
  const auto mean = [&](const Rail& rail) {
    return (rail.at(s + kAheadM) + rail.at(s - kAheadM)) / 2.0;
  };
  const auto lean = [&](const Rail& rail) {
    return (rail.at(s + kAheadM) - rail.at(s - kAheadM)) / (2.0 * kAheadM);
  };
  const double off = s - middle_;
  const double turned = 2.0 * std::numbers::pi * s / kPinionM + pinion_phase_;
  const Vector3d shift(s + scale_ * off + pinion_m_ * std::sin(turned),
                       across_rad_ * off + mean(side_),
                       above_rad_ * off + (mean(left_) + mean(right_)) / 2.0);
  const double roll = (mean(left_) - mean(right_)) / (2.0 * kBesideM);
  const double pitch = pitch_rad_m_ * off - (lean(left_) + lean(right_)) / 2.0;
  Eigen::Isometry3d carriage = Eigen::Isometry3d::Identity();
  carriage.translation() = axes_ * shift;
  carriage.linear() = axes_ *
                      (AngleAxisd(lean(side_), Vector3d::UnitZ()) *
                       AngleAxisd(pitch, Vector3d::UnitY()) * AngleAxisd(roll, Vector3d::UnitX()))
                          .toRotationMatrix() *
                      axes_.transpose();
  return carriage;
}

}  // namespace cellcal::experiments
