#pragma once
// A combination of parameters that the touches do not decide, and its sentence.

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "calib/model/parameter_key.h"
#include "calib/model/robot.h"

namespace cellcal::calib {

struct Calibration;
enum class UnidentifiableKind {
  // Frame directions (gauge): no touch anywhere could determine them.
  kZeroOfFirstJoint,  ///< turning all targets about the base axis
  kHeightOfBase,      ///< lowering all targets
  kBehindLastJoint,   ///< what moves the tip behind the last axis is one too many
  kNothingMoves,      ///< any other
  // Weak directions: other touches would determine them.
  kNoEffect,  ///< one parameter that hardly moves any tip
  kScale,     ///< all lengths together, and no certified one
  kWeak,      ///< any other
  kRecorded   ///< in the words of a file that holds no more
};

/// As files name it: "zero_of_first_joint". Of a name that is none, nothing.
const char* to_string(UnidentifiableKind kind);
std::optional<UnidentifiableKind> unidentifiable_kind(const std::string& name);
/// A choice of frame, not an error.
constexpr bool is_of_frame(UnidentifiableKind kind) {
  return kind <= UnidentifiableKind::kNothingMoves;
}

struct UnidentifiableDirection {
  UnidentifiableKind kind = UnidentifiableKind::kRecorded;
  std::vector<ParameterKey> parameters = {};  ///< that it is made of, the more telling ones
  std::size_t more_parameters = 0;            ///< that are not among them
  std::size_t more_as_weak = 0;               ///< further directions, of which nothing else is said
  std::vector<std::pair<ParameterKey, double>> direction = {};  ///< share of its prior sigma
  std::string text = {};                                        ///< kRecorded

  bool operator==(const UnidentifiableDirection&) const = default;
};

/// "A2.a and A3.a cannot be separated by these touches; their tolerances decide. Touch in ..."
std::string words(const Cell& cell, const UnidentifiableDirection& direction);

// Parameters that go together: of such a pair the touches know a combination much better than
// either value. Correlations with the frame directions held; left in, they would make every target
// coordinate correlate with the first axis and hide the pairs that matter.
//
// Worked out from what the calibration holds, wherever it is needed: files, screens and reports
// name the same pairs, whether the calibration comes from identify() or from a file.

/// |correlation| from which on a pair is worth naming.
constexpr double kStrongCorrelation = 0.9;

struct CorrelatedPair {
  std::size_t first = 0, second = 0;  ///< indices into Calibration::parameters
  double correlation = 0.0;           ///< -1 to 1
};

struct Correlations {
  bool available = false;             ///< a covariance of the right size with finite entries
  bool frame_removed = false;         ///< the frame directions were taken out
  std::vector<CorrelatedPair> pairs;  ///< of arm, tool and touch, strongest first
  /// Further pairs, with a coordinate of a target or with a value that is a matter of the frame:
  /// targets move together with the arm that found them. They say nothing about the robot.
  std::size_t of_targets_or_frame = 0;
};

/// Pairs with |correlation| >= least. Never throws; where nothing can be said it says so.
Correlations strong_correlations(const Calibration& calibration, double least = kStrongCorrelation);

}  // namespace cellcal::calib
