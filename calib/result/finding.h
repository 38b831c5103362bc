#pragma once
// A finding of an identification that concerns the user: a value, not a sentence. Kind, severity,
// subject, and evidence. Sentences are generated on display only (calib/result); code compares
// kinds.

#include <Eigen/Core>
#include <concepts>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "calib/model/enum_table.h"
#include "calib/model/parameter_key.h"
#include "calib/model/robot.h"
#include "calib/model/touch.h"
#include "calib/result/likely_cause.h"

namespace cellcal::calib {

enum class FindingKind {
  // Touches and their noise.
  kTouchScatter,       ///< chi^2: above the stated scatter
  kDuplicateTouches,   ///< copies of other touches
  kManyOutliers,       ///< of all touches
  kOutliersOfTarget,   ///< of one target's
  kCheckTouches,       ///< residuals of held-out touches exceed the prediction
  kGrossCheckTouches,  ///< gross errors among them, excluded
  kNoCheckTouches,
  kUnseenPlace,      ///< check touches of a target without fit touches
  kUnseenNotJudged,  ///< too few of these to judge
  kTemperature,
  kModelError,  ///< an error of the arm beyond every model level
  // Geometry of the touches.
  kTooFewTouches,  ///< a first session
  kRank,
  kTooFewDirections,  ///< of a target
  kAllLeftOut,        ///< of a target
  kNotTouched,        ///< targets of the cell file
  // Statements of the files.
  kCertifiedLength,     ///< contradicted
  kCertifiedTwice,      ///< two contradictory certificates of one length
  kArtefactSize,        ///< a sphere's diameter, a wire's zero
  kStatedCentre,        ///< targets far from their stated places
  kExchangedCentres,    ///< two targets at each other's place
  kNegativeCompliance,  ///< against gravity
  kArmScale,            ///< of all the arm's lengths together
  kOffNominal,          ///< parameters beyond their tolerances
  kEffectiveRadius,     ///< beyond its prior
  // Use of the result.
  kScaleByLengths,     ///< scope: certified lengths hold the scale
  kScaleByReadings,    ///< scope: a tracker's or wire's readings do
  kScaleByNothing,     ///< scope: near the targets, and the reason
  kScopeOfTouches,     ///< scope: near the targets, since the prediction holds there alone
  kUncheckedReadings,  ///< nothing else determines the scale
  kUncheckedTouch,     ///< an undetected wrong contact would shift the tip beyond every bound
  kUncheckedLengths,   ///< too few touches to check one by the others
  kUncheckedLength,    ///< one length, not checked by others
  kRequired,           ///< predicted error above the required one
  kNoGain,             ///< no better than the nominal arm
  kGain,
  kControllerModel,  ///< the controller computes with another model of the arm
  // Comparison with the last calibration.
  kChanged,
  kChangeAccepted,
  kUnchanged,
  kNotCompared,
  // Update of the last calibration by a few touches.
  kUpdated,
  kUpdateNotNeeded,     ///< nothing changed
  kUpdateContradicted,  ///< more than one change
  kUpdateNotResolved,   ///< the change is less certain than the arm was before
  kUpdateNotFound,      ///< spheres were missed
  kUpdateTooFew,        ///< too few touches
  // Causes and failures.
  kNotIdentified,
  kLikelyCause,  ///< see LikelyCause
  kMovedTarget,
  kJumped,               ///< a joint's zero, the tool or a target; several if indistinguishable
  kStillWithModelError,  ///< found with the model error estimated, too
  kReferenceMethod,      ///< another estimator, for comparison only
  kRecorded              ///< text of a file without kinds
};

/// Name in files: "touch_scatter".
constexpr const char* to_string(FindingKind kind) { return own_name(kind); }

enum class Severity {
  kWithholds,  ///< the result must not be used for this
  kWarns,      ///< to be reviewed before using the result
  kInforms
};
constexpr const char* to_string(Severity severity) { return own_name(severity); }

/// Subject of a finding.
struct Subject {
  enum class Of {
    kSession,
    kTouch,
    kTarget,
    kJoint,
    kTool,
    kLength,
    kParameter,
    kRobot,
    kPositioner
  };
  Of of = Of::kSession;
  /// Name in files and sentences; identifies target, joint or tool. For a touch its target; for a
  /// length one end; for a robot its file, or the stated robot's name.
  std::string name;
  /// For a length the other end; for a touch or target with a wrong name the correct one; for
  /// another robot its name.
  std::string other_end;
  /// Key of a parameter; empty if the cell does not have it.
  std::optional<ParameterKey> parameter;
  std::optional<TargetKind> target_kind;  ///< of a target
  /// Counted from 0: the touch itself, or the one after which something changed.
  std::optional<std::size_t> touch;
  int line = 0;  ///< line of the touch's source file; 0: none

