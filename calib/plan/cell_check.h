#pragma once
// What a cell file says against itself, before anything is touched. Plan, session and doctor judge
// by this one function.
//
// Looked at: stated centres against certified lengths, and what would put them right (a decimal
// point, two centres exchanged, one centre wrong, surfaces in place of centres); spheres in each
// other, in an obstacle, in the floor, or out of reach; metres written for millimetres. Not seen:
// what only a touch can tell, as a table that stands elsewhere.

#include <string>
#include <vector>

#include "calib/model/robot.h"

namespace cellcal::calib {

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
};

struct CellFault {
  CellFaultKind kind = CellFaultKind::kLength;
  bool refused = true;             ///< nothing must move; otherwise to be looked at
  std::vector<std::string> ids{};  ///< of targets; of kInside also what it is in
  double a_m = 0.0, b_m = 0.0, c_m = 0.0;
  double sigma_m = 0.0;  ///< 1 sigma of what is off, where that is what it is judged by
};

/// Refused ones first. Empty where nothing contradicts. Meshes must have been read.
std::vector<CellFault> faults_of(const Cell& cell);

/// What was found, with its numbers, and what to do about it.
std::string found_words(const CellFault& fault);
std::string advice_words(const CellFault& fault);

/// Throws PlanError naming all that is refused; returns the words of what is not.
std::vector<std::string> refuse_faulty(const Cell& cell);

}  // namespace cellcal::calib
