#pragma once
// Temperatures that touches state: the model has none, but whoever reads the result should know
// over which range it was made.

#include <span>
#include <string>

#include "calib/model/touch.h"

namespace cellcal::calib {

/// The range, and how many touches state one; empty where none does.
std::string temperature_words(std::span<const Touch> touches);

}  // namespace cellcal::calib
