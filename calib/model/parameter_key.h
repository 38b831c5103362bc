#pragma once
// Address of a parameter: the kind of error, and the part of the cell. Code identifies parameters
// by it; files, screens and reports use its name. Name and key are converted here only.

#include <compare>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "calib/model/robot.h"

namespace cellcal::calib {

enum class ParameterKind {
  // Arm.
  kTheta,
  kD,
  kA,
  kAlpha,
  kBeta,        // geometric error of a joint
  kGuide,       // slope or wave of one of a linear unit's six motions
  kCompliance,  // k_i
  kLoad,        // k_i times an unknown part of a link's mass moment
  kCosine,
  kSine,  // transmission harmonic
  kFunctionCosine,
  kFunctionSine,  // of a joint's function
  kBearing,       // compliance of a joint across its axis, about x or y of the preceding frame
  kStiffening,    // deflection at small loads of a gear of rising stiffness
  kPlay,          // play_i
  kDeflection,    // c_t
  kTcp,           // one component of the tool's offset
  kPositioner,    // error of one of the positioner's axes
  // Touches and targets.
  kEffectiveRadius,  // rho of a tool
  kLatchDelay,       // t_l, one for the cell
  kCentre,           // one component of a target's centre
  kTilt,
  kShift,     // of a plane
  kTurn,      // of a tracker's frame
  kRadius,    // deviation of a sphere's radius
  kProbeTurn  // rotation of a tracker's probe on the tool
};

/// Motions of a linear unit's carriage: shifts along the travel, across it and above it (right-handed,
/// above nearest to the preceding frame's z), and turns about these.
enum class GuideMotion { kAlong, kAcross, kAbove, kRoll, kPitch, kYaw };
constexpr int kGuideMotions = 6;
constexpr bool is_shift(GuideMotion motion) { return motion < GuideMotion::kRoll; }

/// Indices refer to the cell that the parameter belongs to.
struct ParameterKey {
  ParameterKind kind = ParameterKind::kTheta;
  int joint = -1;    ///< -1: not of a joint
  int harmonic = 0;  ///< kCosine to kFunctionSine: order h; kGuide: order of the wave, 0 the slope
  /// kTcp, kLoad, kCentre, kTurn, kProbeTurn: 0 x, 1 y, 2 z; kBearing, kTilt: 0, 1; kGuide: GuideMotion.
  int axis = 0;
  int link = -1;     ///< kLoad: the joint whose link it is
  int tool = 0;      ///< kDeflection, kTcp, kEffectiveRadius: tool index; 0 the first
  int target = -1;   ///< target index, kCentre and following
  int carrier = -1;  ///< kPositioner: index of its axis; `axis` is the AxisError

  auto operator<=>(const ParameterKey&) const = default;
};

/// For kTheta to kBeta, kCompliance, kStiffening, kPlay.
ParameterKey joint_parameter(ParameterKind kind, std::size_t joint);
ParameterKey load_parameter(std::size_t joint, std::size_t link, int axis);
ParameterKey bearing_parameter(std::size_t joint, int axis);
/// Order 0: the slope.
ParameterKey guide_parameter(std::size_t joint, GuideMotion motion, int order);
/// kCosine to kFunctionSine.
ParameterKey wave_parameter(ParameterKind kind, std::size_t joint, int harmonic);
/// kDeflection, kTcp, kEffectiveRadius.
ParameterKey tool_parameter(ParameterKind kind, std::size_t tool, int axis = 0);
ParameterKey latch_delay_parameter();
ParameterKey positioner_parameter(std::size_t carrier, AxisError error);
/// For kCentre and following.
ParameterKey target_parameter(ParameterKind kind, std::size_t target, int axis = 0);

/// True for deflection of a joint in proportion to its load.
constexpr bool is_compliance(ParameterKind kind) {
  return kind == ParameterKind::kCompliance || kind == ParameterKind::kLoad;
}
/// True for errors periodic in the motor angle, once per revolution and faster.
constexpr bool is_transmission(ParameterKind kind) {
  return kind == ParameterKind::kCosine || kind == ParameterKind::kSine;
}
/// True for a joint's function of its angle.
constexpr bool is_function(ParameterKind kind) {
  return kind == ParameterKind::kFunctionCosine || kind == ParameterKind::kFunctionSine;
}
/// True for parameters that an arm has only if the touches show them or its file states them.
constexpr bool is_by_evidence(ParameterKind kind) {
  return is_function(kind) || kind == ParameterKind::kBearing || kind == ParameterKind::kStiffening;
}
/// True for deflection of a positioner's axis in proportion to its load.
constexpr bool is_positioner_compliance(const ParameterKey& key) {
  return key.kind == ParameterKind::kPositioner && AxisError{key.axis} >= AxisError::kCompliance;
}
/// True for errors of the arm's geometry, a linear unit's included.
constexpr bool is_geometric(ParameterKind kind) { return kind <= ParameterKind::kGuide; }

/// "A1.theta", "A2.compliance", "A2.load_A4_x", "A3.cos2", "E1.along_slope", "E1.pitch3", "tool.c_t",
/// "E2.rx", "touch.rho", "latch_delay", "S1.x", ... Throws std::out_of_range if the cell has no such part.
std::string parameter_name(const Cell& cell, const ParameterKey& key);
/// Inverse of parameter_name(); empty if the cell has no such part.
std::optional<ParameterKey> parameter_key(const Cell& cell, std::string_view name);

}  // namespace cellcal::calib
