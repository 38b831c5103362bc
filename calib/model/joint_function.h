#pragma once
// The kernel of a joint's function as a Fourier series.

#include <vector>

namespace cellcal::calib {

/// Prior sigma of both amplitudes of each order from `lowest` to `highest`, of a function of these
/// orders with 1 rad rms over a turn and this reach.
std::vector<double> function_shares(double reach_rad, int lowest, int highest);

}  // namespace cellcal::calib
