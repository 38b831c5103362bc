#pragma once
// Rows of a design drawn at random.

#include "calib/estimate/information.h"
#include "calib/model/linear.h"

namespace cellcal::calib::testing {

inline RowMajor random_rows(Eigen::Index rows, Eigen::Index columns, Random& random) {
  RowMajor m(rows, columns);
  for (double& value : m.reshaped()) value = random.normal();
  return m;
}

}  // namespace cellcal::calib::testing
