#pragma once
// Check of an earlier calibration by a few touches: whether it holds, the shift of the TCP since,
// and the change, with the likelihood of every other explanation. calib/check computes it,
// calib/result words it, calib/files writes it.

#include <Eigen/Core>
#include <cstddef>
#include <string>
#include <vector>

#include "calib/model/enum_table.h"

namespace cellcal::calib {

enum class ChangeKind {
  kNothing,
  kTool,       ///< its tip on the flange, three components
  kSphere,     ///< one sphere, three components, in the frame that it is fixed in
  kJoint,      ///< the zero of a joint, or of a positioner's axis
  kGrowth,     ///< all the arm's lengths by one factor: temperature
  kTouch,      ///< a single touch: dirt on tip or sphere
  kPositioner  ///< a positioner's foot: shift of its first axis, base frame, and turn
};

/// Name in files: "sphere".
constexpr const char* to_string(ChangeKind kind) { return own_name(kind); }
/// Of three components.
constexpr bool is_shift(ChangeKind kind) {
  return kind == ChangeKind::kTool || kind == ChangeKind::kSphere ||
         kind == ChangeKind::kPositioner;
}

/// Verdict of a check on the calibration.
enum class CheckVerdict {
  kHolds,
  kDoesNotHold,  ///< the odds are above the alarm, a touch made no contact, or a mastered zero does not hold
  kUndecided  ///< touches gave no contact point, and the others raise no alarm
};
/// Name in files: "does_not_hold".
constexpr const char* to_string(CheckVerdict verdict) { return own_name(verdict); }

/// A possible single change, and how well it explains the touches.
struct Explanation {
  ChangeKind kind = ChangeKind::kNothing;
  /// Name of the sphere or joint; kTouch: its target; kTool: the tool's; kPositioner: its first axis'.
  std::string name = {};
  std::size_t touch = 0;        ///< kTouch: index of the planned touches
  double log_likelihood = 0.0;  ///< over that of no change, size integrated out; natural logarithm
  double probability = 0.0;     ///< among all explanations
  /// kTool: in the flange's frame; kSphere: in that of its axis, or the base's; kPositioner: in the base's.
  Eigen::Vector3d shift_m = Eigen::Vector3d::Zero();
  /// kJoint: rad, in the controller's sense; kGrowth: 1; kTouch: m, outwards; kPositioner: rad, of
  /// its turn; kTool, kSphere: least length (k=2) [m] of a shift known along its touches only, otherwise 0.
  double amount = 0.0;
  /// Along the shift, or in its least known direction where only its least length is stated; or of the amount.
  double sigma = 0.0;
  double turn_sigma = 0.0;  ///< kPositioner: of its turn [rad]
};

/// A planned touch without contact by the end of its search.
struct NotFound {
  std::size_t touch = 0;  ///< index of the planned touches
  std::string target = {};
  double beyond_m = 0.0;  ///< distance of the search's end past the expected surface
};

/// A touch with contact but without a valid result: its contacts did not agree, or there was noise.
struct UnsteadyTouch {
  std::size_t touch = 0;  ///< index of the planned touches
  std::string target = {};
};

struct TcpCheck {
  /// True if the odds are below the alarm and every planned touch was made: an abandoned one may be of a
  /// loose part.
  bool holds = false;
  std::size_t touches = 0;  ///< number made
  /// Shift of the tool's tip relative to the flange, flange frame, assuming that the tool changed.
  Eigen::Vector3d shift_m = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance_m2 = Eigen::Matrix3d::Zero();
  double rms_m = 0.0;         ///< of the residuals
  double log_odds = 0.0;      ///< of any change against none, natural logarithm
  double log_alarm = 0.0;     ///< share of checks of an unchanged cell above the alarm
  double false_alarms = 0.0;  ///< share of checks with nothing changed that are above it
  double found = 0.0;         ///< share of tool shifts by `finds_m`, any direction, above the alarm
  double finds_m = 0.0;
  std::vector<Explanation> explanations = {};  ///< most likely first; includes kNothing
  std::vector<NotFound> not_found = {};
  std::vector<UnsteadyTouch> unsteady = {};
  bool zeros_hold = true;  ///< after mastering: those of the mastered joints

  CheckVerdict verdict() const;
  /// The most likely change; null if too few touches were made.
  const Explanation* change() const;
  double u_m(int axis) const;  ///< U(k=2) of one component of the shift
  double u_along_m() const;    ///< of the shift along itself
};

// Sentences of a check, generated here only: number first, then the remedy.

/// "holds: TCP shift 0.03 ± 0.08 mm (k=2)", "does not hold: ..."
std::string verdict_words(const TcpCheck& check);
/// The change and the remedy; empty if it holds.
std::string change_words(const TcpCheck& check);
/// "tool shifted by 0.31 ± 0.08 mm (k=2) on the flange"
std::string words(const Explanation& explanation);
/// All sentences, one per line: verdict, remedy, spheres not found, every explanation with its likelihood,
/// and the resolution of the check.
std::vector<std::string> words(const TcpCheck& check);

}  // namespace cellcal::calib
