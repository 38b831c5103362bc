#pragma once
// Static objects of a cell: spheres, stands, planes within their extent, obstacles, the floor.
// Distances from a capsule's axis; for boxes, cylinders and meshes by FCL.

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "calib/model/robot.h"
#include "calib/plan/bodies.h"

namespace cellcal::calib {

/// Stand of a target: a cylinder about z of `frame`, with the frame in its centre.
struct Post {
  std::size_t target = 0;
  Eigen::Isometry3d frame = Eigen::Isometry3d::Identity();
  double radius_m = 0.0, length_m = 0.0;
};
/// Stands of all targets with a stated place and a stand; dimensions as stated or assumed.
std::vector<Post> posts_of(const Cell& cell);

class Surroundings {
 public:
  /// Throws PlanError if the mesh of an obstacle is not loaded.
  explicit Surroundings(const Cell& cell);
  Surroundings(Surroundings&&) noexcept;
  ~Surroundings();

  std::size_t size() const;
  /// "sphere S1", "the stand of S1", "obstacle table", "the floor"
  const std::string& words(std::size_t i) const;
  /// The target that it is or supports; -1 for others.
  int target(std::size_t i) const;
  /// How far off its place may be at this setting of a positioner, 3 sigma; 0 without one.
  double off_m(std::size_t i) const;
  /// Centre of its bounding ball; empty for the floor.
  std::optional<Eigen::Vector3d> middle_m(std::size_t i) const;
  /// Lower bound of bound_m() for an axis of this centre and half this length; faster still.
  double coarse_bound_m(std::size_t i, const Eigen::Vector3d& middle, double half_m) const;
  /// Lower bound of the distance of the axis from the object; fast.
  double bound_m(std::size_t i, const Segment& axis) const;
  /// Upper bound of distance_m() - bound_m(); 0: the bound is the distance.
  double bound_gap_m(std::size_t i) const;
  /// The distance; any value above `most_m` may represent a larger distance. 0: intersection.
  double distance_m(std::size_t i, const Segment& axis, double most_m) const;

 private:
  struct Thing;
  std::vector<Thing> things_;
};

}  // namespace cellcal::calib
