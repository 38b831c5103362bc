#pragma once
// Touches that were not made but copied: a file that was read or pasted twice. Each would count as
// if it had been measured twice, and one that is held out would test the fit against itself.

#include <span>
#include <string>

#include "calib/model/touch.h"

namespace cellcal::calib {

/// What to say of touches that read the same as others of their target, to the last digit; empty
/// where they are few, or where no more than repeats that were rounded to the same digits.
std::string copies_words(std::span<const Touch> touches);

}  // namespace cellcal::calib
