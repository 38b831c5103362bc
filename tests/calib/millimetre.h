#pragma once

namespace cellcal::calib::testing {

inline constexpr double kMm = 1e-3;  ///< [m]

}  // namespace cellcal::calib::testing
