#pragma once
// Which of the usual mistakes explains a result that is withheld: a value. What a finding of kind
// kLikelyCause is about, its evidence and its parts are as said here; its sentence is made in
// likely_cause.cc.

#include <optional>
#include <string>


namespace cellcal::calib {

struct Finding;
enum class LikelyCause {
  // Touches that were read or written otherwise than they were made.
  kRadians,             ///< "largest" deg of all joint angles
  kAxisSign,            ///< of a joint
  kMastering,           ///< of a joint: "add" deg to all its angles
  kExchangedColumns,    ///< parts: two joints
  kTargetNames,         ///< parts: targets, each with the one that its touches are of
  kScatteredTouches,    ///< of a target: "together" of "touches", "others" alike
  kReadingsUnit,        ///< parts: targets; "unit" mm that one of it is
  kReadingsHandedness,  ///< parts: targets
  kMoved,               ///< of a target: "shift" mm, from that touch on
  // What the files state, and is not so.
  kToolUnit,          ///< "reach" mm
  kToolTip,           ///< "x", "y", "z" mm that it is off; "turn": as if the last axis were
  kDimension,         ///< part: joint, a field as below; "last": it is the last one
  kOtherRobot,        ///< of a robot; parts: the stated one, then as below if few "differences"
  kAxisConvention,    ///< parts: joints, each with a field as it should be, and "stated"
  kGravity,           ///< "x", "y", "z" m/s^2
  kAllDiameters,      ///< "off" mm
  kDiameter,          ///< of a sphere: "off" mm
  kArtefactSize,      ///< parts: one of these, a sphere "measured" and "stated" mm, or a wire, or
                      ///< all, "longer" mm; "lengths": certified ones may be wrong instead
  kCertifiedLength,   ///< of a length: "stated" mm, and "measured" mm where anything tells of it
  kExchangedLengths,  ///< parts: two lengths
  kLengthsOfTarget,   ///< all "lengths" of a target
  kAllLengths,
  kStatedCentre,  ///< of a target: "off" mm where it was measured
  kAllCentres     ///< that are held
};

/// As files name it: "axis_sign". Of a name that is none, nothing.
const char* to_string(LikelyCause cause);
std::optional<LikelyCause> likely_cause(const std::string& name);

// The sentence of each likely cause, made here and nowhere else: what is wrong and by how much, then
// what to check.

/// Of a finding that names its likely cause (`cause`).
std::string cause_words(const Finding& finding);

}  // namespace cellcal::calib
