#pragma once
// The result of an identification: parameters, uncertainty, and verdict.
// calib/files/calibration_json.h writes it as "cellcal.calibration/1".

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "calib/model/enum_table.h"
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

/// Name in files and on screens.
constexpr const char* to_string(DecidedBy decided) { return own_name(decided); }

/// One identified quantity. Values are in SI units and radians; `unit` is the display unit.
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
  /// Base frame; for a plane and a tracker the centre of the touched points.
  Eigen::Vector3d centre_m = Eigen::Vector3d::Zero();
  /// Sphere: r_s + r_tip + rho + dr; plane: r_tip + rho; others: 0. For the first tool that touched
  /// it.
  double effective_radius_m = 0.0;
  TargetKind kind = TargetKind::kSphere;
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< plane: unit, base frame, towards the tips
  double distance_m = 0.0;                           ///< plane: from the base's origin
  Eigen::Isometry3d frame = Eigen::Isometry3d::Identity();  ///< tracker: in the base frame
};

/// Absolute distances between predicted and constrained positions.
struct ResidualSummary {
  int count = 0;
  double mean_m = 0.0, max_m = 0.0, rms_m = 0.0;
};

/// Residuals of one touch, for the report. `before`: nominal robot and rigid tool, with targets,
/// radius offset and uncertain tool fitted; `after`: calibrated robot. Signed along the constraint.
/// NaN for a check touch of a target without a known place.
struct TouchResidual {
  std::size_t touch = 0;  ///< index of the given touches
  double before_m = 0.0, after_m = 0.0;
  double whitened = 0.0;  ///< after / its sigma
  bool outlier = false;
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();  ///< from the target's centre to the tip
};

/// Noise of a touch, estimated from repeated touches of one place (repeats.h).
struct RepeatedTouches {
  int touches = 0;                  ///< number of repeats
  double scatter_m = 0.0;           ///< 1 sigma of one repeat
  double degrees_of_freedom = 0.0;  ///< 0: not measured
  double used_m = 0.0;              ///< noise assumed for touches without their own; 0: unknown
};

/// Model error not visible in repeats (discrepancy.h): an error of the tip that varies from place
/// to place and does not average out.
struct Discrepancy {
  double sigma_m = 0.0;  ///< 1 sigma of each component; 0: none
  /// Correlation length, as an angle of the joint that moves the tip most. 0: no correlation
  /// between touches was detected.
  double reach_rad = 0.0;
  double noise_m = 0.0;  ///< rms noise of a touch without it; 0: as assumed
  /// Correlation of residuals at similar postures beyond that caused by the fit, in sigmas.
  double alike = 0.0;
  /// True if it was estimated jointly with the parameters and is included in their covariance;
  /// otherwise it is an upper bound on what the touches cannot separate from noise.
  bool estimated = false;
  /// Effective degrees of freedom of sigma_m (Satterthwaite), if estimated.
  double degrees_of_freedom = 0.0;
};

/// A target that moved during the session.
struct MovedTarget {
  std::string target;
  std::size_t after_touch = 0;                        ///< last one at its first place
  Eigen::Vector3d shift_m = Eigen::Vector3d::Zero();  ///< base frame
  double sigma_m = 0.0;                               ///< along the shift
  double squared_sigmas = 0.0;                        ///< of the shift, three degrees of freedom
};

/// A jump of a joint's zero, the tool's tip or a target during the session.
struct Jump {
  enum class What { kJoint, kTool, kTarget };
  What what = What::kJoint;
  std::string name;                                   ///< of the joint or target; "tool"
  std::size_t after_touch = 0;                        ///< last one before the jump
  double angle_rad = 0.0;                             ///< joint: in the controller's sense
  Eigen::Vector3d shift_m = Eigen::Vector3d::Zero();  ///< tool: flange frame; target: base frame
  double sigma = 0.0;                                 ///< of the angle, or of the shift along it
  double squared_sigmas = 0.0;                        ///< one degree of freedom, or three
  double log_odds = 0.0;                              ///< against no change, natural logarithm
  bool mends = false;                                 ///< correcting it resolves all other findings
};

constexpr const char* to_string(Jump::What what) { return own_name(what); }

