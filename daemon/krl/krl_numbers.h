#pragma once
// Numbers as a KRL file has them, changed as little as a correction needs.

#include <string>
#include <string_view>
#include <vector>

#include "calib/model/units.h"

namespace cellcal::daemon::krl {

struct Edit {
  std::size_t begin = 0, end = 0;  ///< bytes that are replaced
  std::string text;
};

/// Of a number with its sign, as KRL writes it, whatever the locale; 0 for what is none.
double value_of(std::string_view text);

/// `value` with the decimals of `old`, and at least `least` of them; `old` itself where that is the same
/// number to that many decimals. 'B110' and 'H6' become decimal. KRL's REAL holds seven digits, so more would say nothing.
std::string rewritten(std::string_view old, double value, int least);

/// Of the triples A, B, C of one rotation the one nearest to `near`: by whole turns, by the other
/// solution, and at B = +-90 deg, where A and C are one turn, with C as it was.
calib::FrameMmDeg nearest_turns(const Eigen::Isometry3d& pose, const calib::FrameMmDeg& near);

/// The text with all edits made; they do not overlap.
std::string edited(const std::string& text, std::vector<Edit> edits);

}  // namespace cellcal::daemon::krl
