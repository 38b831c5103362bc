#pragma once
// Consistency check of a cell file before anything is touched. The single check used by plan, session and doctor.
//
// Checked: stated centres against certified lengths, and corrections that make them consistent (a decimal point, two
// centres exchanged, one centre wrong, surfaces in place of centres); spheres inside each other, an obstacle or the
// floor, or out of reach; spheres that searches may pass; metres instead of millimetres; a tool that the robot cannot
// carry, or that meets a sphere before its tip does; an arm that intersects itself, the floor or an obstacle, with the sign, offset or tool
// direction that explains it. Not detected: errors that only a touch reveals, such as a misplaced
// table.

#include <optional>
#include <string>
#include <vector>

#include "calib/model/robot.h"
#include "calib/plan/planned_touch.h"
#include "calib/words/phrase.h"

namespace cellcal::calib {

struct Goal;

enum class CellFaultKind {
  kLength,              ///< centres and a certified length disagree. a: stated, b: from centres
  kSurfaces,            ///< as kLength, by both radii: measured between surfaces
  kDecimalPoint,        ///< as kLength, corrected by a power of ten. c: the corrected length
  kCentresExchanged,    ///< the first two ids: exchanging them makes all lengths fit
  kCentre,              ///< only lengths at the first id disagree, several. a: the largest
  kLengthTooShort,      ///< the spheres would intersect. a: stated, b: both radii
  kTwoLengths,          ///< of one pair, which disagree. a, b: stated
  kLengthTwice,         ///< the same certificate: it would count as two measurements. a: stated
  kTriangle,            ///< three lengths form no triangle. a: longest, b: the others' sum
  kOverlap,             ///< two spheres intersect. a: between centres, b: both radii
  kInside,              ///< a sphere inside an object. a: depth
  kOutOfReach,          ///< no posture touches it. a: from the base's origin
  kCentreInMetres,      ///< a: from the base's origin
  kToolInMetres,        ///< a: from the flange
  kDiameterInMetres,    ///< a: stated; or in inches
  kUnusualDiameter,     ///< a: stated
  kRoughCentre,         ///< the first search may pass the sphere. a: sigma stated, b: limit
  kMeshInMetres,        ///< of the first id's obstacle; the second is its file. a, b, c: extents
  kTouchSigma,          ///< a: stated. Implausibly small or large for touches
  kCertifiedSigma,      ///< of the length between two ids, or the diameter of one. a: stated
  kToolTooHeavy,        ///< kg: stated, limit_kg: the robot's rated payload, or any robot's
  kInColumn,            ///< the first id intersects axis A1. a: from the axis, b: limit
  kLargeBall,           ///< a: radius of the ball tip, b: clearance between touches
  kShaftTouchesFirst,   ///< a: tip ahead of the shaft, b: required for a touch along the tool
  kShankTouchesFirst,   ///< a: radius of the ball tip, b: of the slim end
  kPositionerUnloaded,  ///< the positioner of which the id is the last axis carries no stated mass
  kToolAcross,          ///< a: tip along the flange's axis, b: across it
  kDescription,  ///< the arm rests in the id's object, or (no id) reaches no target. See `mistakes`
  kGoal,         ///< a: required_mm, b: goal, c: expected mean error at the goal
  kRequired,     ///< a: required_mm, b: predicted for the plan
  kRadiusOffset  ///< none stated: the radius at which touches detect the spheres counts as exact
};

/// One change of the description that resolves the contradiction.
struct DescriptionMistake {
  enum class Kind { kSign, kOffset, kToolAxis };
  Kind kind = Kind::kSign;
  std::string joint{};                              ///< kSign, kOffset
  int sign = 0;                                     ///< kSign: corrected value
  double offset_deg = 0.0;                          ///< kOffset: corrected value
  Eigen::Vector3d tcp_m = Eigen::Vector3d::Zero();  ///< kToolAxis: corrected value
};

struct CellFault {
  CellFaultKind kind = CellFaultKind::kLength;
  bool refused = true;             ///< motion is refused; otherwise a warning
  std::vector<std::string> ids{};  ///< of targets; kInside: also the object
  double a_m = 0.0, b_m = 0.0, c_m = 0.0;
  double sigma_m = 0.0;  ///< 1 sigma of the deviation, if it is judged by it
  double kg = 0.0, limit_kg = 0.0;
  std::vector<DescriptionMistake> mistakes{};  ///< kDescription: each alone explains it
  std::size_t more = 0;                        ///< number of further mistakes that would explain it
};

/// Refused ones first. Empty if there is no contradiction. Meshes must be loaded.
std::vector<CellFault> faults_of(const Cell& cell);

/// Certificates state 0.2 um to 0.1 mm; more was probably stated in micrometres.
inline constexpr double kMostCertifiedSigmaM = 1e-3;

/// Smaller distances of a centre or a tip from the base's origin were probably stated in metres.
inline constexpr double kNearestCentreM = 0.020;

/// Warning if required_mm is below the predicted error of a plan of this cell.
std::optional<CellFault> fault_of(const Cell& cell, const Plan& plan);

/// Warning if required_mm is below the mean error that touches to this goal (u95, mean over the region) lead to.
std::optional<CellFault> fault_of(const Cell& cell, const Goal& goal);

/// The finding with its numbers, and the remedy.
Phrase found_phrase(const CellFault& fault);
Phrase advice_phrase(const CellFault& fault);
/// Finding and remedy.
Phrase phrase(const CellFault& fault);

/// Throws PlanError naming all refused faults; returns the others. `by_centres`: searches go to the stated centres,
/// which must not be rough.
std::vector<Phrase> refuse_faulty(const Cell& cell, bool by_centres = true);

// Plausibility of the described arm and tool; cell_description.cc.

/// Rated payload [kg] from KUKA's model name ("KR 16 R1610-2": 16, "KR 150 L110": 110). 0: unknown.
double rated_payload_kg(const Robot& robot);

void examine_load(const Cell& cell, std::vector<CellFault>& faults);
void examine_column(const Cell& cell, std::vector<CellFault>& faults);
void examine_tool(const Cell& cell, std::vector<CellFault>& faults);
/// At rest the arm must intersect neither itself nor the floor, and must reach some target; otherwise its description
/// is wrong. Replaces the `faults` explained by this; no effect if others are refused.
void examine_description(const Cell& cell, std::vector<CellFault>& faults);

}  // namespace cellcal::calib
