#pragma once
// Kinematics of the real arm as a function of its errors, with analytic derivatives.
//
// Model (calib/model/README.md, (1) to (7)). With the errors x put into the exact chain:
//   theta_i = sgn_i q_i + offset_i + dtheta_i + k_i tau_i(q) + play_i tanh(tau_i(q) / tau_0i)
//             + soft_i tanh(tau_i(q) / tau_si) + sum_h [wc_ih cos(h gear_i q_i) + ws_ih sin(h gear_i q_i)]
//             + f_i(q_i)
//   T_i     = Rz(theta_i) Tz(d_i + dd_i) Tx(a_i + da_i) Rx(alpha_i + dalpha_i) Ry(beta_i + dbeta_i)
// and of a linear unit, in its guide's axes (along, across, above)
//   T_i     = Trans(q_i + m_1(q_i), m_2(q_i), m_3(q_i)) Rx(m_4(q_i)) Ry(m_5(q_i)) Rz(m_6(q_i))
//   TCP     = flange * tool, then displaced by c_t m_t l_t^3/3 g_perp and turned by c_t m_t l_t^2/2 (z_t cross g)
// If a link's mass moment m_j com_j is not known, each of its components adds k_i times its torque about joint i, one
// unknown per joint and component. tau_i is evaluated on the nominal geometry: errors of 1 mm and 1 mrad change it by a
// few parts in a thousand, which moves the tip by less than 10 um on an arm that deflects by 5 mm.
//
// A positioner (positioner.h) carries targets: what is said of such a touch is in the frame that they are fixed in, where
// the arm's base, gravity and all axes move with the positioner's angles.
//
// All parameters are in SI units and radians. The number of joints is arbitrary.

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "calib/model/parameter_key.h"
#include "calib/model/robot.h"

