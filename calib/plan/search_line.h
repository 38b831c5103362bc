#pragma once
// A search for a sphere as executed: straight in joint space, and therefore curved in space. An arm
// of 1.1 m bows by 1.5 mm over 9 cm, and the region of a sphere may be 20 cm wide: the ends are
// offset from the line by half of the bow, to the opposite side, so that the tip deviates to both
// sides, and the search may be longer by a factor of 1.4.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "calib/model/kinematics.h"
#include "calib/model/robot.h"
#include "calib/plan/centre_particles.h"

namespace cellcal::calib {

/// Maximum deviation of the tip from its line.
inline constexpr double kMostBowM = 0.0015;

struct LineToLead {
  Eigen::Vector3d aim_m, normal;  ///< as in SearchLine, base frame
  Eigen::Matrix3d orientation;    ///< of the TCP
  JointVector near;               ///< initial posture for the inverse kinematics
};

/// Along the normal from the aim, the farthest first.
struct LineEnds {
  double clear_m, standoff_m, end_m;
};

struct LedSearch {
  Eigen::Vector3d from, to;  ///< the line, from the stand-off to the end
  JointVector clear, standoff, end;
  double expected_m = 0.0;  ///< expected distance to contact; set by the caller
};

/// Unit, from the flange to the tip, in the TCP's frame.
Eigen::Vector3d shaft_in_tool(const Tool& tool);

class LineLeader {
 public:
  /// Refers to both.
  LineLeader(const ArmModel& arm, const Tool& tool, double limit_margin_rad)
      : arm_(arm), tool_(tool), margin_rad_(limit_margin_rad) {}

  /// Empty if the line is out of reach or not followed: tip within kMostBowM, end of the shaft
  /// within twice that, no joint far from its start.
  std::optional<LedSearch> lead(const LineToLead& line, const LineEnds& ends) const;
  /// Deviation of the tip at the middle of a move from the straight line between its ends.
  Eigen::Vector3d bow_m(const JointVector& from, const JointVector& to) const;

 private:
  std::optional<JointVector> posture(const LineToLead& line, double outside_m,
                                     const Eigen::Vector3d& beside, const JointVector& near) const;
  Eigen::Vector3d on_move(const JointVector& from, const JointVector& to, double share,
                          double behind_tip_m) const;
  bool keeps_to(const LineToLead& line, const LedSearch& led) const;

  const ArmModel& arm_;
  const Tool& tool_;
  double margin_rad_;
};

// Allowed depth of a search for a sphere, and its probability of contact.

struct SearchLine {
  Eigen::Vector3d aim_m;   ///< a point on the line, base frame
  Eigen::Vector3d normal;  ///< unit, opposite to the search direction
  Eigen::Vector3d shaft;   ///< unit, from the shaft's end to the tip
};

/// Stand of the sphere: a post straight below its centre, of any length.
struct SearchStand {
  Eigen::Vector3d up;     ///< unit
  double radius_m = 0.0;  ///< 0: none
};

struct SearchDepth {
  double end_m = 0.0;  ///< of the tip, from the aim along the normal; negative: beyond the aim
  double share = 0.0;  ///< of the places whose sphere the tip meets before the end
  /// Per place, the contact position of the tip from the aim along the normal; kNeverM: not before
  /// the end.
  std::vector<double> met_m{};
};

inline constexpr double kNeverM = -std::numeric_limits<double>::max();

/// The tip may advance while the shaft is clear of every sphere that the tip does not certainly
/// meet first (by 5 mm, for inaccurate arms), tip and shaft are clear of the stands of such
/// spheres, and contact is still possible. `radius_m`: of the sphere.
SearchDepth search_depth(const SearchLine& line, const std::vector<Eigen::Vector3d>& places,
                         double radius_m, const SearchStand& stand, const Tool& tool);

/// Expected reduction of the variance of the centre [m^2, sum of three components] by the outcome
/// of the search, contact with depth or none, with an error `sigma_m` of the depth.
double expected_reduction_m2(const SearchDepth& depth, const std::vector<Eigen::Vector3d>& places,
                             double sigma_m);

/// Causes of touches that do not lie on one sphere.
std::string advice_after_touches(double arm_sigma_m);

// A sphere being searched for: what its touches and the lines without contact leave of its place. All places in
// the base frame [m].

/// Error of a nominal arm beyond that in the particles.
inline constexpr double kWrongM = 0.005;

/// Ball that contains the sphere at any possible place: its own radius plus `beyond_m`.
struct Ball {
  Eigen::Vector3d centre_m;
  double beyond_m;
};
/// Without any touch.
Ball ball_of_prior(const CentreParticles& particles);

struct Sought {
  std::size_t target;         ///< index into the cell
  double radius_m;            ///< sum of sphere and tip
  Eigen::Isometry3d carrier;  ///< frame of its stated place
  CentreParticles particles;
  Ball ball = ball_of_prior(particles);
  std::vector<Eigen::Vector3d> tips{};
  std::vector<double> seen_rad{};  ///< angles of the positioner at the last touch
  int lines = 0;
  bool found = false;
  Eigen::Vector3d centre_m = Eigen::Vector3d::Zero();
  double sigma_m = 0.0;  ///< the largest

  /// The tip moved from `from` and met it at `tip`. Throws PlanError where so many touches have to be
  /// enough, and are not; `stated` for its words.
  void touched(const Eigen::Vector3d& from, const Eigen::Vector3d& tip, const Target& stated);
  /// Largest sigma of a found centre. Of many touches, after which further ones add little, that with which the searches of
  /// a calibration still meet the sphere.
  double enough_m() const;
  /// Its ball under the current knowledge. Before the first contact it contains the whole initial
  /// region, including excluded places; afterwards it shrinks, barely exceeding the previous one,
  /// whose boundary the arm has just left.
  void shrink_ball();
};

}  // namespace cellcal::calib
