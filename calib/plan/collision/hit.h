#pragma once
// What keeps the arm from a posture or a move, and its sentence.

#include <optional>
#include <string>

namespace cellcal::calib {

/// Where the cell file states no floor, hand and wrist stay above the lowest target less this.
inline constexpr double kBelowTargetsM = 0.10;

struct Hit {
  enum class Kind {
    kTooNear,       ///< the body comes nearer to the other thing than its margin
    kBelowTargets,  ///< the body goes too deep, where the cell file states no floor
    kImpassable     ///< of no body: near a singularity, or beyond a correction limit
  };
  Kind kind = Kind::kTooNear;
  std::string body = {};   ///< "the forearm (A4)"
  std::string other = {};  ///< kTooNear: "obstacle table"
  double gap_m = 0.0;      ///< kTooNear; 0 or less where they meet

  /// Of the same things, however near they come.
  bool is_like(const Hit& hit) const {
    return kind == hit.kind && body == hit.body && other == hit.other;
  }
};

/// "the forearm (A4) comes within 12 mm of obstacle table"
std::string words(const Hit& hit);
/// `otherwise` where nothing is hit.
std::string words_or(const std::optional<Hit>& hit, const char* otherwise);

}  // namespace cellcal::calib
