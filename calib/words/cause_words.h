#pragma once
// The sentence of each likely cause, made here and nowhere else: what is wrong and by how much, then
// what to check.

#include <string>

#include "calib/result/finding.h"

namespace cellcal::calib {

/// Of a finding that names its likely cause (`cause`).
std::string cause_words(const Finding& finding);

}  // namespace cellcal::calib
