#pragma once
// The result of an identification: what was found, how sure it is, and whether it may be used.
// calib/files/calibration_json.h writes it as "cellcal.calibration/1".

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "calib/model/kinematics.h"
#include "calib/model/parameter_key.h"
#include "calib/model/robot.h"
#include "calib/result/finding.h"
#include "calib/result/level.h"
#include "calib/result/outlier.h"
#include "calib/result/unidentifiable.h"
#include "calib/result/update.h"

namespace cellcal::calib {

enum class DecidedBy { kData, kPrior, kFrame };

/// As files and screens name it.
constexpr const char* to_string(DecidedBy decided) {
  switch (decided) {
    case DecidedBy::kData:
      return "data";
    case DecidedBy::kPrior:
      return "prior";
    case DecidedBy::kFrame:
      return "frame";
  }
  return "";
}

/// One identified quantity. Values are SI and radians; `unit` names what files and screens show.
struct ParameterResult {
  ParameterKey key;
  std::string unit;      ///< "mm", "deg", "1/(N m^2)", "rad/(N m)", "arcsec"
  double to_unit = 1.0;  ///< value in `unit` = SI value * to_unit
  double nominal = 0.0;
  double correction = 0.0;
  double sigma = 0.0;
  DecidedBy decided_by = DecidedBy::kData;
};

struct TargetResult {
  std::string id;
  /// Base frame; of a plane and a tracker the middle of what was touched.
  Eigen::Vector3d centre_m = Eigen::Vector3d::Zero();
  /// Sphere: r_s + r_tip + rho + dr; plane: r_tip + rho; others: 0. Of the first tool that touched
  /// it.
  double effective_radius_m = 0.0;
  TargetKind kind = TargetKind::kSphere;
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< plane: unit, base frame, to the tips' side
  double distance_m = 0.0;                           ///< plane: of it from the base's origin
  Eigen::Isometry3d frame = Eigen::Isometry3d::Identity();  ///< tracker: its frame in the base's
};

/// Distances of predicted from constrained positions, absolute values.
struct ResidualSummary {
  int count = 0;
  double mean_m = 0.0, max_m = 0.0, rms_m = 0.0;
};

/// One touch under the result, for the report. `before` is with nominal robot and stiff tool,
/// and with targets, radius offset and an uncertain tool as they fit it best; `after` with the
/// calibrated one. Signed along the constraint.
/// Of a check touch whose target has no place the numbers are NaN.
struct TouchResidual {
  std::size_t touch = 0;  ///< index into the touches given
  double before_m = 0.0, after_m = 0.0;
  double whitened = 0.0;  ///< after / its sigma
  bool outlier = false;
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  ///< from the target's centre to the tip
};

/// What touches of one place, repeated, say about the noise of a touch (repeats.h).
struct RepeatedTouches {
  int touches = 0;                  ///< that are repeats
  double scatter_m = 0.0;           ///< 1 sigma of one of them
  double degrees_of_freedom = 0.0;  ///< that it rests on; 0: not measured
  double used_m = 0.0;  ///< noise that touches without their own were weighed by; 0: not known
};

/// What the model does not explain and repeats do not show (discrepancy.h): an error of the tip
/// that differs from place to place, and no number of touches averages away.
struct Discrepancy {
  double sigma_m = 0.0;  ///< 1 sigma of each component; 0: none
  /// How far it reaches: correlation length, as an angle of the joint that moves the tip most. 0:
  /// it was not seen to reach from touch to touch.
  double reach_rad = 0.0;
  double noise_m = 0.0;  ///< rms noise of a touch beside it; 0: as weighed without it
  /// By how many sigmas residuals of like postures are alike, the fit's own likeness aside.
  double alike = 0.0;
  /// Estimated together with the parameters, which have their covariance from it; otherwise a bound
  /// for what the touches do not tell from noise.
  bool estimated = false;
  /// That sigma_m rests on (Satterthwaite), where it was estimated: few postures say little of it.
  double degrees_of_freedom = 0.0;
};

/// A target that stood elsewhere from one of its touches on.
struct MovedTarget {
  std::string target;
  std::size_t after_touch = 0;                        ///< its last one where it stood before
  Eigen::Vector3d shift_m = Eigen::Vector3d::Zero();  ///< base frame
  double sigma_m = 0.0;                               ///< of the shift, along it
  double squared_sigmas = 0.0;                        ///< of the shift, three degrees of freedom
};

/// A joint's zero, the tool's tip or a target that jumped in the middle of the session.
struct Jump {
  enum class What { kJoint, kTool, kTarget };
  What what = What::kJoint;
  std::string name;                                   ///< the joint's, the target's; "tool"
  std::size_t after_touch = 0;                        ///< the last one before
  double angle_rad = 0.0;                             ///< joint: as its controller counts
  Eigen::Vector3d shift_m = Eigen::Vector3d::Zero();  ///< tool: flange frame; target: base frame
  double sigma = 0.0;                                 ///< of the angle, or of the shift along it
  double squared_sigmas = 0.0;                        ///< one degree of freedom, or three
  double log_odds = 0.0;  ///< against that nothing changed, natural logarithm
  bool mends = false;     ///< with it undone nothing else is wrong
};

constexpr const char* to_string(Jump::What what) {
  switch (what) {
    case Jump::What::kJoint:
      return "joint";
    case Jump::What::kTool:
      return "tool";
    case Jump::What::kTarget:
      return "target";
  }
  return "";
}

/// A certified length, and what all but it says of it.
struct LengthResult {
  std::string from, to;
  double certified_m = 0.0, certified_sigma_m = 0.0;
  double by_others_m = 0.0, sigma_m = 0.0;  ///< 1 sigma, without that of the certificate
};

/// A sphere's radius or a wire's readings, and what all else says of them.
struct ArtefactBias {
  std::string target;  ///< empty: all wires
  /// How much larger the radius, or how much longer every reading, had to be; 1 sigma of that.
  double off_m = 0.0, sigma_m = 0.0;
};

/// How well the touches tell the geometry, targets eliminated and frame directions taken out;
/// observability.h says of what and why. All numbers are finite; those of directions that the
/// touches do not see at all are left out of the indices, and `rank` says how many count.
struct Observability {
  int rows = 0;        ///< that were measured: touches (three of a point or tracker), lengths
  int unknowns = 0;    ///< of the fullest model: geometry, gears, compliance, targets
  int directions = 0;  ///< of the geometry, frame directions aside
  int rank = 0;        ///< of those, how many the touches see at all
  int determined = 0;  ///< of those, how many the touches tell better than the tolerances
  /// Of all `directions`, largest first: sigmas of all measurements per tolerance.
  std::vector<double> singular_values;
  double o1 = 0.0;  ///< geometric mean of s over the root of the rows: what an average row tells
  double o2 = 0.0;  ///< smallest over largest s: how evenly the touches tell the directions
  double o3 = 0.0;  ///< smallest s: how well they tell the worst direction
  double o4 = 0.0;  ///< smallest s squared over the largest, noise amplification: o3 times o2
  double o5 = 0.0;  ///< 1 over the sum of 1/s: the sum of all directions' errors, inverted
  double condition = 0.0;  ///< largest over smallest s; 0 where nothing is seen
};

struct Verdict {
  bool judged = false;            ///< a result that was not judged is not published
  bool workspace = false;         ///< scope: workspace, otherwise near targets
  std::vector<Finding> findings = {};  ///< the withholding ones first

