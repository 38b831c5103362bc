#pragma once
// A combination of parameters not determined by the touches, and its sentence.

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "calib/model/enum_table.h"
#include "calib/model/parameter_key.h"
#include "calib/model/robot.h"

namespace cellcal::calib {

struct Calibration;
enum class UnidentifiableKind {
  // Frame directions (gauge): not determined by any touches.
  kZeroOfFirstJoint,  ///< turning all targets about the base axis
  kHeightOfBase,      ///< lowering all targets
  kBehindLastJoint,   ///< redundant displacement of the tip relative to the last axis
  kNothingMoves,      ///< any other
  // Weak directions: other touches would determine them.
  kNoEffect,  ///< one parameter with hardly any effect on the tips
  kScale,     ///< all lengths together, without a certified one
  kWeak,      ///< any other
  kRecorded   ///< text of a file without kinds
};

/// Name in files: "zero_of_first_joint".
constexpr const char* to_string(UnidentifiableKind kind) { return own_name(kind); }

struct UnidentifiableDirection {
  UnidentifiableKind kind = UnidentifiableKind::kRecorded;
  std::vector<ParameterKey> parameters = {};                    ///< the largest components
  std::size_t more_parameters = 0;                              ///< number of smaller components
  std::size_t more_as_weak = 0;                                 ///< further directions, not listed
  std::vector<std::pair<ParameterKey, double>> direction = {};  ///< in prior sigmas
  std::string text = {};                                        ///< kRecorded

  bool operator==(const UnidentifiableDirection&) const = default;
};

/// "A2.a and A3.a cannot be separated by these touches; their tolerances decide. Touch in ..."
std::string words(const Cell& cell, const UnidentifiableDirection& direction);

// Correlated parameters: the touches determine a combination of such a pair much better than either
// value. Correlations are conditional on the frame directions; otherwise every target coordinate
// would correlate with the first axis and hide the relevant pairs.
//
// Derived from the calibration on demand, so that files, screens and reports name the same pairs,
// whether the calibration comes from identify() or from a file.

/// Minimum |correlation| of a reported pair.
constexpr double kStrongCorrelation = 0.9;

struct CorrelatedPair {
  std::size_t first = 0, second = 0;  ///< indices into Calibration::parameters
  double correlation = 0.0;           ///< -1 to 1
};

struct Correlations {
  bool available = false;             ///< the covariance has the right size and finite entries
  bool frame_removed = false;         ///< conditional on the frame directions
  std::vector<CorrelatedPair> pairs;  ///< of arm, tool and touch, strongest first
  /// Further pairs, with a coordinate of a target or with a frame-dependent value: targets move
  /// together with the arm that located them. Not informative about the robot.
  std::size_t of_targets_or_frame = 0;
};

/// Pairs with |correlation| >= least. Never throws; see `available`.
Correlations strong_correlations(const Calibration& calibration, double least = kStrongCorrelation);

}  // namespace cellcal::calib
