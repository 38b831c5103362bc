#pragma once
// Touches that were not made but copied: a file that was read or pasted twice. Each would count as
// if it had been measured twice, and one that is held out would test the fit against itself.

#include <span>
#include <string>
#include <tuple>

#include "calib/files/touch.h"

namespace cellcal::calib {

/// All that was read of a touch. Refers to it.
inline auto reading(const Touch& touch) {
  return std::tie(touch.joint_rad, touch.radius_m, touch.tracker_m[0], touch.tracker_m[1],
                  touch.tracker_m[2], touch.tracker_abc_rad);
}

/// What to say of touches that read the same as others of their target, to the last digit; empty
/// where they are few, or where no more than repeats that were rounded to the same digits.
std::string copies_words(std::span<const Touch> touches);

}  // namespace cellcal::calib
