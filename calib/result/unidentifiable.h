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

}  // namespace cellcal::calib
