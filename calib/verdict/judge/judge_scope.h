#pragma once
// What holds the scale of the arm, and so for which poses the result may be used; and who would
// notice if it were wrong.

#include <vector>

#include "calib/problem/problem.h"
#include "calib/result/calibration.h"
#include "calib/verdict/judge/held_places.h"

namespace cellcal::calib {

struct Scale {
  std::vector<Problem::Length> lengths;  ///< certified, each once, with ends that the touches hold
  bool by_lengths = false;               ///< they hold it
  bool by_readings = false;              ///< of a tracker or wire
  bool held() const { return by_lengths || by_readings; }
};
Scale scale_of(const Problem& problem, const HeldPlaces& places);

/// The scope and why; what of the scale nothing checks.
void note_scope(const Problem& problem, const Calibration& c, const HeldPlaces& places,
                const Scale& scale, std::vector<Finding>& findings);

}  // namespace cellcal::calib
