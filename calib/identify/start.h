#pragma once
// Where the targets are, seen with the nominal arm: the starting point of the estimate, and the
// sphere against which the nominal model is judged.

#include <Eigen/Core>
#include <vector>

namespace cellcal::calib {

struct SphereFit {
  Eigen::Vector3d centre_m = Eigen::Vector3d::Zero();
  bool determined = false;  ///< the points span a sphere; otherwise centre_m is their mean
};

/// Centre of the sphere with radius `radius_m[i]` about each point: linear fit (differences of
/// |p|^2), then Gauss-Newton on the distances. Points that lie in a plane or fewer than four do
/// not determine it. `guess`: a stated centre, used where they do not.
SphereFit fit_centre(const std::vector<Eigen::Vector3d>& points_m,
                     const std::vector<double>& radius_m, const Eigen::Vector3d* guess);

/// The same with the stated place as a prior (1 sigma, 0: none) and points that are each wrong by
/// about `point_sigma_m`: where the points hardly hold the centre, it stays where it was said to
/// be.
Eigen::Vector3d fit_centre_near(const std::vector<Eigen::Vector3d>& points_m,
                                const std::vector<double>& radius_m, double point_sigma_m,
                                const Eigen::Vector3d& place_m, double place_sigma_m);

}  // namespace cellcal::calib