/// A certified length, and its estimate from all other data.
struct LengthResult {
  std::string from, to;
  double certified_m = 0.0, certified_sigma_m = 0.0;
  double by_others_m = 0.0, sigma_m = 0.0;  ///< 1 sigma, without the certificate's
  bool is_check = false;                    ///< was not fitted
};

/// A sphere's radius or a wire's readings, compared with all other data.
struct ArtefactBias {
  std::string target;  ///< empty: all wires
  /// Required increase of the radius, or of every reading, and its 1 sigma.
  double off_m = 0.0, sigma_m = 0.0;
};

/// Observability of the geometry by the touches, targets eliminated and frame directions removed;
/// defined in observability.h. All numbers are finite; directions that the touches do not determine
/// at all are excluded from the indices, and `rank` counts the included ones.
struct Observability {
  int rows = 0;        ///< measured ones: touches (three of a point or tracker), lengths
  int unknowns = 0;    ///< of the fullest model: geometry, gears, compliance, targets
  int directions = 0;  ///< of the geometry, without frame directions
  int rank = 0;        ///< of those, determined at all by the touches
  int determined = 0;  ///< of those, determined better than by the tolerances
  /// For all `directions`, descending: tolerance over the sigma of all measurements.
  std::vector<double> singular_values;
  double o1 = 0.0;  ///< geometric mean of s over the root of the rows: information per row
  double o2 = 0.0;  ///< smallest over largest s: uniformity
  double o3 = 0.0;  ///< smallest s: the least determined direction
  double o4 = 0.0;  ///< smallest s squared over the largest, noise amplification: o3 times o2
  double o5 = 0.0;  ///< 1 over the sum of 1/s: inverse of the summed errors
  double condition = 0.0;  ///< largest over smallest s; 0 if the rank is 0
};

/// Basis of the arm's scale.
enum class ScaleBy {
  kNotJudged,
  kLengths,   ///< certified, also where readings hold it as well
  kReadings,  ///< of a tracker or of wires
  kNothing,
};

struct Verdict {
  bool judged = false;                 ///< a result that was not judged is not published
  bool workspace = false;              ///< scope: workspace, otherwise near targets
  std::vector<Finding> findings = {};  ///< the withholding ones first

  /// Judged, and no finding withholds.
  bool publish() const;
  /// Withheld only because the touches are too few, as after a first session that checks the cell.
  bool too_few() const;
  ScaleBy scale() const;
  /// After the findings of the same weight: withholding ones, then all others.
  void add(Finding finding);
  /// Before those of the same weight: a cause of what was found before.
  void add_first(Finding finding);
};

/// Held-out touches: squared residual over the predicted variance, which includes that of the fit,
/// and the number of rows.
struct HeldOut {
  std::size_t touch = 0;
  double square = 0.0;
  double rows = 0.0;
};

struct UnseenTarget {
  enum class NotJudged {
    kPlaceAlone,   ///< its touches determine little more than its place
    kNoPlace,      ///< its touches do not determine its place
    kUnusable,     ///< a reading is not a number
    kOtherNormal,  ///< of a plane: the fitted normal is far from the stated one
  };
  std::string target;
  std::size_t touches = 0;
  double degrees_of_freedom = 0.0;  ///< of its rows, remaining after the place was fitted
  double rms_m = 0.0;
  std::optional<NotJudged> not_judged;  ///< none: judged
};

struct UnseenChecks {
  std::vector<UnseenTarget> targets;
  std::vector<HeldOut> held_out;  ///< of the judged targets
};

/// The touch whose undetected error shifts the tip most (calib/verdict/artefacts.h).
struct UncheckedTouch {
  std::size_t touch = 0;  ///< index of the given touches
  double unseen_m = 0.0;  ///< largest error that the other touches do not contradict
  double shift_m = 0.0;   ///< mean tip shift by it over poses; 0: every touch is checked
};

