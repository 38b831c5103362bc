#pragma once
// The sentences of an outcome, made here and nowhere else: number first, then what to do.

#include <string>
#include <vector>

#include "daemon/result/outcome.h"

namespace cellcal::daemon {

/// The first line is the outcome, those after it its evidence and what to do.
std::vector<std::string> words(const SessionOutcome& outcome);
/// "S1: centre_mm = [1200.00, 0.00, 300.00]  # +- 5 mm (k=2), 9 touches", as the cell file has it.
std::string words(const FoundSphere& sphere);

}  // namespace cellcal::daemon
