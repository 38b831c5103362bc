// Plans touches and predicts the accuracy that they give.
//   05_plan_touches cell.toml 30
#include <cstdlib>
#include <exception>
#include <iostream>

#include "calib/files/files.h"
#include "calib/plan/plan.h"

int main(int argc, char** argv) try {
  using namespace cellcal::calib;
  if (argc != 3) {
    std::cerr << "05_plan_touches CELL NUMBER_OF_TOUCHES\n";
    return 2;
  }
  PlanOptions options;
  options.fit_touches = std::atoi(argv[2]);
  options.check_touches = 0;
  const Plan plan = make_plan(load_cell(argv[1]), options);
  for (const PlannedTouch& touch : plan.touches) {
    std::cout << touch.target << "  stand-off";
    for (const double q_rad : touch.standoff) std::cout << ' ' << q_rad;
    std::cout << " rad, search " << 1e3 * touch.search_m << " mm\n";
  }
  std::cout << plan.touches.size() << " touches promise " << 1e3 * plan.predicted_mean_m
            << " mm on average over the workspace\n";
} catch (const std::exception& error) {
  std::cerr << error.what() << '\n';
  return 1;
}
