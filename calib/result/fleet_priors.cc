#include "calib/result/fleet_priors.h"

#include <cmath>

namespace cellcal::calib {

double offered(const Spread& spread) {
  // (91)
  return spread.found > 0.0 ? spread.found * std::exp(spread.found_sigma / spread.found) : 0.0;
}

}  // namespace cellcal::calib
