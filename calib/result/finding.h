#pragma once
// What an identification found out that a user has to know: a value, not a sentence. What it is,
// how much it weighs, what it is about, and the numbers that it rests on. Sentences are made where
// they are read, and nowhere else (calib/result); code asks for kinds.

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "calib/model/parameter_key.h"
#include "calib/model/robot.h"
#include "calib/model/touch.h"
#include "calib/result/likely_cause.h"

namespace cellcal::calib {

enum class FindingKind {
  // Touches and their noise.
  kTouchScatter,       ///< chi^2: more than stated
  kDuplicateTouches,   ///< copies of other touches
  kManyOutliers,       ///< of all touches
  kOutliersOfTarget,   ///< of one target's
  kCheckTouches,       ///< held-out touches are farther off than predicted
  kGrossCheckTouches,  ///< a few of them are, and were left aside
  kNoCheckTouches,
  kUnseenPlace,      ///< check touches of a target without fit touches
  kUnseenNotJudged,  ///< these say too little
  kTemperature,
  kModelError,  ///< an error of the arm that no model level explains
  // Geometry of the touches.
  kTooFewTouches,  ///< a first session
  kRank,
  kTooFewDirections,  ///< of a target
  kAllLeftOut,        ///< of a target
  kNotTouched,        ///< targets of the cell file
  // What the files state.
  kCertifiedLength,     ///< contradicted
  kCertifiedTwice,      ///< two certificates of one length that differ
  kArtefactSize,        ///< a sphere's diameter, a wire's zero
  kStatedCentre,        ///< targets far from where the cell file has them
  kExchangedCentres,    ///< two of them, each where the other should be
  kNegativeCompliance,  ///< against gravity
  kArmScale,            ///< all lengths of the arm together
  kOffNominal,          ///< parameters beyond their tolerances
  kEffectiveRadius,     ///< beyond its prior
  // What the result is good for.
  kScaleByLengths,     ///< scope: certified lengths hold the scale
  kScaleByReadings,    ///< scope: a tracker's or wire's readings do
  kScaleByNothing,     ///< scope: near the targets, and why
  kUncheckedReadings,  ///< nothing else says how long everything is
  kUncheckedTouch,     ///< a wrong contact that is not detected shifts the tip beyond every bound
  kUncheckedLengths,   ///< the touches are too few to check one by the others
  kUncheckedLength,    ///< there is one, and nothing checks it
  kRequired,           ///< predicted error above what is required
  kNoGain,             ///< no better than the nominal arm
  kGain,
  // Against the last calibration.
  kChanged,
  kChangeAccepted,
  kUnchanged,
  kNotCompared,
  // Out of the last calibration by a few touches.
  kUpdated,
  kUpdateNotNeeded,     ///< nothing changed
  kUpdateContradicted,  ///< more than one thing did
  kUpdateNotResolved,   ///< what changed is not known as well as the arm was before
  kUpdateNotFound,      ///< spheres were not met
  kUpdateTooFew,        ///< touches
  // What went wrong.
  kNotIdentified,
  kLikelyCause,  ///< which one: LikelyCause
  kMovedTarget,
  kJumped,  ///< a joint's zero, the tool or a target; several where it is not clear which
  kStillWithModelError,  ///< found with the model's own error estimated, too
  kReferenceMethod,      ///< another's estimator, for comparison only
  kRecorded              ///< in the words of a file that holds no more
};

/// As files name it: "touch_scatter". Of a name that is none, nothing.
const char* to_string(FindingKind kind);
std::optional<FindingKind> finding_kind(const std::string& name);

enum class Severity {
  kWithholds,  ///< the result must not be used for this
  kWarns,      ///< look at it before using the result
  kInforms
};
const char* to_string(Severity severity);
std::optional<Severity> severity(const std::string& name);

/// What a finding is about.
struct Subject {
  enum class Of { kSession, kTouch, kTarget, kJoint, kTool, kLength, kParameter, kRobot };
  Of of = Of::kSession;
  /// As files and sentences have it, which of target, joint and tool is the key, too. Of a touch its
  /// target; of a length the one end; of a robot its file, or, of the stated one, its name.
  std::string name;
  /// Of a length; of a touch or target under another's name that one; of another robot its name.
  std::string other_end;
  /// What a parameter is found by; none of one that the cell does not have.
  std::optional<ParameterKey> parameter;
  std::optional<TargetKind> target_kind;  ///< of a target
  /// Counted from 0: the touch itself, or that after which something changed.
  std::optional<std::size_t> touch;
  int line = 0;  ///< of the file that the touch was read from; 0: none

  bool operator==(const Subject&) const = default;
};
const char* to_string(Subject::Of of);
std::optional<Subject::Of> subject_of(const std::string& name);

Subject about_touch(std::size_t index, const Touch& touch);
Subject about_target(const Target& target);
Subject about_joint(std::string name);
Subject about_tool(std::string name);
Subject about_length(std::string from, std::string to);
Subject about_parameter(const Cell& cell, const ParameterKey& key);
Subject about_robot(std::string file, std::string name);
/// The same, after a touch.
Subject after(Subject subject, std::size_t index, const Touch& touch);

/// One number, in the unit that it is read in.
struct Quantity {
  std::string name;
  double value = 0.0;
  std::string unit;    ///< "mm", "deg", "%", "sigma"; empty: a count or a ratio
  double sigma = 0.0;  ///< 0: none is stated

  bool operator==(const Quantity&) const = default;
};

/// Of lengths [m] and angles [rad], with their sigmas.
Quantity in_mm(std::string name, double m, double sigma_m = 0.0);
Quantity in_deg(std::string name, double rad, double sigma_rad = 0.0);
/// "shift", with its sigma along it, and its "x", "y", "z".
std::vector<Quantity> shift_in_mm(const Eigen::Vector3d& shift_m, double sigma_m);

/// One of several that a finding is about together.
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
  std::vector<FindingPart> parts = {};  ///< weightiest first
  /// What others said, and is passed on: an error's message, a file's own words.
  std::string text = {};
  /// Of kLikelyCause; none where a file holds its words alone. Where the result would be let through
  /// with it put right, the evidence has "mends".
  std::optional<LikelyCause> cause = {};
  std::vector<Finding> still = {};  ///< kStillWithModelError: what was found then, too

  bool withholds() const { return severity == Severity::kWithholds; }
  bool operator==(const Finding&) const = default;
};

/// That a mistake explains what is withheld.
Finding likely(LikelyCause cause, Subject about = {}, std::vector<Quantity> evidence = {},
               std::vector<FindingPart> parts = {});

/// The quantity of that name; null where there is none.
const Quantity* find(const std::vector<Quantity>& evidence, const std::string& name);
/// Its value; not a number where there is none.
double value(const std::vector<Quantity>& evidence, const std::string& name);

bool has(const std::vector<Finding>& findings, FindingKind kind);
/// The first of that kind; null where there is none.
const Finding* first(const std::vector<Finding>& findings, FindingKind kind);
void erase(std::vector<Finding>& findings, FindingKind kind);

// The sentence of each finding, made here and nowhere else: the number first, with its unit and
// uncertainty, then what to do.

/// "certified length S1-S2: 400.000 mm stated, 400.100 +- 0.010 mm measured (7 sigma). Measure ..."
std::string words(const Finding& finding);
/// One for each, in their order.
std::vector<std::string> words(const std::vector<Finding>& findings);
/// Without the opening ("scope: "), for where a heading says it.
std::string sentence(const Finding& finding);

}  // namespace cellcal::calib
