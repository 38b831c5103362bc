#pragma once
// Another arm on the spheres of the demo cell, calibrated by 100 touches.

#include "calib/model/units.h"
#include "tests/calib/check/changed_cell.h"

namespace cellcal::calib::testing {

/// In the base of the first arm. The arms are no obstacles to each other here.
inline Eigen::Isometry3d second_base() {
  return to_isometry({{150.0, -100.0, 20.0}, {40.0, 0.4, -0.5}});
}

inline Cell second_cell() {
  Cell cell = demo_cell();
  for (Target& target : cell.targets) target.centre_m = second_base().inverse() * target.centre_m;
  return cell;
}

inline const Calibration& second_calibration() {
  static const Calibration found = [] {
    sim::Truth of_second = plain_truth(second_cell(), 8);
    for (std::size_t t = 0; t < of_second.centre_m.size(); ++t)
      of_second.centre_m[t] = second_base().inverse() * truth().centre_m[t];
    return identify(second_cell(),
                    make_touches(second_cell(), of_second, {.fit = 100, .seed = 9}).touches);
  }();
  return found;
}

}  // namespace cellcal::calib::testing
