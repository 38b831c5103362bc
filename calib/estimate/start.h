#pragma once
// Positions of the targets as seen with the nominal arm: the starting point of the estimate, and
// the sphere by which the nominal model is assessed.

#include <Eigen/Geometry>
#include <cstddef>
#include <functional>
#include <vector>

namespace cellcal::calib {

Eigen::Vector3d mean_of_points(const std::vector<Eigen::Vector3d>& points);

struct SphereFit {
  Eigen::Vector3d centre_m = Eigen::Vector3d::Zero();
  bool determined = false;  ///< the points span a sphere; else, unstated, it is their mean
};

/// Prior knowledge of the position of a sphere or wire, in addition to the points.
struct CentreHints {
  const Eigen::Vector3d* stated_m = nullptr;
  double stated_sigma_m = 0.0;  ///< 0: starting value only
  /// Direction towards the tool: the centre is on the opposite side. 0: unknown.
  Eigen::Vector3d outwards = Eigen::Vector3d::Zero();
};

/// True if two touches can be of the same target.
using Together = std::function<bool(std::size_t, std::size_t)>;

/// Largest set, among `count` touches, of those that can be of the same target as one of them.
/// Touches labelled with a wrong target are far apart from the others and would bias the start.
std::vector<std::size_t> of_one_target(std::size_t count, const Together& together);

/// Usual position error of a nominal arm, and thus of the points [m].
inline constexpr double kNominalOffM = 2e-3;

/// Centre of the spheres with radius `radius_m[i]` about each point. Points on one side of a sphere
/// fit the mirrored sphere nearly as well, and a few hardly determine it. Gauss-Newton therefore
/// starts from the linear fit (differences of |p|^2), its mirror image and the stated position; the
/// most likely result by the hints and points of sigma `point_sigma_m` is returned. Beyond
/// kNominalOffM the cost of a point grows linearly. Points in a plane, or fewer than four, do not
/// determine the centre, which then stays near the stated one.
SphereFit fit_centre(const std::vector<Eigen::Vector3d>& points_m,
                     const std::vector<double>& radius_m, const CentreHints& hints = {},
                     double point_sigma_m = kNominalOffM);

struct PlaneFit {
  Eigen::Vector3d middle_m = Eigen::Vector3d::Zero();  ///< mean of the points, on the plane
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();   ///< unit, of either sign
  bool determined = false;  ///< the points are spread in two directions, and flat
};

/// Total least squares plane.
PlaneFit fit_plane(const std::vector<Eigen::Vector3d>& points_m);

struct FrameFit {
  Eigen::Isometry3d frame = Eigen::Isometry3d::Identity();  ///< readings to points
  Eigen::Vector3d middle_m = Eigen::Vector3d::Zero();       ///< mean of the readings
  bool determined = false;                                  ///< the readings are not in a line
};

/// Rigid motion that maps `readings_m` to `points_m`, by least squares.
FrameFit fit_frame(const std::vector<Eigen::Vector3d>& readings_m,
                   const std::vector<Eigen::Vector3d>& points_m);

}  // namespace cellcal::calib
