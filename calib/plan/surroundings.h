#pragma once
// What stands still in a cell: spheres, stands, planes as far as they go, obstacles, the floor.
// Distances of a capsule's axis from each; of boxes, cylinders and meshes by FCL.

#include <memory>
#include <string>
#include <vector>

#include "calib/model/robot.h"
#include "calib/plan/bodies.h"

namespace cellcal::calib {

/// Upwards; along z where there is no gravity.
Eigen::Vector3d up_of(const Robot& robot);

/// The post that a target stands on: a cylinder about z of `frame`, which lies in its middle.
struct Post {
  std::size_t target = 0;
  Eigen::Isometry3d frame = Eigen::Isometry3d::Identity();
  double radius_m = 0.0, length_m = 0.0;
};
/// Of all targets that state where they are, and stand; as stated or assumed.
std::vector<Post> posts_of(const Cell& cell);

class Surroundings {
 public:
  /// Throws PlanError where the mesh of an obstacle was not read.
  explicit Surroundings(const Cell& cell);
  Surroundings(Surroundings&&) noexcept;
  ~Surroundings();

  std::size_t size() const;
  /// "sphere S1", "the stand of S1", "obstacle table", "the floor"
  const std::string& words(std::size_t i) const;
  /// The target that it is or carries; -1 for others.
  int target(std::size_t i) const;
  /// Not more than bound_m() of an axis of this middle and half this length; quicker still.
  double far_off_m(std::size_t i, const Eigen::Vector3d& middle, double half_m) const;
  /// Not more than the distance of the axis from the thing; quick.
  double bound_m(std::size_t i, const Segment& axis) const;
  /// By how much distance_m() may be above bound_m() at most; 0: the bound is the distance.
  double doubt_m(std::size_t i) const;
  /// The distance; any value above `most_m` may stand for whatever is further. 0: they meet.
  double distance_m(std::size_t i, const Segment& axis, double most_m) const;

 private:
  struct Thing;
  std::vector<Thing> things_;
};

}  // namespace cellcal::calib
