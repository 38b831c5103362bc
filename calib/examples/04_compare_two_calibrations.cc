// Has the arm changed? Two calibrations of one cell, and what their bounds allow.
//   04_compare_two_calibrations earlier.json later.json touches_of_the_later.csv
#include <exception>
#include <iostream>

#include "calib/files/calibration_json.h"
#include "calib/files/files.h"
#include "calib/verdict/change.h"

int main(int argc, char** argv) try {
  using namespace cellcal::calib;
  if (argc != 4) {
    std::cerr << "04_compare_two_calibrations EARLIER LATER TOUCHES_OF_THE_LATER\n";
    return 2;
  }
  const Calibration earlier = load_calibration(argv[1]), later = load_calibration(argv[2]);
  const auto change = change_since(earlier, later, load_touches(argv[3], later.cell));
  if (!change) {
    std::cout << "cannot be compared: another arm or tool, or too few poses\n";
    return 3;
  }
  std::cout << "the tips lie " << 1e3 * change->mean_m << " mm apart on average "
            << (change->workspace ? "over the workspace" : "near the targets") << ", "
            << 1e3 * change->expected_m << " mm is what both allow\n";
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 1;
}
