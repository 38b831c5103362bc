#pragma once
// Independent collision check of a plan: points along the axes of links and tool, and their
// distances from spheres, posts, boxes and triangles. Shares nothing with the planner's clearance
// except the arm's forward kinematics and the documented radii.

#include <limits>
#include <string>
#include <vector>

#include "calib/model/kinematics.h"
#include "calib/plan/plan.h"

namespace cellcal::calib::testing {

/// Smallest distance [m]; negative: collision. With a description.
struct Nearest {
  double gap_m = std::numeric_limits<double>::max();
  std::string words;
};

struct Approach {
  Nearest tip;   ///< slim end and ball, from the cell
  Nearest body;  ///< links and shaft, from the cell
  Nearest self;  ///< hand and tool, from column and upper arm

  void take(const Approach& other);
};

/// Guaranteed within a move, half the planner's margins; points on an axis are 2 mm apart.
inline constexpr double kPromisedTipM = 0.0034, kPromisedBodyM = 0.0098;

class Collisions {
 public:
  explicit Collisions(const Cell& cell);

  /// `touched`: target that the tip may touch, with its stand; -1: none. `past`: the tip only gets
  /// there with the target farther off, which is ignored.
  Approach at(const JointVector& q, int touched = -1, bool past = false) const;
  /// Every 0.2 deg of the joint that turns most, or `step_rad`.
  Approach along(const JointVector& from, const JointVector& to, int touched = -1,
                 double step_rad = 0.0035, bool past = false) const;
  /// Three lines across the triangle in which the arm may pass the way-point `at`.
  Approach across(const JointVector& from, const JointVector& at, const JointVector& to,
                  const Corner& corner) const;
  /// Everything that may be executed: paths, corners, search lines, retreats, the return path.
  Approach of(const Plan& plan) const;

 private:
  struct Shape {
    enum class Kind { kBall, kPost, kBox, kTriangles, kFloor } kind;
    std::string words;
    int target;
    Eigen::Isometry3d frame;
    Eigen::Vector3d
        half;  // of a box; of a post: radius, radius, half its height; of a ball: radius
    std::vector<Eigen::Vector3d> corners;  // three by three
  };
  struct Rod {
    std::string words;
    double radius_m;
    bool tip, moves;
    int joint;
    Eigen::Vector3d a, b;
  };
  static double distance_m(const Shape& shape, const Eigen::Vector3d& point);
  std::vector<Rod> rods(const JointVector& q) const;

  Cell cell_;
  ArmModel arm_;
  std::vector<Shape> shapes_;
};

}  // namespace cellcal::calib::testing
