#pragma once
// Arm, tool and targets as described by the files. Plain data, SI units and radians; the files use
// millimetres and degrees (calib/files reads and writes them).
//
// Frames. base: the robot's root. Each joint defines the frame after it:
//   T_i = Rz(theta_i) Tz(d_i) Tx(a_i) Rx(alpha_i) Ry(beta_i),   theta_i = sgn_i q_i + offset_i
// with q_i the controller's axis angle (Denavit-Hartenberg with Hayati's beta for parallel axes).
// A linear unit is a prismatic first joint: T_1 = Trans(q_1 along), q_1 in metres.
// flange = base_fixed * T_1 ... T_last * flange_fixed; the tool is mounted on the flange.

#include <Eigen/Geometry>
#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/model/enum_table.h"
#include "calib/model/joint_vector.h"
#include "calib/model/positioner.h"

namespace cellcal::calib {

/// Geometric errors of one joint that may be identified.
enum class JointError { kTheta, kD, kA, kAlpha, kBeta };

/// What makes a joint prismatic: its carriage and all that follows move along `along`. Errors are six
/// functions of its position, each a slope and waves (calib/model/README.md, (1a)).
struct LinearGuide {
  Eigen::Vector3d along = Eigen::Vector3d::UnitX();  ///< unit, preceding frame
  // Prior 1 sigma; 0: known to be exact.
  double scale_sigma = 0.0;           ///< of positioning, m per m
  double direction_sigma_rad = 0.0;   ///< of the direction of travel, across it
  double straightness_sigma_m = 0.0;  ///< rms of the waves of each of the three shifts
  double turn_sigma_rad_m = 0.0;      ///< of roll, pitch and yaw, per metre
  double turn_sigma_rad = 0.0;        ///< rms of the waves of each
};

/// One sine and cosine of a joint's own angle, with a size of its own.
struct JointWave {
  int order = 0;           ///< periods per turn of the joint, from kLowestOrder to kHighestWave
  double sigma_rad = 0.0;  ///< prior of each amplitude, > 0
};

/// Data of a prismatic joint are in metres where the name has _rad: range, speed, position.
struct Joint {
  std::string name;
  std::optional<LinearGuide> guide;  ///< empty: the joint turns
  bool is_prismatic() const { return guide.has_value(); }
  int sign = 1;
  double offset_rad = 0.0;
  double d_m = 0.0;
  double a_m = 0.0;
  double alpha_rad = 0.0;
  double beta_rad = 0.0;
  std::vector<JointError> errors;
  double min_rad = 0.0;
  double max_rad = 0.0;
  double max_speed_rad_s = 0.0;      ///< 0: not stated; required for motion, not for an estimate
  double tolerance_length_m = 0.0;   ///< prior 1 sigma of d and a errors
  double tolerance_angle_rad = 0.0;  ///< prior 1 sigma of theta, alpha and beta errors
  double mass_kg = 0.0;              ///< of the link that this joint moves
  Eigen::Vector3d com_m = Eigen::Vector3d::Zero();  ///< in the joint's frame, after T_i
  double moment_sigma_kg_m = 0.0;  ///< prior of each component of mass_kg * com_m; 0: known
  double compliance_sigma_rad_per_nm = 0.0;  ///< prior of k_i; 0: rigid joint
  double gear_ratio = 1.0;
  std::vector<int> harmonics;       ///< orders h of cos/sin(h gear_i q_i)
  double harmonic_sigma_rad = 0.0;  ///< prior of each amplitude, of order 1
  /// Prior of play_i, half of the play; 0: no play (at_level).
  double play_sigma_rad = 0.0;
  double play_closes_nm = 1.0;            ///< tau_0, at which the play is closed, > 0
  double harmonic_falloff = 0.0;          ///< amplitude of order h scales with h to minus this
  double bearing_sigma_rad_per_nm = 0.0;  ///< prior of the compliance across the axis; 0: rigid
  /// Prior of the joint's function f_i(q_i), rms over a turn; 0: none.
  double function_sigma_rad = 0.0;
  double function_fast_sigma_rad = 0.0;  ///< likewise, of its fast orders (kHighestOrder)
  double function_reach_rad = 0.0;       ///< correlation length of f_i, l_i, > 0
  std::vector<JointWave> waves;  ///< single orders of f_i, ascending, beside the sizes above
  /// Angles that f_i was learnt over; equal: not stated.
  double function_min_rad = 0.0, function_max_rad = 0.0;
  /// Prior of the deflection by a counterbalance (spring, cylinder) that acts about this joint; 0: none.
  double counterbalance_sigma_rad = 0.0;
  /// Prior of the deflection at small loads that a gear of rising stiffness adds; 0: none.
  double stiffening_sigma_rad = 0.0;
  double stiffening_nm = 1000.0;  ///< load at which it is stiff, > 0
  double radius_m = 0.0;          ///< of the capsule about this joint's link; 0: assumed (plan)
};

/// KUKA's option of that name: the controller computes with a measured model of this arm.
enum class AbsoluteAccuracy {
  kNotStated,
  kOff,     ///< switched off, or not there: the controller's model is the nominal one
  kActive,  ///< by a model that this file does not hold
  kInFile   ///< by the model of this file
};

struct Robot {
  std::string name;
  std::string source;
  Eigen::Vector3d gravity_m_s2{0.0, 0.0, -9.81};  ///< in the base frame
  std::vector<Joint> joints;                      ///< base to flange
  Eigen::Isometry3d base_fixed = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d flange_fixed = Eigen::Isometry3d::Identity();
  AbsoluteAccuracy absolute_accuracy = AbsoluteAccuracy::kNotStated;
  std::vector<PositionerAxis> positioner;  ///< base outwards; empty: none