/// Sources of the uncertainty of a TCP position (calib/estimate/budget.h).
enum class UncertaintySource {
  kTouches,  ///< scatter of one touch
  kCertifiedLengths,
  kDiameters,        ///< of spheres
  kEffectiveRadius,  ///< of the tips
  kLatchDelay,
  kTool,          ///< its stated TCP
  kArmLengths,    ///< tolerances of the robot file, d and a
  kArmAngles,     ///< tolerances of the robot file, theta, alpha and beta
  kLinearUnit,    ///< tolerances of its motions
  kTransmission,  ///< of the joints: waves, functions, play
  kLoads,         ///< deflection of joints, bearings and tool
  kPlaces,        ///< stated centres of targets
  kRipple,        ///< of the gears, at every pose
  kModel          ///< scatter that the model does not explain, at every pose
};
constexpr const char* to_string(UncertaintySource source) { return own_name(source); }
/// Unit of a source's sigma in files and documents; "" for several.
struct SourceUnit {
  const char* name;
  double per_si;
};
SourceUnit unit_of(UncertaintySource source);

/// A line of the budget; the squared contributions add up to the squared standard uncertainty, rms
/// over the directions and mean over the poses.
struct UncertaintyLine {
  UncertaintySource source = UncertaintySource::kTouches;
  double sigma = 0.0;  ///< of the source, 1 sigma, rms [m, rad, s]; 0: of several units
  double near_targets_m = 0.0, workspace_m = 0.0;
};

/// A positioner's axis as found, its line in the base frame with all axes of the positioner at 0.
/// The bounds exclude the base frame, as those of positions do (calib/estimate/predict.h).
struct PositionerLine {
  std::string axis;
  Eigen::Vector3d point_m = Eigen::Vector3d::Zero();        ///< on it: the origin of its frame
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();     ///< unit
  Eigen::Isometry3d frame = Eigen::Isometry3d::Identity();  ///< as PositionerAxis::frame
  double place_u95_m = 0.0, direction_u95_rad = 0.0;        ///< across the axis
  /// Least and greatest angle that something it carries was touched at; empty: not stated.
  std::optional<std::array<double, 2>> touched_rad;
};

/// A linear unit as found. `motion`: (1b) of calib/model/README.md without the slopes of the shifts,
/// which are `scale` and `direction`; [m, rad], with bounds of 95 %.
struct LinearUnitLine {
  struct At {
    double position_m = 0.0;
    std::array<double, kGuideMotions> motion{}, u95{};
  };
  std::string axis;
  Eigen::Vector3d direction = Eigen::Vector3d::UnitX();  ///< of travel, unit, base frame
  double direction_u95_rad = 0.0;                        ///< without a turn of the base frame
  double scale = 0.0, scale_u95 = 0.0;                   ///< m per m
  std::vector<At> at;                                    ///< from end to end, evenly
  /// Least and greatest position of a touch; empty: not stated.
  std::optional<std::array<double, 2>> touched_m;
};

struct InputFile {
  std::string role, name, sha256;
};

