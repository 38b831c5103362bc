#include "calib/identify/observability.h"

#include <algorithm>
#include <cmath>

namespace cellcal::calib {

Observability observability(const Eigen::VectorXd& singular_values, int frame, int touches) {
  Observability result;
  result.directions = std::max(0, static_cast<int>(singular_values.size()) - frame);
  if (result.directions == 0 || touches <= 0) return result;
  const auto s = singular_values.head(result.directions).array();
  const double largest = s[0], least = s[result.directions - 1];
  if (!(least > 0.0)) return result;  // some direction is not seen at all: every index is 0
  result.o1 = std::exp(s.log().mean()) / std::sqrt(static_cast<double>(touches));
  result.o2 = least / largest;
  result.o3 = least;
  result.o4 = least * least / largest;
  result.o5 = 1.0 / s.inverse().sum();
  result.condition = largest / least;
  return result;
}

}  // namespace cellcal::calib