namespace cellcal::calib {

/// Orders per turn of the deflection by a counterbalance.
constexpr int kCounterbalanceOrders = 3;
/// Orders per turn of a joint's function; slower ones are the smooth transmission error's. Its fast
/// orders, above kHighestOrder, have a prior of their own; single waves have up to kHighestWave.
constexpr int kLowestOrder = 5, kHighestOrder = 40, kFastestOrder = 100, kHighestWave = 200;

/// Waves per motion of a linear unit with this stroke [m]: half-waves down to 0.5 m.
int guide_orders(double stroke_m);
/// Prior sigma of both amplitudes of each order from `lowest` to `highest`, of a joint's function of
/// these orders with 1 rad rms over a turn and this reach.
std::vector<double> function_shares(double reach_rad, int lowest, int highest);

/// A possible error of the arm.
struct ArmParameter : ParameterKey {
  double sigma = 0.0;  ///< prior 1 sigma, > 0
  std::string unit;    ///< of the value times to_unit
  double to_unit = 1.0;
};

/// Maximum number of joints; bounds the stack.
constexpr int kMaxJoints = 32;
/// Maximum number of tips and reflectors on one flange.
constexpr int kMaxTools = 8;

/// The part of the model that depends on the axis angles only; computed once per touch.
struct PreparedPose {
  /// Per joint: cosine and sine of the nominal theta; of a linear unit, its position [m] and 0.
  Eigen::Matrix2Xd direction;
  /// Per parameter: d(angle)/dx of what depends on the pose; d(motion)/dx of a linear unit; 1 for other
  /// errors of the positioner's axes that carry; else 0.
  Eigen::VectorXd factor;
  int tool = 0;      ///< index of the tool
  int carriers = 0;  ///< number of the positioner's axes that carry the target's frame
  std::array<double, kMaxPositionerAxes> carrier_rad{};
};

/// The part of the model that depends on the errors only; computed once for many poses. Refers to
/// the x that it was computed from.
struct ArmErrors {
  struct OfJoint {
    double theta_rad, d_m, a_m;  ///< theta: the error; d and a: nominal and error
    double cos_alpha, sin_alpha, cos_beta, sin_beta;
    bool has_beta;
  };
  struct OfTool {
    Eigen::Vector3d tcp_m;            ///< in the flange's frame, before it bends
    double bend_m_per_accel = 0.0;    ///< tip shift per acceleration across the tool
    double turn_rad_per_accel = 0.0;  ///< tip rotation per acceleration across the tool
  };
  std::array<OfJoint, kMaxJoints> joint;
  std::array<OfTool, kMaxTools> tool;
  const double* x;  ///< null: all zero
};

/// The arm in one pose under errors: axes and origins along the chain, in the base frame, or in that
/// of the target's carrier (PreparedPose).
struct ArmChain {
  struct Link {
    Eigen::Vector3d tilt_x, tilt_y;  ///< bearing tilts, through z_origin; set where there are any
    Eigen::Vector3d z, z_origin;     ///< theta and d act about and along z through z_origin
    Eigen::Vector3d x;               ///< a acts along x; alpha about x through end
    Eigen::Vector3d y;               ///< beta about y through end
    Eigen::Vector3d end;             ///< origin after the joint
    Eigen::Matrix3d rotation;        ///< after the joint
    /// Linear unit: axes of roll, pitch and yaw, through `end`; x, y and z are along, across, above.
    Eigen::Matrix3d turns;
  };
  /// A positioner's axis, in the chain's frame: x and y shift it, tilt_x, tilt_y and z turn what it
  /// carries, through `origin`.
  struct Carrier {
    Eigen::Vector3d x, y, tilt_x, tilt_y, z, origin;
  };
  std::array<Carrier, kMaxPositionerAxes> carrier;  ///< of those that carry the target
  Eigen::Vector3d gravity;
  std::array<Link, kMaxJoints> link;
  Eigen::Matrix3d flange;
  Eigen::Vector3d flange_origin;
  Eigen::Vector3d rigid_tip, tip;  ///< without and with bending of the tool
};

/// Geometry of one pose under errors, for drawing and collision checks.
struct ArmShape {
  std::vector<Eigen::Vector3d> joint_origin_m;  ///< base frame; the last is the flange
  Eigen::Isometry3d flange;
  Eigen::Isometry3d tcp;
};

/// Robot with its tools, and the list of its possible errors. Several tools may be mounted: the
/// joints carry all of them, and each bends independently. Immutable; thread-safe.
class ArmModel {
 public:
  ArmModel(const Robot& robot, const Tool& tool, const std::vector<Tool>& others = {},
           const std::vector<Load>& loads = {});
  explicit ArmModel(const Cell& cell)
      : ArmModel(cell.robot, cell.tool, cell.other_tools, cell.loads) {}

  const std::vector<ArmParameter>& parameters() const { return parameters_; }
  int size() const { return static_cast<int>(parameters_.size()); }
  int joint_count() const { return static_cast<int>(robot_.joints.size()); }
  const Robot& robot() const { return robot_; }
  int tool_count() const { return static_cast<int>(tools_.size()); }
  const Tool& tool(int index = 0) const { return tools_[static_cast<std::size_t>(index)]; }
  /// True if a tool with this id is on the flange; an empty id denotes the first.
  bool has_tool(std::string_view id) const;
  /// Index of the tool with this id (empty: the first); throws std::out_of_range naming it.
  int tool_index(std::string_view id) const;
  /// The load with this id, null for an empty one; throws std::out_of_range naming it.
  const Load* load(std::string_view id) const;

  /// `load`: held by the tools, null: nothing. `carrier_rad`: angles of the positioner's axes that
  /// carry the frame which everything about the pose is in; empty: the base frame. `outer_rad`: of the
  /// axes after them, which load them; empty: 0. Throws std::invalid_argument if the number of angles
  /// differs from the robot's, or exceeds its axes.
  PreparedPose prepare(std::span<const double> joint_rad, int tool = 0, const Load* load = nullptr,
                       std::span<const double> carrier_rad = {},
                       std::span<const double> outer_rad = {}) const;

