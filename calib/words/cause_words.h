#pragma once
// The sentence of each likely cause, made here and nowhere else: what was put right for the touches
// to make sense, then what to check.

#include <string>

#include "calib/result/finding.h"

namespace cellcal::calib {

/// Of a finding that names its likely cause (`cause`).
std::string cause_words(const Finding& finding);

}  // namespace cellcal::calib
