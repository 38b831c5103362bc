#pragma once
// A parameter's address: what kind of error it is, and of which part of the cell. Code finds
// parameters by it. Files, screens and reports print its name, and files are read by it; both are
// made here and nowhere else.

#include <compare>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "calib/model/robot.h"

namespace cellcal::calib {

enum class ParameterKind {
  // Of the arm.
  kTheta,
  kD,
  kA,
  kAlpha,
  kBeta,        // geometric error of a joint
  kCompliance,  // k_i
  kLoad,        // k_i times an unknown part of a link's mass moment
  kCosine,
  kSine,        // transmission harmonic
  kFunctionCosine,
  kFunctionSine,  // of a joint's function
  kPlay,        // play_i
  kDeflection,  // c_t
  kTcp,         // one component of the tool's offset
  // Beside it.
  kEffectiveRadius,  // rho of a tool
  kLatchDelay,       // t_l, one for the cell
  kCentre,           // one component of a target's centre
  kTilt,
  kShift,     // a plane's
  kTurn,      // of a tracker's frame
  kRadius,    // deviation of a sphere's
  kProbeTurn  // how a tracker's probe sits on the tool
};

/// Indices are those of the cell that the parameter is of.
struct ParameterKey {
  ParameterKind kind = ParameterKind::kTheta;
  int joint = -1;    ///< -1 where it is of none
  int harmonic = 0;  ///< kCosine to kFunctionSine: order h
  int axis = 0;      ///< kTcp, kLoad, kCentre, kTurn, kProbeTurn: 0 x, 1 y, 2 z; kTilt: 0, 1
  int link = -1;     ///< kLoad: the joint whose link it is
  int tool = 0;      ///< kDeflection, kTcp, kEffectiveRadius: whose; 0 the first
  int target = -1;   ///< of the target's own

  auto operator<=>(const ParameterKey&) const = default;
};

/// Of a joint: kTheta to kBeta, kCompliance, kPlay.
ParameterKey joint_parameter(ParameterKind kind, std::size_t joint);
ParameterKey load_parameter(std::size_t joint, std::size_t link, int axis);
/// kCosine to kFunctionSine.
ParameterKey wave_parameter(ParameterKind kind, std::size_t joint, int harmonic);
/// kDeflection, kTcp, kEffectiveRadius.
ParameterKey tool_parameter(ParameterKind kind, std::size_t tool, int axis = 0);
ParameterKey latch_delay_parameter();
/// kCentre and what follows it.
ParameterKey target_parameter(ParameterKind kind, std::size_t target, int axis = 0);

/// What a joint gives in proportion to its load.
constexpr bool is_compliance(ParameterKind kind) {
  return kind == ParameterKind::kCompliance || kind == ParameterKind::kLoad;
}
/// What its gear adds to its angle once per revolution and faster.
constexpr bool is_transmission(ParameterKind kind) {
  return kind == ParameterKind::kCosine || kind == ParameterKind::kSine;
}
/// What a joint's function adds to its angle.
constexpr bool is_function(ParameterKind kind) {
  return kind == ParameterKind::kFunctionCosine || kind == ParameterKind::kFunctionSine;
}
/// Of the arm's geometry.
constexpr bool is_geometric(ParameterKind kind) { return kind <= ParameterKind::kBeta; }

/// "A1.theta", "A2.compliance", "A2.load_A4_x", "A3.cos2", "tool.c_t", "touch.rho", "latch_delay",
/// "S1.x", ...
/// Throws std::out_of_range where the cell has no such part.
std::string parameter_name(const Cell& cell, const ParameterKey& key);
/// The parameter of that name; where the cell has no part that it could be of, nothing.
std::optional<ParameterKey> parameter_key(const Cell& cell, std::string_view name);

}  // namespace cellcal::calib
