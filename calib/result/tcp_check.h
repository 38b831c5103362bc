#pragma once
// What a few touches say of a calibration that was made before: whether it holds, how far the tool's
// tip has shifted since, and what has changed, with what speaks for every other explanation.
// calib/check works it out, calib/result has its sentences, calib/files writes it.

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace cellcal::calib {

enum class ChangeKind {
  kNothing,
  kTool,    ///< its tip on the flange, by three components
  kSphere,  ///< one of them, likewise, in the base frame
  kJoint,   ///< the zero of one
  kGrowth,  ///< all lengths of the arm by one factor: it is warmer or colder
  kTouch    ///< one touch alone is wrong: dirt on tip or sphere
};

/// As files name it: "sphere". Of a name that is none, nothing.
const char* to_string(ChangeKind kind);
std::optional<ChangeKind> change_kind(const std::string& name);

/// What a check says of the calibration.
enum class CheckVerdict {
  kHolds,
  kDoesNotHold,  ///< the odds are above the alarm, or a touch met nothing
  kUndecided     ///< touches gave no contact point, and the others raise no alarm
};
/// As files name it: "does_not_hold". Of a name that is none, nothing.
const char* to_string(CheckVerdict verdict);
std::optional<CheckVerdict> check_verdict(const std::string& name);

/// What may have changed, and how well that alone explains the touches.
struct Explanation {
  ChangeKind kind = ChangeKind::kNothing;
  std::string name = {};  ///< the sphere's, the joint's; of a touch its target; of the tool its own
  std::size_t touch = 0;  ///< kTouch: which of the planned ones, counted from 0
  double log_likelihood = 0.0;  ///< over that of nothing, size integrated out; natural logarithm
  double probability = 0.0;     ///< among all explanations
  /// kTool: in the flange's frame; kSphere: in the base's.
  Eigen::Vector3d shift_m = Eigen::Vector3d::Zero();
  double amount = 0.0;  ///< kJoint: rad, as its controller counts; kGrowth: 1; kTouch: m, outwards
  double sigma = 0.0;   ///< of the shift along it, or of the amount
};

/// A touch that was to be made and met nothing by the end of its search.
struct NotFound {
  std::size_t touch = 0;  ///< of the planned ones, counted from 0
  std::string target = {};
  double beyond_m = 0.0;  ///< so far behind the expected surface the search ended
};

/// A touch that met something and is not one all the same: its contacts did not agree, or there was noise.
struct UnsteadyTouch {
  std::size_t touch = 0;  ///< of the planned ones, counted from 0
  std::string target = {};
};

struct TcpCheck {
  /// The odds are below the alarm, and every planned touch was made: one that was given up may be of what
  /// has come loose.
  bool holds = false;
  std::size_t touches = 0;  ///< that were made
  /// Of the tool's tip against the flange, in the flange's frame, were that what changed.
  Eigen::Vector3d shift_m = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance_m2 = Eigen::Matrix3d::Zero();
  double rms_m = 0.0;         ///< of what the touches are off by
  double log_odds = 0.0;      ///< that anything changed over that nothing did, natural logarithm
  double log_alarm = 0.0;     ///< above this it does not hold
  double false_alarms = 0.0;  ///< share of checks with nothing changed that are above it
  double found = 0.0;         ///< share of tool shifts by `finds_m`, any direction, that are
  double finds_m = 0.0;
  std::vector<Explanation> explanations = {};  ///< likeliest first; kNothing is one of them
  std::vector<NotFound> not_found = {};
  std::vector<UnsteadyTouch> unsteady = {};

  CheckVerdict verdict() const;
  /// The likeliest of what may have changed; null where too few touches were made to say.
  const Explanation* change() const;
  double u_m(int axis) const;  ///< U(k=2) of one component of the shift
  double u_along_m() const;    ///< of the shift's length
};

// The sentences of a check, made here and nowhere else: number first, then what to do.

/// "holds: TCP shift 0.03 +- 0.08 mm (k=2)", "does not hold: ..."
std::string verdict_words(const TcpCheck& check);
/// What changed and what to do; empty where it holds.
std::string change_words(const TcpCheck& check);
/// "tool shifted by 0.31 +- 0.08 mm (k=2) on the flange"
std::string words(const Explanation& explanation);
/// What to do about a change; empty of none.
std::string remedy_words(const Explanation& change);
/// All of it, a line each: the verdict, what to do, spheres that were not found, every explanation with its
/// likelihood, what such a check finds.
std::vector<std::string> words(const TcpCheck& check);

}  // namespace cellcal::calib
