#pragma once
// Numbers of a KRL file, changed as little as a correction requires.

#include <string>
#include <string_view>
#include <vector>

#include "calib/model/units.h"

namespace cellcal::daemon::krl {

struct Edit {
  std::size_t begin = 0, end = 0;  ///< replaced bytes
  std::string text;
};

/// Value of a number with its sign in KRL's notation, independent of the locale; 0 if it is not
/// one.
double value_of(std::string_view text);

/// `value` with the decimals of `old`, at least `least`; `old` itself if equal at that resolution.
/// 'B110' and 'H6' become decimal. KRL's REAL has seven digits; more are not significant.
std::string rewritten(std::string_view old, double value, int least);

double degrees_between(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b);

/// Triple A, B, C of the rotation nearest to `near`: by whole turns, by the other solution, and at
/// B = +-90 deg, where A and C are one rotation, with C unchanged.
calib::FrameMmDeg nearest_turns(const Eigen::Isometry3d& pose, const calib::FrameMmDeg& near);

/// The text with all edits, which do not overlap.
std::string edited(const std::string& text, std::vector<Edit> edits);

}  // namespace cellcal::daemon::krl
