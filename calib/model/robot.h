#pragma once
// The arm, the tool and what is touched, as the files describe them. Plain data, SI units and
// radians; the files hold millimetres and degrees (calib/files reads and writes them).
//
// Frames. base: the robot's root. Each joint carries the frame behind it:
//   T_i = Rz(theta_i) Tz(d_i) Tx(a_i) Rx(alpha_i) Ry(beta_i),   theta_i = sgn_i q_i + offset_i
// with q_i the controller's axis angle (Denavit-Hartenberg with Hayati's beta for parallel axes).
// flange = base_fixed * T_1 ... T_last * flange_fixed; the tool sits on the flange.

#include <Eigen/Geometry>
#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "calib/model/joint_vector.h"

namespace cellcal::calib {

/// Geometric errors of one joint that may be identified.
enum class JointError { kTheta, kD, kA, kAlpha, kBeta };

struct Joint {
  std::string name;
  int sign = 1;
  double offset_rad = 0.0;
  double d_m = 0.0;
  double a_m = 0.0;
  double alpha_rad = 0.0;
  double beta_rad = 0.0;
  std::vector<JointError> errors;
  double min_rad = 0.0;
  double max_rad = 0.0;
  double max_speed_rad_s = 0.0;      ///< 0: not stated; motion needs it, an estimate does not
  double tolerance_length_m = 0.0;   ///< prior 1 sigma of d and a errors
  double tolerance_angle_rad = 0.0;  ///< prior 1 sigma of theta, alpha and beta errors
  double mass_kg = 0.0;              ///< of the link that this joint moves
  Eigen::Vector3d com_m = Eigen::Vector3d::Zero();  ///< in the joint's frame, behind T_i
  double moment_sigma_kg_m = 0.0;  ///< prior of each component of mass_kg * com_m; 0: known
  double compliance_sigma_rad_per_nm = 0.0;  ///< prior of k_i; 0: joint taken as stiff
  double gear_ratio = 1.0;
  std::vector<int> harmonics;       ///< orders h of cos/sin(h gear_i q_i)
  double harmonic_sigma_rad = 0.0;  ///< prior of each amplitude, of order 1
  /// Prior of play_i, half of the play; 0: the joint has none (at_level).
  double play_sigma_rad = 0.0;
  double play_closes_nm = 1.0;    ///< tau_0 that closes it, > 0
  double harmonic_falloff = 0.0;  ///< that of order h is less by h to the power of this
  /// Prior of the joint's function f_i(q_i), rms over a turn; 0: it has none.
  double function_sigma_rad = 0.0;
  double function_reach_rad = 0.0;  ///< over which f_i is alike, l_i, > 0
  /// Angles that f_i was learnt over; equal: not stated.
  double function_min_rad = 0.0, function_max_rad = 0.0;
  double radius_m = 0.0;          ///< of the capsule about this joint's link; 0: assumed (plan)
};

struct Robot {
  std::string name;
  std::string source;
  Eigen::Vector3d gravity_m_s2{0.0, 0.0, -9.81};  ///< in the base frame
  std::vector<Joint> joints;                      ///< base to flange
  Eigen::Isometry3d base_fixed = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d flange_fixed = Eigen::Isometry3d::Identity();
};

/// A robot and its file, as a cell file names it.
struct NamedRobot {
  std::string file;
  Robot robot;
};

struct Tool {
  std::string id;  ///< empty: the cell has one, which needs none
  /// As its parameters and messages name it.
  std::string name() const { return id.empty() ? "tool" : id; }
  Eigen::Isometry3d tcp = Eigen::Isometry3d::Identity();  ///< flange to TCP
  Eigen::Vector3d tcp_sigma_m = Eigen::Vector3d::Zero();  ///< 0: known, > 0: estimated
  double mass_kg = 0.0;
  Eigen::Vector3d com_m = Eigen::Vector3d::Zero();  ///< in the flange frame
  double length_m = 0.0;                            ///< cantilever length l_t
  double tip_radius_m = 0.0;
  double deflection_sigma = 0.0;  ///< prior of c_t [1/(N m^2)]; 0: tool taken as stiff
  // What keeps clear of things: a shaft from the flange, and a slim end up to the TCP.
  double radius_m = 0.03;       ///< of the shaft: a torch's neck
  double slim_length_m = 0.06;  ///< contact tip and wire
  double slim_radius_m = 0.004;
};

enum class TargetKind { kSphere, kWire, kPlane, kPoint, kTracker };

/// Whether certified lengths can begin or end at it.
constexpr bool has_a_centre(TargetKind kind) {
  return kind == TargetKind::kSphere || kind == TargetKind::kWire || kind == TargetKind::kPoint;
}

struct Target {
  std::string id;
  TargetKind kind = TargetKind::kSphere;
  double diameter_m = 0.0;  ///< spheres
  double diameter_sigma_m = 0.0;
  bool only_in_the_way = false;  ///< no touch of it is planned; no file says so
  bool has_centre = false;       ///< centre_m is stated
  Eigen::Vector3d centre_m =
      Eigen::Vector3d::Zero();  ///< base frame, nominal; plane: a point on it
  bool has_box = false;         ///< without a centre: it is somewhere between the two corners
  Eigen::Vector3d low_m = Eigen::Vector3d::Zero(), high_m = Eigen::Vector3d::Zero();
  double centre_sigma_m = 0.0;  ///< 0: no prior, the touches decide; plane: along its normal
  bool has_normal = false;      ///< planes: normal is stated
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit, base frame, to the side of the tips
  double normal_sigma_rad = 0.0;                      ///< 0: no prior, the touches decide
  /// Planes: it may be touched inside a circle of this diameter about centre_m; 0: not stated.
  double extent_m = 0.0;
  bool has_stand = true;          ///< a vertical post below it; of what has a centre
  double stand_diameter_m = 0.0;  ///< 0: assumed (plan)
  double stand_height_m = 0.0;    ///< from its lowest point down; 0: assumed (plan)
};

/// Surface of triangles, in its own frame.
struct Mesh {
  std::vector<Eigen::Vector3d> vertices_m;
  std::vector<std::array<int, 3>> triangles;  ///< indices of vertices
};

enum class ObstacleShape { kBox, kCylinder, kMesh };

/// Something of the cell that stands still and must not be hit.
struct Obstacle {
  std::string id;
  ObstacleShape shape = ObstacleShape::kBox;
  Eigen::Isometry3d frame = Eigen::Isometry3d::Identity();  ///< in the base frame
  Eigen::Vector3d size_m = Eigen::Vector3d::Zero();         ///< boxes, frame in the middle
  double diameter_m = 0.0, height_m = 0.0;  ///< cylinders about z, frame in the middle
  std::string mesh_file;                    ///< as the cell file names it
  std::shared_ptr<const Mesh> mesh;         ///< null until load_meshes() (calib/files)
};

/// A certified distance between two targets' centres.
struct CertifiedLength {
  std::string from, to;
  double length_m = 0.0;
  double sigma_m = 0.0;
};

/// Whether the arm can be led from one posture to another.
using Passable = std::function<bool(const JointVector& from, const JointVector& to)>;

struct Cell {
  Robot robot;
  Tool tool;                      ///< the first, which sessions touch with and figures are about
  std::vector<Tool> other_tools;  ///< tips and reflectors that are on the flange beside it
  std::vector<Target> targets;
  std::vector<CertifiedLength> lengths;
  std::vector<Obstacle> obstacles;
  std::optional<double> floor_m;  ///< height against gravity that nothing goes below
  /// Mean 3-D error that a calibration may be published with; without it the verdict's usual one.
  std::optional<double> required_m;
  double touch_sigma_m = 0.0;          ///< 1 sigma of one touch
  double turn_sigma_rad = 0.0;         ///< of a tracker's turns, about each axis; 0: not stated
  double radius_offset_sigma_m = 0.0;  ///< prior of rho, one for the cell; 0: known to be zero
  double latch_delay_s = 0.0;  ///< how long after the contact its angles are latched, as expected
  /// 1 sigma of it; 0: known. Where nothing is stated: over RSI the latch is late by 0.1 to 0.2 ms
  /// (tests/experiments, latch).
  double latch_delay_sigma_s = 2e-4;

  /// Whether the arm can be led from one posture straight in joint space to the other, were there
  /// nothing to hit; null: always. No file says it: whoever drives the arm knows what its wire
  /// cannot carry. Any thread.
  Passable passable;

  /// Index of the target with this id; throws std::out_of_range naming the id.
  std::size_t target_index(const std::string& id) const;
};

// Kinds of targets, as files name them.

const char* to_string(TargetKind kind);
/// Of a name that is none, nothing.
std::optional<TargetKind> target_kind(std::string_view name);

}  // namespace cellcal::calib