  /// Judged, and no finding withholds.
  bool publish() const;
  /// Withheld only because the touches are too few, as after a first session that checks the cell.
  bool too_few() const;
  /// Before the findings of the same weight: withholding ones, then all others.
  void add(Finding finding);
};

/// A held-out touch: the square of its residual over its predicted sigmas, of the touch and of what
/// the fit leaves open there, and for how many rows it stands.
struct HeldOut {
  std::size_t touch = 0;
  double square = 0.0;
  double rows = 0.0;
};

struct UnseenTarget {
  enum class NotJudged {
    kPlaceAlone,   ///< its touches hold its place and little more
    kNoPlace,      ///< they do not say where it is
    kUnusable,     ///< a reading is no number
    kOtherNormal,  ///< of a plane: theirs is far from the stated one
  };
  std::string target;
  std::size_t touches = 0;
  double degrees_of_freedom = 0.0;  ///< of its rows, what the place left
  double rms_m = 0.0;
  std::optional<NotJudged> not_judged;  ///< none: it is judged
};

struct UnseenChecks {
  std::vector<UnseenTarget> targets;
  std::vector<HeldOut> held_out;  ///< of those that are judged
};

/// The touch whose errors do the most harm before the others contradict it (unchecked_touch.h).
struct UncheckedTouch {
  std::size_t touch = 0;  ///< index into the touches given
  double unseen_m = 0.0;  ///< largest error that the others do not contradict
  double shift_m = 0.0;   ///< of the tip by it, mean over poses; 0: each is checked
};

struct InputFile {
  std::string role, name, sha256;
};

struct Calibration {
  Cell cell;  ///< nominal
  std::string method = "map";
  ModelLevel level;  ///< that the parameters belong to: the mean over the levels
  LevelReason level_reason;
  std::vector<LevelEvidence> levels;  ///< that were considered, best first
  /// Of the touches, whatever level, arm and places (natural logarithm); each that was left out
  /// costs as much as one at the gate. Compares sessions of the same readings; not written to files.
  double log_evidence = 0.0;
  std::vector<ParameterResult> parameters;
  std::vector<TargetResult> targets;
  std::vector<LengthResult> lengths;          ///< of which both ends were touched
  std::vector<ArtefactBias> artefact_biases;  ///< of spheres and wires; not written to files
  ResidualSummary before, after, check_before, check;
  std::vector<TouchResidual> residuals;
  UnseenChecks unseen;  ///< of targets that no fit touch is of (unseen.h); not written to files
  std::vector<UnidentifiableDirection> unidentifiable;
  Observability observability;  ///< rows 0: not worked out
  double predicted_near_targets_m = 0.0,
         predicted_workspace_m = 0.0;  ///< mean 3-D error, from the covariance
  /// This arm's with its nominal model over the same poses, and U (k = 2) of that
  /// (uncertainty/nominal_error.h). U 0: not worked out, or read from a file that has what tolerances foresee.
  double nominal_near_targets_m = 0.0, nominal_workspace_m = 0.0;
  double nominal_near_targets_u_m = 0.0, nominal_workspace_u_m = 0.0;
  /// What the tolerances foresee of any arm of this model, over the same poses; not written to files.
  double tolerated_near_targets_m = 0.0, tolerated_workspace_m = 0.0;
  UncheckedTouch unchecked_near_targets, unchecked_workspace;  ///< not written to files
  double chi2 = 0.0;  ///< of the fit: sum of the squared whitened residuals of the touches in use
  /// Left to judge it by: sum over the touches of 1 - leverage, which counts an unknown by how far
  /// the touches and not its prior decide it; at least 1.
  double degrees_of_freedom = 0.0;
  double chi2_per_dof = 0.0;
  double touch_noise_m = 0.0;  ///< rms of fit residuals, corrected for degrees of freedom
  RepeatedTouches repeats;
  Discrepancy discrepancy;
  Verdict verdict;
  std::vector<Outlier> outliers;
  /// One at most; of identify_as_stated(), which does not look closer, suspects without a shift.
  std::vector<MovedTarget> moved;
  /// What jumped; several where the touches do not tell which. Of identify_as_stated(), which does
  /// not look closer, a suspect without a size.
  std::vector<Jump> jumped;
  Eigen::MatrixXd covariance;  ///< of `parameters`, SI; frame directions included
  /// Orthonormal-in-prior-units basis of the frame directions, one column each, SI.
  Eigen::MatrixXd frame_basis;
  std::optional<UpdateOrigin> update;  ///< it was made out of the one before it by a few touches
  std::vector<InputFile> inputs;
};

/// Null where it was not estimated.
inline const ParameterResult* find(const Calibration& c, const ParameterKey& key) {
  for (const ParameterResult& one : c.parameters)
    if (one.key == key) return &one;
  return nullptr;
}
/// [SI]; 0 where it was not estimated.
inline double correction_of(const Calibration& c, const ParameterKey& key) {
  const ParameterResult* found = find(c, key);
  return found == nullptr ? 0.0 : found->correction;
}

// What robot and cell file state of a parameter that is identified as a deviation.

/// [SI]. Of a joint's theta (its zero), d, a, alpha, beta and of the tool's x, y, z; 0 of all
/// others, which have no nominal value.
double stated_value(const Cell& cell, const ParameterKey& parameter);

// The arm's own parameters, in its order, out of a calibration's.

/// Nominal and correction [SI] per parameter of the arm; 0 of what was not estimated.
Eigen::VectorXd arm_values(const ArmModel& arm, const Calibration& calibration);
/// [SI]; empty where the calibration has none.
Eigen::MatrixXd arm_covariance(const ArmModel& arm, const Calibration& calibration);

}  // namespace cellcal::calib