  /// Index of the arm's first joint: 1 behind a linear unit, else 0.
  std::size_t first_turning() const { return !joints.empty() && joints[0].is_prismatic() ? 1 : 0; }
};

/// Unit, against gravity in the base frame; z where the robot file states no gravity.
Eigen::Vector3d up_of(const Robot& robot);

/// Unit of a joint's position in files and interfaces.
struct JointUnit {
  double per_si = 1.0;
  const char* name = "";  ///< "deg", "mm"
};
JointUnit unit_of(const Joint& joint);
/// Throws LinearUnitError for an arm on a linear unit: "WHAT is not possible yet ...: INSTEAD".
void refuse_linear_unit(const Robot& robot, const std::string& what, const std::string& instead);
/// Throws PositionerError for a robot with a positioner, likewise.
void refuse_positioner(const Robot& robot, const std::string& what, const std::string& instead);
/// Both.
void refuse_external_axes(const Robot& robot, const std::string& what, const std::string& instead);
/// Place in the base frame of what the nominal axes with these angles carry, at most all of them.
Eigen::Isometry3d carried_at(const Robot& robot, std::span<const double> positioner_rad);
/// Moment of gravity [N m] of what each axis of the positioner carries, further axes included, about the
/// origin and in the directions of the axis' frame F_j; nominal axes, without an angle at 0.
std::array<Eigen::Vector3d, kMaxPositionerAxes> carried_moment_nm(
    const Robot& robot, std::span<const double> positioner_rad);

/// A robot and its file, as named by a cell file.
struct NamedRobot {
  std::string file;
  Robot robot;
};

struct Tool {
  std::string id;  ///< empty: the cell's only tool
  /// Name in parameters and messages.
  std::string name() const { return id.empty() ? "tool" : id; }
  Eigen::Isometry3d tcp = Eigen::Isometry3d::Identity();  ///< flange to TCP
  Eigen::Vector3d tcp_sigma_m = Eigen::Vector3d::Zero();  ///< 0: known, > 0: estimated
  double mass_kg = 0.0;
  Eigen::Vector3d com_m = Eigen::Vector3d::Zero();  ///< in the flange frame
  double length_m = 0.0;                            ///< cantilever length l_t
  double tip_radius_m = 0.0;
  double deflection_sigma = 0.0;  ///< prior of c_t [1/(N m^2)]; 0: rigid tool
  // Collision shape: a shaft from the flange, and a slim end up to the TCP.
  double radius_m = 0.03;       ///< of the shaft: a torch's neck
  double slim_length_m = 0.06;  ///< contact tip and wire
  double slim_radius_m = 0.004;
};
/// Unit, from the flange to the TCP, in the flange's frame; z of the flange for a TCP on it.
Eigen::Vector3d shaft_of(const Tool& tool);

/// What the tools hold: a gripper's part. The joints bear it in addition to the tools; it bends no
/// tool.
struct Load {
  std::string id;
  double mass_kg = 0.0;
  Eigen::Vector3d com_m = Eigen::Vector3d::Zero();  ///< in the flange frame
};

enum class TargetKind { kSphere, kWire, kPlane, kPoint, kTracker };
constexpr const char* to_string(TargetKind kind) { return own_name(kind); }

/// True if certified lengths can begin or end at targets of this kind.
constexpr bool has_a_centre(TargetKind kind) {
  return kind == TargetKind::kSphere || kind == TargetKind::kWire || kind == TargetKind::kPoint;
}

struct Target {
  std::string id;
  TargetKind kind = TargetKind::kSphere;
  double diameter_m = 0.0;  ///< spheres
  double diameter_sigma_m = 0.0;
  /// Number of the positioner's axes that carry it: 0 the floor, 1 the first, ... Its place is in the
  /// frame of the last of them, else in the base frame.
  int carried_by = 0;
  /// Angles of these axes at which its place was taught; empty: 0, or the limit next to it.
  std::vector<double> taught_rad;
  /// How far off its place may be, 3 sigma. Not in any file: of what a positioner carries, at a setting
  /// (plan).
  double off_m = 0.0;
  bool obstacle_only = false;  ///< an obstacle without planned touches; not in any file
  bool has_centre = false;     ///< centre_m is stated
  Eigen::Vector3d centre_m =
      Eigen::Vector3d::Zero();  ///< base frame, nominal; plane: a point on it
  bool has_box = false;         ///< without a centre: it lies between the two corners
  Eigen::Vector3d low_m = Eigen::Vector3d::Zero(), high_m = Eigen::Vector3d::Zero();
  double centre_sigma_m = 0.0;                        ///< 0: no prior; plane: along its normal
  bool has_normal = false;                            ///< planes: normal is stated
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit, base frame, towards the tips
  double normal_sigma_rad = 0.0;                      ///< 0: no prior
  /// Planes: touches lie inside a circle of this diameter about centre_m; 0: not stated.
  double extent_m = 0.0;
  bool has_stand = true;          ///< a vertical post below; targets with a centre only
  double stand_diameter_m = 0.0;  ///< 0: assumed (plan)
  double stand_height_m = 0.0;    ///< from its lowest point down; 0: assumed (plan)
  /// From the stand to the target, unit; zero: against gravity. Not in any file: of a target on a
  /// positioner, where that stands (plan).
  Eigen::Vector3d stand_up = Eigen::Vector3d::Zero();
};
/// Unit, from the stand to the target.
Eigen::Vector3d stand_up(const Robot& robot, const Target& target);

/// Triangle mesh in its own frame.
struct Mesh {
  std::vector<Eigen::Vector3d> vertices_m;
  std::vector<std::array<int, 3>> triangles;  ///< indices of vertices
};

enum class ObstacleShape { kBox, kCylinder, kMesh };

/// A static object of the cell to be avoided.
struct Obstacle {
  std::string id;
  int carried_by = 0;  ///< as a target's
  double off_m = 0.0;  ///< likewise
  ObstacleShape shape = ObstacleShape::kBox;
  Eigen::Isometry3d frame = Eigen::Isometry3d::Identity();  ///< in the base frame
  Eigen::Vector3d size_m = Eigen::Vector3d::Zero();         ///< boxes, frame in the centre
  double diameter_m = 0.0, height_m = 0.0;  ///< cylinders about z, frame in the centre
  std::string mesh_file;                    ///< as named by the cell file
  std::shared_ptr<const Mesh> mesh;         ///< null until load_meshes() (calib/files)
};

/// A certified distance between two targets' centres.
struct CertifiedLength {
  std::string from, to;
  double length_m = 0.0;
  double sigma_m = 0.0;
  bool is_check = false;  ///< compared with the result and never fitted
};

/// True if the arm can be moved from one posture to the other.
using Passable = std::function<bool(const JointVector& from, const JointVector& to)>;

struct Cell {
  Robot robot;
  Tool tool;                      ///< the first, used for sessions and accuracy figures
  std::vector<Tool> other_tools;  ///< other tips and reflectors mounted on the flange
  std::vector<Load> loads;        ///< states of load besides the bare tools
  std::vector<Target> targets;
  std::vector<CertifiedLength> lengths;
  std::vector<Obstacle> obstacles;
  std::optional<double> floor_m;  ///< lower bound of all heights, against gravity
  /// Largest mean 3-D error of a calibration that may be published; empty: the verdict's default.
  std::optional<double> required_m;
  double touch_sigma_m = 0.0;          ///< 1 sigma of one touch
  double turn_sigma_rad = 0.0;         ///< of a tracker's rotations, each axis; 0: not stated
  double radius_offset_sigma_m = 0.0;  ///< prior of rho, one for the cell; 0: known to be zero
  double latch_delay_s = 0.0;          ///< from contact to the latched angles, as expected
  /// 1 sigma of latch_delay_s; 0: known. Default: over RSI the latch is late by 0.1 to 0.2 ms
  /// (tests/experiments, latch).
  double latch_delay_sigma_s = 2e-4;

  /// True if the arm can move between the postures in a straight line in joint space, obstacles
  /// aside; null: always. Not in any file: set by the driver, which knows the limits of its
  /// interface. Callable from any thread.
  Passable passable;

  /// Index of the target with this id; throws std::out_of_range naming the id.
  std::size_t target_index(const std::string& id) const;
};

}  // namespace cellcal::calib
