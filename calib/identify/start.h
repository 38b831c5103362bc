#pragma once
// Where the targets are, seen with the nominal arm: the starting point of the estimate, and the
// sphere against which the nominal model is judged.

#include <Eigen/Geometry>
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

struct PlaneFit {
  Eigen::Vector3d middle_m = Eigen::Vector3d::Zero();  ///< mean of the points, on the plane
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();   ///< unit, of either sign
  bool determined = false;  ///< the points are spread in two directions, and flat
};

/// Total least squares.
PlaneFit fit_plane(const std::vector<Eigen::Vector3d>& points_m);

struct FrameFit {
  Eigen::Isometry3d frame = Eigen::Isometry3d::Identity();  ///< readings to points
  Eigen::Vector3d middle_m = Eigen::Vector3d::Zero();       ///< mean of the readings
  bool determined = false;                                  ///< the readings are not in a line
};

/// The rigid motion that brings `readings_m` nearest to `points_m`.
FrameFit fit_frame(const std::vector<Eigen::Vector3d>& readings_m,
                   const std::vector<Eigen::Vector3d>& points_m);

}  // namespace cellcal::calib
