#pragma once
// The common mistake that explains a withheld result. Subject, evidence and parts of a finding of
// kind kLikelyCause are documented per enumerator; likely_cause.cc words them.

#include <string>

#include "calib/model/enum_table.h"

namespace cellcal::calib {

struct Finding;
enum class LikelyCause {
  // Touches recorded differently from how they were made.
  kRadians,             ///< "largest" deg of all joint angles
  kAxisSign,            ///< of a joint
  kMastering,           ///< of a joint: "add" deg to all its angles
  kExchangedColumns,    ///< parts: two joints
  kTargetNames,         ///< parts: targets, each with the one that its touches belong to
  kScatteredTouches,    ///< of a target: "together" of "touches"; "others" alike
  kReadingsUnit,        ///< parts: targets; "unit" mm per unit of reading
  kReadingsHandedness,  ///< parts: targets
  kMoved,               ///< of a target: "shift" mm, from this touch on
  // Wrong statements of the files.
  kToolUnit,          ///< "reach" mm
  kToolTip,           ///< "x", "y", "z" mm deviation; "turn": equivalent to a last axis turn
  kDimension,         ///< part: joint, a field as below; "last": last joint
  kOtherRobot,        ///< of a robot; parts: the stated one, then as below for few "differences"
  kAxisConvention,    ///< parts: joints, each with the corrected field and "stated"
  kGravity,           ///< "x", "y", "z" m/s^2
  kAllDiameters,      ///< "off" mm
  kDiameter,          ///< of a sphere: "off" mm
  kArtefactSize,      ///< parts: one of a sphere "measured" and "stated" mm, a wire, or
                      ///< all, "longer" mm; "lengths": or certified lengths are wrong
  kCertifiedLength,   ///< of a length: "stated" mm, and "measured" mm if known
  kExchangedLengths,  ///< parts: two lengths
  kLengthsOfTarget,   ///< all "lengths" of a target
  kAllLengths,
  kStatedCentre,  ///< of a target: "off" mm if measured
  kAllCentres,    ///< all stated centres
  kLengthsUnit    ///< all: "unit" mm per unit stated
};

/// Name in files: "axis_sign".
constexpr const char* to_string(LikelyCause cause) { return own_name(cause); }

// Sentences of likely causes, generated here only: deviation first, then what to check.

/// For a finding with a likely cause (`cause`).
std::string cause_words(const Finding& finding);

}  // namespace cellcal::calib