  bool operator==(const Subject&) const = default;
};
constexpr const char* to_string(Subject::Of of) { return own_name(of); }

Subject about_touch(std::size_t index, const Touch& touch);
Subject about_target(const Target& target);
Subject about_joint(std::string name);
Subject about_tool(std::string name);
/// `axis`: the first.
Subject about_positioner(std::string axis);
Subject about_length(std::string from, std::string to);
Subject about_parameter(const Cell& cell, const ParameterKey& key);
Subject about_robot(std::string file, std::string name);
/// The subject, changed after this touch.
Subject after(Subject subject, std::size_t index, const Touch& touch);

/// A number in its display unit.
struct Quantity {
  Quantity() = default;
  Quantity(std::string its_name, double its_value, std::string its_unit = {},
           double its_sigma = 0.0)
      : name(std::move(its_name)), value(its_value), unit(std::move(its_unit)), sigma(its_sigma) {}
  /// A count; true is 1.
  template <std::integral T>
  Quantity(std::string its_name, T count)
      : Quantity(std::move(its_name), static_cast<double>(count)) {}

  std::string name;
  double value = 0.0;
  std::string unit;    ///< "mm", "deg", "%", "sigma"; empty: a count or a ratio
  double sigma = 0.0;  ///< 0: not stated

  bool operator==(const Quantity&) const = default;
};

/// From lengths [m] and angles [rad], with their sigmas.
Quantity in_mm(std::string name, double m, double sigma_m = 0.0);
Quantity in_deg(std::string name, double rad, double sigma_rad = 0.0);
/// "shift" with its sigma along it, and its components "x", "y", "z".
std::vector<Quantity> shift_in_mm(const Eigen::Vector3d& shift_m, double sigma_m);

/// One of several subjects of a finding.
struct FindingPart {
  Subject about;
  std::vector<Quantity> evidence;

  bool operator==(const FindingPart&) const = default;
};

struct Finding {
  FindingKind kind = FindingKind::kRecorded;
  Severity severity = Severity::kWithholds;
  Subject about = {};
  std::vector<Quantity> evidence = {};
  std::vector<FindingPart> parts = {};  ///< most significant first
  /// Quoted text: an error message, or a file's own words.
  std::string text = {};
  /// For kLikelyCause; empty if a file holds text only. If correcting it would let the result pass,
  /// the evidence contains "mends".
  std::optional<LikelyCause> cause = {};
  std::vector<Finding> still = {};  ///< kStillWithModelError: findings that remain

  bool withholds() const { return severity == Severity::kWithholds; }
  bool operator==(const Finding&) const = default;
};

/// A mistake that explains a withheld result.
Finding likely(LikelyCause cause, Subject about = {}, std::vector<Quantity> evidence = {},
               std::vector<FindingPart> parts = {});

/// The quantity of this name; null if absent.
const Quantity* find(const std::vector<Quantity>& evidence, const std::string& name);
/// Its value; NaN if absent.
double value(const std::vector<Quantity>& evidence, const std::string& name);

bool has(const std::vector<Finding>& findings, FindingKind kind);
/// The first finding of this kind; null if absent.
const Finding* first(const std::vector<Finding>& findings, FindingKind kind);
void erase(std::vector<Finding>& findings, FindingKind kind);

// Sentences of findings, generated here only: the number first, with unit and uncertainty, then the
// remedy.

/// "certified length S1-S2: 400.000 mm stated, 400.100 ± 0.010 mm measured (7 sigma). Measure ..."
std::string words(const Finding& finding);
/// One for each finding, in order.
std::vector<std::string> words(const std::vector<Finding>& findings);
/// Without the opening ("scope: "), for display under a heading.
std::string sentence(const Finding& finding);

}  // namespace cellcal::calib
