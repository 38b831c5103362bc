#pragma once
// A synthetic but realistic session: a KR 5 R1400 with spheres, touches and a plausible result.
// Nothing is measured; the same seed gives the same session.

#include <cstddef>

#include "daemon/report/report.h"

namespace cellcal::daemon::report::testing {

struct SessionShape {
  std::size_t spheres = 4;
  std::size_t fit = 80;
  std::size_t check = 20;
  std::size_t outliers = 2;  ///< among the fit touches
  std::size_t joints = 6;
  bool certified_lengths = true;
  unsigned seed = 1;
};

ReportInput made_up_session(const SessionShape& shape = {});

}  // namespace cellcal::daemon::report::testing
