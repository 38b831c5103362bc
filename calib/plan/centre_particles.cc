#include "calib/plan/centre_particles.h"

#include <algorithm>
#include <cmath>

namespace cellcal::calib {

namespace {

using Eigen::Vector3d;

constexpr int kPlaces = 4000;
constexpr double kUsualSigmaM = 0.010;
constexpr double kCut = 3.0;  ///< sigmas
/// Jitter of particles drawn more than once, relative to the error of the arm.
constexpr double kApart = 0.3;

}  // namespace

double CentreParticles::distance_m(const Vector3d& point, const Vector3d& from,
                                   const Vector3d& to) {
  const Vector3d line = to - from;
  const double length2 = line.squaredNorm();
  const double share =
      length2 > 0.0 ? std::clamp((point - from).dot(line) / length2, 0.0, 1.0) : 0.0;
  return (point - from - share * line).norm();
}

CentreParticles::CentreParticles(const Target& target, double radius_m, double arm_sigma_m,
                                 unsigned seed, const Eigen::Isometry3d& frame, double off_m)
    : radius_m_(radius_m),
      arm_sigma_m_(arm_sigma_m),
      random_(seed),
      has_box_(!target.has_centre),
      box_axes_(frame.linear()) {
  places_.reserve(kPlaces);
  if (target.has_centre) {
    prior_mean_ = frame * target.centre_m;
    const double stated_m = target.centre_sigma_m > 0.0 ? target.centre_sigma_m : kUsualSigmaM;
    prior_sigma_m_ = std::hypot(stated_m, off_m / kCut);
    while (places_.size() < kPlaces) {
      Vector3d draw;
      for (double& component : draw) component = random_.normal();
      if (draw.norm() < kCut) places_.push_back(prior_mean_ + prior_sigma_m_ * draw);
    }
    return;
  }
  const Vector3d low = target.low_m.array() - off_m, high = target.high_m.array() + off_m;
  prior_mean_ = frame * ((low + high) / 2.0);
  half_box_m_ = (high - low) / 2.0;
  prior_sigma_m_ =
      std::max(half_box_m_.norm(), region_tolerance_m());  // also of a box without extent
  while (places_.size() < kPlaces) {
    Vector3d place;
    for (int k = 0; k < 3; ++k) place[k] = random_.uniform(low[k], high[k]);
    places_.push_back(frame * place);
  }
}

void CentreParticles::hit(const Vector3d& from, const Vector3d& tip) {
  // Places that would have been met before the last sigmas of the line.
  const double length = (tip - from).norm();
  const double clear_m = std::max(0.0, length - certain_miss_m());
  const Vector3d last = length > 0.0 ? Vector3d(from + clear_m / length * (tip - from)) : from;
  std::vector<double> weight(places_.size());
  for (std::size_t k = 0; k < places_.size(); ++k) {
    const double off = ((places_[k] - tip).norm() - radius_m_) / arm_sigma_m_;
    const bool earlier = distance_m(places_[k], from, last) < radius_m_ - certain_miss_m();
    weight[k] = earlier ? 0.0 : std::exp(-0.5 * off * off);  // (70)
  }
  resample(weight);
}

void CentreParticles::miss(const Vector3d& from, const Vector3d& to) {
  missed_.push_back({from, to});
  std::erase_if(places_, [&](const Vector3d& place) {
    const double inside_m = radius_m_ - distance_m(place, from, to);
    if (inside_m <= 0.0) return false;
    if (inside_m > certain_miss_m()) return true;
    return random_.uniform() >= normal_above(inside_m / arm_sigma_m_);  // (70a)
  });
  if (!places_.empty() && places_.size() < kPlaces / 2)
    resample(std::vector<double>(places_.size(), 1.0));
}

double CentreParticles::bound_m() const {
  return has_box_ ? half_box_m_.norm() + std::sqrt(3.0) * region_tolerance_m()
                  : kCut * prior_sigma_m_ + region_tolerance_m();
}

bool CentreParticles::is_possible(const Vector3d& place) const {
  for (const auto& [from, to] : missed_)
    if (distance_m(place, from, to) < radius_m_ - certain_miss_m()) return false;
  const Vector3d off = box_axes_.transpose() * (place - prior_mean_);
  if (has_box_) return ((off.cwiseAbs() - half_box_m_).array() <= region_tolerance_m()).all();
  return off.norm() <= kCut * prior_sigma_m_ + region_tolerance_m();
}

/// Systematic resampling by weight, with the initial number of particles.
void CentreParticles::resample(const std::vector<double>& weight) {
  double sum = 0.0;
  for (const double w : weight) sum += w;
  if (!(sum > 0.0)) {
    places_.clear();
    return;
  }
  std::vector<Vector3d> drawn;
  drawn.reserve(kPlaces);
  double passed = 0.0, at = random_.uniform() * sum / kPlaces;
  for (std::size_t k = 0; k < weight.size(); ++k) {
    for (passed += weight[k]; at < passed && drawn.size() < kPlaces; at += sum / kPlaces) {
      Vector3d apart;
      for (double& component : apart) component = kApart * arm_sigma_m_ * random_.normal();
      // Repeated jitter must not move particles to impossible places.
      drawn.push_back(is_possible(places_[k] + apart) ? Vector3d(places_[k] + apart) : places_[k]);
    }
  }
  places_ = std::move(drawn);
}

Vector3d CentreParticles::mean() const {
  Vector3d sum = Vector3d::Zero();
  for (const Vector3d& place : places_) sum += place;
  return places_.empty() ? prior_mean_ : Vector3d(sum / static_cast<double>(places_.size()));
}

Eigen::Matrix3d CentreParticles::covariance() const {
  const Vector3d middle = mean();
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const Vector3d& place : places_) sum += (place - middle) * (place - middle).transpose();
  return places_.empty() ? sum : Eigen::Matrix3d(sum / static_cast<double>(places_.size()));
}

double CentreParticles::reach_m(const Vector3d& from) const {
  double farthest = 0.0;
  for (const Vector3d& place : places_) farthest = std::max(farthest, (place - from).norm());
  return farthest;
}

}  // namespace cellcal::calib
