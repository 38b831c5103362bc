#pragma once
// Where the targets are, seen with the nominal arm: the starting point of the estimate, and the
// sphere against which the nominal model is judged.

#include <Eigen/Geometry>
#include <cstddef>
#include <functional>
#include <vector>

namespace cellcal::calib {

struct SphereFit {
  Eigen::Vector3d centre_m = Eigen::Vector3d::Zero();
  bool determined = false;  ///< the points span a sphere; otherwise, unstated, it is their mean
};

/// What is known of a sphere's or wire's place beside the points.
struct CentreHints {
  const Eigen::Vector3d* stated_m = nullptr;
  double stated_sigma_m = 0.0;  ///< 0: no more than where to begin
  /// To the side that the tool comes from: the centre lies on the other. 0: unknown.
  Eigen::Vector3d outwards = Eigen::Vector3d::Zero();
};

/// Whether two touches can be of the same target.
using Together = std::function<bool(std::size_t, std::size_t)>;

/// Of `count` touches those that can be of the same target as one of them, which has the most of
/// the kind: touches that carry another target's name lie apart and would draw the start away.
std::vector<std::size_t> of_one_target(std::size_t count, const Together& together);

/// What a nominal arm is wrong by, and points with it.
inline constexpr double kNominalOffM = 2e-3;

/// Centre of the sphere with radius `radius_m[i]` about each point. Points on one side of a sphere
/// fit one on the other side of them nearly as well, and a few hardly hold it at all: so
/// Gauss-Newton begins at the linear fit (differences of |p|^2), behind the points as in a mirror,
/// and where it is stated to be, and what the hints and points that are wrong by `point_sigma_m`
/// make the likeliest is taken. Gross errors pull by their side alone. Points that lie in a plane
/// or fewer than four do not determine it: it stays near where it was stated.
SphereFit fit_centre(const std::vector<Eigen::Vector3d>& points_m,
                     const std::vector<double>& radius_m, const CentreHints& hints = {},
                     double point_sigma_m = kNominalOffM);

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
