#include "calib/result/fleet_priors.h"

#include <algorithm>
#include <cmath>

namespace cellcal::calib {

double offered(const Spread& spread) {
  if (!(spread.found > 0.0)) return 0.0;
  const double wider = spread.found * std::exp(spread.found_sigma / spread.found);  // (91)
  return spread.arms < kDrawnArms ? std::max(wider, spread.drawn) : wider;
}

}  // namespace cellcal::calib