struct Calibration {
  Cell cell;  ///< nominal
  std::string method = "map";
  ModelLevel level;  ///< of the parameters: mean over the levels
  LevelReason level_reason;
  std::vector<LevelEvidence> levels;  ///< considered levels, best first
  /// Log evidence of the touches, marginalised over level, arm and places (natural logarithm); each
  /// touch left out costs as much as one at the gate. Compares sessions of the same readings; not
  /// written to files.
  double log_evidence = 0.0;
  std::vector<ParameterResult> parameters;
  std::vector<TargetResult> targets;
  std::vector<LengthResult> lengths;       ///< with both ends touched
  std::vector<PositionerLine> positioner;  ///< its axes, base outwards
  std::optional<LinearUnitLine> linear_unit;
  std::vector<ArtefactBias> artefact_biases;  ///< of spheres and wires; not written to files
  ResidualSummary before, after, check_before, check;
  std::vector<TouchResidual> residuals;
  UnseenChecks unseen;  ///< targets without fit touches (held_out.h); not written to files
  std::vector<UnidentifiableDirection> unidentifiable;
  Observability observability;  ///< rows 0: not computed
  double predicted_near_targets_m = 0.0,
         predicted_workspace_m = 0.0;  ///< mean 3-D error, from the covariance
  /// Mean error of this arm with its nominal model over the same poses, and its U (k=2)
  /// (calib/estimate/region.h). U 0: not computed, or read from a file with the error predicted from
  /// tolerances.
  double nominal_near_targets_m = 0.0, nominal_workspace_m = 0.0;
  double nominal_near_targets_u_m = 0.0, nominal_workspace_u_m = 0.0;
  /// Mean error predicted from the tolerances for any arm of this model, over the same poses; not
  /// written to files.
  double tolerated_near_targets_m = 0.0, tolerated_workspace_m = 0.0;
  std::vector<UncertaintyLine> uncertainty;  ///< empty: not computed
  /// Postures that span where trackers alone measured the arm, and so its base: M2 and u95 hold
  /// there (calib/estimate/region.h). Empty: other targets were touched.
  std::vector<JointVector> region;
  /// Ids of the loads held in fit touches; "" where none was held. Empty: the cell has no loads.
  std::vector<std::string> touched_loads;
  UncheckedTouch unchecked_near_targets, unchecked_workspace;  ///< not written to files
  double chi2 = 0.0;  ///< sum of the squared whitened residuals of the fit touches in use
  /// Degrees of freedom of chi2: sum over the touches of 1 - leverage, which counts an unknown by
  /// the share determined by the touches and not by its prior; at least 1.
  double degrees_of_freedom = 0.0;
  double chi2_per_dof = 0.0;
  double touch_noise_m = 0.0;  ///< rms of fit residuals, corrected for degrees of freedom
  RepeatedTouches repeats;
  Discrepancy discrepancy;
  Verdict verdict;
  std::vector<Outlier> outliers;
  /// At most one. identify_single_pass(), which does not diagnose, reports suspects without a shift.
  std::vector<MovedTarget> moved;
  /// Jumps; several if the touches cannot distinguish them. identify_single_pass(), which does not
  /// diagnose, reports a suspect without a size.
  std::vector<Jump> jumped;
  Eigen::MatrixXd covariance;  ///< of `parameters`, SI; includes frame directions
  /// Basis of the frame directions, orthonormal in prior units, one column each, SI.
  Eigen::MatrixXd frame_basis;
  std::optional<UpdateOrigin> update;  ///< set if updated from the preceding one by a few touches
  std::vector<InputFile> inputs;
};

/// Null if the parameter was not estimated.
inline const ParameterResult* find(const Calibration& c, const ParameterKey& key) {
  for (const ParameterResult& one : c.parameters)
    if (one.key == key) return &one;
  return nullptr;
}
/// [SI]; 0 if the parameter was not estimated.
inline double correction_of(const Calibration& c, const ParameterKey& key) {
  const ParameterResult* found = find(c, key);
  return found == nullptr ? 0.0 : found->correction;
}

/// Zero of an axis, in the sense in which the axis counts: to be added to the angle shown.
struct ZeroOffset {
  std::string joint;
  double offset_rad = 0.0, sigma_rad = 0.0;
  DecidedBy decided_by = DecidedBy::kData;
};
/// For the joints with an estimated zero.
std::vector<ZeroOffset> zero_offsets(const Calibration& c);

/// f_i of one joint over the touched angles, at most half a degree apart.
struct JointFunction {
  std::size_t joint = 0;
  std::vector<double> angle_rad;           ///< axis angle as the controller shows it
  std::vector<double> error_rad, u95_rad;  ///< added to theta_i; half of the 95 % band
};
/// Empty if no joint has a function.
std::vector<JointFunction> joint_functions(const Calibration& c);

// Values of robot and cell file for parameters that are identified as deviations.

/// [SI]. For a joint's theta (its zero), d, a, alpha, beta and the tool's x, y, z; 0 for all
/// others, which have no nominal value.
double stated_value(const Cell& cell, const ParameterKey& parameter);

// The arm's own parameters, in its order.

/// Nominal value plus correction [SI] per parameter of the arm; 0 if not estimated.
Eigen::VectorXd arm_values(const ArmModel& arm, const Calibration& calibration);
/// [SI]; empty if the calibration has none.
Eigen::MatrixXd arm_covariance(const ArmModel& arm, const Calibration& calibration);

}  // namespace cellcal::calib
