#pragma once
// What a cell file says against itself, before anything is touched. Plan, session and doctor judge
// by this one function.
//
// Looked at: stated centres against certified lengths, and what would put them right (a decimal
// point, two centres exchanged, one centre wrong, surfaces in place of centres); spheres in each
// other, in an obstacle, in the floor, or out of reach; metres written for millimetres; a tool that the robot cannot
// carry, or that meets a sphere before its tip does; an arm that stands in itself, the floor or an obstacle, with the
// sign, offset or tool direction that explains it (cell_arm_check.cc). Not seen: what only a touch can tell, as a
// table that stands elsewhere.

#include <optional>
#include <string>
#include <vector>

#include "calib/model/robot.h"
#include "calib/plan/planned_touch.h"

namespace cellcal::calib {

struct Goal;

enum class CellFaultKind {
  kLength,            ///< centres and a certified length disagree. a: stated, b: of the centres
  kSurfaces,          ///< likewise, by the two radii: taken between surfaces
  kDecimalPoint,      ///< likewise, and a power of ten puts it right. c: the length then
  kCentresExchanged,  ///< the first two ids: exchanged, all lengths fit
  kCentre,            ///< several lengths at the first id disagree, all others fit. a: the largest
  kLengthTooShort,    ///< spheres that far apart were in each other. a: stated, b: both radii
  kTriangle,          ///< three lengths make no triangle. a: the longest, b: the other two together
  kOverlap,           ///< two spheres in each other. a: between centres, b: both radii
  kInside,            ///< a sphere in something. a: how deep
  kOutOfReach,        ///< no posture touches it. a: from the base's origin
  kCentreInMetres,    ///< a: from the base's origin
  kToolInMetres,      ///< a: from the flange
  kDiameterInMetres,  ///< a: stated
  kTouchSigma,        ///< a: stated. Finer, or coarser, than touches are
  kToolTooHeavy,      ///< kg: stated, limit_kg: the robot's rated payload, or of any robot
  kInColumn,          ///< the first id through axis A1. a: from the axis, b: limit
  kLargeBall,         ///< a: radius of the tip's ball, b: clearance between touches
  kShaftTouchesFirst,  ///< a: tip before the shaft, b: needed of a touch along the tool
  kShankTouchesFirst,  ///< a: radius of the tip's ball, b: of the slim end behind it
  kToolAcross,         ///< a: tip along the flange's axis, b: beside it
  kDescription,  ///< the arm rests in what the id says, or (no id) reaches nothing. See `mistakes`
  kGoal,         ///< a: required_mm, b: goal, c: mean error that it leads to
  kRequired,     ///< a: required_mm, b: what the plan reaches
};

/// One change of the description with which the arm no longer stands where no arm can.
struct DescriptionMistake {
  enum class Kind { kSign, kOffset, kToolAxis };
  Kind kind = Kind::kSign;
  std::string joint{};                              ///< kSign, kOffset
  int sign = 0;                                     ///< kSign: what would fit
  double offset_deg = 0.0;                          ///< kOffset: what would fit
  Eigen::Vector3d tcp_m = Eigen::Vector3d::Zero();  ///< kToolAxis: what would fit
};

struct CellFault {
  CellFaultKind kind = CellFaultKind::kLength;
  bool refused = true;             ///< nothing must move; otherwise to be looked at
  std::vector<std::string> ids{};  ///< of targets; of kInside also what it is in
  double a_m = 0.0, b_m = 0.0, c_m = 0.0;
  double sigma_m = 0.0;  ///< 1 sigma of what is off, where that is what it is judged by
  double kg = 0.0, limit_kg = 0.0;
  std::vector<DescriptionMistake> mistakes{};  ///< of kDescription: each alone explains it
  std::size_t more = 0;                        ///< mistakes that would explain it, too
};

/// Refused ones first. Empty where nothing contradicts. Meshes must have been read.
std::vector<CellFault> faults_of(const Cell& cell);

/// required_mm below what a plan of this cell reaches; to be looked at.
std::optional<CellFault> fault_of(const Cell& cell, const Plan& plan);

/// required_mm below the mean error that touches to this goal (u95, mean over the region) lead to; to be looked at.
std::optional<CellFault> fault_of(const Cell& cell, const Goal& goal);

/// What was found, with its numbers, and what to do about it.
std::string found_words(const CellFault& fault);
std::string advice_words(const CellFault& fault);
/// Both, as one line.
std::string words(const CellFault& fault);

/// Throws PlanError naming all that is refused; returns the words of what is not.
std::vector<std::string> refuse_faulty(const Cell& cell);

// The arm and its tool as a cell file describes them, against what no arm can be or do; part of cell_check.h.

/// Rated payload [kg] as KUKA's model name states it ("KR 16 R1610-2": 16, "KR 150 L110": 110). 0: not known.
double rated_payload_kg(const Robot& robot);

void look_at_load(const Cell& cell, std::vector<CellFault>& faults);
void look_at_column(const Cell& cell, std::vector<CellFault>& faults);
void look_at_tool(const Cell& cell, std::vector<CellFault>& faults);
/// At rest the arm can neither stand in itself nor in the floor, and it reaches some target: where it would not, its
/// description is wrong. Takes the place of those `faults` that this explains; says nothing where others are refused.
void look_at_description(const Cell& cell, std::vector<CellFault>& faults);

}  // namespace cellcal::calib