  /// x: size() values, SI; null: all zero.
  ArmErrors errors(const double* x) const;
  /// Fills `chain`; its `tip` is the TCP's position [m, base frame].
  void walk(const PreparedPose& pose, const ArmErrors& errors, ArmChain& chain) const;
  /// Derivative of the tip's component along the unit vector n: size() values, `stride` apart.
  void derivative_along(const Eigen::Vector3d& n, const PreparedPose& pose, const ArmErrors& errors,
                        const ArmChain& chain, double* derivative, std::ptrdiff_t stride = 1) const;
  /// Derivative of the tip, 3 x size(), column per parameter, column-major.
  void derivative(const PreparedPose& pose, const ArmErrors& errors, const ArmChain& chain,
                  Eigen::Ref<Eigen::Matrix3Xd> jacobian) const;

  /// Rotation of the TCP frame in the base frame.
  Eigen::Matrix3d rotation(const PreparedPose& pose, const ArmErrors& errors,
                           const ArmChain& chain) const;
  /// Rotation derivative in the base frame: 3 x size() [rad per parameter].
  void turn_derivative(const PreparedPose& pose, const ArmErrors& errors, const ArmChain& chain,
                       Eigen::Ref<Eigen::Matrix3Xd> jacobian) const;

  /// TCP position [m, base frame] at errors x (size() values; null: all zero).
  Eigen::Vector3d position(const PreparedPose& pose, const double* x) const;
  /// As above, with the derivative.
  Eigen::Vector3d position(const PreparedPose& pose, const double* x,
                           Eigen::Ref<Eigen::Matrix3Xd> jacobian) const;
  ArmShape shape(const PreparedPose& pose, const double* x) const;

  /// TCP pose of the nominal arm with a rigid tool, in the frame of prepare().
  Eigen::Isometry3d nominal_tcp(std::span<const double> joint_rad, int tool = 0,
                                std::span<const double> carrier_rad = {}) const;
  /// Position of nominal_tcp().
  Eigen::Vector3d nominal_tip_m(std::span<const double> joint_rad, int tool = 0,
                                std::span<const double> carrier_rad = {}) const;
  /// Geometric Jacobian of the first tool's nominal TCP, 6 x joints (linear above angular), per
  /// controller axis angle or metre, base frame.
  Eigen::Matrix<double, 6, Eigen::Dynamic> nominal_jacobian(
      std::span<const double> joint_rad) const;

 private:
  PreparedPose turned(std::span<const double> joint_rad, int tool,
                      std::span<const double> carrier_rad = {},
                      std::span<const double> outer_rad = {}) const;
  void add_positioner();
  /// The factors of its errors.
  void prepare_positioner(std::span<const double> outer_rad, PreparedPose& pose) const;
  /// The arm's base seen from the carrier of the pose.
  Eigen::Isometry3d base_of(const PreparedPose& pose, const double* x, ArmChain& chain) const;
  void carrier_derivative(const Eigen::Vector3d& n, const PreparedPose& pose, const ArmChain& chain,
                          double* derivative, std::ptrdiff_t stride) const;
  void add_counterbalance(std::size_t joint);
  void add_function(std::size_t joint);
  void add_guide(std::size_t joint);
  void add_tool_parameters(int index);
  /// Of a linear unit, its position included.
  std::array<double, kGuideMotions> guide_motion(int joint, const PreparedPose& pose,
                                                 const double* x) const;
  void walk_links(const PreparedPose& pose, const ArmErrors& errors, ArmChain& chain) const;
  /// Moment of gravity about each joint's origin [N m], base frame.
  Eigen::Matrix3Xd gravity_moment_nm(const ArmChain& chain, const Load* load) const;

  Robot robot_;
  std::vector<Tool> tools_;
  std::vector<Load> loads_;
  std::vector<ArmParameter> parameters_;
  /// Boundaries of the parameter ranges with pose-dependent motion: about a joint's axis, across it,
  /// of a linear unit; behind the tools are the positioner's.
  int first_by_pose_ = 0, last_by_pose_ = 0, last_bearing_ = 0, last_guide_ = 0, last_tool_ = 0;
  /// Per joint: of a linear unit, its guide's axes as columns, in the preceding frame.
  std::vector<std::optional<Eigen::Matrix3d>> guide_axes_;
  std::vector<double> stiff_;  ///< m l^3/3 of each tool
  ArmErrors none_;             ///< of the nominal arm
};

}  // namespace cellcal::calib
